//! `supine run`.

use crate::End;
use crate::args;
use crate::failure::Failure;
use crate::screen::Screen;
use crate::start::start;
use std::path::Path;
use supine_flow::commands::Colour;
use supine_flow::commands::fit::{self, Fit};
use supine_flow::commands::run::{self, Run, RunDone};
use supine_flow::{
    Denial, Options, Summary, check_text, denial, directions, held, is_status, moves, run_told,
    stopped_at_once, verdict_lines, write_status,
};
use supine_space::Failure as Kind;

pub(crate) fn run(args: args::Run, screen: &Screen) -> Result<End, Failure> {
    let args::Run { case, out, changes, anonymise, until, force, .. } = args;
    let worst = if args.deny_warnings { Colour::Green } else { Colour::Amber };
    let (overwrite, inputs_changed, status) = (args.overwrite, args.inputs_changed, args.status);
    let options = Options { until, force, overwrite, inputs_changed };
    let start = Some(start()?);
    let given = Run { case, changes, anonymise, out, options, start };
    let Some(file) = status else { return case_into(&given, worst, screen) };
    check_text("--status", &file, is_status)?;
    let stopped = stopped_at_once(&given, &file);
    let last = file.clone();
    // Nobody is left to be told that it cannot be written.
    screen.tell_last(move || drop(write_status(&stopped, &last)));
    let (done, status) = run_told(&given, (worst, &file), screen);
    screen.tell_last(|| {});
    // The run's own failure is told before that of the small file.
    let ended = done.map_err(Failure::from).and_then(|done| tell(&given, &done, worst, screen));
    match (ended, write_status(&status, &file)) {
        (Ok(_), Err(error)) => Err(error.into()),
        (Err(failure), Err(error)) => {
            screen.say(&format!("warning: {error}"));
            Err(failure)
        }
        (ended, Ok(())) => ended,
    }
}

pub(crate) fn fit(args: args::Fit, screen: &Screen) -> Result<End, Failure> {
    let args::Fit { case, out, changes, overwrite } = args;
    let done = fit::fit(&Fit { case, changes, out, overwrite, start: Some(start()?) }, screen)?;
    let mut lines = Vec::new();
    for state in &done.fit.states {
        let [low, high] = state.interval_kpa;
        lines.push(format!(
            "{}: {:.3} kPa (95 %: {low:.3} to {high:.3}), scan {:.2} mm rms off on the breast",
            state.rest, state.young_kpa, state.misfit_mm
        ));
    }
    let first = done.fit.states.first().map_or("", |state| state.rest.name());
    lines.push(match (done.fit.decided, done.fit.evidence) {
        (true, None) => format!("rest state: {first}, as the case says"),
        (true, Some(evidence)) => {
            format!("rest state: {first} by the scan (evidence {evidence:.0}, above 10 decides)")
        }
        (false, evidence) => format!(
            "rest state: not decided by the scan (evidence {:.1}, above 10 decides)",
            evidence.unwrap_or(0.0)
        ),
    });
    screen.result(&done, &lines.join("\n"));
    Ok(End::Done)
}

/// Runs a case and says how it ended: well if its verdict is not worse than `worst`.
pub(crate) fn case_into(given: &Run, worst: Colour, screen: &Screen) -> Result<End, Failure> {
    tell(given, &run::run(given, screen)?, worst, screen)
}

/// Says how a run ended.
fn tell(given: &Run, done: &RunDone, worst: Colour, screen: &Screen) -> Result<End, Failure> {
    if done.renewed {
        screen
            .say("the folder held results of another version, which were set aside and made anew");
    }
    let Some(summary) = &done.summary else {
        let until = given.options.until.map_or("", |node| node.name());
        let json = serde_json::json!({ "status": "done", "until": until, "out": given.out });
        screen.result(&json, &format!("done until {until}: {}", given.out.display()));
        return Ok(End::Done);
    };
    let failure = denial(summary, worst).map(|denial| denied(&denial, &given.out));
    screen.result_but(failure.as_ref(), summary, &conclusion(summary, &given.out));
    if failure.is_some() {
        screen.reason(&verdict_lines(summary).join("\n"));
    }
    Ok(End::of(failure.is_none(), Kind::Check))
}

/// Why a run that has its result ends with another code than 0.
fn denied(denial: &Denial, out: &Path) -> Failure {
    let lines: Vec<&str> = denial.lines.iter().map(|line| line.trim()).collect();
    let failure = Failure::coded(Kind::Check, denial.code, lines.join("\n"));
    let red = denial.code == "verdict-red";
    if red { failure.with_status("not-usable") } else { failure }.at(out)
}

fn conclusion(summary: &Summary, out: &Path) -> String {
    let mut lines = Vec::new();
    if let Some(tumour) = &summary.tumour {
        let way = (!held(summary)).then(|| format!(": {}", directions(tumour.displacement_mm)));
        lines.push(moves(summary) + &way.unwrap_or_default());
    }
    lines.extend(verdict_lines(summary));
    if let Some(e) = &summary.export {
        let folder = out.join(&e.folder);
        lines.push(format!(
            "series: {} ({} files, {} of {} checks passed)",
            folder.display(),
            e.files,
            e.verified.passed,
            e.verified.total
        ));
    }
    lines.push(format!("report: {}", out.join("report").join("index.html").display()));
    let memory = summary.run.peak_memory_mb.map_or(String::new(), |m| format!(", {m:.0} MB"));
    lines.push(format!(
        "{:.1} s{memory}, {} warnings",
        summary.run.total_seconds,
        summary.warnings.len()
    ));
    lines.join("\n")
}
