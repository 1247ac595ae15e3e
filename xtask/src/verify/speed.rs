//! Time and memory of the segmentation, beside the script a practitioner would write.

use super::{Bench, number, output, patients, real, run};
use anyhow::Result;
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

/// One CT.
struct Row {
    name: &'static str,
    /// What `bench-segment` prints.
    own: Value,
    /// The command `supine segment`, from start to written labels, s.
    command_s: f64,
    /// The script, from start to written labels, s.
    script_s: f64,
}

/// The table of all CTs measured.
pub(crate) fn table(bench: &Bench<'_>) -> Result<String> {
    run(Command::new("cargo").args([
        "build",
        "--release",
        "-p",
        "supine",
        "-p",
        "supine-benches",
    ]))?;
    let fixture = bench.house.root.join("fixtures/patient");
    let fixture = patients::unpacked(&fixture, &bench.work.join("fixture"))?;
    let chest = real::unpacked(bench, "chest-lidc0001")?;
    let mut table = String::from(
        "| CT | voxels | `supine segment` s | `baseline.py` s | of ours: reading / segmenting s | a \
         seed changed s | surfaces s | peak MB (times the raw volume): segmenting / with surfaces \
         |\n|---|---|---|---|---|---|---|---|\n",
    );
    for (name, ct) in [("fixture", fixture), ("chest-lidc0001", chest)] {
        line(&mut table, &row(bench, name, &ct)?)?;
    }
    Ok(table)
}

fn row(bench: &Bench<'_>, name: &'static str, ct: &Path) -> Result<Row> {
    let own = output(Command::new(bench.house.target.join("release/bench-segment")).arg(ct))?;
    let out = bench.work.join("speed.nrrd");
    let mut command = Command::new(&bench.supine);
    command.args(["segment", "--overwrite", "--quiet", "--ct"]).arg(ct).arg("--out").arg(&out);
    let command_s = timed(&mut command)?;
    let mut script = Command::new(&bench.python);
    script.arg(bench.shared.join("reference/segment/baseline.py")).arg(ct).arg(&out);
    let script_s = timed(&mut script)?;
    Ok(Row { name, own: serde_json::from_str(&own)?, command_s, script_s })
}

/// Seconds a command takes.
fn timed(command: &mut Command) -> Result<f64> {
    let start = Instant::now();
    run(command)?;
    Ok(start.elapsed().as_secs_f64())
}

fn line(table: &mut String, row: &Row) -> Result<()> {
    let n = |key: &str| number(&row.own, &format!("/{key}"));
    let raw = n("raw_mb")?;
    let peak = |key: &str| -> Result<String> {
        let mb = n(key)?;
        Ok(format!("{mb:.0} ({:.1})", mb / raw))
    };
    writeln!(
        table,
        "| {} | {} x {} x {} | {:.1} | {:.1} | {:.1} / {:.1} | {:.2} | {:.1} | {} / {} |",
        row.name,
        n("size/0")?,
        n("size/1")?,
        n("size/2")?,
        row.command_s,
        row.script_s,
        n("import_s")?,
        n("segment_s")?,
        n("seed_change_s")?,
        n("surfaces_s")?,
        peak("peak_segment_mb")?,
        peak("peak_surfaces_mb")?,
    )?;
    Ok(())
}
