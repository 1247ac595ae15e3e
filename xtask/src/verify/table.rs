//! The operating table tilted step by step: time and error.

use super::{Bench, number, output, run};
use anyhow::Result;
use std::fmt::Write;
use std::process::Command;

const TEXT: &str = include_str!("table.md");
/// Mesh and order.
const BODIES: [(&str, u8); 3] = [("1.6k", 1), ("1.6k", 2), ("12k", 1)];
const REST: [&str; 2] = ["net", "unloaded"];

/// Text and table.
pub(super) fn section(bench: &Bench<'_>) -> Result<String> {
    let build = ["build", "--release", "-p", "supine-benches", "--bin", "bench-tilt"];
    run(Command::new("cargo").args(build))?;
    let mut page = String::from(TEXT);
    for (rest, (mesh, order)) in REST.into_iter().flat_map(|rest| BODIES.map(|body| (rest, body))) {
        let mut own = Command::new(bench.house.target.join("release/bench-tilt"));
        own.env("RAYON_NUM_THREADS", "1").arg(bench.shared.join("reference/fem"));
        own.arg(mesh).arg(order.to_string()).arg(rest);
        let told = serde_json::from_str(&output(&mut own)?)?;
        let n = |key: &str| number(&told, &format!("/{key}"));
        let elements = if order == 1 { "linear" } else { "quadratic" };
        write!(page, "| {rest} | {mesh} | {elements} |")?;
        write!(page, " {:.1} / {:.1} / {:.1} |", n("median_ms")?, n("p95_ms")?, n("worst_ms")?)?;
        write!(page, " {:.1} | {} | {:.0} |", n("corrections")?, n("anew")?, n("jump_ms")?)?;
        writeln!(page, " {:.4} |", n("error_mm")?)?;
    }
    Ok(page)
}
