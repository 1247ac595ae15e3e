//! Whole runs and repeated ones: time and memory, beside another build of the program when one is
//! named.

use super::{Bench, patients, real};
use anyhow::{Context, Result, ensure};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const TEXT: &str = include_str!("flow.md");
/// Names the build that is measured beside this one.
const BEFORE: &str = "SUPINE_BEFORE";
/// Runs of each kind, of which the fastest counts.
const REPEATS: usize = 3;
/// Time between two looks at the memory.
const LOOK: Duration = Duration::from_millis(5);

/// One CT and a point in its left breast that stands for a tumour (LPS, mm).
const REAL: [(&str, [f64; 3]); 2] =
    [("breast-flt013", [60.0, -212.0, -590.0]), ("chest-lidc0001", [112.0, -72.0, -165.0])];

/// What one kind of run cost.
#[derive(Clone, Copy, Default)]
struct Cost {
    seconds: f64,
    peak_mb: f64,
}

/// Of a whole run, one with another tilt, and one with nothing to do.
type Costs = [Cost; 3];

pub(crate) fn section(bench: &Bench<'_>) -> Result<String> {
    let before = std::env::var_os(BEFORE).map(PathBuf::from);
    let mut table = String::from(TEXT);
    for (name, ct, tumour) in cts(bench)? {
        let own = measured(bench, &bench.supine, &ct, tumour)?;
        let other = before.as_ref().map(|b| measured(bench, b, &ct, tumour)).transpose()?;
        table += &line(&name, &own, other.as_ref())?;
    }
    Ok(table)
}

fn cts(bench: &Bench<'_>) -> Result<Vec<(String, PathBuf, [f64; 3])>> {
    let fixture = bench.house.root.join("fixtures/patient");
    let fixture = patients::unpacked(&fixture, &bench.work.join("fixture"))?;
    let mut all = vec![("fixture".to_string(), fixture, [91.37, -248.09, -594.5])];
    for (name, tumour) in REAL {
        all.push((name.to_string(), real::unpacked(bench, name)?, tumour));
    }
    Ok(all)
}

fn measured(bench: &Bench<'_>, supine: &Path, ct: &Path, tumour: [f64; 3]) -> Result<Costs> {
    let folder = bench.work.join("flow");
    std::fs::create_dir_all(&folder)?;
    let case = |ap: f64| -> Result<PathBuf> {
        let path = folder.join(format!("ap-{ap}.toml"));
        let text = format!(
            "ct = {ct:?}\nbreast = \"left\"\ntable = {{ ap = {ap:?}, lat = 5.0 }}\n\
             tumour = {{ centre = {tumour:?}, radius = 5.0 }}\n"
        );
        std::fs::write(&path, text)?;
        Ok(path)
    };
    let out = folder.join("out");
    let mut best: Option<Costs> = None;
    for _ in 0..REPEATS {
        if out.exists() {
            std::fs::remove_dir_all(&out)?;
        }
        let costs = [
            cost(supine, &case(7.0)?, &out)?,
            cost(supine, &case(3.0)?, &out)?,
            cost(supine, &case(3.0)?, &out)?,
        ];
        let kept = best.get_or_insert(costs);
        for (kept, now) in kept.iter_mut().zip(costs) {
            kept.seconds = kept.seconds.min(now.seconds);
            kept.peak_mb = kept.peak_mb.max(now.peak_mb);
        }
    }
    best.context("nothing was measured")
}

/// Time of a run from start to end, and the most memory that was resident at a look.
fn cost(supine: &Path, case: &Path, out: &Path) -> Result<Cost> {
    let start = Instant::now();
    let mut command = Command::new(supine);
    command.arg("run").arg(case).arg("--out").arg(out).arg("--quiet").stdout(Stdio::null());
    let mut child = command.spawn().with_context(|| supine.display().to_string())?;
    let mut peak_mb = 0.0f64;
    let status = loop {
        peak_mb = peak_mb.max(resident_mb(child.id()).unwrap_or_default());
        if let Some(status) = child.try_wait()? {
            break status;
        }
        std::thread::sleep(LOOK);
    };
    ensure!(status.success(), "{command:?}: {status}");
    Ok(Cost { seconds: start.elapsed().as_secs_f64(), peak_mb })
}

/// Largest resident memory of a process so far, MB.
fn resident_mb(process: u32) -> Option<f64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kilobytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes * 1.024e-3)
}

fn line(name: &str, own: &Costs, other: Option<&Costs>) -> Result<String> {
    let mut line = format!("| {name} |");
    for (n, now) in own.iter().enumerate() {
        let beside = other.map_or(String::new(), |other| {
            format!(" ({:.1}, {:.2})", other[n].seconds, now.seconds / other[n].seconds)
        });
        write!(line, " {:.2}{beside} |", now.seconds)?;
    }
    let beside = other.map_or(String::new(), |other| {
        format!(" ({:.0}, {:.2})", other[0].peak_mb, own[0].peak_mb / other[0].peak_mb)
    });
    writeln!(line, " {:.0}{beside} |", own[0].peak_mb)?;
    Ok(line)
}
