//! Opening a folder, a series, a case or a run, and bringing stages up to date.

use crate::Error;
use crate::adjacent::AdjacentObject;
use crate::draw::body::body;
use crate::draw::planes::views;
use crate::draw::voxels::Voxels;
use crate::job::JobObserver;
use crate::names::{name_of, quoted, run_command};
use crate::roots::{is_case, is_run};
use crate::send::words;
use crate::state::{CaseShown, InspectionShown, Phase, ResultShown, VerifiedShown, stages};
use crate::unsaved::{Kept, Record};
use crate::workspace::{OpenCase, Workspace};
use serde::Deserialize;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use supine_flow::commands::dicom::{Inspect, PlanObject, PlanObjectKind, inspect};
use supine_flow::spec::edit;
use supine_flow::{
    CarriedKind, CaseFile, FinishedRun, Lane, NodeId, Options, Request, RunFolder, Session, Spec,
    Summary, headline,
};

/// What the page opens, by the numbers that it was given.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub(crate) enum OpenRequest {
    /// A series of the folder that was looked through.
    Series(String),
    /// A case file.
    Case(String),
    /// The folder of a run.
    Run(String),
    /// What was kept of a case that no file holds.
    Unsaved(String),
}

/// What is opened.
enum Opened {
    Series { dir: PathBuf, uid: String },
    Case(PathBuf),
    Run(PathBuf),
    Unsaved(Box<Record>),
}

impl Workspace {
    /// Opens what the program was started with; a folder may be looked through.
    ///
    /// # Errors
    /// When work goes on.
    pub(crate) fn start(self: &Arc<Self>, path: &Path, look_through: bool) -> Result<(), Error> {
        if path.is_dir() && is_run(path) {
            return self.open_it(Opened::Run(path.into()), None);
        }
        if path.is_file() && is_case(path) {
            return self.open_it(Opened::Case(path.into()), None);
        }
        if look_through { self.look_through(path.into()) } else { Ok(()) }
    }

    /// Looks through a folder by its number.
    ///
    /// # Errors
    /// When it was not given out, or work goes on.
    pub(crate) fn inspect(self: &Arc<Self>, dir: &str) -> Result<(), Error> {
        let path = self.held().roots.path(dir)?;
        self.look_through(path)
    }

    fn look_through(self: &Arc<Self>, path: PathBuf) -> Result<(), Error> {
        self.begin("looking through the folder", move |workspace, watching| {
            let spec = Spec::new("");
            let found = inspect(&Inspect { spec, path: path.clone(), pixels: false }, watching)?;
            workspace.change(|held| {
                let dir = held.roots.name(&path);
                let first = held.series.len();
                let series = found.series.iter().map(|s| (s.folder.clone(), s.uid.clone()));
                held.series.extend(series);
                held.objects = found.objects.iter().map(beside).collect();
                held.state.inspection =
                    Some(InspectionShown::of(dir, &found, |n| (first + n).to_string()));
            });
            Ok(())
        })
    }

    /// Opens what the page asks for.
    ///
    /// # Errors
    /// When it was not given out, or work goes on.
    pub(crate) fn open(self: &Arc<Self>, asked: &OpenRequest) -> Result<(), Error> {
        let mut kept = None;
        let opened = {
            let held = self.held();
            match asked {
                OpenRequest::Series(id) => {
                    let (dir, uid) = held.series(id)?.clone();
                    Opened::Series { dir, uid }
                }
                OpenRequest::Case(id) => Opened::Case(held.roots.path(id)?),
                OpenRequest::Run(id) => Opened::Run(held.roots.path(id)?),
                OpenRequest::Unsaved(id) => {
                    let (record, taken) = held.take_unsaved(id)?;
                    kept = Some(taken);
                    Opened::Unsaved(Box::new(record))
                }
            }
        };
        self.open_it(opened, kept)
    }

    /// Opens it; `kept`: what was kept of it before.
    fn open_it(self: &Arc<Self>, opened: Opened, kept: Option<Kept>) -> Result<(), Error> {
        self.begin("reading the CT", move |workspace, watching| {
            let case = opened.case()?;
            let kept = kept.or_else(|| Some(Kept::new(opened.place()?.into(), &case)));
            let session =
                Session::new(case.spec()?, workspace.threads)?.with_start(workspace.start.clone());
            let session = Arc::new(session);
            workspace.live.end();
            workspace.drop_preview();
            workspace.change(|held| {
                held.clear();
                // What was followed is of another patient.
                workspace.leave();
                held.state.stages = stages(&session.case());
                held.state.command = opened.command();
                held.state.case = Some(shown_case(&session, &case));
                held.kept = kept;
                held.show_unsaved();
            });
            let request = Request { observer: watching, ..Request::default() };
            let ct = session.ct(&request)?;
            // Structure sets are read for the names of their regions.
            let found = match &opened {
                Opened::Series { .. } => workspace.held().objects.clone(),
                _ => vec![],
            };
            let beside =
                found.into_iter().map(|(kind, path)| AdjacentObject::new(kind, path)).collect();
            workspace.change(|held| {
                held.state.patient = session.peek_whose();
                held.state.views = views(ct.grid());
                held.show("ct", Voxels::Hu(Arc::clone(&ct), false), true);
                held.state.phase = Phase::Ready;
                held.show_results(&session);
                (held.session, held.case) = (Some(Arc::clone(&session)), Some(case));
                held.beside = beside;
                held.show_beside();
                if let (Some(shown), Some(kept)) = (&mut held.state.case, &held.kept) {
                    shown.kept = kept.is_there();
                }
            });
            workspace.read_objects(&session, watching, Lane::Final);
            let patient = body(&ct);
            workspace.change(|held| {
                held.state.volumes.iter_mut().for_each(|volume| volume.body = patient);
            });
            if let Opened::Run(path) = &opened {
                workspace.show_run(path, &session, watching)?;
            }
            Ok(())
        })
    }

    /// Shows what a run left, if it is what would be made now; nothing is made anew.
    fn show_run(
        self: &Arc<Self>,
        path: &Path,
        session: &Session,
        watching: &JobObserver,
    ) -> Result<(), Error> {
        let run = FinishedRun::open(path)?;
        if !run.is_of(session)? {
            return Err(Error::OtherRun);
        }
        let summary = run.summary()?;
        session.keep_in(Some(RunFolder::open(path)?))?;
        let request = Request { observer: watching, ..Request::default() };
        let read = read_back(session, &request);
        session.keep_in(None)?;
        read?;
        self.read_objects(session, watching, Lane::Final);
        self.change(|held| {
            held.show_results(session);
            held.result_of = held.case.as_ref().map(|case| case.text().to_owned());
            held.show_result(path, &summary);
            held.show_ticks();
        });
        Ok(())
    }

    /// Brings the stages up to one of them up to date, in memory.
    ///
    /// # Errors
    /// When nothing is open, or work goes on.
    pub(crate) fn run(self: &Arc<Self>, until: Option<NodeId>) -> Result<(), Error> {
        let session = self.held().session.clone().ok_or(Error::Nothing)?;
        // The deformed CT is shown before it is known how sure the tumour's place is.
        let parts: Vec<Vec<NodeId>> = match until {
            // Labels are looked at where they are doubted, which is known of a region.
            Some(NodeId::Segment) if has_breast(&session) => {
                vec![vec![NodeId::Segment], vec![NodeId::Region]]
            }
            Some(until) => vec![vec![until]],
            None => vec![
                vec![NodeId::Warp, NodeId::MovedObjects],
                vec![NodeId::Points, NodeId::Interval, NodeId::Evaluation],
                vec![NodeId::Fields],
            ],
        };
        self.begin(until.map_or("simulating", NodeId::name), move |workspace, watching| {
            workspace.change(|held| held.tell_run("result", until.or(Some(NodeId::Interval))));
            let request = Request { observer: watching, lane: Lane::Final, ..Request::default() };
            for part in parts {
                let done = session.update(&part, &request);
                // What was finished before it failed is shown all the same.
                workspace.change(|held| held.show_results(&session));
                done?;
            }
            Ok(())
        })
    }

    /// Runs the whole case into a folder.
    ///
    /// # Errors
    /// When nothing is open, the name is none, or work goes on.
    pub(crate) fn run_into(self: &Arc<Self>, dir: &str, name: &str) -> Result<(), Error> {
        let session = self.held().session.clone().ok_or(Error::Nothing)?;
        let path = self.held().roots.path_of(dir, name)?;
        let name = name.to_owned();
        let text = |held: &OpenCase| held.case.as_ref().map(|case| case.text().to_owned());
        let before = text(&self.held());
        self.begin("the whole run", move |workspace, watching| {
            workspace.change(|held| held.tell_run(&name, None));
            // The deformed CT is shown before its files are written.
            let request = Request { observer: watching, ..Request::default() };
            session.update(&[NodeId::Warp], &request)?;
            workspace.change(|held| held.show_results(&session));
            session.keep_in(Some(RunFolder::open(&path)?))?;
            let done = supine_flow::run(&session, Options::default(), watching);
            // A run lets go in memory of what lies in its folder.
            let read = if done.is_ok() { read_back(&session, &request) } else { Ok(()) };
            session.keep_in(None)?;
            read?;
            workspace.read_objects(&session, watching, Lane::Final);
            workspace.change(|held| held.show_results(&session));
            if let Some(summary) = done? {
                workspace.change(|held| {
                    held.result_of = text(held).filter(|now| before.as_ref() == Some(now));
                    held.show_result(&path, &summary);
                });
            }
            Ok(())
        })
    }
}

/// Reads what is shown from the folder of a run. Each is asked for: what is only brought up to date
/// there is not read.
fn read_back(session: &Session, request: &Request<'_>) -> Result<(), supine_flow::Error> {
    session.labels(request)?;
    session.region(request)?;
    session.mesh(request)?;
    session.deformation(request)?;
    session.read_scans(request)?;
    session.deformed_ct(request)?;
    session.tumour(request)?;
    session.tumour_interval(request).map(drop)
}

/// Whether side and tumour are known, and so the region.
pub(crate) fn has_breast(session: &Session) -> bool {
    session.case().breast.is_some() && session.tumour_sphere().is_some()
}

impl OpenCase {
    /// Tells the command line of a run.
    fn tell_run(&mut self, out: &str, until: Option<NodeId>) {
        let Some(path) = self.case.as_ref().and_then(CaseFile::path) else {
            self.state.command.clear();
            return;
        };
        let until = until.map_or(String::new(), |node| format!(" --until {node}"));
        let (case, out) = (quoted(&name_of(path)), quoted(out));
        self.state.command = format!("supine run {case} --out {out}{until}");
    }

    /// Shows what a run left.
    fn show_result(&mut self, path: &Path, summary: &Summary) {
        let shown = result(path, summary);
        let is_saved = self.case.as_ref().is_some_and(|case| case.path().is_some());
        if !is_saved && summary.run.case_folder.is_some() {
            let name = name_of(path);
            let (of, out) = (quoted(&format!("{name}/summary.json")), quoted(&name));
            self.state.command = format!("supine run {of} --out {out}");
        }
        let shown = ResultShown { old: self.result_of.is_none(), ..shown };
        (self.result, self.state.result) = (Some(path.into()), Some(shown));
    }
}

fn result(path: &Path, summary: &Summary) -> ResultShown {
    let checks = summary.export.as_ref().map(|export| &export.verified);
    ResultShown {
        verified: checks.map(|checks| VerifiedShown {
            ok: checks.passed == checks.total && checks.total > 0,
            text: format!(
                "{} of {} checks of the written files passed",
                checks.passed, checks.total
            ),
        }),
        confirm: words(summary.verdict.colour),
        name: name_of(path),
        old: false,
        lacks_ticks: false,
        verdict: summary.verdict.colour,
        headline: headline(summary),
        reasons: summary.verdict.reasons.iter().map(|reason| reason.message.clone()).collect(),
        outputs: summary.outputs.iter().map(|output| output.path.clone()).collect(),
    }
}

/// An object of a folder, as a case may name it.
fn beside(found: &PlanObject) -> (CarriedKind, PathBuf) {
    let kind = match found.kind {
        PlanObjectKind::Structures => CarriedKind::Structures,
        PlanObjectKind::Dose => CarriedKind::Dose,
        PlanObjectKind::Segmentation => CarriedKind::Segmentation,
    };
    (kind, found.path.clone())
}

impl OpenCase {
    /// A series that was found: its folder and its UID.
    pub(crate) fn series(&self, id: &str) -> Result<&(PathBuf, String), Error> {
        let series = id.parse().ok().and_then(|n: usize| self.series.get(n));
        series.ok_or(Error::NotBelow)
    }
}

impl Opened {
    /// The case; of a series and of a run no file holds it.
    fn case(&self) -> Result<CaseFile, Error> {
        let text = |spec: &Spec| -> Result<String, Error> {
            let edits = spec.edits();
            Ok(edit("", &edits)?)
        };
        match self {
            Self::Series { dir, uid } => {
                Ok(CaseFile::new(text(&of_series(dir, uid)?)?, PathBuf::new()))
            }
            Self::Case(path) => Ok(CaseFile::open(path)?),
            Self::Unsaved(record) => Ok(record.case()),
            Self::Run(path) => {
                let spec = Spec::read(&path.join("summary.json"))?;
                Ok(CaseFile::new(text(&spec)?, spec.folder().into()))
            }
        }
    }

    /// The folder that a case is made from which no file holds.
    fn place(&self) -> Option<&Path> {
        match self {
            Self::Series { dir, .. } => Some(dir),
            Self::Run(path) => Some(path),
            Self::Unsaved(record) => Some(record.place()),
            Self::Case(_) => None,
        }
    }

    /// The command line that goes on from here; empty where there is none.
    fn command(&self) -> String {
        match self {
            Self::Unsaved(_) => String::new(),
            Self::Series { dir, .. } => format!("supine init {}", quoted(&name_of(dir))),
            Self::Case(path) => run_command(&name_of(path), &[]),
            Self::Run(path) => run_command(&format!("{}/summary.json", name_of(path)), &[]),
        }
    }
}

/// What is known of a series alone.
pub(crate) fn of_series(dir: &Path, uid: &str) -> Result<Spec, Error> {
    let mut spec = Spec::new("");
    spec.set("ct", &json!(dir))?;
    spec.set("series", &json!(uid))?;
    Ok(spec)
}

/// A case as the page shows it.
pub(crate) fn shown_case(session: &Session, file: &CaseFile) -> CaseShown {
    let case = session.case();
    let mut values = serde_json::Map::new();
    flatten(&mut values, "", &serde_json::Value::Object(case.canonical().clone()));
    let [can_undo, can_redo] = file.can_undo_redo();
    CaseShown {
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
