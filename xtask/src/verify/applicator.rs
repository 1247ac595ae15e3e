//! An applicator moved step by step: time and error.

use super::mechanics::Mechanics;
use super::number;
use anyhow::{Result, ensure};
use std::fmt::Write;

const TEXT: &str = include_str!("applicator.md");
const SURFACE_TEXT: &str = include_str!("surface.md");
/// Mesh and order.
const BODIES: [(&str, u8); 4] = [("1.6k", 1), ("1.6k", 2), ("12k", 1), ("40k", 1)];
const PATHS: [&str; 2] = ["1", "2"];
/// Largest nodal difference to a stored field that counts as agreement, mm.
const CLOSE_MM: f64 = 1e-8;

/// Text and table.
pub(super) fn table(mechanics: &Mechanics<'_>) -> Result<String> {
    let mut page = String::from(TEXT);
    for ((mesh, order), path) in BODIES.into_iter().flat_map(|b| PATHS.map(|p| (b, p))) {
        let told = mechanics.applied(mesh, order, path)?;
        let n = |key: &str| number(&told, &format!("/{key}"));
        let elements = if order == 1 { "linear" } else { "quadratic" };
        let stored = if n("stored")? > 0.0 {
            ensure!(
                n("off")? <= CLOSE_MM,
                "{mesh}, order {order}, path {path}: {:.1e} mm",
                n("off")?
            );
            format!("{:.1e} ({})", n("off")?, n("stored")?)
        } else {
            "-".into()
        };
        writeln!(
            page,
            "| {mesh} | {elements} | {path} | {} | {:.2} / {:.2} | {:.1} | {:.1} | {:.4} | {stored} | {} |",
            n("coupled")?,
            n("median_ms")?,
            n("worst_ms")?,
            n("corrections")?,
            n("renewal_ms")?,
            n("error_mm")?,
            n("anew")?,
        )?;
    }
    page += SURFACE_TEXT;
    for (mesh, order) in BODIES.into_iter().take(3) {
        let told = mechanics.applied(mesh, order, "surface")?;
        let n = |key: &str| number(&told, &format!("/{key}"));
        let elements = if order == 1 { "linear" } else { "quadratic" };
        write!(page, "| {mesh} | {elements} |")?;
        for which in ["ragged", "exact"] {
            let [rms, most, nodes] = [0, 1, 2].map(|k| n(&format!("{which}/{k}")));
            write!(page, " {}: {:.2} / {:.2} |", nodes?, rms?, most?)?;
        }
        writeln!(page, " {} |", n("moved")?)?;
    }
    Ok(page)
}
