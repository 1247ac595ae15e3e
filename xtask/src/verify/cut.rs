//! What stands for the tissue beyond the sphere, against a truth that knows no sphere.

use super::{Bench, number, output, patients, run};
use anyhow::{Context, Result};
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;

const TEXT: &str = include_str!("cut.md");
const BEYOND_MM: &str = "5,10,15,20,30";
const CUTS: [&str; 3] = ["free", "fixed", "spring"];
/// The sphere on which the stiffness is varied: as far beyond the breast as a proposed one, mm.
const VARIED_BEYOND_MM: &str = "15";
/// Stiffness of springs that are the same everywhere, in units of the mean of the default's.
const STIFFNESSES: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 4.0];
const STIFFNESS_TEXT: &str = include_str!("stiffness.md");

/// Text and table.
pub(super) fn table(bench: &Bench<'_>) -> Result<String> {
    let build = ["build", "--release", "-p", "supine-benches", "--bin", "bench-cut"];
    run(Command::new("cargo").args(build))?;
    let mut page = String::from(TEXT);
    let mut nearest = [0; CUTS.len()];
    for (name, folder) in patients::folders(bench) {
        let rows = measured(bench, &folder, BEYOND_MM, &CUTS.join(","))?;
        for pose in ["operating", "sitting"] {
            let of_pose: Vec<&Value> = rows.iter().filter(|r| r["pose"] == pose).collect();
            for cuts in of_pose.chunks_exact(CUTS.len()) {
                row(&mut page, name, pose, cuts)?;
                let errors = cuts.iter().map(|c| number(c, "/nodes_mm/0"));
                let errors = errors.collect::<Result<Vec<_>>>()?;
                let least = (0..CUTS.len()).min_by(|a, b| errors[*a].total_cmp(&errors[*b]));
                nearest[least.context("no cut")?] += 1;
            }
        }
    }
    let all: usize = nearest.iter().sum();
    let shares: Vec<String> =
        CUTS.iter().zip(nearest).map(|(cut, n)| format!("{cut} in {n}")).collect();
    writeln!(page, "\nNearest at the nodes (rms), of {all} rows: {}.", shares.join(", "))?;
    stiffnesses(bench, &mut page)?;
    Ok(page)
}

/// The errors of one patient: what `bench-cut` says.
fn measured(bench: &Bench<'_>, folder: &Path, beyond: &str, cuts: &str) -> Result<Vec<Value>> {
    let mut command = Command::new(bench.house.target.join("release/bench-cut"));
    let mut report: Value =
        serde_json::from_str(&output(command.arg(folder).arg(beyond).arg(cuts))?)?;
    serde_json::from_value(report["rows"].take()).context("no rows")
}

/// How the errors depend on the stiffness of the springs.
fn stiffnesses(bench: &Bench<'_>, page: &mut String) -> Result<()> {
    *page += STIFFNESS_TEXT;
    for (name, folder) in patients::folders(bench) {
        let default = measured(bench, &folder, VARIED_BEYOND_MM, "spring")?;
        let mean = number(&default[0], "/spring_kpa_mm")?;
        let stiff: Vec<String> = STIFFNESSES.iter().map(|s| (s * mean).to_string()).collect();
        let rows = measured(bench, &folder, VARIED_BEYOND_MM, &stiff.join(","))?;
        for pose in ["operating", "sitting"] {
            write!(page, "| {name} | {pose} | {mean:.3} |")?;
            for row in rows.iter().chain(&default).filter(|r| r["pose"] == pose) {
                let [fiducials, nodes] = ["/fiducials_mm/0", "/nodes_mm/0"].map(|k| number(row, k));
                write!(page, " {:.3}; {:.3} |", fiducials?, nodes?)?;
            }
            page.push('\n');
        }
    }
    Ok(())
}

/// The cuts of one patient, pose and sphere, in the order of [`CUTS`].
fn row(page: &mut String, name: &str, pose: &str, cuts: &[&Value]) -> Result<()> {
    let moved = number(cuts[0], "/moved_mm")?;
    write!(page, "| {name} | {pose} ({moved:.1} mm) | {} |", number(cuts[0], "/beyond_mm")?)?;
    for cut in cuts {
        let n = |key: &str| number(cut, key);
        write!(
            page,
            " {:.2}; {:.2} / {:.2}; {:.2} / {:.1} |",
            n("/tumour_mm")?,
            n("/fiducials_mm/0")?,
            n("/fiducials_mm/1")?,
            n("/nodes_mm/0")?,
            n("/nodes_mm/1")?
        )?;
    }
    page.push('\n');
    Ok(())
}
