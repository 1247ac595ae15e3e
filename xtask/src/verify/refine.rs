//! What a mesh made for the tumour's displacement gains.

use super::{Bench, number, output, patients, run};
use anyhow::{Context, Result};
use serde_json::Value;
use std::fmt::Write;
use std::process::Command;

const TEXT: &str = include_str!("refine.md");
/// Counts of the paper: followed live, planned.
const COUNTS: [&str; 2] = ["1581", "4997"];

/// Text and table, on the runs that [`patients::all`] left.
pub(crate) fn table(bench: &Bench<'_>) -> Result<String> {
    run(Command::new("cargo").args(["build", "--release", "-p", "supine-benches"]))?;
    let mut page = String::from(TEXT);
    for (name, _) in patients::folders(bench) {
        let mut command = Command::new(bench.house.target.join("release/bench-refine"));
        command.arg(bench.work.join(name).join("out")).args(COUNTS);
        let found: Value = serde_json::from_str(&output(&mut command)?)?;
        let rows = found["rows"].as_array().context("no rows")?;
        for pair in rows.chunks_exact(2) {
            let [usual, goal] = [0, 1].map(|n| number(&pair[n], "/error_mm"));
            let (usual, goal) = (usual?, goal?);
            let order = if pair[0]["order"] == 1 { "linear" } else { "quadratic" };
            writeln!(
                page,
                "| {name} | {:.1} | {} | {order} | {usual:.3} | {goal:.3} | {:.2} |",
                number(&found, "/moved_mm")?,
                pair[0]["tetrahedra"],
                goal / usual
            )?;
        }
    }
    Ok(page)
}
