//! Live navigation: how long a pose takes to come back as a place, and how right the place is.

mod report;

use super::{Bench, number, output, patients, run, run_case, write_plot};
use anyhow::{Context, Result, ensure};
use report::{Loop, Report};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Names how long the motion is followed, minutes; all of it lasts 10.
const MINUTES: &str = "SUPINE_NAVIGATE_MINUTES";
/// Loops beside which something goes on, and the round trip alone, take so long, minutes,
const BRIEF: f64 = 1.0;
/// from when the applicator goes in, as do all loops that are shorter than the motion, s.
const INSERTION: &str = "20";
/// Tetrahedra of the planning mesh, asked and at least made.
const PLANNED: (usize, f64) = (13_000, 11_828.0);
/// Meshes that are followed, the first of them under load too.
const MESHES: [(usize, u8); 3] = [(1581, 2), (1581, 1), (5000, 2)];
/// How long the whole motion lasts, minutes.
const WHOLE: f64 = 10.0;
/// Steps after which the applicator returns to the start, of the whole motion.
const STEPS: f64 = 10_000.0;
const PLOT: &str = "pictures/navigate_latency.svg";

/// Text, tables and picture: of `bench-navigate`.
pub(super) fn section(bench: &Bench<'_>) -> Result<String> {
    let build = ["build", "--release", "-p", "supine-benches", "--bin", "bench-navigate"];
    run(Command::new("cargo").args(build))?;
    let minutes = match std::env::var(MINUTES) {
        Ok(text) => text.parse().with_context(|| format!("{MINUTES}={text}: minutes"))?,
        Err(_) => WHOLE,
    };
    let measured = Measured { bench, run: planned(bench)?, minutes };
    let report = measured.all()?;
    write_plot(bench, PLOT, &report.plot())?;
    report.page(PLOT, minutes)
}

/// A run of the fixture patient with a fine mesh.
pub(super) fn planned(bench: &Bench<'_>) -> Result<PathBuf> {
    let folder = bench.work.join("navigate");
    std::fs::create_dir_all(&folder)?;
    let patient = bench.house.root.join("fixtures/patient");
    let ct = patients::unpacked(&patient, &folder)?;
    let (case, out) = (folder.join("case.toml"), folder.join("out"));
    let text = format!(
        "ct = {ct:?}\nbreast = \"left\"\ntable = {{ ap = 7.0, lat = 5.0 }}\n\
         tumour = {{ centre = [91.37, -248.09, -594.5], radius = 9.0 }}\n\
         tissue = {{ young = 0.9, rest = \"unloaded\" }}\nmesh = {{ tetrahedra = {} }}\n",
        PLANNED.0
    );
    std::fs::write(&case, text)?;
    let summary = run_case(bench, &case, &out)?;
    let made = number(&summary, "/mesh/tetrahedra")?;
    ensure!(made >= PLANNED.1, "the planning mesh has {made} tetrahedra, {} are wanted", PLANNED.1);
    Ok(out)
}

/// How it is measured.
struct Measured<'a> {
    bench: &'a Bench<'a>,
    run: PathBuf,
    minutes: f64,
}

impl Measured<'_> {
    fn all(&self) -> Result<Report> {
        let brief = self.minutes.min(BRIEF);
        let echo = self.timed("S = 0", &["echo", INSERTION, &brief.to_string()])?;
        let recording = self.bench.work.join("navigate/session.jsonl");
        if recording.exists() {
            std::fs::remove_file(&recording)?;
        }
        let mut loops = vec![];
        for (n, (tetrahedra, order)) in MESHES.into_iter().enumerate() {
            let elements = if order == 1 { "linear" } else { "quadratic" };
            let name = format!("{tetrahedra} {elements}");
            let beside: &[&str] = match n {
                0 => &["record", path(&recording)?],
                _ => &[],
            };
            loops.push(self.session(&name, (tetrahedra, order), self.minutes, beside)?);
        }
        let beside = |name: &str, words: &[&str]| self.session(name, MESHES[0], brief, words);
        loops.push(beside("1581 quadratic, a minute alone", &[])?);
        loops.push(beside("the same, a busy process", &["hog"])?);
        loops.push(beside("the same, the image streamed", &["image"])?);
        loops.push(beside("the same, tissue pressed instead of tied", &["pressing"])?);
        let run = path(&self.run)?;
        let accuracy = self.told(&["accuracy", run, path(&recording)?])?;
        let steps = (STEPS * self.minutes / WHOLE).min(STEPS).round();
        let drift = self.told(&["drift", run, &steps.to_string()])?;
        Ok(Report { echo, loops, accuracy, drift })
    }

    fn session(
        &self,
        name: &str,
        (tetrahedra, order): (usize, u8),
        minutes: f64,
        beside: &[&str],
    ) -> Result<Loop> {
        let (supine, run) = (path(&self.bench.supine)?, path(&self.run)?);
        let from = if minutes < WHOLE { INSERTION } else { "0" };
        let [tetrahedra, order, minutes] =
            [tetrahedra.to_string(), order.to_string(), minutes.to_string()];
        let words = ["loop", supine, run, &tetrahedra, &order, from, &minutes];
        self.timed(name, &[&words, beside].concat())
    }

    /// What the bench tells, between two looks at the machine's load.
    fn timed(&self, name: &str, words: &[&str]) -> Result<Loop> {
        let before = load()?;
        let told = self.told(words)?;
        Ok(Loop { name: name.into(), told, load: [before, load()?] })
    }

    fn told(&self, words: &[&str]) -> Result<Value> {
        let program = self.bench.house.target.join("release/bench-navigate");
        Ok(serde_json::from_str(&output(Command::new(program).args(words))?)?)
    }
}

fn path(path: &Path) -> Result<&str> {
    path.to_str().with_context(|| format!("{} is no UTF-8", path.display()))
}

/// Processes that ran or wanted to, mean of the last minute.
fn load() -> Result<f64> {
    let text = std::fs::read_to_string("/proc/loadavg")?;
    let first = text.split_whitespace().next().context("no load")?;
    Ok(first.parse()?)
}
