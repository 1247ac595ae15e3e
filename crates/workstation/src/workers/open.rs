//! Opening a folder, a series, a case or a run.

use crate::Error;
use crate::draw::body::body;
use crate::names::{name_of, quoted, run_command};
use crate::navigation::follow::Following;
use crate::roots::{is_case, is_run};
use crate::store::adjacent::AdjacentObject;
use crate::store::unsaved::{Draft, Record};
use crate::workers::jobs::Jobs;
use crate::workers::objects;
use crate::workers::reporter::Reporter;
use crate::workers::run::read_back;
use serde::Deserialize;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use supine_flow::commands::dicom::{Inspect, inspect};
use supine_flow::spec::edit;
use supine_flow::{
    CarriedKind, CaseFile, FinishedRun, Lane, Request, RunFolder, Session, Spec, Start,
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
    /// With the objects that lie beside it.
    Series {
        dir: PathBuf,
        uid: String,
        objects: Vec<(CarriedKind, PathBuf)>,
    },
    Case(PathBuf),
    Run(PathBuf),
    Unsaved(Box<Record>),
}

/// Opens one thing after another.
pub(crate) struct Opener {
    pub(crate) jobs: Arc<Jobs>,
    pub(crate) following: Arc<Following>,
    pub(crate) threads: usize,
    /// When and by which command the program began.
    pub(crate) start: Option<Start>,
}

impl Opener {
    /// Opens what the program was started with; a folder may be looked through.
    ///
    /// # Errors
    /// When work goes on.
    pub(crate) fn start(self: &Arc<Self>, path: &Path, look_through: bool) -> Result<(), Error> {
        if path.is_dir() && is_run(path) {
            return self.begin(Opened::Run(path.into()), None);
        }
        if path.is_file() && is_case(path) {
            return self.begin(Opened::Case(path.into()), None);
        }
        if look_through { self.look_through(path.into()) } else { Ok(()) }
    }

    /// Looks through a folder by its number.
    ///
    /// # Errors
    /// When it was not given out, or work goes on.
    pub(crate) fn inspect(&self, dir: &str) -> Result<(), Error> {
        self.look_through(self.jobs.workspace.look(|store| store.roots.path(dir))?)
    }

    fn look_through(&self, path: PathBuf) -> Result<(), Error> {
        self.jobs.begin("looking through the folder", move |report| {
            let spec = Spec::new("");
            let inspection = inspect(&Inspect { spec, path: path.clone(), pixels: false }, report)?;
            report.change(|store| store.inspected(&path, &inspection));
            Ok(())
        })
    }

    /// Opens what the page asks for.
    ///
    /// # Errors
    /// When it was not given out, or work goes on.
    pub(crate) fn open(self: &Arc<Self>, asked: &OpenRequest) -> Result<(), Error> {
        let (opened, kept) = self.jobs.workspace.look(|store| {
            let folder = &store.folder;
            let opened = match asked {
                OpenRequest::Series(id) => {
                    let ((dir, uid), objects) = (folder.series(id)?.clone(), folder.objects());
                    Opened::Series { dir, uid, objects: objects.to_vec() }
                }
                OpenRequest::Case(id) => Opened::Case(store.roots.path(id)?),
                OpenRequest::Run(id) => Opened::Run(store.roots.path(id)?),
                OpenRequest::Unsaved(id) => {
                    let (record, draft) = store.unsaved.take(id)?;
                    return Ok((Opened::Unsaved(Box::new(record)), Some(draft)));
                }
            };
            Ok::<_, Error>((opened, None))
        })?;
        self.begin(opened, kept)
    }

    /// Opens it; `kept`: what was kept of it before.
    fn begin(self: &Arc<Self>, opened: Opened, kept: Option<Draft>) -> Result<(), Error> {
        let opener = Arc::clone(self);
        self.jobs.begin("reading the CT", move |report| opener.read(&opened, kept, report))
    }

    fn read(&self, opened: &Opened, kept: Option<Draft>, report: &Reporter) -> Result<(), Error> {
        let case = opened.case()?;
        let draft = kept.or_else(|| Some(Draft::new(opened.place()?.into(), &case)));
        let session = Session::new(case.spec()?, self.threads)?.with_start(self.start.clone());
        let session = Arc::new(session);
        let live = &self.jobs.live;
        live.end();
        live.drop_preview();
        report.change(|store| {
            store.reading(&session, &case, draft, opened.command());
            // What was followed is of another patient.
            self.following.leave();
        });
        let ct = session.ct(&Request { observer: report, ..Request::default() })?;
        // Structure sets are read for the names of their regions.
        let adjacent = opened.objects().iter().cloned();
        let adjacent = adjacent.map(|(kind, path)| AdjacentObject::new(kind, path)).collect();
        report.change(|store| store.opened(&session, case, &ct, adjacent));
        objects::read(&session, report, Lane::Final);
        let patient = body(&ct);
        report.change(|store| store.display.set_body(patient));
        if let Opened::Run(path) = opened { show_run(path, &session, report) } else { Ok(()) }
    }
}

/// Shows what a run left, if it is what would be made now; nothing is made anew.
fn show_run(path: &Path, session: &Session, report: &Reporter) -> Result<(), Error> {
    let run = FinishedRun::open(path)?;
    if !run.is_of(session)? {
        return Err(Error::OtherRun);
    }
    let summary = run.summary()?;
    session.keep_in(Some(RunFolder::open(path)?))?;
    let read = read_back(session, &Request { observer: report, ..Request::default() });
    session.keep_in(None)?;
    read?;
    objects::read(session, report, Lane::Final);
    report.change(|store| {
        store.show_results(session);
        let case = store.case.text().map(ToOwned::to_owned);
        store.show_run(path, case, &summary);
    });
    Ok(())
}

impl Opened {
    /// The case; of a series and of a run no file holds it.
    fn case(&self) -> Result<CaseFile, Error> {
        let text = |spec: &Spec| -> Result<String, Error> {
            let edits = spec.edits();
            Ok(edit("", &edits)?)
        };
        match self {
            Self::Series { dir, uid, .. } => {
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

    fn objects(&self) -> &[(CarriedKind, PathBuf)] {
        if let Self::Series { objects, .. } = self { objects } else { &[] }
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
