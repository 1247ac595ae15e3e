//! The commands that do one stage, and `supine check`.

use crate::End;
use crate::args;
use crate::cli_values::Numbers;
use crate::failure::Failure;
use crate::screen::Screen;
use crate::start::start;
use std::path::Path;
use supine_flow::commands::mesh::{self, MeshDone, MeshSource};
use supine_flow::commands::warp::{self, OutputGrid};
use supine_flow::commands::{check, coarsen, segment, solve};
use supine_space::Failure as Kind;

pub(crate) fn check(args: args::Check, screen: &Screen) -> Result<End, Failure> {
    let args::Check { case, changes, out } = args;
    let done = check::check(&check::Check { case, changes, out: out.clone() }, screen)?;
    let mut text = plan(&done);
    if let (Some(redone), Some(out)) = (&done.redone, out) {
        let stages = if redone.is_empty() { "nothing".into() } else { redone.join(", ") };
        text += &format!("\nto do in {}: {stages}", out.display());
        if let Some(held) = &done.would_replace {
            text += &format!("\nrefused without --overwrite: {} holds {held}", out.display());
        }
    }
    screen.result(&done, &text);
    Ok(End::Done)
}

/// What a run would do, in words.
fn plan(done: &check::CheckDone) -> String {
    let check::CheckDone { case, ct, tumour, breast, table_deg: [ap, lat], .. } = done;
    let ([i, j, k], [x, y, z]) = (ct.size, ct.spacing_mm);
    let [tx, ty, tz] = tumour.centre_mm;
    let ends = |tilt: f64, up: &str, down: &str| match tilt {
        0.0 => "level".into(),
        tilt => format!("{} by {}°", if tilt > 0.0 { up } else { down }, tilt.abs()),
    };
    let (head, side) = (
        ends(*ap, "head raised", "head lowered"),
        ends(*lat, "left side lowered", "right side lowered"),
    );
    let region = if done.region_proposed { "found from the breast" } else { "as given" };
    let left_out = match ct.left_out {
        0 => String::new(),
        n => format!(", {n} files of the folder left out"),
    };
    let told = |scan: &check::CheckedScan| {
        let from = if scan.unit_detected { ", by its size" } else { "" };
        let check::CheckedScan { name, points, unit, size_mm, .. } = scan;
        format!(
            "\n  scan    {name}: {points} points in {unit}{from}, {size_mm:.0} mm from corner to corner"
        )
    };
    let scans: String = done.scans.iter().map(told).collect();
    format!(
        "{} can be run\n  CT      {i} x {j} x {k} voxels of {x:.3} x {y:.3} x {z:.3} mm{left_out}\n  \
         tumour  {tx:.1}, {ty:.1}, {tz:.1} mm (LPS), radius {:.1} mm, {:.0} HU, {breast} breast\n  \
         table   AP {ap}°, LAT {lat}°: {head}, {side}\n  region  {region}\n  mesh    {} tetrahedra{scans}",
        case.display(),
        tumour.radius_mm,
        tumour.mean_hu,
        done.tetrahedra
    )
}

pub(crate) fn segment(args: args::Segment, screen: &Screen) -> Result<End, Failure> {
    let args::Segment { given, case, out, over, uncertainty, surfaces } = args;
    let start = Some(start()?);
    let overwrite = over.overwrite;
    let spec = given.spec;
    let given = segment::Segment { spec, case, out, uncertainty, surfaces, start, overwrite };
    let done = segment::segment(&given, screen)?;
    let text = format!(
        "{}: soft tissue {:.0} ml, chest wall {:.0} ml in the whole CT",
        done.labels.display(),
        done.soft_tissue_ml,
        done.chest_wall_ml
    );
    screen.result(&done, &text);
    Ok(End::Done)
}

pub(crate) fn mesh(args: args::Mesh, screen: &Screen) -> Result<End, Failure> {
    let args::Mesh { labels, surfaces, skin, chest_wall, frame, given, out, over, report } = args;
    let source = match (labels, skin, chest_wall) {
        (Some(file), ..) => MeshSource::Labels { file, surfaces },
        (None, Some(skin), Some(chest_wall)) => {
            MeshSource::Solids { skin, chest_wall, frame: frame.into() }
        }
        _ => {
            let message = "--labels, or --skin and --chest-wall, are needed";
            return Err(Failure::new(Kind::Usage, message));
        }
    };
    let (spec, overwrite) = (given.spec, over.overwrite);
    let done = mesh::mesh(&mesh::Mesh { spec, source, out, report, overwrite }, screen)?;
    tell_mesh(&done, screen);
    Ok(End::Done)
}

pub(crate) fn coarsen(args: args::Coarsen, screen: &Screen) -> Result<End, Failure> {
    let args::Coarsen { from, tetrahedra, out, over, report } = args;
    let (tetrahedra, overwrite) = (tetrahedra.get(), over.overwrite);
    let given = coarsen::Coarsen { from, tetrahedra, out, report, overwrite };
    tell_mesh(&coarsen::coarsen(&given, screen)?, screen);
    Ok(End::Done)
}

fn tell_mesh(done: &MeshDone, screen: &Screen) {
    let facts = &done.facts;
    let far = facts.surfaces.iter().map(|s| s.distance.max_mm).fold(0.0, f64::max);
    let text = format!(
        "{}: {} tetrahedra, dihedral angles {:.1} to {:.1} degrees, {:.1} ml, surface within {far:.2} mm",
        done.mesh.display(),
        facts.tetrahedra,
        facts.min_dihedral_deg,
        facts.max_dihedral_deg,
        facts.volume_ml
    );
    screen.result(done, &text);
}

pub(crate) fn solve(args: args::Solve, screen: &Screen) -> Result<End, Failure> {
    let args::Solve { mesh, sitting, gravity, given, sensitivity, problem, out, over } = args;
    let target = match gravity {
        Some(Numbers(direction)) => solve::Target::Direction(direction),
        None if sitting => solve::Target::Sitting,
        None => solve::Target::Table,
    };
    let (spec, overwrite) = (given.spec, over.overwrite);
    let given = solve::Solve { spec, mesh, target, sensitivity, problem, out, overwrite };
    let done = solve::solve(&given, screen)?;
    let mut text = format!(
        "{}: largest displacement {:.2} mm, {} iterations, det F {:.2} to {:.2}",
        done.deformed.display(),
        done.max_displacement_mm,
        done.iterations,
        done.min_det_f,
        done.max_det_f
    );
    if let Some(slope) = done.max_displacement_mm_per_kpa {
        text += &format!(", up to {slope:.2} mm per kPa");
    }
    if let Some(interval) = &done.young_interval {
        let ([low, high], [of_low, of_high]) = (interval.young_kpa, interval.max_displacement_mm);
        text += &format!(", {of_low:.2} mm at {low} kPa, {of_high:.2} mm at {high} kPa");
    }
    screen.result(&done, &text);
    Ok(End::Done)
}

pub(crate) fn warp(args: args::Warp, screen: &Screen) -> Result<End, Failure> {
    let args::Warp { given, mesh, spacing, around, axial, fields, registration, out, over } = args;
    let grid = OutputGrid {
        spacing_mm: spacing.map(|s| s.0),
        around_mm: around,
        axial_mm: axial.map(|a| a.0),
    };
    let folder = registration.clone();
    let start = Some(start()?);
    let (spec, overwrite) = (given.spec, over.overwrite);
    let given = warp::Warp { spec, mesh, grid, fields, registration, out, start, overwrite };
    let done = warp::warp(&given, screen)?;
    let mut text = format!(
        "{}: {} voxels moved, Jacobian {:.2} to {:.2}",
        done.out.display(),
        done.moved_voxels,
        done.jacobian_min,
        done.jacobian_max
    );
    let line = |folder: &Path, what: &str, [mean, p99, max]: [f64; 3]| {
        let folder = folder.display();
        format!(
            "\n{folder}: {what} {mean:.3} mm in the mean, {p99:.3} mm at 99 %, {max:.3} mm at the maximum"
        )
    };
    if let (Some(folder), Some(c)) = (&done.fields, &done.forward_then_backward) {
        text += &line(folder, "fields; forward, then backward:", [c.mean_mm, c.p99_mm, c.max_mm]);
    }
    if let (Some(folder), Some(r)) = (&folder, &done.registration) {
        let what = "registrations; between their vectors off the map:";
        text += &line(folder, what, [r.error.mean_mm, r.error.p99_mm, r.error.max_mm]);
    }
    screen.result(&done, &text);
    Ok(End::Done)
}
