//! What a mesh made for the tumour's displacement gains.

use super::{Bench, number, output, patients, run};
use anyhow::{Context, Result, ensure};
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
        let report: Value = serde_json::from_str(&output(&mut command)?)?;
        let rows = report["rows"].as_array().context("no rows")?;
        for same in rows.chunk_by(|a, b| ["tetrahedra", "order"].iter().all(|k| a[k] == b[k])) {
            let errors: Result<Vec<f64>> = same.iter().map(|r| number(r, "/error_mm")).collect();
            let errors = errors?;
            let linear = same[0]["order"] == 1;
            ensure!(errors.len() == if linear { 2 } else { 4 }, "{} rows", errors.len());
            let curved = |n: usize| errors.get(n).map_or("-".into(), |e| format!("{e:.3}"));
            writeln!(
                page,
                "| {name} | {:.1} | {} | {} | {:.3} | {:.3} | {:.2} | {} | {} |",
                number(&report, "/moved_mm")?,
                same[0]["tetrahedra"],
                if linear { "linear" } else { "quadratic" },
                errors[0],
                errors[1],
                errors[1] / errors[0],
                curved(2),
                curved(3)
            )?;
        }
    }
    Ok(page)
}
