//! The deformation gradient of a mesh under its displacement.

use rayon::prelude::*;
use supine_mesh::{Displacement, Edges, Order, TetMesh};
use supine_record::Jacobian;
use supine_space::Matrix;

/// The deformation gradient F within one tetrahedron, d(deformed)/d(CT), without unit.
///
/// F is linear in the barycentric coordinates for quadratic displacements, so its values at the
/// corners say all.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gradient([Matrix; 4]);

impl Gradient {
    /// F = I + grad u.
    pub(crate) fn new(
        mesh: &TetMesh,
        edges: &Edges,
        displacement: &Displacement,
        tet: usize,
    ) -> Self {
        Self([0, 1, 2, 3].map(|at| {
            let corner = [0, 1, 2, 3].map(|a| if a == at { 1.0 } else { 0.0 });
            Matrix::identity() + displacement.gradient(mesh, edges, tet, corner)
        }))
    }

    /// det F at barycentric coordinates `l`.
    pub(crate) fn det(&self, l: [f64; 4]) -> f64 {
        let f: Matrix = (0..4).map(|a| self.0[a] * l[a]).sum();
        f.determinant()
    }
}

/// Points at which det F of a tetrahedron is looked at: the centre alone for linear displacement,
/// all points with quarter barycentric coordinates for quadratic (det F is then a cubic).
pub(crate) fn probes(order: Order) -> Vec<[f64; 4]> {
    if order == Order::Linear {
        return vec![[0.25; 4]];
    }
    let mut all = Vec::with_capacity(35);
    for a in 0..=4u8 {
        for b in 0..=4 - a {
            for c in 0..=4 - a - b {
                all.push([a, b, c, 4 - a - b - c].map(|n| f64::from(n) / 4.0));
            }
        }
    }
    all
}

/// Smallest det F of each tetrahedron over its [`probes`].
pub(crate) fn min_dets(mesh: &TetMesh, edges: &Edges, displacement: &Displacement) -> Vec<f64> {
    let probes = probes(displacement.order());
    (0..mesh.tets().len())
        .into_par_iter()
        .map(|tet| {
            let gradient = Gradient::new(mesh, edges, displacement, tet);
            probes.iter().map(|&l| gradient.det(l)).fold(f64::INFINITY, f64::min)
        })
        .collect()
}

/// Statistics of det F: extremes over all [`probes`], mean and percentiles weighted by the volume
/// of the tetrahedra in the CT; and the number of tetrahedra in which det F <= 0 somewhere.
pub(crate) fn statistics(
    mesh: &TetMesh,
    edges: &Edges,
    displacement: &Displacement,
) -> (Jacobian, usize) {
    let probes = probes(displacement.order());
    let (mut min, mut max, mut inverted) = (f64::INFINITY, f64::NEG_INFINITY, 0);
    let mut weighted: Vec<(f64, f64)> = Vec::with_capacity(mesh.tets().len() * probes.len());
    for tet in 0..mesh.tets().len() {
        let gradient = Gradient::new(mesh, edges, displacement, tet);
        let volume = mesh.volume(tet) / probes.len() as f64;
        let mut lowest = f64::INFINITY;
        for &l in &probes {
            let det = gradient.det(l);
            lowest = lowest.min(det);
            max = max.max(det);
            weighted.push((det, volume));
        }
        min = min.min(lowest);
        inverted += usize::from(lowest <= 0.0);
    }
    weighted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = weighted.iter().map(|w| w.1).sum();
    let percentile = |share: f64| {
        let mut sum = 0.0;
        let reached = weighted.iter().find(|w| {
            sum += w.1;
            sum >= share * total
        });
        reached.map_or(max, |w| w.0)
    };
    let mean = weighted.iter().map(|(det, volume)| det * volume).sum::<f64>() / total;
    (Jacobian { min, p01: percentile(0.01), mean, p99: percentile(0.99), max }, inverted)
}
