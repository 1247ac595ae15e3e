//! Cost of a cold solution: ours beside other finite-element programs, and its growth with the
//! mesh.

use super::plot::{Line, Panel, svg};
use super::{Bench, environment, number, output, run};
use crate::solvers;
use anyhow::Result;
use serde_json::Value;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

const BESIDE_TEXT: &str = include_str!("mechanics.md");
const GROWTH_TEXT: &str = include_str!("growth.md");
/// Relative residual at which all programs stop.
const TOLERANCE: f64 = 1e-9;
/// Problems of the comparison: mesh, pose.
const BESIDE: [(&str, &str); 5] =
    [("1.6k", "tilt"), ("1.6k", "sit"), ("12k", "tilt"), ("12k", "sit"), ("40k", "tilt")];
const PEERS: [&str; 2] = ["dolfinx", "felupe"];
/// Our own problems: mesh, order, pose.
const OWN: [(&str, u8, &str); 7] = [
    ("1.6k", 1, "tilt"),
    ("5k", 1, "tilt"),
    ("12k", 1, "tilt"),
    ("40k", 1, "tilt"),
    ("100k", 1, "tilt"),
    ("12k", 1, "sit"),
    ("1.6k", 2, "tilt"),
];
/// Where the plot of the cost lies, seen from the folder of the documents.
const PLOT: &str = "plots/mechanics-cost.svg";

/// The mechanics on the reference problems.
pub(super) struct Mechanics<'a> {
    pub(super) bench: &'a Bench<'a>,
    binaries: PathBuf,
}

impl<'a> Mechanics<'a> {
    pub(super) fn open(bench: &'a Bench<'a>) -> Result<Self> {
        let build = ["build", "--release", "-p", "supine-benches"];
        let binaries = ["--bin", "bench-mechanics", "--bin", "bench-applicator"];
        run(Command::new("cargo").args(build).args(binaries))?;
        Ok(Self { bench, binaries: bench.house.target.join("release") })
    }

    fn reference(&self) -> PathBuf {
        self.bench.shared.join("reference/fem")
    }

    /// Our solution of a problem to a relative residual: what `bench-mechanics` says.
    pub(super) fn own(&self, mesh: &str, order: u8, field: &str, goal: f64) -> Result<Value> {
        let mut own = self.solution(mesh, order, field, goal);
        Ok(serde_json::from_str(&output(&mut own)?)?)
    }

    /// The same with quadratic elements that follow skin and chest wall.
    pub(super) fn curved(&self, mesh: &str, field: &str, goal: f64) -> Result<Value> {
        let mut own = self.solution(mesh, 2, field, goal);
        Ok(serde_json::from_str(&output(own.arg("curved"))?)?)
    }

    /// The same on the coarse mesh by quadratic elements with another law or boundary, beside its
    /// stored field.
    pub(super) fn otherwise(&self, what: &[&str], field: &str, goal: f64) -> Result<Value> {
        let fixtures = self.bench.house.root.join("fixtures/fem");
        let mut own = self.solution_in(&fixtures, "1.6k", 2, field, goal);
        Ok(serde_json::from_str(&output(own.args(what))?)?)
    }

    fn solution(&self, mesh: &str, order: u8, field: &str, goal: f64) -> Command {
        self.solution_in(&self.reference(), mesh, order, field, goal)
    }

    fn solution_in(
        &self,
        reference: &Path,
        mesh: &str,
        order: u8,
        field: &str,
        goal: f64,
    ) -> Command {
        let mut own = Command::new(self.binaries.join("bench-mechanics"));
        own.env("RAYON_NUM_THREADS", "1").arg(reference);
        own.arg(mesh).arg(order.to_string()).arg(field).arg(goal.to_string());
        own
    }

    /// An applicator on one of its paths: what `bench-applicator` says.
    pub(super) fn applied(&self, mesh: &str, order: u8, path: &[&str]) -> Result<Value> {
        let mut own = Command::new(self.binaries.join("bench-applicator"));
        own.env("RAYON_NUM_THREADS", "1").arg(self.reference());
        own.arg(mesh).arg(order.to_string()).args(path);
        Ok(serde_json::from_str(&output(&mut own)?)?)
    }

    /// Another program's solution of a linear `net` problem; `None` when it finds none.
    fn peer(&self, program: &str, python: &Path, mesh: &str, pose: &str) -> Result<Option<Value>> {
        let mut script = Command::new(python);
        // What dolfinx compiles is kept there.
        script.env("XDG_CACHE_HOME", self.bench.work.join("cache"));
        script.arg(self.bench.house.root.join("xtask/study/solvers.py")).arg(program);
        script.arg(self.reference().join(format!("mesh_{mesh}.npz")));
        script.arg(pose).arg(TOLERANCE.to_string());
        let told: Value = serde_json::from_str(&output(&mut script)?)?;
        Ok((!told.is_null()).then_some(told))
    }

    /// Text, tables and plot of the cost.
    pub(super) fn cost(&self) -> Result<String> {
        let mut page = String::from(BESIDE_TEXT);
        let mut lines = vec![line("supine", 0)];
        for (n, peer) in PEERS.into_iter().enumerate() {
            lines.push(line(peer, n + 1));
        }
        self.beside(&mut page, &mut lines)?;
        page += &GROWTH_TEXT.replace("{plot}", &format!("![CPU seconds against unknowns]({PLOT})"));
        self.growth(&mut page, &mut lines[0])?;
        let plot = svg(&[Panel {
            title: "Cold solution, tilt, linear tetrahedra",
            axes: ["unknowns", "CPU seconds, one thread"],
            lines,
        }]);
        super::write_plot(self.bench, PLOT, &plot)?;
        Ok(page)
    }

    fn beside(&self, page: &mut String, lines: &mut [Line]) -> Result<()> {
        solvers::install()?;
        let felupe = environment(self.bench.house, "solvers")?;
        let pythons = [Path::new(solvers::PYTHON), felupe.as_path()];
        for (mesh, pose) in BESIDE {
            let own = self.own(mesh, 1, &format!("net_{pose}"), TOLERANCE)?;
            let own_s = number(&own, "/cpu_s")?;
            write!(page, "| {mesh} | {pose} | {} |", figures(&own)?)?;
            for ((n, peer), python) in PEERS.into_iter().enumerate().zip(pythons) {
                let Some(told) = self.peer(peer, python, mesh, pose)? else {
                    page.push_str(" finds no solution | - |");
                    continue;
                };
                let seconds = number(&told, "/cpu_s")?;
                let apart = number(&told, "/max_mm")? - number(&own, "/max_mm")?;
                write!(
                    page,
                    " {}; {:.0e} | {:.1} |",
                    figures(&told)?,
                    apart.abs(),
                    seconds / own_s
                )?;
                if pose == "tilt" {
                    lines[n + 1].points.push([number(&own, "/unknowns")?, seconds]);
                }
            }
            page.push('\n');
        }
        Ok(())
    }

    fn growth(&self, page: &mut String, plot: &mut Line) -> Result<()> {
        for (mesh, order, pose) in OWN {
            let own = self.own(mesh, order, &format!("net_{pose}"), TOLERANCE)?;
            let n = |key: &str| number(&own, &format!("/{key}"));
            let (held, factor) = (n("peak_mb")? - n("before_mb")?, n("factor_mb")?);
            writeln!(
                page,
                "| {mesh} | {order} | {pose} | {} | {} ({}) | {:.3} | {:.1} | {held:.0} | {factor:.1} | \
                 {:.1} |",
                n("unknowns")?,
                n("iterations")?,
                n("indefinite")?,
                n("cpu_s")?,
                1e6 * n("cpu_s")? / n("unknowns")?,
                held / factor,
            )?;
            if pose == "tilt" && order == 1 {
                plot.points.push([n("unknowns")?, n("cpu_s")?]);
            }
        }
        Ok(())
    }
}

fn line(name: &str, colour: usize) -> Line {
    Line { name: name.into(), colour, dashed: false, points: Vec::new() }
}

/// CPU time, iterations and memory of a solution.
fn figures(told: &Value) -> Result<String> {
    let n = |key: &str| number(told, &format!("/{key}"));
    let held = n("peak_mb")? - n("before_mb")?;
    Ok(format!("{:.3} s ({}); {held:.0} MB", n("cpu_s")?, n("iterations")?))
}
