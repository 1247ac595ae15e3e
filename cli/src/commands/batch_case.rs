//! A case of a batch in a process of its own: one that takes all memory, or in which the program
//! breaks off, ends itself alone.
//!
//! The batch starts this program with the command `batch-case`, writes what was asked as one line
//! of JSON, and closes the pipe when the case is to stop; if the batch itself is ended, the pipe
//! closes too. The case answers with lines of JSON.

use crate::End;
use crate::args_batch::{Batch, BatchCase};
use crate::failure::Failure;
use crate::screen::{Screen, data, interrupt};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use supine_flow::batch::{BatchObserver, Lost, OneCase, run_one};
use supine_flow::commands::Clock;
use supine_flow::{Observer, RunStatus, Start};
use supine_space::Failure as Kind;

/// How often the batch is asked whether its cases are to stop.
const PATIENCE: Duration = Duration::from_millis(100);

/// What a case is told by its batch.
#[derive(Serialize, Deserialize)]
struct Asked {
    /// Its row in the table that is its file.
    row: Option<String>,
    /// Date, time and command of the batch.
    date: String,
    time: String,
    command: Vec<String>,
}

/// What a case tells its batch.
#[derive(Serialize, Deserialize)]
enum Said {
    /// The share of it that is done.
    Share(f64),
    /// See [`BatchObserver::withheld`].
    Withheld(String),
    /// How it ended; last.
    Ended(Box<RunStatus>),
}

/// The cases of a batch, each to be run in a process of its own.
pub(crate) struct Apart {
    /// What every case is given beside its file and name.
    words: Vec<std::ffi::OsString>,
    start: Start,
    running: Running,
}

/// Numbers of the processes at work.
#[derive(Clone, Default)]
pub(crate) struct Running(Arc<Mutex<BTreeSet<u32>>>);

impl Running {
    fn all(&self) -> MutexGuard<'_, BTreeSet<u32>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Ends them at once, as the batch itself is: left alone they would go on to the end of a step.
    pub(crate) fn end(&self) {
        #[cfg(unix)]
        for &id in &*self.all() {
            let id = nix::unistd::Pid::from_raw(id.cast_signed());
            let _ended = nix::sys::signal::kill(id, nix::sys::signal::Signal::SIGKILL);
        }
    }
}

impl Apart {
    pub(crate) fn new(args: &Batch, start: Start) -> Self {
        Self { words: args.words(), start, running: Running::default() }
    }

    /// The processes at work, now and later.
    pub(crate) fn running(&self) -> Running {
        self.running.clone()
    }

    /// Runs a case and waits for its end.
    ///
    /// # Errors
    /// When nobody knows how it ended.
    pub(crate) fn run(
        &self,
        one: &OneCase,
        observer: &dyn BatchObserver,
    ) -> Result<RunStatus, Lost> {
        let mut child = self.begin(one).map_err(|error| Lost::NotStarted(error.to_string()))?;
        self.running.all().insert(child.id());
        let (stdin, stdout) = (child.stdin.take(), child.stdout.take());
        let (alive, ended) = channel::<()>();
        let told = std::thread::scope(|scope| {
            scope.spawn(move || hold_open(stdin, &ended, observer));
            let told = stdout.and_then(|stdout| listen(stdout, one, observer));
            drop(alive);
            told
        });
        // Its number may be another's as soon as somebody has waited for it.
        self.running.all().remove(&child.id());
        let how = child.wait().map_err(|error| Lost::NotStarted(error.to_string()))?;
        told.ok_or_else(|| lost(how))
    }

    /// Starts the process of a case and tells it what is asked.
    fn begin(&self, one: &OneCase) -> std::io::Result<Child> {
        let mut command = Command::new(program()?);
        command.arg("batch-case").arg(format!("--name={}", one.name())).args(&self.words);
        command.arg("--threads").arg(one.threads().to_string()).arg("--").arg(one.file());
        // Ctrl-C is the batch's, which tells its cases.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
        let Start { clock, command } = self.start.clone();
        let asked = Asked { row: one.row(), date: clock.date, time: clock.time, command };
        let line = serde_json::to_string(&asked)? + "\n";
        // One that ended at once is told of by how it ended.
        let _told = child.stdin.as_mut().map(|stdin| stdin.write_all(line.as_bytes()));
        Ok(child)
    }
}

/// This program: as it was started, also where its file was replaced since.
fn program() -> std::io::Result<PathBuf> {
    let own = Path::new("/proc/self/exe");
    if own.exists() { Ok(own.into()) } else { std::env::current_exe() }
}

/// Keeps the pipe to a case open until it ends or is to stop.
fn hold_open(pipe: Option<ChildStdin>, ended: &Receiver<()>, observer: &dyn BatchObserver) {
    while observer.go_on() {
        if ended.recv_timeout(PATIENCE) != Err(RecvTimeoutError::Timeout) {
            break;
        }
    }
    drop(pipe);
}

/// Hears a case out; how it ended, if it told that.
fn listen(stdout: impl Read, one: &OneCase, observer: &dyn BatchObserver) -> Option<RunStatus> {
    let mut told = None;
    for line in BufReader::new(stdout).lines().map_while(Result::ok) {
        match serde_json::from_str(&line) {
            Ok(Said::Share(share)) => observer.share(one.name(), share),
            Ok(Said::Withheld(message)) => observer.withheld(one.name(), &message),
            Ok(Said::Ended(status)) => told = Some(*status),
            Err(_) => {}
        }
    }
    told
}

/// What became of a case that did not tell it, by how its process ended.
fn lost(how: ExitStatus) -> Lost {
    #[cfg(unix)]
    {
        use nix::libc::{SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGSEGV};
        use std::os::unix::process::ExitStatusExt as _;
        let signal = how.signal();
        if signal.is_some_and(|s| [SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGSEGV].contains(&s)) {
            return Lost::BrokeOff;
        }
        if signal.is_some() {
            return Lost::Ended;
        }
    }
    let retry = i32::from(Kind::Retry.exit_code());
    if how.code() == Some(retry) { Lost::Ended } else { Lost::BrokeOff }
}

/// `supine batch-case`: runs one case for the batch that started this process.
pub(crate) fn batch_case(args: BatchCase, screen: &Screen) -> Result<End, Failure> {
    let mut line = String::new();
    let mut stdin = BufReader::new(std::io::stdin());
    let wrong = |what: &dyn std::fmt::Display| Failure::new(Kind::Usage, what.to_string());
    stdin.read_line(&mut line).map_err(|error| wrong(&error))?;
    let asked: Asked = serde_json::from_str(&line).map_err(|error| wrong(&error))?;
    // The pipe closes when the batch ends or wants the case to stop.
    std::thread::spawn(move || {
        let _closed = std::io::copy(&mut stdin, &mut std::io::sink());
        interrupt();
    });
    let clock = Clock { date: asked.date, time: asked.time };
    let start = Start { clock, command: asked.command };
    let BatchCase { name, batch } = args;
    let file = batch.cases.first().cloned().unwrap_or_default();
    let one = OneCase::new(name, &file, asked.row.as_deref(), screen.threads())?;
    let status = run_one(&batch.given(screen.threads(), start), &one, &Told { screen });
    say(&Said::Ended(Box::new(status)));
    Ok(End::Done)
}

/// What sees the one case of this process.
struct Told<'a> {
    screen: &'a Screen,
}

impl BatchObserver for Told<'_> {
    fn share(&self, _: &str, share: f64) {
        say(&Said::Share(share));
    }

    fn withheld(&self, _: &str, message: &str) {
        say(&Said::Withheld(message.into()));
    }

    fn go_on(&self) -> bool {
        self.screen.go_on()
    }
}

/// Tells the batch.
fn say(said: &Said) {
    if let Ok(line) = serde_json::to_string(said) {
        data(&(line + "\n"));
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::process::ExitStatusExt as _;

    #[test]
    fn what_ended_a_case_is_told_from_what_broke_it() {
        let by_code = |code: i32| lost(ExitStatus::from_raw(code << 8));
        assert_eq!((by_code(75), by_code(101)), (Lost::Ended, Lost::BrokeOff));
        let by_signal = |signal: i32| lost(ExitStatus::from_raw(signal));
        assert_eq!((by_signal(9), by_signal(15)), (Lost::Ended, Lost::Ended));
        assert_eq!((by_signal(11), by_signal(6)), (Lost::BrokeOff, Lost::BrokeOff));
    }
}
