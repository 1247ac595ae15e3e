//! What is looked at in a mesh and a displacement that the caller has, before anything rests on
//! them: whether they lie in the tissue, and are in the axes, the unit and the order that they are
//! taken for.

use super::readings::other_reading;
use crate::Error;
use rayon::prelude::*;
use supine_mesh::{Deformation, Edges, Order, TetMesh, det_f};
use supine_space::{Failure, Point, Vector, Warning};
use supine_volume::{LabelMap, label};

/// A mesh of which less lies in the soft tissue is of something else.
const LEAST_SHARE: f64 = 0.5;
/// A mesh of which less lies in the soft tissue is told.
const TOLD_SHARE: f64 = 0.9;
/// The middle of an edge lies off the mean of its ends by a small part of the difference between
/// them when the field is smooth; rows in another order are off by more than this part.
const OFF_MIDDLE: f64 = 1.0;
/// A pull to the patient's side below this, as a share of gravity, says nothing of a displacement's
/// direction: 2 degrees.
const LEAST_PULL: f64 = 0.035;
/// A largest displacement below this, mm, is told: it may be in another unit.
const TINY_MM: f64 = 0.05;

/// Looks at where a mesh lies; what is doubtful.
///
/// # Errors
/// When less than half of it lies in the soft tissue: with the axes or the unit in which it would.
pub(crate) fn check_mesh(mesh: &TetMesh, labels: &LabelMap) -> Result<Vec<Warning>, Error> {
    let share = share_in_tissue(mesh, labels, |p| p);
    if share >= TOLD_SHARE {
        return Ok(Vec::new());
    }
    let percent = 100.0 * share;
    if share >= LEAST_SHARE {
        let text = format!(
            "{percent:.0} % of the given mesh lie in the soft tissue of the labels: where it does not, air or chest wall \
             moves with it"
        );
        return Ok(vec![Warning::new("mesh-beside-tissue", text)]);
    }
    let fits = other_reading(|read| share_in_tissue(mesh, labels, read) >= TOLD_SHARE);
    let hint = fits.map_or("it is of another CT, or displaced".into(), |reading| {
        format!("it would lie there if it is {reading}")
    });
    Err(refused(format!(
        "{percent:.0} % of the given mesh lie in the soft tissue of the labels, and it must be most of it: {hint} (points are \
         LPS, mm, in the shape of the CT)"
    )))
}

/// The share of a mesh's volume that lies in the soft tissue, when its points are read in some way.
fn share_in_tissue(mesh: &TetMesh, labels: &LabelMap, read: impl Fn(Point) -> Point) -> f64 {
    let is_tissue = |p: &Point| {
        labels.grid().voxel_at(p).is_some_and(|voxel| label::is_soft_tissue(labels.at(voxel)))
    };
    let middle =
        |tet: usize| Point::from(mesh.corners(tet).iter().map(|p| p.coords).sum::<Vector>() / 4.0);
    let inside = (0..mesh.tets().len()).filter(|tet| is_tissue(&read(middle(*tet))));
    inside.map(|tet| mesh.volume(tet)).sum::<f64>() / mesh.total_volume()
}

/// Looks at a displacement; what is doubtful. `pull` is the table's gravity minus that of the CT,
/// LPS.
///
/// # Errors
/// When the rows of its edges are in another order, or it turns tetrahedra inside out.
pub(crate) fn check_displacement(
    deformation: &Deformation,
    pull: &Vector,
) -> Result<Vec<Warning>, Error> {
    let (mesh, displacement) = (deformation.mesh(), deformation.displacement());
    let edges = Edges::new(mesh);
    if displacement.order() == Order::Quadratic && off_middle(deformation, &edges) > OFF_MIDDLE {
        return Err(refused(
            "the given displacement has rows for the edges that do not lie between those of their ends: after the points comes \
             one row for the middle of each edge, sorted by the edge's (lower, higher) point, not in the order of a file of \
             quadratic tetrahedra"
                .into(),
        ));
    }
    let folded: Vec<usize> = (0..mesh.tets().len())
        .into_par_iter()
        .filter(|tet| folds(deformation, &edges, *tet))
        .collect();
    if let Some(first) = folded.first() {
        let [x, y, z] = mesh.corners(*first)[0].coords.into();
        return Err(refused(format!(
            "the given displacement turns {} of {} tetrahedra inside out, the first at [{x:.1}, {y:.1}, {z:.1}] mm (LPS): no image \
             can be warped by it; is it in mm, LPS, from the shape of the CT?",
            folded.len(),
            mesh.tets().len()
        )));
    }
    Ok(doubts(displacement.max_norm(), displacement.values(), pull))
}

/// A displacement that may be in another unit or in other axes.
fn doubts(largest_mm: f64, vectors: &[Vector], pull: &Vector) -> Vec<Warning> {
    let mean = vectors.iter().sum::<Vector>() / vectors.len() as f64;
    let mut doubts = Vec::new();
    if largest_mm > 0.0 && largest_mm < TINY_MM {
        let text = format!(
            "the given displacement is {largest_mm:.1e} mm at most: displacements are in mm, not in metres"
        );
        doubts.push(Warning::new("displacement-tiny", text));
    }
    let to_the_other_side = pull.x.abs() > LEAST_PULL
        && mean.x.abs() > 0.1 * mean.norm()
        && mean.x.signum() != pull.x.signum();
    if mean.dot(pull) < 0.0 || to_the_other_side {
        let text = "the given displacement moves the tissue against the table's gravity: is it in RAS, or from the table to \
                    the CT? Displacements are in LPS, from the CT to the table";
        doubts.push(Warning::new("displacement-against-gravity", text));
    }
    doubts
}

/// How far the middles of edges lie off the mean of their ends, in parts of the difference between
/// the ends: means over all edges.
fn off_middle(deformation: &Deformation, edges: &Edges) -> f64 {
    let (of_points, of_edges) =
        deformation.displacement().values().split_at(deformation.mesh().points().len());
    let (mut off, mut apart) = (0.0, 0.0);
    for ([a, b], middle) in edges.ends().iter().zip(of_edges) {
        let [a, b] = [of_points[*a as usize], of_points[*b as usize]];
        off += (middle - (a + b) / 2.0).norm();
        apart += (a - b).norm();
    }
    if off > 0.0 { off / apart } else { 0.0 }
}

/// Whether a tetrahedron is turned inside out where its stiffness is integrated.
fn folds(deformation: &Deformation, edges: &Edges, tet: usize) -> bool {
    // The places of four for polynomials of the second degree; for constants one would do.
    const PLACES: [[f64; 4]; 4] = {
        const NEAR: f64 = 0.585_410_196_624_968_5;
        const FAR: f64 = 0.138_196_601_125_010_5;
        [[NEAR, FAR, FAR, FAR], [FAR, NEAR, FAR, FAR], [FAR, FAR, NEAR, FAR], [FAR, FAR, FAR, NEAR]]
    };
    let (mesh, displacement) = (deformation.mesh(), deformation.displacement());
    PLACES.into_iter().any(|at| det_f(mesh, edges, displacement, tet, at) <= 0.0)
}

fn refused(message: String) -> Error {
    Error::Refused { kind: Failure::Input, message }
}
