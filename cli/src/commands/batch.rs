//! `supine batch`.

use super::batch_case::Apart;
use crate::End;
use crate::args_batch as args;
use crate::failure::Failure;
use crate::screen::{Screen, data};
use crate::start::start;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use supine_flow::batch::{BatchDone, BatchObserver, batch as run, collect};
use supine_flow::{Ended, Observer, RunStatus};
use supine_space::Failure as Kind;

pub(crate) fn batch(args: args::Batch, screen: &Screen) -> Result<End, Failure> {
    if args.collect {
        let done = collect(&args.out, args.worst())?;
        done.ended.iter().for_each(|status| told_at_once(screen, status));
        screen.clear();
        return Ok(ended(&done, &told(&done), None, screen));
    }
    let (anonymise, start) = (args.anonymise, start()?);
    let apart = Apart::new(&args, start.clone());
    let running = apart.running();
    screen.tell_last(move || running.end());
    let given = args.given(screen.threads(), start);
    let view = View { screen, shares: Mutex::default() };
    let done = run(&given, &|one, observer| apart.run(one, observer), &view)?;
    screen.clear();
    let mut lines = told(&done);
    if anonymise {
        let keys = given.out.join("runs").join("*-reidentification");
        lines.push(format!("who they are tells {}: keep that apart", keys.display()));
    }
    Ok(ended(&done, &lines, done.failure(), screen))
}

/// Says how a case ended when it ends: a line of JSON for each, unless all are asked for in one
/// document.
fn told_at_once(screen: &Screen, status: &RunStatus) {
    if !screen.is_json() {
        data(&(status.line() + "\n"));
    }
}

/// Says how all ended.
fn ended(done: &BatchDone, lines: &[String], failure: Option<Kind>, screen: &Screen) -> End {
    if screen.is_json() {
        let document = serde_json::json!({
            "cases": done.ended, "not_begun": done.left, "others": done.others,
            "table": done.table, "page": done.page, "patients": done.patients,
        });
        screen.result(&document, "");
    } else {
        screen.say(&lines.join("\n"));
    }
    failure.map_or(End::Done, End::Failed)
}

/// What became of all, for people.
fn told(done: &BatchDone) -> Vec<String> {
    let counts = Ended::ALL.into_iter().map(|ended| (done.count(ended), ended.word()));
    let counts: Vec<String> =
        counts.filter(|(n, _)| *n > 0).map(|(n, word)| format!("{n} {word}")).collect();
    let cases = if done.ended.len() == 1 { "case" } else { "cases" };
    let mut lines = vec![format!("{} {cases}: {}", done.ended.len(), counts.join(", "))];
    if done.left > 0 {
        lines.push(format!("{} not begun: the same call goes on with them", done.left));
    }
    lines.push(format!("page: {}, {} patients", done.page.display(), done.patients));
    lines.push(format!("table: {}", done.table.display()));
    if !done.others.is_empty() {
        lines.push(format!(
            "in neither, as they are no cases of this call: {}; `--collect` makes both of all",
            done.others.join(", ")
        ));
    }
    lines
}

/// The screen as a batch sees it: one bar over all cases.
struct View<'a> {
    screen: &'a Screen,
    /// How many there are, and how far each has come that was begun.
    shares: Mutex<(usize, BTreeMap<String, f64>)>,
}

impl View<'_> {
    fn come(&self, name: &str, share: f64) {
        let mut held = self.shares.lock().unwrap_or_else(PoisonError::into_inner);
        let (all, shares) = &mut *held;
        shares.insert(name.into(), share);
        let ended = shares.values().filter(|share| **share >= 1.0).count();
        let sum: f64 = shares.values().sum();
        let text = format!("{ended} of {all} cases");
        self.screen.whole(text, sum / (*all).max(1) as f64);
    }
}

/// The most of a case that is told as done before its end: the rest is its end.
const NEARLY: f64 = 0.99;

impl BatchObserver for View<'_> {
    fn cases(&self, number: usize) {
        self.shares.lock().unwrap_or_else(PoisonError::into_inner).0 = number;
    }

    fn begin(&self, name: &str, threads: usize) {
        self.come(name, 0.0);
        if self.screen.is_verbose() {
            self.screen.say(&format!("{name}: begins, {threads} threads"));
        }
    }

    fn share(&self, name: &str, share: f64) {
        self.come(name, share * NEARLY);
    }

    fn withheld(&self, name: &str, message: &str) {
        self.screen.say(&format!("{name}: {}", from_here(message)));
    }

    fn end(&self, name: &str, status: &RunStatus, kept: bool) {
        told_at_once(self.screen, status);
        self.come(name, 1.0);
        if self.screen.has_lines() || status.exit != 0 {
            self.screen.say(&line(name, status, kept));
        }
    }

    fn go_on(&self) -> bool {
        self.screen.go_on()
    }
}

/// How a case ended, for people.
fn line(name: &str, status: &RunStatus, kept: bool) -> String {
    let how = if kept { "done before".into() } else { format!("{:.1} s", status.seconds) };
    let word = status.status.word();
    let why = match (&status.error, status.status) {
        (Some(error), Ended::Failed) => format!(": {}", from_here(&error.message)),
        (_, Ended::NotUsable | Ended::Flagged) => {
            status.reasons.first().map(|reason| format!(": {reason}")).unwrap_or_default()
        }
        _ => String::new(),
    };
    format!("{name}: {word}, {how}{why}")
}

/// A message with the working folder taken off its paths.
fn from_here(message: &str) -> String {
    let here = std::env::current_dir().ok();
    let here = here.filter(|here| here != Path::new("/"));
    here.map_or(message.to_owned(), |here| message.replace(&format!("{}/", here.display()), ""))
}
