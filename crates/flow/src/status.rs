//! How a run ended, told from its result or its failure: one place for `supine run --status` and
//! for a batch.

use crate::commands::run::{Run, RunDone};
use crate::folder::{USERS, whole, write_atomically};
use crate::spec::{Spec, Value};
use crate::{Error, Observer, Options, Start, Summary, headline};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;
use supine_report::{Colour, Ended, RunError, RunStatus, TumourMoved, advice_for};
use supine_space::Failure;

/// The code of a run that the system ended.
pub(crate) const NOT_ENDED: &str = "not-ended";

/// Why a run that has its result ends with another code than 0.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Denial {
    /// `verdict-red` or `verdict-not-green`.
    pub code: &'static str,
    /// The verdict and its reasons, a line each.
    pub lines: Vec<String>,
}

/// Why a verdict worse than `worst` does not do; none when it does.
pub fn denial(summary: &Summary, worst: Colour) -> Option<Denial> {
    let colour = summary.verdict.colour;
    let code = if colour == Colour::Red { "verdict-red" } else { "verdict-not-green" };
    (colour > worst).then(|| Denial { code, lines: verdict_lines(summary) })
}

/// The verdict and its reasons, a line each; those of the reasons are indented.
pub fn verdict_lines(summary: &Summary) -> Vec<String> {
    let headline = headline(summary);
    let headline = headline
        .split_once(':')
        .map_or(headline.clone(), |(colour, rest)| format!("{}:{rest}", colour.to_uppercase()));
    let reasons = summary.verdict.reasons.iter().map(|reason| format!("  {}", reason.told()));
    std::iter::once(headline).chain(reasons).collect()
}

/// What to do, where a message says it: last, after a semicolon.
pub fn advice(message: &str) -> Option<String> {
    message.rsplit_once("; ").map(|(_, advice)| advice.trim_end().to_owned())
}

/// What to do about a failure: what its message says, else what helps with its kind.
pub fn advice_of(kind: Failure, message: &str) -> String {
    advice_for(kind, advice(message))
}

/// The name of a case: that of its file, or of its folder where the file is called `case` or
/// `summary`.
pub fn case_name(case: &Path) -> String {
    let whole = whole(case);
    let stem = |path: &Path| path.file_stem().map(|name| name.to_string_lossy().into_owned());
    let folder = whole.parent().and_then(Path::file_name);
    let folder = folder.map(|name| name.to_string_lossy().into_owned());
    let own = stem(&whole).filter(|name| !["case", "summary"].contains(&name.as_str()));
    own.or(folder).or_else(|| stem(&whole)).unwrap_or_else(|| "case".into())
}

/// A run that is to be told of.
pub(crate) struct Told<'a> {
    /// Name of its case.
    pub(crate) name: String,
    /// Its name when the patient is taken out.
    pub(crate) nameless: String,
    pub(crate) case_file: &'a Path,
    /// Its values; why there are none.
    pub(crate) spec: Result<Spec, Error>,
    /// Whether the patient is taken out, whatever the case says.
    pub(crate) anonymise: bool,
    pub(crate) out: &'a Path,
    pub(crate) options: Options,
    pub(crate) start: Option<Start>,
    pub(crate) threads: usize,
    /// The worst verdict that does.
    pub(crate) worst: Colour,
}

/// Runs a case; how that ended, and the same in the words of a status. Until it ended the file says
/// that it did not.
pub fn run_told(
    given: &Run,
    (worst, path): (Colour, &Path),
    observer: &dyn Observer,
) -> (Result<RunDone, Error>, RunStatus) {
    let told = Told::of(given, (worst, path));
    let not_ended = told.not_ended();
    // A pipe or a device takes one status.
    let takes_another = std::fs::metadata(path).map_or(true, |there| there.is_file());
    match takes_another.then(|| write_status(&not_ended, path)) {
        Some(Err(error)) => (Err(error), not_ended),
        _ => told.run(observer),
    }
}

/// Writes a status; see [`write_text`].
///
/// # Errors
/// [`Error::Output`] when it cannot be written.
pub fn write_status(status: &RunStatus, path: &Path) -> Result<(), Error> {
    write_text(path, &status.text())
}

/// No status and no trace of a run is larger, bytes.
const LARGEST: u64 = 1 << 26;

/// That a text may be written there: no file is replaced that is not such a text itself.
///
/// # Errors
/// [`Error::Refused`] when something else is there.
pub fn check_text(option: &str, path: &Path, is_such: impl Fn(&str) -> bool) -> Result<(), Error> {
    let there = std::fs::metadata(path).ok().filter(|there| there.is_file() && there.len() > 0);
    let Some(there) = there else { return Ok(()) };
    if there.len() < LARGEST && std::fs::read_to_string(path).is_ok_and(|text| is_such(&text)) {
        return Ok(());
    }
    let path = path.display();
    let message = format!("{path} was not written by {option}: name another file for {option}");
    Err(Error::Refused { kind: Failure::Usage, message })
}

/// Whether a text is a status.
pub fn is_status(text: &str) -> bool {
    let read: Option<serde_json::Value> = serde_json::from_str(text).ok();
    let schema = read.as_ref().and_then(|all| all["schema"].as_str());
    schema.is_some_and(|schema| schema.starts_with("supine-status/"))
}

/// Writes a text: a file is replaced as a whole, through links; what is no file, such as a pipe or
/// a device, takes it as a stream and stays what it is. A folder that is missing is made.
///
/// # Errors
/// [`Error::Output`] when it cannot be written.
pub fn write_text(path: &Path, text: &str) -> Result<(), Error> {
    let output = |source| Error::Output { path: path.into(), source };
    match std::fs::metadata(path) {
        Ok(there) if there.is_file() => {
            let file = std::fs::canonicalize(path).map_err(output)?;
            write_atomically(&file, text.as_bytes(), USERS)
        }
        Ok(there) if !there.is_dir() => {
            let mut stream = std::fs::OpenOptions::new().write(true).open(path).map_err(output)?;
            stream.write_all(text.as_bytes()).map_err(output)
        }
        _ => {
            // A link that leads to no file yet makes that file.
            let file =
                std::fs::read_link(path).map_or_else(|_| path.into(), |to| path.with_file_name(to));
            let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty());
            folder.map_or(Ok(()), std::fs::create_dir_all).map_err(output)?;
            write_atomically(&file, text.as_bytes(), USERS)
        }
    }
}

/// The status of a run that somebody ends at once, for whoever ends it.
pub fn stopped_at_once(given: &Run, path: &Path) -> RunStatus {
    Told::of(given, (Colour::Amber, path)).stopped()
}

impl<'a> Told<'a> {
    fn of(given: &'a Run, (worst, path): (Colour, &Path)) -> Self {
        Self {
            name: case_name(&given.case),
            nameless: case_name(path),
            case_file: &given.case,
            spec: crate::commands::run::spec(&given.case, &given.changes),
            anonymise: given.anonymise,
            out: &given.out,
            options: given.options,
            start: given.start.clone(),
            threads: rayon::current_num_threads(),
            worst,
        }
    }
}

impl Told<'_> {
    /// Runs it.
    pub(crate) fn run(mut self, observer: &dyn Observer) -> (Result<RunDone, Error>, RunStatus) {
        let begun = Instant::now();
        let nameless = self.is_nameless();
        let mut peak_memory_mb = None;
        // It is taken once, and told of no more.
        let given = std::mem::replace(&mut self.spec, Err(Error::Stopped));
        let into = crate::commands::run::Into {
            out: self.out,
            anonymise: self.anonymise,
            options: self.options,
            start: self.start.take(),
            threads: self.threads,
        };
        let done = crate::commands::run::run_into(given, into, observer, &mut peak_memory_mb);
        let seconds = begun.elapsed().as_secs_f64();
        let bare = RunStatus { seconds, peak_memory_mb, ..self.bare(nameless) };
        let status = match &done {
            Ok(RunDone { summary: Some(summary), .. }) => finished(bare, summary, self.worst),
            Ok(RunDone { summary: None, .. }) => bare,
            Err(error) => failed(bare, error, nameless),
        };
        (done, status)
    }

    /// Of a case whose run failed otherwise than by its own error.
    pub(crate) fn broken(&self, kind: Failure, code: &str, message: &str) -> RunStatus {
        let error = RunError::new(kind, code, message.into(), advice(message));
        let (status, exit, error) = (Ended::Failed, kind.exit_code(), Some(error));
        RunStatus { status, exit, error, ..self.bare(self.is_nameless()) }
    }

    /// Of a run that the system ended: it stands where the status goes while the run goes on, as
    /// nobody could say it then.
    pub(crate) fn not_ended(&self) -> RunStatus {
        let text = "the run did not come to its end: the memory did not suffice, or somebody ended the program from outside; \
                    run it again, with more memory or fewer at once";
        self.broken(Failure::Retry, NOT_ENDED, text)
    }

    /// Of a run that somebody stopped, told by others.
    pub(crate) fn stopped(&self) -> RunStatus {
        failed(self.bare(self.is_nameless()), &Error::Stopped, false)
    }

    /// Whether nothing may name the patient. A case that cannot be read is taken for one that asks
    /// for it if its text speaks of it.
    pub(crate) fn is_nameless(&self) -> bool {
        let asks = match &self.spec {
            Ok(spec) => spec.get("export.anonymise") == Some(&Value::Switch(true)),
            Err(_) => {
                std::fs::read_to_string(self.case_file).is_ok_and(|text| text.contains("anonymise"))
            }
        };
        self.anonymise || asks
    }

    /// What is known of a run without its result.
    fn bare(&self, nameless: bool) -> RunStatus {
        let shown = |path: &Path| -> Option<PathBuf> { (!nameless).then(|| whole(path)) };
        RunStatus {
            schema: RunStatus::SCHEMA.into(),
            case: if nameless { self.nameless.clone() } else { self.name.clone() },
            case_file: shown(self.case_file),
            out: shown(self.out),
            exit: 0,
            status: Ended::Partial,
            colour: None,
            reasons: vec![],
            warnings: 0,
            error: None,
            seconds: 0.0,
            peak_memory_mb: None,
            voxels: None,
            threads: self.threads,
            tumour: None,
            version: env!("CARGO_PKG_VERSION").into(),
        }
    }

    /// Of a run that is finished.
    pub(crate) fn finished(&self, summary: &Summary) -> RunStatus {
        finished(self.bare(self.is_nameless()), summary, self.worst)
    }
}

/// The status of a finished run, with the time and memory of its summary.
pub(crate) fn finished(bare: RunStatus, summary: &Summary, worst: Colour) -> RunStatus {
    let colour = summary.verdict.colour;
    let error = denial(summary, worst).map(|denial| {
        let lines: Vec<&str> = denial.lines.iter().map(|line| line.trim()).collect();
        RunError::new(Failure::Check, denial.code, lines.join("\n"), None)
    });
    RunStatus {
        exit: error.as_ref().map_or(0, |error| error.exit),
        status: Ended::of(colour),
        colour: Some(colour),
        reasons: summary.verdict.reasons.iter().map(supine_report::Reason::told).collect(),
        warnings: summary.warnings.len(),
        error,
        seconds: summary.run.total_seconds,
        peak_memory_mb: summary.run.peak_memory_mb,
        voxels: Some(summary.ct.size.iter().product()),
        threads: summary.run.threads,
        tumour: TumourMoved::of(summary),
        version: summary.tool.version.clone(),
        ..bare
    }
}

/// The status of a run that ended without a result. Messages name files: of a de-identified one the
/// code stands in their place.
fn failed(bare: RunStatus, error: &Error, nameless: bool) -> RunStatus {
    let (kind, code, message) = (error.kind(), error.code(), error.to_string());
    let mut told = RunError::new(kind, code, message.clone(), advice(&message));
    told.place = error.place();
    if nameless {
        told.message =
            format!("{code}: the message may name files; it was told on the terminal alone");
        told.place.file = None;
        told.advice = Some(advice_for(kind, None));
    }
    let status = if kind == Failure::Stopped { Ended::Stopped } else { Ended::Failed };
    RunStatus { exit: kind.exit_code(), status, error: Some(told), ..bare }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_case_is_called_after_its_file_or_its_folder() {
        for (path, name) in [
            ("/a/p1/case.toml", "p1"),
            ("/a/p1/summary.json", "p1"),
            ("/a/p2.toml", "p2"),
            ("/a/Ms X.case.toml", "Ms X.case"),
            ("/case.toml", "case"),
        ] {
            assert_eq!(case_name(Path::new(path)), name, "{path}");
        }
    }

    fn told<'a>(case: &'a Path, out: &'a Path, anonymise: bool) -> Told<'a> {
        Told {
            name: case_name(case),
            nameless: "s7".into(),
            case_file: case,
            spec: Spec::read(case).map_err(Error::from),
            anonymise,
            out,
            options: Options::default(),
            start: None,
            threads: 1,
            worst: Colour::Amber,
        }
    }

    #[test]
    fn a_failure_is_told_with_its_place_and_a_de_identified_one_names_no_file() {
        let dir = tempfile::tempdir().unwrap();
        let (case, out) = (dir.path().join("Meier.toml"), dir.path().join("out"));
        let whole = "ct = 'Meier_ct'\nbreast = 'left'\ntable = { ap = 7, lat = 5 }\n\
                     tumour = { centre = [1, 2, 3], radius = 9 }\n";
        for (text, anonymise, code, exit) in [
            ("breast = 'lft'\n", false, "case-value", 1),
            ("breast = 'lft'\nexport = { anonymise = true }\n", false, "case-value", 1),
            (whole, false, "input-missing", 1),
            (whole, true, "input-missing", 1),
        ] {
            std::fs::write(&case, text).unwrap();
            let (done, status) = told(&case, &out, anonymise).run(&crate::Unwatched);
            let error = status.error.clone().unwrap();
            assert!(done.is_err());
            assert_eq!((status.exit, status.status), (exit, Ended::Failed), "{done:?}");
            assert_eq!((error.code.as_str(), error.exit), (code, exit));
            let nameless = anonymise || text.contains("anonymise");
            assert_eq!(status.line().contains("Meier"), !nameless, "{}", status.line());
            assert_eq!(status.case, if nameless { "s7" } else { "Meier" });
        }
        assert!(!out.join("summary.json").exists());
    }

    #[cfg(unix)]
    #[test]
    fn what_is_no_file_stays_what_it_is() {
        use std::os::unix::fs::FileTypeExt as _;
        let dir = tempfile::tempdir().unwrap();
        let [file, link, dangling, pipe] =
            ["file", "link", "dangling", "pipe"].map(|n| dir.path().join(n));
        std::fs::write(&file, "old").unwrap();
        std::os::unix::fs::symlink("file", &link).unwrap();
        std::os::unix::fs::symlink("made", &dangling).unwrap();
        write_text(&link, "new").unwrap();
        write_text(&dangling, "new").unwrap();
        for (path, is_link) in [(&file, false), (&link, true), (&dangling, true)] {
            assert_eq!(std::fs::read_to_string(path).unwrap(), "new");
            assert_eq!(std::fs::symlink_metadata(path).unwrap().is_symlink(), is_link);
        }
        write_text(Path::new("/dev/null"), "new").unwrap();
        let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
        assert!(made.success());
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || std::fs::read_to_string(pipe).unwrap()
        });
        write_text(&pipe, "new").unwrap();
        assert_eq!(reader.join().unwrap(), "new");
        assert!(std::fs::symlink_metadata(&pipe).unwrap().file_type().is_fifo());
    }

    #[test]
    fn a_status_is_written_whole_into_a_folder_of_its_own() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("status/x.json");
        let case = dir.path().join("none.toml");
        write_status(&told(&case, dir.path(), false).run(&crate::Unwatched).1, &path).unwrap();
        let read = RunStatus::read(&std::fs::read_to_string(&path).unwrap()).unwrap();
        assert_eq!(read.error.unwrap().code, "case-unreadable");
        assert_eq!(std::fs::read_dir(dir.path().join("status")).unwrap().count(), 1);
    }
}
