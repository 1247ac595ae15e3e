//! An applicator moved through the reference breast, step by step: its cost and its error:
//! `bench-applicator REFERENCE MESH ORDER PATH [sliding]`, JSON on stdout.
//!
//! REFERENCE is the folder of the reference's arrays, MESH one of its meshes (`12k`), PATH 1 (ten
//! shifts) or 2 (turning). The answers that a step starts from are renewed at the place before, as
//! a second thread would; that time is told apart. With `sliding` the tissue slides without
//! friction; `off_surface_mm` says how far a node comes off its distance from the sphere. PATH
//! `surface` tells instead what points moved onto the sphere buy at the probes, PATH `stored` how
//! far the settled solutions are from the stored ones of both paths.
#![expect(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "a measurement reads its input and tells its result"
)]

mod reference;
mod surface;

use anyhow::{Result, bail, ensure};
use ndarray_npy::ReadNpzError;
use reference::{Reference, cpu_s, memory_mb, order, rows};
use serde_json::{Value, json};
use std::sync::Arc;
use supine_fem::{Applicator, Body, Contact, Cut, Insertion, Load, Params, SphereOnShaft, Tissue};
use supine_mesh::{Edges, Order, TetMesh};
use supine_space::{Point, Pose, Progress, Vector, supine};

/// The sphere of the reference in the tilted breast.
const SPHERE: SphereOnShaft = SphereOnShaft {
    centre: Point::new(96.689_502_2, -111.251_350_18, 0.0),
    radius_mm: 20.0,
    shaft: None,
};
/// Its nodes are those of the reference, which counts none beyond 20 mm: of the sphere above those
/// 0.002 mm beyond count as on its surface, and the quadratic elements of 12k have one.
const WITHIN: SphereOnShaft = SphereOnShaft { radius_mm: 20.0 / 1.0001, ..SPHERE };
const STEPS: usize = 10;
/// The path is gone so often; of each step the median time counts.
const RUNS: usize = 5;
/// Relative residual of the solutions that the steps and the stored fields are compared with.
const SETTLED: f64 = 1e-10;

fn main() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let (words, contact) = match &words[..] {
        [words @ .., "sliding"] => (words, Contact::Frictionless),
        words => (words, Contact::Tied),
    };
    let &[folder, mesh, number, path] = words else {
        bail!("bench-applicator REFERENCE MESH ORDER PATH [sliding]");
    };
    let reference = Reference(folder.into());
    let (body, tissue) = (Arc::new(reference.mesh(mesh)?), Tissue::default());
    let load = Load { ct: supine(), target: reference::tilt() };
    let order = order(number)?;
    let params = Params { order, cut: Cut::Free, tolerance: SETTLED, ..Params::default() };
    let attach = |sphere: &SphereOnShaft| {
        let body = Body::new(body.clone(), tissue);
        Applicator::attach(
            &body,
            &load,
            &params,
            &Insertion::new(sphere, contact),
            Progress::none(),
        )
    };
    if path == "surface" {
        println!(
            "{}",
            surface::measure(&reference, &Body::new(body.clone(), tissue), &load, &params)?
        );
        return Ok(());
    }
    if path == "stored" {
        let (mut settled, _) = attach(&WITHIN)?;
        println!("{}", agreement(&reference, (mesh, order), &mut settled)?);
        return Ok(());
    }
    let (mut settled, _) = attach(&SPHERE)?;
    let mut exact = Vec::new();
    for step in 1..=STEPS {
        settled.settle(&pose(path, step)?, SETTLED, Progress::none())?;
        exact.push(settled.deformation()?.displacement().values().to_vec());
    }
    let (mut times, mut renewals) = (vec![Vec::new(); STEPS], Vec::new());
    let (mut corrections, mut error, mut anew) = (0, 0.0f64, 0);
    let (nodes, mut off) = (nodes(&body, order), 0.0f64);
    for _ in 0..RUNS {
        let (mut live, _) = attach(&SPHERE)?;
        let first = within(&nodes, &live)?;
        for step in 1..=STEPS {
            let pose = pose(path, step)?;
            let start = cpu_s();
            let made = live.step(&pose)?;
            times[step - 1].push(1e3 * (cpu_s() - start));
            corrections += made.corrections;
            anew += usize::from(made.by_newton);
            error = error.max(largest_difference(
                live.deformation()?.displacement().values(),
                &exact[step - 1],
            ));
            off = off.max(off_surface(&nodes, &first, &live)?);
            let start = cpu_s();
            live.renew()?;
            renewals.push(1e3 * (cpu_s() - start));
        }
    }
    let mut steps: Vec<f64> = times.iter_mut().map(|times| median(times)).collect();
    let result = json!({
        "coupled": settled.coupled_nodes(),
        "median_ms": median(&mut steps),
        "worst_ms": steps.iter().copied().fold(0.0, f64::max),
        "renewal_ms": median(&mut renewals),
        "corrections": corrections as f64 / (RUNS * STEPS) as f64,
        "anew": anew,
        "error_mm": error,
        "off_surface_mm": off,
        "peak_mb": memory_mb("VmHWM")?,
    });
    println!("{result}");
    Ok(())
}

/// The pose after so many steps of a path: shift (mm), and turn about +y through the centre.
fn pose(path: &str, step: usize) -> Result<Pose> {
    let k = step as f64;
    let (shift, turn_deg) = match path {
        "1" => (Vector::repeat(0.5 * k), 0.0f64),
        "2" => (Vector::new(k.min(5.0), 0.0, -(k - 5.0).max(0.0)), 2.0 * k),
        other => bail!("path {other} is neither 1 nor 2"),
    };
    let turn = nalgebra::UnitQuaternion::from_scaled_axis(Vector::y() * turn_deg.to_radians());
    let turn = Pose::rotation_wrt_point(turn, SPHERE.centre);
    Ok(Pose::translation(shift.x, shift.y, shift.z) * turn)
}

/// The nodes of elements of an order in the CT shape, in the order of a displacement.
fn nodes(mesh: &TetMesh, order: Order) -> Vec<Point> {
    let mut nodes = mesh.points().to_vec();
    if order == Order::Quadratic {
        let middle = |[a, b]: &[u32; 2]| {
            nalgebra::center(&mesh.points()[*a as usize], &mesh.points()[*b as usize])
        };
        nodes.extend(Edges::new(mesh).ends().iter().map(middle));
    }
    nodes
}

/// The nodes on which the sphere acts at its first pose, with their distances from its centre, mm.
fn within(nodes: &[Point], applicator: &Applicator) -> Result<Vec<(usize, f64)>> {
    let u = applicator.deformation()?;
    let distance = |(n, u): (usize, &Vector)| (n, (nodes[n] + u - SPHERE.centre).norm());
    let mut found: Vec<_> = u.displacement().values().iter().enumerate().map(distance).collect();
    found.retain(|(_, distance)| *distance <= SPHERE.radius_mm * 1.0001);
    let coupled = applicator.coupled_nodes();
    ensure!(found.len() == coupled, "{} nodes in the sphere, {coupled} coupled", found.len());
    Ok(found)
}

/// How far a node in the sphere is off its first distance from the centre, at most, mm.
fn off_surface(nodes: &[Point], first: &[(usize, f64)], applicator: &Applicator) -> Result<f64> {
    let (u, centre) = (applicator.deformation()?, applicator.pose() * SPHERE.centre);
    let off = |&(n, was): &(usize, f64)| {
        ((nodes[n] + u.displacement().values()[n] - centre).norm() - was).abs()
    };
    Ok(first.iter().map(off).fold(0.0, f64::max))
}

/// Largest nodal difference, mm, of the settled solutions to the stored fields of both paths, and
/// their number.
fn agreement(
    reference: &Reference,
    (mesh, order): (&str, Order),
    settled: &mut Applicator,
) -> Result<Value> {
    let (mut off, mut stored) = (0.0f64, 0);
    for (path, step) in ["1", "2"].into_iter().flat_map(|p| (1..=STEPS).map(move |k| (p, k))) {
        let field = format!("app{path}_b{step}");
        let Some(found) = stored_field(reference, (mesh, order), &field)? else { continue };
        settled.settle(&pose(path, step)?, SETTLED, Progress::none())?;
        let u = settled.deformation()?;
        ensure!(
            found.len() == u.displacement().values().len(),
            "{field} has {} nodes",
            found.len()
        );
        off = off.max(largest_difference(u.displacement().values(), &found));
        stored += 1;
    }
    ensure!(stored > 0, "no field of an applicator is stored for {mesh}");
    Ok(json!({ "stored": stored, "off": off }))
}

fn stored_field(
    reference: &Reference,
    (mesh, order): (&str, Order),
    field: &str,
) -> Result<Option<Vec<Vector>>> {
    let Some(mut stored) = reference.fields(mesh, order)? else { return Ok(None) };
    match stored.by_name::<ndarray::OwnedRepr<f64>, ndarray::Ix2>(field) {
        Ok(stored) => Ok(Some(rows(&stored).into_iter().map(Vector::from).collect())),
        Err(ReadNpzError::Zip(_)) => Ok(None),
        Err(other) => Err(other.into()),
    }
}

fn largest_difference(a: &[Vector], b: &[Vector]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
