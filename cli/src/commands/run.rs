//! `supine run`.

use crate::End;
use crate::args;
use crate::failure::Failure;
use crate::screen::Screen;
use crate::start::start;
use std::path::Path;
use supine_flow::commands::Colour;
use supine_flow::commands::fit::{self, Fit};
use supine_flow::commands::run::{self, Run};
use supine_flow::{Options, Summary, directions, headline, held, moves};
use supine_space::Failure as Kind;

pub(crate) fn run(args: args::Run, screen: &Screen) -> Result<End, Failure> {
    let args::Run { case, out, changes, anonymise, until, force, deny_warnings } = args;
    let worst = if deny_warnings { Colour::Green } else { Colour::Amber };
    let (options, start) = (Options { until, force }, Some(start()?));
    let given = Run { case, changes, anonymise, out, options, start };
    case_into(&given, worst, screen)
}

pub(crate) fn fit(args: args::Fit, screen: &Screen) -> Result<End, Failure> {
    let args::Fit { case, out, changes } = args;
    let done = fit::fit(&Fit { case, changes, out, start: Some(start()?) }, screen)?;
    let mut lines = Vec::new();
    for state in &done.fit.states {
        let [low, high] = state.interval_kpa;
        lines.push(format!(
            "{}: {:.3} kPa (95 %: {low:.3} to {high:.3}), scan {:.2} mm rms off on the breast",
            state.rest, state.young_kpa, state.misfit_mm
        ));
    }
    let first = done.fit.states.first().map_or("", |state| state.rest.as_str());
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
    let done = run::run(given, screen)?;
    if done.renewed {
        screen.say("the folder held results of another version, which were made anew");
    }
    let Some(summary) = &done.summary else {
        let until = given.options.until.map_or("", |node| node.name());
        let json = serde_json::json!({ "status": "done", "until": until, "out": given.out });
        screen.result(&json, &format!("done until {until}: {}", given.out.display()));
        return Ok(End::Done);
    };
    let failure = (!done.usable(worst)).then(|| denied(summary, &given.out));
    screen.result_but(failure.as_ref(), summary, &conclusion(summary, &given.out));
    if failure.is_some() {
        screen.reason(&verdict(summary).join("\n"));
    }
    Ok(End::of(failure.is_none(), Kind::Check))
}

/// Why a run that has its result ends with another code than 0.
fn denied(summary: &Summary, out: &Path) -> Failure {
    let lines = verdict(summary);
    let message = lines.iter().map(|line| line.trim()).collect::<Vec<_>>().join("\n");
    let failure = match summary.verdict.colour {
        Colour::Red => {
            Failure::coded(Kind::Check, "verdict-red", message).with_status("not-usable")
        }
        _ => Failure::coded(Kind::Check, "verdict-not-green", message),
    };
    failure.at(out)
}

/// The verdict and its reasons, a line each.
fn verdict(summary: &Summary) -> Vec<String> {
    let headline = headline(summary);
    let headline = headline
        .split_once(':')
        .map_or(headline.clone(), |(colour, rest)| format!("{}:{rest}", colour.to_uppercase()));
    let reasons = summary.verdict.reasons.iter().map(|reason| format!("  {}", reason.told()));
    std::iter::once(headline).chain(reasons).collect()
}

fn conclusion(summary: &Summary, out: &Path) -> String {
    let mut lines = Vec::new();
    if let Some(tumour) = &summary.tumour {
        let way = (!held(summary)).then(|| format!(": {}", directions(tumour.displacement_mm)));
        lines.push(moves(summary) + &way.unwrap_or_default());
    }
    lines.extend(verdict(summary));
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
