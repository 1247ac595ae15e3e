//! The operating table tilted live: cost and error of the turns of the reference breast:
//! `bench-tilt REFERENCE MESH ORDER REST`, JSON on stdout.
//!
//! REFERENCE is the folder of the reference's arrays, MESH one of its meshes (`1.6k`), REST `net`
//! or `unloaded`. The path goes in steps of 1 degree from level to AP 20, from there to LAT 15,
//! back over level to AP -20; then one jump from there to AP 20, LAT 15. Every few turns the tissue
//! is compared with a cold solution.
#![expect(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "a measurement reads its input and tells its result"
)]

#[expect(dead_code, reason = "the other benches use the rest")]
mod reference;

use anyhow::{Result, bail};
use reference::{Reference, cpu_s, memory_mb, order};
use serde_json::json;
use std::sync::Arc;
use supine_fem::{Body, Cut, Load, Params, RestState, Tilt, Tissue, solve};
use supine_mesh::Deformation;
use supine_space::{Progress, TablePose, supine};

/// Relative residual of the cold solutions.
const SETTLED: f64 = 1e-10;
/// Of so many turns one is compared.
const COMPARED: usize = 7;

fn main() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [folder, mesh, number, rest] = &words[..] else {
        bail!("bench-tilt REFERENCE MESH ORDER REST");
    };
    let reference = Reference(folder.into());
    let body = Body::new(Arc::new(reference.mesh(mesh)?), Tissue::default());
    let rest = match rest.as_str() {
        "net" => RestState::Net,
        "unloaded" => RestState::Unloaded,
        other => bail!("{other} is neither net nor unloaded"),
    };
    let params = Params {
        order: order(number)?,
        rest,
        cut: Cut::Free,
        tolerance: SETTLED,
        ..Params::default()
    };
    let level = Load { ct: supine(), target: supine() };
    let (mut tilt, _) = Tilt::new(&body, &level, &params, Progress::none())?;
    let cold = |pose: TablePose| {
        let load = Load { target: pose.gravity(), ..level };
        solve(&body, &load, &params, Progress::none())
    };
    let (mut times, mut corrections, mut anew, mut error) = (vec![], 0, 0, 0.0f64);
    for (n, pose) in path().into_iter().enumerate() {
        let start = cpu_s();
        let step = tilt.turn(&pose.gravity())?;
        times.push(1e3 * (cpu_s() - start));
        corrections += step.corrections;
        anew += usize::from(step.by_newton);
        if n % COMPARED == COMPARED - 1 {
            error = error.max(apart(&tilt.deformation()?, &cold(pose)?.0));
        }
    }
    let jump = TablePose { ap_deg: 20.0, lat_deg: 15.0 };
    let start = cpu_s();
    tilt.turn(&jump.gravity())?;
    let jump_ms = 1e3 * (cpu_s() - start);
    error = error.max(apart(&tilt.deformation()?, &cold(jump)?.0));
    let turns = times.len();
    let mean = corrections as f64 / turns as f64;
    times.sort_by(f64::total_cmp);
    let result = json!({
        "turns": turns,
        "median_ms": times[turns / 2],
        "p95_ms": times[turns * 95 / 100],
        "worst_ms": times[turns - 1],
        "corrections": mean,
        "anew": anew,
        "jump_ms": jump_ms,
        "error_mm": error,
        "peak_mb": memory_mb("VmHWM")?,
    });
    println!("{result}");
    Ok(())
}

/// The tilts, one after the other.
fn path() -> Vec<TablePose> {
    let pose = |ap: i32, lat: i32| TablePose { ap_deg: ap.into(), lat_deg: lat.into() };
    let up = (1..=20).map(|ap| pose(ap, 0));
    let aside = (1..=15).map(|lat| pose(20, lat));
    let back = (0..15).rev().map(|lat| pose(20, lat));
    let down = (-20..20).rev().map(|ap| pose(ap, 0));
    up.chain(aside).chain(back).chain(down).collect()
}

/// Largest distance between two displacements of one mesh at a node, mm.
fn apart(one: &Deformation, other: &Deformation) -> f64 {
    let pairs = one.displacement().values().iter().zip(other.displacement().values());
    pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}
