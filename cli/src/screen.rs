//! What people see: the progress bar, warnings and errors; and Ctrl-C.

use crate::args::Common;
use crate::failure::Failure;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use supine_pipeline::{Stage, Watch};

/// Set by Ctrl-C; every progress callback answers with it.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// stderr, and the wish to stop.
pub(crate) struct Screen {
    bar: ProgressBar,
    pub(crate) json: bool,
    quiet: bool,
    /// One line per stage instead of a bar.
    lines: bool,
}

impl Screen {
    pub(crate) fn new(common: &Common) -> Self {
        let bar = ProgressBar::new(1000);
        if common.quiet || common.no_progress {
            bar.set_draw_target(ProgressDrawTarget::hidden());
        }
        let style = ProgressStyle::with_template("{msg:>9} [{bar:32}] {percent:>3} %  {elapsed}");
        if let Ok(style) = style {
            bar.set_style(style.progress_chars("=> "));
        }
        let lines = !common.quiet && (common.verbose || bar.is_hidden());
        Self { bar, json: common.json, quiet: common.quiet, lines }
    }

    /// Makes Ctrl-C stop the work at its next step; a second one ends the program at once.
    pub(crate) fn catch_interrupts(&self) -> Result<(), Failure> {
        let bar = self.bar.clone();
        ctrlc::set_handler(move || {
            if INTERRUPTED.swap(true, Ordering::SeqCst) {
                std::process::exit(130);
            }
            bar.suspend(|| eprintln!("stopping (Ctrl-C again to end at once)"));
        })
        .map_err(|e| Failure { code: 75, message: format!("Ctrl-C cannot be caught: {e}") })
    }

    /// Progress of a command with one part.
    pub(crate) fn share(&self, what: &'static str, share: f64) -> bool {
        self.bar.set_message(what);
        self.bar.set_position((share * 1000.0) as u64);
        if share >= 1.0 {
            self.bar.reset();
        }
        !INTERRUPTED.load(Ordering::SeqCst)
    }

    /// A line for people.
    pub(crate) fn say(&self, text: &str) {
        if !self.quiet {
            self.bar.suspend(|| eprintln!("{text}"));
        }
    }

    /// Warnings of a command with one part.
    pub(crate) fn warn_all(&self, warnings: &[String]) {
        for warning in warnings {
            self.say(&format!("warning: {warning}"));
        }
    }

    /// Takes the bar away.
    pub(crate) fn clear(&self) {
        self.bar.finish_and_clear();
    }

    /// The one message of a command that failed.
    pub(crate) fn fail(&self, message: &str) {
        self.bar.finish_and_clear();
        eprintln!("error: {message}");
    }

    /// The result of a command: for scripts on stdout, or `text` for people on stderr.
    pub(crate) fn result(&self, json: &impl serde::Serialize, text: &str) {
        self.bar.finish_and_clear();
        if self.json {
            match serde_json::to_string_pretty(json) {
                Ok(json) => data(&(json + "\n")),
                Err(e) => eprintln!("error: the result is not JSON: {e}"),
            }
        } else {
            self.say(text);
        }
    }
}

/// Writes to stdout. A reader that has seen enough (`| head`) is no fault of ours.
pub(crate) fn data(text: &str) {
    use std::io::Write;
    let _closed_early = std::io::stdout().lock().write_all(text.as_bytes());
}

impl Watch for Screen {
    fn begin(&self, stage: Stage) {
        self.bar.set_message(stage.name());
        self.bar.set_position(0);
        self.bar.enable_steady_tick(Duration::from_millis(200));
    }

    fn progress(&self, stage: Stage, share: f64) -> bool {
        self.bar.set_message(stage.name());
        self.bar.set_position((share * 1000.0) as u64);
        !INTERRUPTED.load(Ordering::SeqCst)
    }

    fn warning(&self, stage: Stage, message: &str) {
        self.say(&format!("warning ({stage}): {message}"));
    }

    fn end(&self, stage: Stage, seconds: f64, cached: bool) {
        if self.lines {
            let how = if cached { "done before".into() } else { format!("{seconds:.1} s") };
            self.say(&format!("{:>9}  {how}", stage.name()));
        }
    }
}
