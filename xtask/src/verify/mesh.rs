//! The mesher on the reference labels, scored against the analytic truth.

use super::{Bench, number, output, run};
use anyhow::{Context, Result};
use serde_json::Value;
use std::process::Command;
use std::time::Instant;

/// One mesh.
pub(crate) struct Row {
    pub(crate) labels: String,
    pub(crate) asked: usize,
    pub(crate) seconds: f64,
    pub(crate) score: Value,
}

const MESHES: [(&str, usize); 7] = [
    ("dome", 1581),
    ("dome", 4997),
    ("dome", 11_828),
    ("dome", 40_000),
    ("dome_noisy", 4997),
    ("thin", 1581),
    ("thin", 4997),
];

pub(crate) fn all(bench: &Bench<'_>) -> Result<Vec<Row>> {
    MESHES.iter().map(|&(labels, asked)| row(bench, labels, asked)).collect()
}

fn row(bench: &Bench<'_>, labels: &str, asked: usize) -> Result<Row> {
    let reference = bench.shared.join("reference/mesh");
    let case = labels.trim_end_matches("_noisy");
    let cases: Value =
        serde_json::from_str(&std::fs::read_to_string(reference.join("data/cases.json"))?)?;
    let sphere = &cases[case];
    let centre = sphere["sphere_centre_mm"].as_array().context("no sphere centre")?;
    let centre: Vec<String> = centre.iter().map(ToString::to_string).collect();
    let out = bench.work.join(format!("{labels}-{asked}.vtu"));
    let mut mesh = Command::new(&bench.supine);
    mesh.arg("mesh").arg("--labels").arg(reference.join(format!("data/{labels}.nrrd")));
    mesh.arg(format!("--centre={}", centre.join(",")));
    mesh.arg(format!("--radius={}", number(sphere, "/sphere_radius_mm")?));
    mesh.arg(format!("--tetrahedra={asked}")).arg("--out").arg(&out).arg("--quiet");
    let start = Instant::now();
    run(&mut mesh)?;
    let seconds = start.elapsed().as_secs_f64();
    let mut metrics = Command::new(&bench.python);
    metrics.current_dir(&reference).arg("metrics.py").arg(case).arg(&out);
    metrics.args(["--asked", &asked.to_string(), "--json"]);
    let score = serde_json::from_str(&output(&mut metrics)?)?;
    Ok(Row { labels: labels.into(), asked, seconds, score })
}
