//! What people see: the progress bar, warnings and errors; and Ctrl-C.

use crate::args::Common;
use crate::cli_values::LogFormat;
use crate::failure::Failure;
use crate::log;
use crate::profile::Profile;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};
use supine_flow::Warning;
use supine_flow::{NodeId, Observer};
use supine_space::{Failure as Kind, visible};

/// Set by Ctrl-C; every progress callback answers with it.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// What is left to be told when a second Ctrl-C ends the program at once.
static LAST_WORDS: Mutex<Option<Box<dyn Fn() + Send>>> = Mutex::new(None);

/// stderr, and the request to stop.
pub(crate) struct Screen {
    bar: ProgressBar,
    /// What is worked on; the bar shows the one that began last.
    running: Mutex<Vec<NodeId>>,
    pub(crate) json: bool,
    /// Whether the one JSON value of the command is out.
    answered: AtomicBool,
    quiet: bool,
    /// One line per node instead of a bar.
    lines: bool,
    /// Also when a node begins, and the codes of warnings.
    verbose: bool,
    /// When a line of something live was shown last, where there is no bar.
    shown: Mutex<Option<Instant>>,
    /// Everything on stderr is JSON.
    log: bool,
    profile: Option<Profile>,
    /// Threads that were asked for.
    threads: Option<usize>,
}

/// Makes the work stop at its next step, as a first Ctrl-C does.
pub(crate) fn interrupt() {
    INTERRUPTED.store(true, Ordering::SeqCst);
}

/// How often the bar's clock goes on.
const TICK: Duration = Duration::from_millis(200);

/// Lines of something live are so far apart where there is no bar.
const LIVE: Duration = Duration::from_secs(1);

impl Screen {
    pub(crate) fn new(common: &Common) -> Self {
        let bar = ProgressBar::new(1000);
        let log = common.log == LogFormat::Json;
        if common.quiet || common.no_progress || log {
            bar.set_draw_target(ProgressDrawTarget::hidden());
        }
        let style = ProgressStyle::with_template(
            "{msg:>13} [{bar:32}] {percent:>3} %  {elapsed}  {prefix}",
        );
        if let Ok(style) = style {
            bar.set_style(style.progress_chars("=> "));
        }
        let lines = !common.quiet && (common.verbose || bar.is_hidden());
        let (json, quiet) = (common.json, common.quiet);
        Self {
            bar,
            running: Mutex::default(),
            json,
            answered: false.into(),
            quiet,
            lines,
            verbose: common.verbose && !quiet,
            shown: Mutex::default(),
            log,
            profile: common.profile.as_deref().map(Profile::new),
            threads: common.threads.map(std::num::NonZeroUsize::get),
        }
    }

    /// Makes Ctrl-C stop the work at its next step; a second one ends the program at once.
    pub(crate) fn catch_interrupts(&self) -> Result<(), Failure> {
        let (bar, log) = (self.bar.clone(), self.log);
        ctrlc::set_handler(move || {
            if INTERRUPTED.swap(true, Ordering::SeqCst) {
                if let Some(tell) = &*LAST_WORDS.lock().unwrap_or_else(PoisonError::into_inner) {
                    tell();
                }
                std::process::exit(Kind::Stopped.exit_code().into());
            }
            let text = "stopping (Ctrl-C again to end at once)";
            bar.suspend(|| err(&if log { log::say(text) } else { text.into() }));
        })
        .map_err(|e| Failure::new(Kind::Retry, format!("Ctrl-C cannot be caught: {e}")))
    }

    /// What a second Ctrl-C still does before it ends the program.
    pub(crate) fn tell_last(&self, tell: impl Fn() + Send + 'static) {
        *LAST_WORDS.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(tell));
    }

    /// Progress of a command that is no part of the flow.
    pub(crate) fn share(&self, what: &'static str, share: f64) -> bool {
        self.bar.set_message(what);
        self.bar.set_position((share * 1000.0) as u64);
        self.go_on()
    }

    /// Progress of many pieces of work as one.
    pub(crate) fn whole(&self, text: String, share: f64) {
        self.bar.set_message(text);
        self.bar.set_position((share * 1000.0) as u64);
        self.bar.enable_steady_tick(TICK);
    }

    /// Whether there are lines in place of a bar.
    pub(crate) fn has_lines(&self) -> bool {
        self.lines
    }

    /// Whether the result is told as JSON, in one document.
    pub(crate) fn is_json(&self) -> bool {
        self.json
    }

    /// Whether all is to be said.
    pub(crate) fn is_verbose(&self) -> bool {
        self.verbose
    }

    /// Threads for all work together: as many as were asked for, or the cores.
    pub(crate) fn threads(&self) -> usize {
        self.threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, Into::into))
    }

    /// A line that changes while somebody looks on; where there is no bar, once a second.
    pub(crate) fn live(&self, text: &str) {
        if self.bar.is_hidden() {
            let mut last = self.shown.lock().unwrap_or_else(PoisonError::into_inner);
            if !self.quiet && last.is_none_or(|last| last.elapsed() >= LIVE) {
                *last = Some(Instant::now());
                self.put(text);
            }
            return;
        }
        if let Ok(style) = ProgressStyle::with_template("{wide_msg}") {
            self.bar.set_style(style);
        }
        self.bar.set_message(text.to_owned());
    }

    /// A line for people.
    pub(crate) fn say(&self, text: &str) {
        if !self.quiet {
            self.bar.suspend(|| self.put(text));
        }
    }

    /// A line in the format that was asked for.
    fn put(&self, text: &str) {
        err(&if self.log { log::say(text) } else { visible(text).into_owned() });
    }

    /// That a trace that was asked for takes the place of no other file.
    ///
    /// # Errors
    /// When it would.
    pub(crate) fn check_profile(&self) -> Result<(), Failure> {
        self.profile.as_ref().map_or(Ok(()), |profile| Ok(profile.check()?))
    }

    /// Writes the trace, if one was asked for.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(crate) fn write_profile(&self) -> Result<(), Failure> {
        let Some(profile) = &self.profile else { return Ok(()) };
        profile.write().map_err(|error| {
            Failure::new(error.kind(), format!("--profile: {error}; name another file"))
        })
    }

    /// Why a command that has its result ends with another code than 0, where [`Self::result`] does
    /// not say it.
    pub(crate) fn reason(&self, text: &str) {
        if self.quiet && !self.json {
            self.put(text);
        }
    }

    /// Takes the bar away.
    pub(crate) fn clear(&self) {
        self.bar.finish_and_clear();
    }

    /// The one message of a command that failed; for scripts on stdout too, unless the command has
    /// answered already and its answer says what failed.
    pub(crate) fn fail(&self, failure: &Failure) {
        self.clear();
        err(&match self.log {
            true => log::line(log::Level::Error, "error", failure.json()["error"].clone()),
            false => format!("error: {}", visible(&failure.message)),
        });
        if self.json && !self.answered.load(Ordering::Relaxed) {
            self.json(&failure.json());
        }
    }

    /// The result of a command: for scripts on stdout, or `text` for people on stderr.
    pub(crate) fn result(&self, json: &impl serde::Serialize, text: &str) {
        self.result_but(None, json, text);
    }

    /// The same of a command that may have failed all the same: for scripts the result says so.
    pub(crate) fn result_but(
        &self,
        failure: Option<&Failure>,
        json: &impl serde::Serialize,
        text: &str,
    ) {
        self.clear();
        if self.json {
            self.json_but(failure, json);
        } else {
            self.say(text);
        }
    }

    /// The answer of a command, which may be that something is wrong, on stdout: for scripts, or as
    /// `text`.
    pub(crate) fn answer_but(
        &self,
        failure: Option<&Failure>,
        json: &impl serde::Serialize,
        text: &str,
    ) {
        self.clear();
        if self.json {
            self.json_but(failure, json);
        } else {
            data(text);
        }
    }

    fn json_but(&self, failure: Option<&Failure>, json: &impl serde::Serialize) {
        match failure.map(|failure| failure.added_to(json).unwrap_or_else(|_| failure.json())) {
            Some(all) => self.json(&all),
            None => self.json(json),
        }
    }

    fn json(&self, json: &impl serde::Serialize) {
        self.answered.store(true, Ordering::Relaxed);
        match serde_json::to_string_pretty(json) {
            Ok(json) => data(&(json + "\n")),
            Err(e) => err(&format!("error: the result is not JSON: {e}")),
        }
    }

    /// Changes what is worked on, and shows it.
    fn now(&self, change: impl FnOnce(&mut Vec<NodeId>)) {
        let mut running = self.running.lock().unwrap_or_else(PoisonError::into_inner);
        change(&mut running);
        if let Some(last) = running.last() {
            self.bar.set_message(last.name());
            self.bar.set_prefix("");
            self.bar.set_position(0);
        }
    }
}

/// A line on stderr; that nobody listens there any more ends no work.
fn err(line: &str) {
    use std::io::Write;
    let _closed = writeln!(std::io::stderr().lock(), "{line}");
}

/// Why something could not be written to stdout, for the end of the program.
static UNWRITTEN: Mutex<Option<std::io::Error>> = Mutex::new(None);

/// Writes to stdout. A reader that has seen enough (`| head`) is no fault of ours; a full disk is
/// told at the end.
pub(crate) fn data(text: &str) {
    use std::io::Write;
    let mut out = std::io::stdout().lock();
    let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    if let Err(error) = written
        && error.kind() != std::io::ErrorKind::BrokenPipe
    {
        UNWRITTEN.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
    }
}

/// That all went to stdout that should.
pub(crate) fn check_written() -> Result<(), Failure> {
    let unwritten = UNWRITTEN.lock().unwrap_or_else(PoisonError::into_inner).take();
    unwritten.map_or(Ok(()), |error| {
        let text = format!("the output cannot be written to stdout: {error}");
        Err(Failure::coded(Kind::Output, "output-not-written", text))
    })
}

impl Observer for Screen {
    fn begin(&self, node: NodeId) {
        self.now(|running| running.push(node));
        if let Some(profile) = &self.profile {
            profile.begin(node);
        }
        if self.verbose && self.log {
            err(&log::begin(node));
        } else if self.verbose {
            self.say(&format!("{:>13}  begins", node.name()));
        }
        self.bar.enable_steady_tick(TICK);
    }

    fn share(&self, node: NodeId, share: f64) {
        if let Some(profile) = &self.profile {
            profile.look();
        }
        let running = self.running.lock().unwrap_or_else(PoisonError::into_inner);
        if running.last() == Some(&node) {
            self.bar.set_position((share * 1000.0) as u64);
        }
    }

    fn note(&self, text: &str) {
        self.say(&format!("note: {text}"));
    }

    fn found(&self, node: NodeId, text: &str) {
        let running = self.running.lock().unwrap_or_else(PoisonError::into_inner);
        if running.last() == Some(&node) {
            self.bar.set_prefix(text.to_string());
        }
        drop(running);
        if self.verbose && self.log {
            err(&log::found(node, text));
        } else if self.verbose {
            self.say(&format!("{:>13}  {text}", node.name()));
        }
    }

    fn warning(&self, node: NodeId, warning: &Warning) {
        if let Some(profile) = &self.profile {
            profile.warning(node, &warning.code);
        }
        if self.log && !self.quiet {
            return err(&log::warning(node, warning));
        }
        let code = if self.verbose { format!(", {}", warning.code) } else { String::new() };
        self.say(&format!("warning ({node}{code}): {}", warning.message));
    }

    fn end(&self, node: NodeId, seconds: f64, cached: bool) {
        self.now(|running| running.retain(|running| *running != node));
        if let Some(profile) = &self.profile {
            profile.end(node, cached);
        }
        if self.lines && self.log {
            err(&log::end(node, seconds, cached));
        } else if self.lines {
            let how = if cached { "done before".into() } else { format!("{seconds:.1} s") };
            self.say(&format!("{:>13}  {how}", node.name()));
        }
    }

    fn go_on(&self) -> bool {
        !INTERRUPTED.load(Ordering::SeqCst)
    }
}
