//! An applicator moved step by step: time and error.

use super::mechanics::Mechanics;
use super::number;
use anyhow::Result;
use std::fmt::Write;

const TEXT: &str = include_str!("applicator.md");
const SURFACE_TEXT: &str = include_str!("surface.md");
/// Mesh and order.
const BODIES: [(&str, u8); 4] = [("1.6k", 1), ("1.6k", 2), ("12k", 1), ("40k", 1)];
/// What becomes of the tissue on the sphere, as the bench is told, and on how many of the bodies.
const CONTACTS: [(&str, &[&str], usize); 2] = [("tied", &[], 4), ("sliding", &["sliding"], 3)];
const PATHS: [&str; 2] = ["1", "2"];

/// Text and table.
pub(super) fn table(mechanics: &Mechanics<'_>) -> Result<String> {
    let mut page = String::from(TEXT);
    for (name, contact, bodies) in CONTACTS {
        let bodies = BODIES.into_iter().take(bodies);
        for ((mesh, order), path) in bodies.flat_map(|b| PATHS.map(|p| (b, p))) {
            let told = mechanics.applied(mesh, order, &[&[path], contact].concat())?;
            let n = |key: &str| number(&told, &format!("/{key}"));
            let elements = if order == 1 { "linear" } else { "quadratic" };
            write!(page, "| {name} | {mesh} | {elements} | {path} | {} |", n("coupled")?)?;
            let (median, worst) = (n("median_ms")?, n("worst_ms")?);
            write!(page, " {median:.2} / {worst:.2} | {:.1} |", n("corrections")?)?;
            let (error, off) = (n("error_mm")?, n("off_surface_mm")?);
            let off = if off == 0.0 { "0".into() } else { format!("{off:.0e}") };
            write!(page, " {:.1} | {error:.4} | {off} |", n("renewal_ms")?)?;
            writeln!(page, " {} |", n("anew")?)?;
        }
    }
    page += SURFACE_TEXT;
    for (mesh, order) in BODIES.into_iter().take(3) {
        let told = mechanics.applied(mesh, order, &["surface"])?;
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
