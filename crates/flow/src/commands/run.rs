//! `supine run`: the whole flow of a case.

use crate::folder::{FinishedRun, RunFolder, note_failed};
use crate::run::{Options, unnoted};
use crate::session::{Session, Start};
use crate::spec::Spec;
use crate::{Error, Observer, Summary};
use serde_json::Value as Json;
use std::path::{Path, PathBuf};
use supine_report::Colour;

/// What is asked.
#[derive(Clone, Debug)]
pub struct Run {
    /// A case file, or the summary of a run.
    pub case: PathBuf,
    /// Changes of its values.
    pub changes: Vec<Change>,
    /// Takes the patient out of all that leaves, whatever the case says.
    pub anonymise: bool,
    /// The folder of the run.
    pub out: PathBuf,
    /// Where it ends, and what is made anew.
    pub options: Options,
    /// When and by which command it began.
    pub start: Option<Start>,
}

/// A change of one value of a case, as it is typed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    /// The key.
    pub key: String,
    /// Its value, as TOML or as a bare word.
    pub value: String,
}

impl std::str::FromStr for Change {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (key, value) = text.split_once('=').ok_or("expected key=value, such as table.ap=5")?;
        Ok(Self { key: key.trim().into(), value: value.trim().into() })
    }
}

/// What became of a run.
#[derive(Clone, Debug)]
pub struct RunDone {
    /// The summary; none of a run that was to end before its report.
    pub summary: Option<Summary>,
    /// The folder held results of another version, which were set aside.
    pub renewed: bool,
}

impl RunDone {
    /// Whether the result may be used: no verdict worse than this, or none yet.
    pub fn usable(&self, worst: Colour) -> bool {
        self.summary.as_ref().is_none_or(|summary| summary.verdict.colour <= worst)
    }
}

/// Brings the folder of a run up to date.
///
/// # Errors
/// When the case cannot be used, a stage fails, or the folder cannot be written.
pub fn run(given: &Run, observer: &dyn Observer) -> Result<RunDone, Error> {
    let threads = rayon::current_num_threads();
    let (start, options) = (given.start.clone(), given.options);
    let anonymise = given.anonymise;
    let into = Into { out: &given.out, anonymise, options, start, threads };
    run_into(spec(&given.case, &given.changes), into, observer, &mut None)
}

/// Where a run goes and how.
pub(crate) struct Into<'a> {
    pub(crate) out: &'a Path,
    /// Whether the patient is taken out, whatever the case says.
    pub(crate) anonymise: bool,
    pub(crate) options: Options,
    pub(crate) start: Option<Start>,
    pub(crate) threads: usize,
}

/// Runs the values of a case, if there are any; what it held at most, MB, is told whether it ends
/// well or not. That it failed is noted in a folder that holds a finished result, which is then not
/// what the case asks for.
pub(crate) fn run_into(
    spec: Result<Spec, Error>,
    into: Into<'_>,
    observer: &dyn Observer,
    peak_memory_mb: &mut Option<f64>,
) -> Result<RunDone, Error> {
    let out = into.out;
    let done = spec.and_then(|spec| values_into(spec, into, observer, peak_memory_mb));
    if let Err(error) = &done {
        note_failed(out, error);
    }
    done
}

fn values_into(
    mut spec: Spec,
    Into { out, anonymise, options, start, threads }: Into<'_>,
    observer: &dyn Observer,
    peak_memory_mb: &mut Option<f64>,
) -> Result<RunDone, Error> {
    spec.note_doubts(observer);
    if anonymise {
        spec.set("export.anonymise", &Json::Bool(true))?;
    }
    spec.check_complete()?;
    let spec = if options.inputs_changed { spec.with_inputs_changed() } else { spec };
    let session = Session::new(spec, threads)?;
    session.refuse_overlap(out)?;
    let folder = match RunFolder::open(out) {
        Ok(folder) => folder.overwriting(options.overwrite),
        Err(error) => return unchanged(&session, (out, options), error),
    };
    let renewed = folder.is_former();
    let session: Session = session.with_folder(folder)?.with_start(start);
    let summary = unnoted(&session, options, observer);
    *peak_memory_mb = session.peak_memory_mb();
    Ok(RunDone { summary: summary?, renewed })
}

/// The finished run in a folder that cannot be written, when there is nothing to write.
///
/// # Errors
/// Why it cannot be written, when there is.
fn unchanged(
    session: &Session,
    (out, options): (&Path, Options),
    why: Error,
) -> Result<RunDone, Error> {
    let whole = options.until.is_none() && options.force.is_none();
    let summary = if whole && why.is_unwritable() { finished(session, out)? } else { None };
    summary.map(|summary| RunDone { summary: Some(summary), renewed: false }).ok_or(why)
}

/// The summary of a finished run, if it is of what a session is given and all its files are there.
///
/// # Errors
/// When what the session is given cannot be read.
pub(crate) fn finished(session: &Session, out: &Path) -> Result<Option<Summary>, Error> {
    let Ok(run) = FinishedRun::open(out) else { return Ok(None) };
    let Ok(summary) = run.summary() else { return Ok(None) };
    let own = run.is_whole(&summary.chain) && run.is_of(session)?;
    Ok(own.then_some(summary))
}

/// The values of a case with some changes.
pub(crate) fn spec(case: &Path, changes: &[Change]) -> Result<Spec, Error> {
    let mut spec = Spec::read(case)?;
    for (n, Change { key, value }) in changes.iter().enumerate() {
        // The last of two changes of one key holds; but nobody gives a key two names for that.
        if let Some(other) = changes[..n].iter().find(|other| Spec::by_two_names(&other.key, key)) {
            return Err(super::usage(format!(
                "`{}` and `{key}` are the same: give one of them alone",
                other.key
            )));
        }
        spec.change(key, value)?;
    }
    Ok(spec)
}
