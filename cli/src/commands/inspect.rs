//! `supine inspect` and `supine verify-export`.

use crate::End;
use crate::args;
use crate::failure::Failure;
use crate::screen::Screen;
use std::fmt::Write;
use std::path::Path;
use supine_flow::commands::dicom::{self, Inspection, PixelReport, SeriesReport};
use supine_space::Failure as Kind;

/// More files of no use than this are only counted.
const NAMED: usize = 5;

pub(crate) fn inspect(args: args::Inspect, screen: &Screen) -> Result<End, Failure> {
    let args::Inspect { path, pixels, given } = args;
    let asked = dicom::Inspect { spec: given.spec, path: path.clone(), pixels };
    let inspection = dicom::inspect(&asked, screen)?;
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _infallible = describe(&inspection, &mut text);
    let failure = nothing_usable(&inspection, &path);
    screen.answer_but(failure.as_ref(), &inspection, &text);
    Ok(End::of(failure.is_none(), Kind::Input))
}

/// Why no series can be used, if none can.
fn nothing_usable(found: &Inspection, path: &Path) -> Option<Failure> {
    if found.usable().next().is_some() {
        return None;
    }
    let reasons: Vec<&str> = found.series.iter().filter_map(|s| s.reason.as_deref()).collect();
    let message = match reasons.as_slice() {
        [] => format!("no CT series in {} files of {}", found.files, path.display()),
        all => format!("{}: {}", path.display(), all.join("\n")),
    };
    Some(Failure::coded(Kind::Input, "no-usable-series", message).at(path))
}

pub(crate) fn verify_export(args: args::VerifyExport, screen: &Screen) -> Result<End, Failure> {
    let args::VerifyExport {
        dir,
        source,
        new_study,
        keep_equipment,
        same_frame,
        clip_padding,
        given,
    } = args;
    let (spec, exported) = (given.spec, dir.clone());
    let given =
        dicom::Verify { spec, dir, source, new_study, keep_equipment, same_frame, clip_padding };
    let verification = dicom::verify_export(&given, screen)?;
    let lines = verification.checks.iter().map(|check| {
        let verdict = match check.passed {
            Some(true) => "PASS",
            Some(false) => "FAIL",
            None => "----",
        };
        format!("{verdict}  {}  {}\n", check.rule, check.detail)
    });
    let (all, failed) = (verification.checks.len(), verification.failures().count());
    let failure = (!verification.passed()).then(|| {
        let broken: Vec<&str> = verification.failures().map(|check| check.rule.as_str()).collect();
        let message = format!("{failed} of {all} checks failed: {}", broken.join(", "));
        Failure::coded(Kind::Check, "check-failed", message).at(&exported)
    });
    screen.answer_but(failure.as_ref(), &verification, &lines.collect::<String>());
    let open = verification.checks.iter().filter(|c| c.passed.is_none()).count();
    screen.say(&format!("{all} checks: {failed} failed, {open} could not be made"));
    Ok(End::of(failure.is_none(), Kind::Check))
}

fn describe(found: &Inspection, text: &mut String) -> std::fmt::Result {
    if found.series.is_empty() {
        writeln!(text, "no CT series in {} files", found.files)?;
    }
    for series in &found.series {
        describe_series(series, text)?;
    }
    for kind in &found.other {
        writeln!(text, "left out: {} x {}", kind.files, kind.kind)?;
    }
    for file in found.foreign.iter().take(NAMED) {
        writeln!(text, "left out: {}: {}", file.file, file.reason)?;
    }
    if found.foreign.len() > NAMED {
        writeln!(text, "left out: {} more files", found.foreign.len() - NAMED)?;
    }
    for damaged in &found.damaged {
        writeln!(text, "warning: {damaged}")?;
    }
    for warning in &found.warnings {
        writeln!(text, "warning: {warning}")?;
    }
    Ok(())
}

fn describe_series(series: &SeriesReport, text: &mut String) -> std::fmt::Result {
    writeln!(text, "series {}", series.uid)?;
    match &series.reason {
        None => writeln!(text, "  usable")?,
        Some(reason) => writeln!(text, "  NOT usable: {reason}")?,
    }
    let SeriesReport { whose, description, number, slices, .. } = series;
    if !whose.line().is_empty() {
        writeln!(text, "  {}", whose.line())?;
    }
    writeln!(text, "  {description:?}, number {number:?}, {slices} slices")?;
    if let Some(grid) = &series.grid {
        let ([i, j, k], [x, y, z]) = (grid.size, grid.spacing);
        let position = &series.patient_position;
        writeln!(text, "  {i} x {j} x {k} voxels of {x} x {y} x {z} mm, {position}")?;
    }
    if let Some(pixels) = &series.pixels {
        describe_pixels(pixels, text)?;
    }
    for warning in &series.warnings {
        writeln!(text, "  warning: {warning}")?;
    }
    Ok(())
}

fn describe_pixels(pixels: &PixelReport, text: &mut String) -> std::fmt::Result {
    let PixelReport { slices, failed } = pixels;
    let ends = slices.iter().map(|s| s.hu_range).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
    if let Some([low, high]) = ends {
        writeln!(text, "  pixels of {} slices decoded: {low} to {high} HU", slices.len())?;
    }
    for reason in failed.iter().take(NAMED) {
        writeln!(text, "  {reason}")?;
    }
    if failed.len() > NAMED {
        writeln!(text, "  and {} more slices that cannot be decoded", failed.len() - NAMED)?;
    }
    Ok(())
}
