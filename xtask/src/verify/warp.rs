//! Cost of the warp beside memcpy, VTK and SimpleITK, and its agreement with the exact reference.

use super::{Bench, environment, number, output, run};
use anyhow::{Context, Result};
use serde_json::Value;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

const TEXT: &str = include_str!("warp.md");
const PEERS_TEXT: &str = include_str!("warp_peers.md");
/// Repetitions of ours, and of the others.
const RUNS: [&str; 2] = ["15", "3"];
/// A frame shall take no longer, ms.
const FRAME_GOAL_MS: f64 = 12.0;
/// What cubic interpolation may take, of the time of linear.
const CUBIC_GOAL: f64 = 2.0;

/// A workload of the reference and its goals.
struct Workload {
    name: &'static str,
    /// Whose volume it uses.
    volume: &'static str,
    /// Multiples of the copy: raster, and with the copy.
    goals: [f64; 2],
}

const WORKLOADS: [Workload; 3] = [
    Workload { name: "W1", volume: "W1", goals: [1.5, 2.3] },
    Workload { name: "W2", volume: "W2", goals: [0.6, 1.5] },
    Workload { name: "W3", volume: "W2", goals: [1.5, 2.4] },
];

/// Text and tables.
pub(super) fn section(bench: &Bench<'_>) -> Result<String> {
    let build = ["build", "--release", "-p", "supine-benches", "--bin", "bench-warp"];
    run(Command::new("cargo").args(build))?;
    let work = bench.work.join("warp");
    std::fs::create_dir_all(&work)?;
    let measure = Measure {
        bench,
        python: environment(bench.house, "resamplers")?,
        reference: bench.shared.join("reference/resample"),
        work,
    };
    let (mut page, mut peers) = (String::from(TEXT), String::from(PEERS_TEXT));
    for workload in &WORKLOADS {
        measure.rows(workload, &mut page, &mut peers)?;
    }
    Ok(page + &peers)
}

struct Measure<'a> {
    bench: &'a Bench<'a>,
    python: PathBuf,
    reference: PathBuf,
    work: PathBuf,
}

impl Measure<'_> {
    fn rows(&self, workload: &Workload, page: &mut String, peers: &mut String) -> Result<()> {
        let ct = self.volume(workload.volume)?;
        let out = self.work.join("out.npy");
        let one = self.own(workload, &ct, 1, Some(&out))?;
        let two = self.own(workload, &ct, 2, None)?;
        let exact = self.exact(workload, &ct, &out)?;
        let n = |key: &str| number(&one, &format!("/{key}"));
        let [raster, with_copy] = workload.goals;
        let frame_goal =
            if workload.name == "W2" { format!(" (goal {FRAME_GOAL_MS})") } else { String::new() };
        writeln!(
            page,
            "| {} | {:.1} | {:.1} (**{:.2}**, goal {raster}) | {:.1} (**{:.2}**, goal {with_copy}) | \
             {:.1}{frame_goal} | {:.1} (**{:.2}**, goal {CUBIC_GOAL}) | {:.2} | {:.2} | {:.0} (goal {:.0}) | {:.0} | \
             {exact} |",
            workload.name,
            n("copy_ms")?,
            n("paint_ms")?,
            n("paint_of_copy")?,
            n("copy_ms")? + n("paint_ms")?,
            n("with_copy_of_copy")?,
            n("frame_ms")?,
            n("cubic_paint_ms")?,
            n("cubic_of_linear")?,
            n("cubic_frame_of_linear")?,
            n("paint_wall_ms")? / number(&two, "/paint_wall_ms")?,
            n("beyond_volumes_mb")?,
            32.0 + 200e-6 * n("tetrahedra")?,
            n("cubic_more_mb")?,
        )?;
        let others = self.others(workload, &ct)?;
        let o = |key: &str| number(&others, &format!("/{key}"));
        let (paint, whole) = (n("paint_ms")?, n("paint_ms")? + n("copy_ms")?);
        writeln!(
            peers,
            "| {} | {:.0} (**{:.0}**) | {:.0} (**{:.0}**) | {:.0} ({:.0}) | {:.0} % |",
            workload.name,
            o("vtk_ms")?,
            o("vtk_ms")? / paint,
            o("itk_box_ms")?,
            o("itk_box_ms")? / paint,
            o("itk_whole_ms")?,
            o("itk_whole_ms")? / whole,
            100.0 * o("itk_differs")?,
        )?;
        Ok(())
    }

    /// The volume of a workload, made once.
    fn volume(&self, name: &str) -> Result<PathBuf> {
        let path = self.work.join(format!("{name}.npy"));
        if !path.is_file() {
            // Under another name until it is whole.
            let part = self.work.join("part.npy");
            let mut make = self.script(&self.reference.join("make_workloads.py"));
            run(make.args(["volume", name]).arg(&part))?;
            std::fs::rename(&part, &path)?;
        }
        Ok(path)
    }

    fn mesh(&self, workload: &Workload) -> PathBuf {
        self.reference.join(format!("{}.npz", workload.name))
    }

    fn own(
        &self,
        workload: &Workload,
        ct: &Path,
        threads: usize,
        out: Option<&Path>,
    ) -> Result<Value> {
        let mut own = Command::new(self.bench.house.target.join("release/bench-warp"));
        own.env("RAYON_NUM_THREADS", threads.to_string());
        own.arg(self.mesh(workload)).arg(ct).arg(RUNS[0]).args(out);
        Ok(serde_json::from_str(&output(&mut own)?)?)
    }

    fn others(&self, workload: &Workload, ct: &Path) -> Result<Value> {
        let script = self.bench.house.root.join("xtask/study/resamplers.py");
        let mut others = self.script(&script);
        others.arg(self.mesh(workload)).arg(ct).arg(RUNS[1]);
        Ok(serde_json::from_str(&output(&mut others)?)?)
    }

    /// What the reference's check says of a volume of ours; that it is bad is a result too.
    fn exact(&self, workload: &Workload, ct: &Path, out: &Path) -> Result<String> {
        let mut check = self.script(&self.reference.join("check_warp.py"));
        let done = check.arg(self.mesh(workload)).arg(ct).arg(out).output()?;
        let told = String::from_utf8(done.stdout)?;
        let after = |label: &str| -> Result<&str> {
            let line = told.lines().find_map(|l| l.strip_prefix(label));
            let count = line.and_then(|l| l.split_whitespace().next());
            count.with_context(|| {
                let said = String::from_utf8_lossy(&done.stderr);
                format!("check_warp.py does not say \"{label}\": {told}{said}")
            })
        };
        Ok(format!(
            "{} of {} at ties, {} wrong by one, {} by more, {} of the others: {}",
            after("one HU, at a rounding tie")?,
            after("mesh voxels")?.trim_end_matches(','),
            after("wrong by one HU")?,
            after("wrong by more")?,
            after("outside but changed")?.parse::<usize>()?
                + after("vacated but not air")?.parse::<usize>()?,
            after("RESULT")?,
        ))
    }

    /// A script with the Python of the programs; nothing is written beside it.
    fn script(&self, path: &Path) -> Command {
        let mut script = Command::new(&self.python);
        script.env("PYTHONDONTWRITEBYTECODE", "1");
        script.env("NUMBA_CACHE_DIR", self.work.join("numba"));
        script.arg(path);
        script
    }
}
