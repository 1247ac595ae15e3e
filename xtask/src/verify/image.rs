//! Where the deformed CT of a patient with known truth differs from the noise-free one.

use super::{Bench, number, output, patients, run};
use anyhow::Result;
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;

const TEXT: &str = include_str!("image.md");

/// What `image_error.py` and the score say of two volumes.
pub(super) struct Errors {
    /// Our kernel on the true field.
    true_field: Value,
    /// Of it, the share recovered.
    true_recovered: f64,
    /// The whole flow.
    run: Value,
}

/// Both volumes of a patient, with pictures of their worst slices in `work`.
pub(super) fn errors(bench: &Bench<'_>, patient: &Path, ct: &Path, work: &Path) -> Result<Errors> {
    let field = work.join("true-field.vtu");
    run(script(bench, "true_field.py").arg(patient).arg(&field))?;
    let volume = work.join("true-field.nrrd");
    let mut warp = Command::new(&bench.supine);
    warp.args(["warp", "--no-progress", "--ct"]).arg(ct).arg("--mesh").arg(&field);
    run(warp.arg("--out").arg(&volume))?;
    let error = |volume: &Path, picture: &str| -> Result<Value> {
        let mut told = script(bench, "image_error.py");
        told.arg(patient).arg(volume).arg(work.join(picture));
        Ok(serde_json::from_str(&output(&mut told)?)?)
    };
    Ok(Errors {
        true_field: error(&volume, "worst-true-field.png")?,
        true_recovered: recovered(bench, patient, &volume)?,
        run: error(&work.join("out/ct"), "worst-run.png")?,
    })
}

/// The score's share recovered by a volume.
pub(super) fn recovered(bench: &Bench<'_>, patient: &Path, volume: &Path) -> Result<f64> {
    let json = volume.with_extension("json");
    let mut score = Command::new(&bench.python);
    score.arg(bench.shared.join("cohort/score.py")).arg(patient);
    run(score.arg("--warped").arg(volume).arg("--json").arg(&json))?;
    number(&patients::read(&json)?, "/hu_recovered")
}

/// One of the scripts of this house with the Python that has what it needs.
pub(super) fn script(bench: &Bench<'_>, name: &str) -> Command {
    let mut script = Command::new(&bench.python);
    script.env("PYTHONDONTWRITEBYTECODE", "1");
    script.arg(bench.house.root.join("xtask/study").join(name));
    script
}

/// Text and table.
pub(super) fn table(rows: &[patients::Row]) -> Result<String> {
    let mut page = String::from(TEXT);
    for row in rows {
        let recovered = number(&row.score, "/hu_recovered")?;
        let Errors { true_field, true_recovered, run } = &row.image;
        line(&mut page, &row.name, ("true field", *true_recovered), true_field)?;
        line(&mut page, &row.name, ("run", recovered), run)?;
    }
    Ok(page)
}

fn line(
    page: &mut String,
    patient: &str,
    (field, recovered): (&str, f64),
    error: &Value,
) -> Result<()> {
    write!(page, "| {patient} | {field} | **{recovered:.3}** |")?;
    for part in ["skin", "wall", "edge", "inside", "air"] {
        let n = |key: &str| number(error, &format!("/{part}/{key}"));
        write!(page, " {:.1} ({:+.1}) |", n("mean_abs_hu")?, n("bias_hu")?)?;
    }
    let skin = |key: &str| number(error, &format!("/skin_mm/{key}"));
    writeln!(
        page,
        " {:.2} | **{:.2}** / {:.2} / {:.2} mm |",
        number(error, "/skin/error_share")?,
        skin("mean")?,
        skin("p95")?,
        skin("max")?,
    )?;
    Ok(())
}
