//! A displacement carried from a mesh to its coarser one and back.

use crate::tests::{dome, labelled, sphere};
use crate::{Domain, Params, Refinement, coarsen};
use std::sync::Arc;
use supine_mesh::{Deformation, Displacement, Edges, Order, TetMesh, transfer};
use supine_space::{Matrix, Point, Progress, Vector};
use supine_volume::Region;

fn displacement(mesh: &TetMesh, order: Order, field: impl Fn(&Point) -> Vector) -> Displacement {
    let edges = Edges::new(mesh);
    let mut values: Vec<Vector> = mesh.points().iter().map(&field).collect();
    if order == Order::Quadratic {
        let at = |p: u32| mesh.points()[p as usize];
        let middle = |[a, b]: &[u32; 2]| at(*a) + 0.5 * (at(*b) - at(*a));
        values.extend(edges.ends().iter().map(|ends| field(&middle(ends))));
    }
    Displacement::new(mesh, &edges, values).unwrap()
}

/// Largest difference of two displacements of one mesh, mm.
fn difference(a: &Displacement, b: &Displacement) -> f64 {
    let both = a.values().iter().zip(b.values());
    both.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

#[test]
fn what_is_carried_to_a_coarser_mesh_comes_back() {
    let labels = labelled(Matrix::identity(), dome);
    let region = Region::new(Arc::new(labels.clone()), sphere()).unwrap();
    let domain = Domain::new(&region, &Params::default(), Progress::none()).unwrap();
    let (fine, _) = domain.mesh(6000, Progress::none()).unwrap();
    let (remade, _) = domain.mesh(1200, Progress::none()).unwrap();
    let (coarsened, _) = coarsen(&fine, 1200, &Refinement::None, Progress::none()).unwrap();
    let away = |p: &Point| p - sphere().centre();
    // Twelve millimetres across the region, bent: more than a table's tilt does.
    let bent = |p: &Point| {
        let v = away(p) / 30.0;
        Vector::new(4.0 * v.x - 2.0 * v.y, 6.0 * v.z + 1.5 * v.x * v.y, 3.0 * v.y * v.y - v.x)
    };
    let fine = Arc::new(fine);
    for coarse in [remade, coarsened].map(Arc::new) {
        for (order, off) in [(Order::Linear, 0.6), (Order::Quadratic, 1e-9)] {
            let there = displacement(&fine, order, bent);
            let given = Deformation::new(Arc::clone(&fine), there.clone()).unwrap();
            let carried = transfer(&given, Arc::clone(&coarse)).unwrap();
            let exact = displacement(&coarse, order, bent);
            assert!(difference(carried.displacement(), &exact) < off, "{order:?}");
            let back = transfer(&carried, Arc::clone(&fine)).unwrap();
            let error = difference(back.displacement(), &there);
            assert!(error < off, "{order:?}: {error}");
        }
    }
}
