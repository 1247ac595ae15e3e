//! An applicator moved step by step: time and error.

use super::mechanics::Mechanics;
use super::number;
use anyhow::Result;
use std::fmt::Write;

const TEXT: &str = include_str!("applicator.md");
const SURFACE_TEXT: &str = include_str!("surface.md");
/// Mesh and order.
const BODIES: [(&str, u8); 4] = [("1.6k", 1), ("1.6k", 2), ("12k", 1), ("40k", 1)];
const PATHS: [&str; 2] = ["1", "2"];

/// Text and table.
pub(super) fn table(mechanics: &Mechanics<'_>) -> Result<String> {
    let mut page = String::from(TEXT);
    for ((mesh, order), path) in BODIES.into_iter().flat_map(|b| PATHS.map(|p| (b, p))) {
        let told = mechanics.applied(mesh, order, path)?;
        let n = |key: &str| number(&told, &format!("/{key}"));
        let elements = if order == 1 { "linear" } else { "quadratic" };
        writeln!(
            page,
            "| {mesh} | {elements} | {path} | {} | {:.2} / {:.2} | {:.1} | {:.1} | {:.4} | {} |",
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
