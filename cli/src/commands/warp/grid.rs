//! The grid on which a warped CT is written.

use crate::args;
use crate::failure::Failure;
use supine_mesh::{Displacement, TetMesh};
use supine_space::{Grid, Vector};

/// Voxels along an axis, in the index of the CT.
#[derive(Clone, Copy, Debug)]
struct Axis {
    /// Where the first voxel begins and the last ends.
    low: f64,
    high: f64,
}

/// The grid that `args` ask for, along the axes of that of the CT; its own when they ask for none.
pub(super) fn output_grid(
    ct: &Grid,
    args: &args::Warp,
    map: (&TetMesh, &Displacement),
) -> Result<Grid, Failure> {
    let refused = |option: &str, reason: String| Failure::usage(format!("{option}: {reason}"));
    let spacing: Vector = args.spacing.as_ref().map_or(ct.spacing(), |s| s.0.into());
    if args.spacing.is_some() && spacing.iter().any(|s| !(0.05..=50.0).contains(s)) {
        return Err(refused("--spacing", "each must be 0.05 to 50 mm".into()));
    }
    let mut axes = ct.size().map(|n| Axis { low: -0.5, high: n as f64 - 0.5 });
    if let Some(margin) = args.around {
        around(&mut axes, ct, map, margin)?;
    }
    if let Some(axial) = &args.axial {
        axes[2] = slices(ct, axial.0, args.spacing.as_ref().map(|s| s.0[2]))?;
    }
    let scale = spacing.component_div(&ct.spacing());
    let first = [0, 1, 2].map(|a| axes[a].low + 0.5 * scale[a]);
    let size = [0, 1, 2].map(|a| {
        let voxels = (axes[a].high - axes[a].low) / scale[a];
        ((voxels - 1e-6).ceil() as usize).max(2)
    });
    let origin = ct.patient_from_index(first);
    Grid::new(size, spacing, origin, *ct.direction())
        .map_err(|e| refused("--spacing, --around, --axial", e.to_string()))
}

/// The box of the tissue before and after, and `margin` mm around it, within the CT and on its voxels.
fn around(
    axes: &mut [Axis; 3],
    ct: &Grid,
    (mesh, displacement): (&TetMesh, &Displacement),
    margin: f64,
) -> Result<(), Failure> {
    if !(0.0..=1000.0).contains(&margin) {
        return Err(Failure::usage("--around: expected 0 to 1000 mm".to_owned()));
    }
    let nodes = mesh.points().iter().zip(displacement.values());
    let places: Vec<[f64; 3]> =
        nodes.flat_map(|(p, u)| [*p, p + u]).map(|p| ct.index_from_patient(&p)).collect();
    for (a, axis) in axes.iter_mut().enumerate() {
        let more = margin / ct.spacing()[a];
        let along = || places.iter().map(|p| p[a]);
        let low = along().fold(f64::INFINITY, f64::min) - more;
        let high = along().fold(f64::NEG_INFINITY, f64::max) + more;
        axis.low = axis.low.max((low + 0.5).floor() - 0.5);
        axis.high = axis.high.min((high + 0.5).ceil() - 0.5);
        if axis.low >= axis.high {
            return Err(Failure::input("--around: the mesh lies outside the CT".to_owned()));
        }
    }
    Ok(())
}

/// Slices with centres from one position to another, mm along the CT's slice axis: those of the CT's grid nearest to
/// that, or `spacing` mm apart.
fn slices(ct: &Grid, ends: [f64; 2], spacing: Option<f64>) -> Result<Axis, Failure> {
    let [from, to] = ends;
    let step = spacing.unwrap_or(ct.spacing().z) / ct.spacing().z;
    // Along the patient's z for axial slices; the axis may point either way.
    let normal = ct.direction().column(2).into_owned();
    let towards = if normal.z < 0.0 { -1.0 } else { 1.0 };
    let origin = ct.patient_from_index([0.0; 3]).coords.dot(&normal);
    let index = |position: f64| (towards * position - origin) / ct.spacing().z;
    let nearest = |i: f64| if spacing.is_some() { i } else { i.round() };
    let (first, last) = (nearest(index(from.min(to))), nearest(index(from.max(to))));
    let (first, last) = (first.min(last), first.max(last));
    if !(step..=5000.0 / ct.spacing().z).contains(&(last - first)) {
        let reason = "expected two positions, mm, one slice to 5000 mm apart";
        return Err(Failure::usage(format!("--axial: {reason}")));
    }
    let more = ((last - first) / step + 1e-6).floor();
    Ok(Axis { low: first - 0.5 * step, high: first + (more + 0.5) * step })
}
