//! The grid on which a warped CT is written.

use crate::Error;
use crate::commands::{input, usage};
use supine_mesh::Deformation;
use supine_space::{Grid, Vector};

/// Other voxels than those of the CT, along its axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OutputGrid {
    /// Voxels this long, mm.
    pub spacing_mm: Option<[f64; 3]>,
    /// Only the box of the tissue, before and after, and this much around it, mm.
    pub around_mm: Option<f64>,
    /// Only slices between these positions, mm along the slice axis; beyond the CT is air.
    pub axial_mm: Option<[f64; 2]>,
}

/// Voxels along an axis, in the index of the CT.
#[derive(Clone, Copy, Debug)]
struct Axis {
    /// Where the first voxel begins and the last ends.
    low: f64,
    high: f64,
}

impl OutputGrid {
    /// Whether another grid than the CT's is asked for.
    pub(super) fn is_other(&self) -> bool {
        *self != Self::default()
    }

    /// The grid that is asked for, given that of the CT.
    pub(super) fn of(&self, ct: &Grid, deformation: &Deformation) -> Result<Grid, Error> {
        let spacing: Vector = self.spacing_mm.map_or(ct.spacing(), Vector::from);
        if self.spacing_mm.is_some() && spacing.iter().any(|s| !(0.05..=50.0).contains(s)) {
            return Err(usage("--spacing: each must be 0.05 to 50 mm"));
        }
        let mut axes = ct.size().map(|n| Axis { low: -0.5, high: n as f64 - 0.5 });
        if let Some(margin) = self.around_mm {
            around(&mut axes, ct, deformation, margin)?;
        }
        if let Some(ends) = self.axial_mm {
            axes[2] = slices(ct, ends, self.spacing_mm.map(|s| s[2]))?;
        }
        let scale = spacing.component_div(&ct.spacing());
        let first = [0, 1, 2].map(|a| axes[a].low + 0.5 * scale[a]);
        let size = [0, 1, 2].map(|a| {
            let voxels = (axes[a].high - axes[a].low) / scale[a];
            ((voxels - 1e-6).ceil() as usize).max(2)
        });
        let origin = ct.patient_from_index(first);
        Grid::new(size, spacing, origin, *ct.direction())
            .map_err(|e| usage(format!("--spacing, --around, --axial: {e}")))
    }
}

/// The box of the tissue before and after, and `margin` mm around it, within the CT and on its
/// voxels.
fn around(
    axes: &mut [Axis; 3],
    ct: &Grid,
    deformation: &Deformation,
    margin: f64,
) -> Result<(), Error> {
    if !(0.0..=1000.0).contains(&margin) {
        return Err(usage("--around: expected 0 to 1000 mm"));
    }
    let nodes = deformation.mesh().points().iter().zip(deformation.displacement().values());
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
            return Err(input("--around: the mesh lies outside the CT"));
        }
    }
    Ok(())
}

/// Slices with centres from one position to another, mm along the CT's slice axis: those of the
/// CT's grid nearest to that, or `spacing` mm apart.
fn slices(ct: &Grid, ends: [f64; 2], spacing: Option<f64>) -> Result<Axis, Error> {
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
        return Err(usage("--axial: expected two positions, mm, one slice to 5000 mm apart"));
    }
    let more = ((last - first) / step + 1e-6).floor();
    Ok(Axis { low: first - 0.5 * step, high: first + (more + 0.5) * step })
}
