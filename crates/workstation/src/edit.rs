//! Changes of the case: each is checked, on disk and told before the next.

use crate::Error;
use crate::names::name_of;
use crate::names::run_command;
use crate::open::shown_case;
use crate::state::{PreviewShown, Readiness, State};
use crate::unsaved::Kept;
use crate::workspace::{OpenCase, Workspace};
use serde::Deserialize;
use std::sync::Arc;
use supine_flow::spec::{Edit, Kind, TABLE, set_argument};
use supine_flow::{CaseFile, Freshness, NodeId, Session};

/// Changes that the page asks for, and the state that it saw.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Edits {
    pub(crate) revision: u64,
    pub(crate) edits: Vec<OneEdit>,
    /// Where they place the tumour, where no value of theirs says it, LPS, mm.
    #[serde(skip)]
    pub(crate) placed: Option<[f64; 3]>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct OneEdit {
    pub(crate) key: String,
    pub(crate) value: serde_json::Value,
}

/// A tick of a warning.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Tick {
    id: String,
    on: bool,
}

/// The state that a page saw when it asked.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SeenVersion {
    revision: u64,
}

/// A file for a new case.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SaveAs {
    dir: String,
    name: String,
}

/// Which way in the history.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Way {
    Back,
    Forth,
}

impl Workspace {
    /// Makes changes of the case that the page sent. Files are no values that it may type: it names
    /// them by the numbers that were given out, and can only take them away here.
    ///
    /// # Errors
    /// As [`Self::edit`]; [`Error::NotBelow`] when a value names a file.
    pub(crate) fn edit_sent(self: &Arc<Self>, asked: Edits) -> Result<(), Error> {
        let may_send = |edit: &OneEdit| {
            // A table of keys may hold any of them.
            let is_within = |key: &str| {
                key.strip_prefix(&*edit.key)
                    .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
            };
            let mut files = TABLE.iter().filter(|p| matches!(p.kind, Kind::File | Kind::Files));
            edit.value.is_null() || !files.any(|file| is_within(file.key))
        };
        if asked.edits.iter().all(may_send) { self.edit(asked) } else { Err(Error::NotBelow) }
    }

    /// Makes changes of the case.
    ///
    /// # Errors
    /// [`Error::Old`] when it was changed since the page looked; when a value does not fit, or the
    /// file cannot be written.
    pub(crate) fn edit(self: &Arc<Self>, asked: Edits) -> Result<(), Error> {
        let edit = |edit: OneEdit| Edit { key: edit.key, value: edit.value };
        let edits: Vec<Edit> = asked.edits.into_iter().map(edit).collect();
        self.change_case(asked.revision, |held| {
            let edits = held.with_what_follows(edits, asked.placed);
            let spec = held.case.as_mut().ok_or(Error::Nothing)?.edit(&edits)?;
            held.edited = edits.iter().filter_map(set_argument).collect();
            Ok(Some(spec))
        })
    }

    /// Ticks a warning as looked at, or takes the tick away.
    ///
    /// # Errors
    /// When nothing is open, there is no such warning, or the case cannot be written.
    pub(crate) fn tick(self: &Arc<Self>, asked: &Tick) -> Result<(), Error> {
        let Tick { id, on } = asked;
        let (revision, mut seen) = {
            let held = self.held();
            if !held.state.warnings.iter().any(|warning| warning.id == *id) {
                return Err(Error::Request("there is no such warning".into()));
            }
            let session = held.session.as_ref().ok_or(Error::Nothing)?;
            (held.state.revision, session.case().seen.clone())
        };
        seen.retain(|known| known != id);
        seen.extend(on.then(|| id.clone()));
        let value = if seen.is_empty() { serde_json::Value::Null } else { seen.into() };
        let edits = vec![OneEdit { key: "report.seen".into(), value }];
        self.edit(Edits { revision, edits, placed: None })
    }

    /// Takes a change back, or makes it again.
    ///
    /// # Errors
    /// As [`Self::edit`].
    pub(crate) fn history(self: &Arc<Self>, seen: SeenVersion, way: Way) -> Result<(), Error> {
        self.change_case(seen.revision, |held| {
            held.edited.clear();
            let case = held.case.as_mut().ok_or(Error::Nothing)?;
            Ok(if way == Way::Back { case.undo()? } else { case.redo()? })
        })
    }

    fn change_case(
        self: &Arc<Self>,
        seen: u64,
        change: impl FnOnce(&mut OpenCase) -> Result<Option<supine_flow::Spec>, Error>,
    ) -> Result<(), Error> {
        let session = self.held().session.clone().ok_or(Error::Nothing)?;
        let (taken_over, done) = self.change(|held| {
            // What another program wrote into the file meanwhile is seen first.
            let taken_over = held.take_over(&session);
            let is_seen = held.state.revision == seen;
            let done = if is_seen { held.make(&session, change) } else { Err(Error::Old) };
            (taken_over, done)
        });
        if taken_over || done.is_ok() {
            self.follow_case(&session);
        }
        done
    }

    /// Labels that are looked at follow the case, and so do objects that it carries along.
    pub(crate) fn follow_case(self: &Arc<Self>, session: &Arc<Session>) {
        if session.peek_labels().is_some_and(|(_, of)| of == Freshness::Stale) {
            self.change(|held| {
                let live = &mut held.state.live;
                (live.following, live.busy, live.problem) = (true, true, None);
            });
            self.follow_seeds(session);
        } else if !session.case().carried.is_empty() && !session.is_fresh(NodeId::Objects) {
            self.prepare(session);
        }
    }

    /// Puts a new case into a file.
    ///
    /// # Errors
    /// When the folder was not given out, the name is none, there is such a file, or it cannot be
    /// written.
    pub(crate) fn save_as(&self, asked: &SaveAs) -> Result<(), Error> {
        let SaveAs { dir, name } = asked;
        if !name.ends_with(".toml") {
            return Err(Error::Request("a case file's name ends with .toml".into()));
        }
        self.change(|held| {
            let path = held.roots.path_of(dir, name)?;
            held.case.as_mut().ok_or(Error::Nothing)?.save_as(&path)?;
            held.keep_no_longer();
            held.show_case();
            Ok(())
        })
    }
}

/// A case without its ticks of warnings.
fn without_ticks(text: &str) -> String {
    let none = Edit { key: "report.seen".into(), value: serde_json::Value::Null };
    supine_flow::spec::edit(text, &[none]).unwrap_or_else(|_| text.into())
}

/// A tumour that is placed is no region of a structure set any more.
const OF_A_REGION: [&str; 2] = ["tumour.structure", "tumour.file"];

impl OpenCase {
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

    /// Makes a change of the case.
    fn make(
        &mut self,
        session: &Arc<Session>,
        change: impl FnOnce(&mut Self) -> Result<Option<supine_flow::Spec>, Error>,
    ) -> Result<(), Error> {
        if let Some(spec) = change(self)? {
            self.use_spec(session, spec)?;
        }
        self.show_case();
        Ok(())
    }

    /// The case says something else now: what is of the case before is marked.
    pub(crate) fn use_spec(
        &mut self,
        session: &Arc<Session>,
        spec: supine_flow::Spec,
    ) -> Result<(), Error> {
        session.set_all(spec)?;
        self.state.revision += 1;
        // What could not be made may be possible now.
        if self.state.preview_bed.state == Readiness::Failed {
            self.state.preview_bed = PreviewShown::default();
        }
        self.keep_case();
        self.mark_as(session);
        Ok(())
    }

    /// Marks what is shown as of the case, or of the case before.
    pub(crate) fn mark_as(&mut self, session: &Session) {
        let written = self.result_of.as_deref();
        let now = self.case.as_ref().map(CaseFile::text);
        // Ticks say what was looked at: the written report lacks them, and nothing that was
        // computed is another for it.
        let is_ticked = written.map(without_ticks) == now.map(without_ticks);
        let is_of_ticked = written.is_some() && is_ticked;
        if let Some(result) = &mut self.state.result {
            result.old = !is_of_ticked;
            result.lacks_ticks = is_of_ticked && written != now;
        }
        // A run keeps what it has written in its folder alone.
        let is_old_run = self.state.result.is_some() && !is_ticked;
        let is_old =
            |node: &NodeId| session.is_stale(*node) || (is_old_run && !session.is_fresh(*node));
        let old: Vec<NodeId> = NodeId::ALL.into_iter().filter(is_old).collect();
        self.mark(&old, |name| NodeId::of_name(name).is_some_and(|node| session.is_stale(node)));
        self.show_results(session);
    }

    /// Nothing that is shown but the CT is known to be of the case: its file says something that
    /// cannot be taken over.
    pub(crate) fn mark_all_old(&mut self) {
        let State { volumes, stages, warnings, figures, result, own, .. } = &mut self.state;
        volumes
            .iter_mut()
            .filter(|volume| volume.id != "ct")
            .for_each(|volume| volume.fresh = false);
        stages.iter_mut().filter(|stage| stage.state == "done").for_each(|one| one.state = "stale");
        warnings.iter_mut().for_each(|warning| warning.old = true);
        figures.iter_mut().for_each(|figure| figure.old = true);
        result.iter_mut().for_each(|result| result.old = true);
        own.iter_mut().for_each(|own| own.fresh = false);
        (self.state.patches_old, self.state.tumour) = (true, None);
    }

    /// Shows the case as it is now, and the command that does the same.
    pub(crate) fn show_case(&mut self) {
        let (Some(case), Some(session)) = (&self.case, &self.session) else { return };
        let before = self.state.case.as_ref();
        let (region, astray) =
            (before.and_then(|case| case.region), before.and_then(|case| case.astray.clone()));
        let mut shown = shown_case(session, case);
        // What was proposed stays on the screen.
        (shown.region, shown.astray) = (shown.region.or(region), astray);
        shown.kept = self.kept.as_ref().is_some_and(Kept::is_there);
        shown.side_proposed = self.side_proposed && session.case().breast.is_some();
        // No command does the same as a case that no file holds: the line before spoke of something
        // else.
        let command = case.path().map(|path| run_command(&name_of(path), &self.edited));
        self.state.command = command.unwrap_or_default();
        self.state.case = Some(shown);
        self.show_beside();
        self.show_ticks();
    }

    /// Shows which warnings are ticked.
    pub(crate) fn show_ticks(&mut self) {
        let Some(session) = &self.session else { return };
        let seen = session.case().seen.clone();
        for warning in &mut self.state.warnings {
            warning.ticked = seen.contains(&warning.id);
        }
    }

    /// Marks the stages whose results are of what was given before.
    ///
    /// `held`: whether the old result of one is in memory.
    fn mark(&mut self, stale: &[NodeId], held: impl Fn(&str) -> bool) {
        let is_stale = |name: &str| stale.iter().any(|node| node.name() == name);
        for stage in self.state.stages.iter_mut().filter(|stage| stage.state != "running") {
            match (is_stale(stage.name), stage.state) {
                // What an old run would have made is no more than not made yet.
                (true, state) if state != "done" && !held(stage.name) => {}
                (true, _) => stage.state = "stale",
                (false, "stale") => stage.state = "done",
                _ => {}
            }
        }
        for warning in &mut self.state.warnings {
            warning.old = is_stale(&warning.stage);
        }
    }
}
