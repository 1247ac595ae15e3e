//! `supine run`.

use crate::args;
use crate::failure::Failure;
use crate::screen::Screen;
use std::path::Path;
use supine_pipeline::{Case, Options, RunError, Summary};

pub(crate) fn run(args: &args::Run, screen: &Screen) -> Result<u8, Failure> {
    let mut case = Case::read(&args.case).map_err(RunError::from)?;
    case.export.anonymise |= args.anonymise;
    case_into(&case, &args.out, Options { until: args.until, force: args.force }, screen)
}

/// Runs a case and says how it ended.
pub(crate) fn case_into(
    case: &Case,
    out: &Path,
    options: Options,
    screen: &Screen,
) -> Result<u8, Failure> {
    let Some(summary) = supine_pipeline::run(case, out, options, screen)? else {
        let until = options.until.map_or("", |s| s.name());
        let done = serde_json::json!({ "until": until, "out": out });
        screen.result(&done, &format!("done until {until}: {}", out.display()));
        return Ok(0);
    };
    screen.result(&summary, &conclusion(&summary, out));
    Ok(if checks_passed(&summary) { 0 } else { 4 })
}

/// The export's own checks; a run without DICOM has none.
fn checks_passed(summary: &Summary) -> bool {
    summary.export.as_ref().is_none_or(|e| e.verified.passed == e.verified.total)
}

fn conclusion(summary: &Summary, out: &Path) -> String {
    let mut lines = Vec::new();
    if let Some(t) = &summary.tumour {
        let [x, y, z] = t.displacement_mm;
        lines.push(format!(
            "the tumour moves {:.1} mm (left {x:+.1}, back {y:+.1}, head {z:+.1})",
            t.distance_mm
        ));
    }
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
