//! The mesher on the reference labels, scored against the analytic truth.

use super::{Bench, number, output, run};
use anyhow::{Context, Result};
use serde_json::Value;
use std::path::{Path, PathBuf};
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

/// Labels whose true surfaces are known.
pub(crate) struct Reference<'a> {
    bench: &'a Bench<'a>,
    folder: PathBuf,
    name: String,
    /// The name without what was done to the voxels.
    case: String,
    pub(crate) labels: PathBuf,
    /// Of the sphere: three numbers with commas, LPS, mm; radius, mm.
    pub(crate) centre: String,
    pub(crate) radius: f64,
}

impl<'a> Reference<'a> {
    pub(crate) fn open(bench: &'a Bench<'a>, name: &str) -> Result<Self> {
        let folder = bench.shared.join("reference/mesh");
        let case = name.trim_end_matches("_noisy").to_owned();
        let cases: Value =
            serde_json::from_str(&std::fs::read_to_string(folder.join("data/cases.json"))?)?;
        let sphere = &cases[&case];
        let centre = sphere["sphere_centre_mm"].as_array().context("no sphere centre")?;
        let centre: Vec<String> = centre.iter().map(ToString::to_string).collect();
        Ok(Self {
            bench,
            labels: folder.join(format!("data/{name}.nrrd")),
            folder,
            name: name.into(),
            case,
            centre: centre.join(","),
            radius: number(sphere, "/sphere_radius_mm")?,
        })
    }

    /// Runs a `supine mesh` on these labels, timed, and scores what it makes.
    pub(crate) fn row(&self, mut mesh: Command, asked: usize, out: &Path) -> Result<Row> {
        mesh.arg("--labels").arg(&self.labels).arg(format!("--centre={}", self.centre));
        mesh.arg(format!("--radius={}", self.radius)).arg(format!("--tetrahedra={asked}"));
        let start = Instant::now();
        run(mesh.arg("--out").arg(out).arg("--quiet"))?;
        let seconds = start.elapsed().as_secs_f64();
        Ok(Row { labels: self.name.clone(), asked, seconds, score: self.score(out, asked)? })
    }

    /// What the scoring script of the reference data says of a mesh.
    pub(crate) fn score(&self, mesh: &Path, asked: usize) -> Result<Value> {
        let mut metrics = Command::new(&self.bench.python);
        metrics.current_dir(&self.folder).arg("metrics.py").arg(&self.case).arg(mesh);
        metrics.args(["--asked", &asked.to_string(), "--json"]);
        Ok(serde_json::from_str(&output(&mut metrics)?)?)
    }
}

pub(crate) fn all(bench: &Bench<'_>) -> Result<Vec<Row>> {
    let row = |&(labels, asked): &(&str, usize)| {
        let mut mesh = Command::new(&bench.supine);
        mesh.args(["mesh", "--overwrite"]);
        let out = bench.work.join(format!("{labels}-{asked}.vtu"));
        Reference::open(bench, labels)?.row(mesh, asked, &out)
    };
    MESHES.iter().map(row).collect()
}

/// The mesh of so many tetrahedra that is coarsened, and to how many: the paper's.
const COARSENED: (usize, usize) = (11_828, 1581);

/// One of the meshes of [`all`] coarsened on its own surface: text and table.
pub(crate) fn coarsened(bench: &Bench<'_>) -> Result<String> {
    let (from, to) = COARSENED;
    let reference = Reference::open(bench, "dome")?;
    let out = bench.work.join("coarsened.vtu");
    let mut coarsen = Command::new(&bench.supine);
    coarsen.args(["coarsen", "--overwrite"]).arg(bench.work.join(format!("dome-{from}.vtu")));
    coarsen.arg(format!("--tetrahedra={to}")).arg("--out").arg(&out).arg("--quiet");
    let start = Instant::now();
    run(&mut coarsen)?;
    let (seconds, score) = (start.elapsed().as_secs_f64(), reference.score(&out, to)?);
    let row = Row { labels: "dome".into(), asked: to, seconds, score };
    Ok(format!("{}{}", include_str!("coarsen.md"), line("", &row)?))
}

/// The columns from skin to rims of a score.
pub(crate) fn surfaces(score: &Value) -> Result<String> {
    let s = |pointer: &str| number(score, pointer);
    let triple = |name: &str| -> Result<String> {
        let [a, b, c] = [0, 1, 2].map(|n| s(&format!("/{name}/mesh_to_truth/{n}")));
        Ok(format!("{:.3} / {:.2} / {:.2}", a?, b?, c?))
    };
    Ok(format!(
        "{} | {} | {} | {:+.2} % | {:.2}, {:.2}",
        triple("skin")?,
        triple("chest_wall")?,
        triple("cut")?,
        s("/volume_error_pct")?,
        s("/rim_skin-cut/mesh_to_truth/0")?,
        s("/rim_chest_wall-cut/mesh_to_truth/0")?,
    ))
}

/// A row of the tables of our own meshes, `names` before the count.
pub(crate) fn line(names: &str, row: &Row) -> Result<String> {
    let s = |pointer: &str| number(&row.score, pointer);
    Ok(format!(
        "| {} | {} |{names} {} | {:.1}-{:.1} | {:.2} | {} | {} | {:.1} |\n",
        row.labels,
        row.asked,
        s("/tets")?,
        s("/dihedral_min")?,
        s("/dihedral_max")?,
        s("/radius_ratio_min")?,
        surfaces(&row.score)?,
        s("/boundary_euler")?,
        row.seconds,
    ))
}
