//! What interpolation does to the noise of the moved tissue.

use super::{Bench, image, number, output, patients};
use anyhow::Result;
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;

const TEXT: &str = include_str!("texture.md");
/// As `supine warp` names them.
const INTERPOLATIONS: [&str; 3] = ["linear", "cubic", "lanczos3"];

/// What an interpolation does to a patient's CT.
pub(super) struct Texture {
    interpolation: &'static str,
    /// What `texture.py` says.
    noise: Value,
    recovered: f64,
}

/// Each interpolation through the mesh of the run in `work`.
pub(super) fn textures(
    bench: &Bench<'_>,
    patient: &Path,
    ct: &Path,
    work: &Path,
) -> Result<Vec<Texture>> {
    let out = work.join("out");
    let one = |interpolation| -> Result<Texture> {
        let volume = work.join(format!("{interpolation}.nrrd"));
        image::carried(bench, ct, &out.join("mesh/deformed.vtu"), (interpolation, &volume))?;
        let mut noise = image::script(bench, "texture.py");
        noise.arg(ct).arg(&volume).arg(out.join("field/deformed_to_ct.nrrd"));
        let noise = serde_json::from_str(&output(&mut noise)?)?;
        let recovered = image::recovered(bench, patient, &volume, &volume.with_extension("json"))?;
        Ok(Texture { interpolation, noise, recovered })
    };
    INTERPOLATIONS.into_iter().map(one).collect()
}

/// Text and table.
pub(super) fn table(rows: &[patients::Row]) -> Result<String> {
    let mut page = String::from(TEXT);
    for row in rows {
        for texture in &row.textures {
            let n = |pointer: &str| number(&texture.noise, pointer);
            let spread = |of: &str| -> Result<String> {
                let [middle, low, high] = ["hu", "p10", "p90"].map(|key| n(&format!("{of}/{key}")));
                Ok(format!("{:.1} ({:.1}-{:.1})", middle?, low?, high?))
            };
            writeln!(
                page,
                "| {} | {} | {} | {} | {} | {} | **{:.2}** / **{:.2}** | {:.3} |",
                row.name,
                texture.interpolation,
                n("/region/before/squares")?,
                spread("/region/before")?,
                spread("/region/after")?,
                spread("/beside/after")?,
                n("/region/low_left")?,
                n("/region/high_left")?,
                texture.recovered,
            )?;
        }
    }
    Ok(page)
}
