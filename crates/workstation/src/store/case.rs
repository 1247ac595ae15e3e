//! The case that is open: its file, its changes, and what is kept of it.

use crate::Error;
use crate::names::{name_of, run_command};
use crate::store::unsaved::Draft;
use serde::Serialize;
use std::path::Path;
use std::sync::Arc;
use supine_flow::spec::{Edit, set_argument};
use supine_flow::{CaseFile, PatientIdentity, Session, Spec, SphereRecord};

/// Keys that name the CT: with another one all is another case, perhaps another patient's.
const CT: [&str; 2] = ["ct", "series"];
/// A tumour that is placed is no region of a structure set any more.
const OF_A_REGION: [&str; 2] = ["tumour.structure", "tumour.file"];

/// How far the opening is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub(crate) enum Phase {
    #[default]
    Empty,
    Reading,
    Ready,
}

/// A change of the case.
pub(crate) enum Change {
    /// Values, and where they place the tumour where none of them says it, LPS, mm.
    Edits(Vec<Edit>, Option<[f64; 3]>),
    Undo,
    Redo,
}

/// What the file says, compared with what is open.
pub(super) enum OnDisk {
    Same,
    Other(Box<Spec>),
    /// Nothing that could be taken over, and why.
    Unusable(String),
}

/// What the page is told of it.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct CaseShown {
    name: String,
    /// Whether a file holds what is shown.
    saved: bool,
    /// Whether its changes, which no file holds, are kept for the next start.
    kept: bool,
    /// Why what another program wrote into its file could not be taken over: what is shown is of
    /// the case before.
    astray: Option<String>,
    /// Whether a change can be taken back, and made again.
    can_undo: bool,
    can_redo: bool,
    /// Values by key, as they are given or by default.
    values: serde_json::Map<String, serde_json::Value>,
    tumour: Option<SphereRecord>,
    region: Option<SphereRecord>,
    /// Whether the side was proposed from the tumour's place, and nobody has set it since.
    side_proposed: bool,
}

/// The case that is open; nothing before its CT was read.
#[derive(Default, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct OpenCase {
    #[serde(skip)]
    session: Option<Arc<Session>>,
    #[serde(skip)]
    file: Option<CaseFile>,
    /// What is kept as long as no file holds it.
    #[serde(skip)]
    draft: Option<Draft>,
    /// The side that was proposed from the tumour's place, as long as nobody has set one.
    #[serde(skip)]
    side_proposed: bool,
    /// The last change, as the command line takes it.
    #[serde(skip)]
    last_edit: Vec<String>,
    /// Counts the changes of the case.
    revision: u64,
    case: Option<CaseShown>,
    /// Whose CT is open.
    patient: Option<PatientIdentity>,
    phase: Phase,
    /// The command line that does the same.
    command: String,
}

impl OpenCase {
    /// # Errors
    /// When nothing is open.
    pub(crate) fn session(&self) -> Result<Arc<Session>, Error> {
        self.session.clone().ok_or(Error::Nothing)
    }

    pub(crate) fn file(&self) -> Option<&CaseFile> {
        self.file.as_ref()
    }

    pub(crate) fn text(&self) -> Option<&str> {
        self.file.as_ref().map(CaseFile::text)
    }

    pub(crate) fn revision(&self) -> u64 {
        self.revision
    }

    /// Whether the file says something that could not be taken over.
    pub(crate) fn is_astray(&self) -> bool {
        self.case.as_ref().is_some_and(|case| case.astray.is_some())
    }

    pub(crate) fn set_command(&mut self, command: String) {
        self.command = command;
    }

    /// Its CT is being read; the case before is closed.
    pub(super) fn begin(
        &mut self,
        session: &Session,
        file: &CaseFile,
        draft: Option<Draft>,
        command: String,
    ) {
        let (revision, case) = (self.revision + 1, Some(CaseShown::new(session, file)));
        let phase = Phase::Reading;
        *self = Self { revision, case, draft, phase, command, ..Self::default() };
    }

    /// Its CT was read.
    pub(super) fn opened(&mut self, session: &Arc<Session>, file: CaseFile) {
        (self.session, self.file) = (Some(Arc::clone(session)), Some(file));
        (self.patient, self.phase) = (session.peek_whose(), Phase::Ready);
        let kept = self.draft.as_ref().is_some_and(Draft::is_there);
        self.case.iter_mut().for_each(|case| case.kept = kept);
    }

    /// Gives an opening up that did not come to its end; whether there was one. What could not be
    /// opened is offered still.
    pub(super) fn give_up(&mut self) -> bool {
        let was_reading = self.phase == Phase::Reading;
        if was_reading {
            (self.phase, self.draft) = (Phase::Empty, None);
        }
        was_reading
    }

    /// Changes the file of the case; what it says then, where that is something else.
    ///
    /// # Errors
    /// When a value does not fit, or the file cannot be written.
    pub(super) fn change(&mut self, change: Change) -> Result<Option<Spec>, Error> {
        let is_undo = matches!(change, Change::Undo);
        if let Change::Edits(edits, placed) = change {
            let edits = self.with_what_follows(edits, placed);
            let spec = self.file.as_mut().ok_or(Error::Nothing)?.edit(&edits)?;
            self.last_edit = edits.iter().filter_map(set_argument).collect();
            return Ok(Some(spec));
        }
        self.last_edit.clear();
        let file = self.file.as_mut().ok_or(Error::Nothing)?;
        Ok(if is_undo { file.undo()? } else { file.redo()? })
    }

    /// Edits with those that follow from them: the side of a tumour that is placed, as long as
    /// nobody has set one.
    fn with_what_follows(&mut self, mut edits: Vec<Edit>, placed: Option<[f64; 3]>) -> Vec<Edit> {
        let Some(session) = self.session.clone() else { return edits };
        let value = edits.iter().find(|edit| edit.key == "tumour.centre").map(|edit| &edit.value);
        let centre = value.and_then(|value| serde_json::from_value(value.clone()).ok());
        if centre.is_some() && session.spec().get("tumour.structure").is_some() {
            let nothing =
                OF_A_REGION.map(|key| Edit { key: key.into(), value: serde_json::Value::Null });
            edits.extend(nothing);
        }
        if edits.iter().any(|edit| edit.key == "breast") {
            self.side_proposed = false;
        } else if let Some(centre) = placed.or(centre) {
            edits.extend(self.side_of(&session, centre));
        }
        edits
    }

    /// The side of a tumour's centre, LPS, mm, where it is another than before and nobody has set
    /// one.
    fn side_of(&mut self, session: &Session, centre: [f64; 3]) -> Option<Edit> {
        let known = session.case().breast;
        let open = known.is_none() || self.side_proposed;
        let side = session.propose_side(centre).filter(|side| open && Some(*side) != known)?;
        self.side_proposed = true;
        Some(Edit { key: "breast".into(), value: side.to_string().into() })
    }

    /// The session works on what the case says now, which is kept where no file holds it.
    ///
    /// # Errors
    /// When the case cannot be used.
    pub(super) fn use_spec(&mut self, spec: Spec, drafts: Option<&Path>) -> Result<(), Error> {
        self.session()?.set_all(spec)?;
        self.revision += 1;
        if let (Some(draft), Some(file), Some(drafts)) = (&mut self.draft, &self.file, drafts) {
            // Where it fails `is_there` says so, and so does the page.
            let _kept = draft.keep(drafts, file);
        }
        Ok(())
    }

    /// Puts a new case into a file.
    ///
    /// # Errors
    /// When there is such a file, or it cannot be written.
    pub(super) fn save_as(&mut self, path: &Path) -> Result<(), Error> {
        self.file.as_mut().ok_or(Error::Nothing)?.save_as(path)?;
        self.draft.take().into_iter().for_each(Draft::end);
        Ok(())
    }

    /// What another program wrote into the file.
    pub(super) fn on_disk(&mut self) -> OnDisk {
        let (Some(session), Some(file)) = (&self.session, &mut self.file) else {
            return OnDisk::Same;
        };
        let Some(path) = file.path() else { return OnDisk::Same };
        let there =
            CaseFile::open(path).and_then(|there| Ok((there.text() == file.text(), there.spec()?)));
        let names_another = |spec: &Spec| {
            let given = session.spec();
            CT.iter().any(|key| given.get(key) != spec.get(key))
        };
        match there {
            Ok((true, _)) => OnDisk::Same,
            Ok((false, spec)) if names_another(&spec) => {
                OnDisk::Unusable("It names another CT now.".into())
            }
            Ok(_) => match file.reread() {
                Ok(Some(spec)) => {
                    self.last_edit.clear();
                    OnDisk::Other(Box::new(spec))
                }
                Ok(None) => OnDisk::Same,
                Err(error) => OnDisk::Unusable(Error::from(error).to_string()),
            },
            Err(error) => OnDisk::Unusable(Error::from(error).to_string()),
        }
    }

    /// Sets why the file could not be taken over; whether it was so before.
    pub(super) fn set_astray(&mut self, why: Option<String>) -> bool {
        let case = self.case.as_mut();
        case.is_some_and(|case| std::mem::replace(&mut case.astray, why).is_some())
    }

    /// Shows the case as it is now, and the command that does the same.
    pub(super) fn refresh(&mut self) {
        let (Some(file), Some(session)) = (&self.file, &self.session) else { return };
        let before = self.case.take();
        let mut shown = CaseShown::new(session, file);
        // What was proposed stays on the screen.
        shown.region = shown.region.or(before.as_ref().and_then(|case| case.region));
        shown.astray = before.and_then(|case| case.astray);
        shown.kept = self.draft.as_ref().is_some_and(Draft::is_there);
        shown.side_proposed = self.side_proposed && session.case().breast.is_some();
        // No command does the same as a case that no file holds: the line before spoke of something
        // else.
        let command = file.path().map(|path| run_command(&name_of(path), &self.last_edit));
        (self.command, self.case) = (command.unwrap_or_default(), Some(shown));
    }

    /// Shows tumour and region as the session has them.
    pub(super) fn show_spheres(&mut self, session: &Session) {
        let Some(case) = &mut self.case else { return };
        case.tumour = session.tumour_sphere().map(Into::into);
        case.region = session.peek_region().map(|(sphere, _)| sphere.into()).or(case.region);
    }
}

impl CaseShown {
    fn new(session: &Session, file: &CaseFile) -> Self {
        let case = session.case();
        let mut values = serde_json::Map::new();
        flatten(&mut values, "", &serde_json::Value::Object(case.canonical().clone()));
        let [can_undo, can_redo] = file.can_undo_redo();
        Self {
            name: file.path().map_or_else(|| "new case".into(), name_of),
            saved: file.path().is_some(),
            kept: false,
            astray: None,
            can_undo,
            can_redo,
            values,
            tumour: session.tumour_sphere().map(Into::into),
            region: case.region.map(Into::into),
            side_proposed: false,
        }
    }
}

/// Values by key, tables joined by dots.
fn flatten(
    into: &mut serde_json::Map<String, serde_json::Value>,
    key: &str,
    value: &serde_json::Value,
) {
    match value {
        serde_json::Value::Object(table) => {
            for (name, value) in table {
                let key = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
                flatten(into, &key, value);
            }
        }
        value => drop(into.insert(key.into(), value.clone())),
    }
}
