//! Where the deformed CT of a patient with known truth differs from the noise-free one.

use super::{Bench, number, output, patients, run};
use anyhow::Result;
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;

const TEXT: &str = include_str!("image.md");

/// As `supine warp` names them: what a run takes unless told otherwise, and what it could take.
const INTERPOLATIONS: [&str; 2] = ["linear", "cubic"];
/// The one of a run whose case names none.
const DEFAULT: &str = "cubic";

/// A deformed CT beside the noise-free one.
pub(super) struct Errors {
    /// Whose map carried it: `true field` or `run`.
    map: &'static str,
    interpolation: &'static str,
    /// The score's share recovered.
    recovered: f64,
    /// What `image_error.py` says.
    parts: Value,
}

/// The volumes of a patient by the true field and by the run in `work`, with pictures of their
/// worst slices there.
pub(super) fn errors(
    bench: &Bench<'_>,
    patient: &Path,
    ct: &Path,
    work: &Path,
) -> Result<Vec<Errors>> {
    let (field, out) = (work.join("true-field.vtu"), work.join("out"));
    run(script(bench, "true_field.py").arg(patient).arg(&field))?;
    let mut all = Vec::new();
    for (map, mesh) in [("true field", field), ("run", out.join("mesh/deformed.vtu"))] {
        for interpolation in INTERPOLATIONS {
            let name = format!("{}-{interpolation}", map.replace(' ', "-"));
            let mut volume = work.join(format!("{name}.nrrd"));
            if (map, interpolation) == ("run", DEFAULT) {
                // What the whole flow left.
                volume = out.join("ct");
            } else {
                carried(bench, ct, &mesh, (interpolation, &volume))?;
            }
            let mut told = script(bench, "image_error.py");
            told.arg(patient).arg(&volume).arg(work.join(format!("worst-{name}.png")));
            let parts = serde_json::from_str(&output(&mut told)?)?;
            let json = work.join(format!("{name}.json"));
            let recovered = recovered(bench, patient, &volume, &json)?;
            all.push(Errors { map, interpolation, recovered, parts });
        }
    }
    Ok(all)
}

/// A CT carried by the map of a mesh; the interpolation as `supine warp` names it, and where the
/// volume goes.
pub(super) fn carried(
    bench: &Bench<'_>,
    ct: &Path,
    mesh: &Path,
    (interpolation, volume): (&str, &Path),
) -> Result<()> {
    let mut warp = Command::new(&bench.supine);
    warp.args(["warp", "--overwrite", "--no-progress", "--interpolation", interpolation, "--ct"])
        .arg(ct);
    run(warp.arg("--mesh").arg(mesh).arg("--out").arg(volume))
}

/// The score's share recovered by a volume; the whole score goes to `json`.
pub(super) fn recovered(
    bench: &Bench<'_>,
    patient: &Path,
    volume: &Path,
    json: &Path,
) -> Result<f64> {
    let mut score = Command::new(&bench.python);
    score.arg(bench.shared.join("cohort/score.py")).arg(patient);
    run(score.arg("--warped").arg(volume).arg("--json").arg(json))?;
    number(&patients::read(json)?, "/hu_recovered")
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
        for errors in &row.image {
            line(&mut page, &row.name, errors)?;
        }
    }
    Ok(page)
}

fn line(page: &mut String, patient: &str, errors: &Errors) -> Result<()> {
    let Errors { map, interpolation, recovered, parts: error } = errors;
    write!(page, "| {patient} | {map} | {interpolation} | **{recovered:.3}** |")?;
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
