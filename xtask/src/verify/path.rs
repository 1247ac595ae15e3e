//! The applicator's path on coarse and fine meshes, beside the paper's.

use super::{Bench, navigate, number, output, run};
use anyhow::{Context, Result};
use serde_json::Value;
use std::fmt::Write;
use std::process::Command;

const TEXT: &str = include_str!("path.md");
/// What the paper needs for a step, ms.
const PAPER_MS: f64 = 30.0;

/// Text and table.
pub(super) fn section(bench: &Bench<'_>) -> Result<String> {
    let build = ["build", "--release", "-p", "supine-benches", "--bin", "bench-navigate"];
    run(Command::new("cargo").args(build))?;
    let mut own = Command::new(bench.house.target.join("release/bench-navigate"));
    own.arg("path").arg(navigate::planned(bench)?);
    let told: Value = serde_json::from_str(&output(&mut own)?)?;
    let mut page = String::from(TEXT);
    for one in told.as_array().context("no table")? {
        let n = |key: &str| number(one, &format!("/{key}"));
        let elements = if n("order")? == 1.0 { "linear" } else { "quadratic" };
        write!(page, "| {} | {elements} | {} |", n("tetrahedra")?, n("acting")?)?;
        let (median, p95, worst) = (n("median_ms")?, n("p95_ms")?, n("worst_ms")?);
        write!(page, " {median:.2} / {p95:.1} / {worst:.1} | {:.0} |", PAPER_MS / median)?;
        write!(page, " {:.3} / {:.3} |", n("place_off_mm/0")?, n("place_off_mm/1")?)?;
        writeln!(page, " {:.3} / {:.3} |", n("motion_off_mm/0")?, n("motion_off_mm/1")?)?;
    }
    let most = number(&told, "/0/moved_mm")?;
    writeln!(page, "\nThe applicator moves the tumour by up to {most:.1} mm.")?;
    Ok(page)
}
