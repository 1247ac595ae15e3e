//! Pieces that are kept while a quadratic displacement changes: halved where they no longer follow
//! it, and never joined again.

use crate::pieces::{Curve, MAX_PIECES, Pieces, difference};
use rayon::prelude::*;
use supine_mesh::{Order, TET_EDGES};
use supine_space::{Grid, Point, Progress, Stopped, Vector};

/// Pieces that miss the displacement by more than the tolerance are made to miss it by this share
/// of it: the tissue may move on before they are halved again.
const TIGHTER: f64 = 0.5;
/// A tetrahedron matters from so many voxels outside of the grid on.
const BESIDE: f64 = 1.0;

/// What is known of pieces that are seen on a grid.
#[derive(Debug)]
pub(crate) struct Kept {
    grid: Grid,
    /// The edges of the pieces: their tetrahedron, and how they lead in its barycentric
    /// coordinates. Of equal ones, which bulge alike, one.
    edges: Vec<(u32, [f32; 4])>,
}

impl Kept {
    /// Of pieces of which nothing is known yet.
    pub(crate) fn new(grid: Grid, pieces: &Pieces) -> Self {
        Self { grid, edges: edges(pieces) }
    }

    /// Gives the pieces another displacement of their mesh and halves those that are seen and miss
    /// it; whether all stayed.
    pub(crate) fn follow(
        &mut self,
        pieces: &mut Pieces,
        curve: &Curve<'_>,
        tolerance_mm: f64,
    ) -> Result<bool, Stopped> {
        pieces.take(curve);
        if curve.displacement.order() == Order::Linear {
            return Ok(true);
        }
        let seen: Vec<bool> =
            (0..curve.mesh.tets().len()).into_par_iter().map(|tet| self.sees(curve, tet)).collect();
        // Where they were too many they are not tried again and again for the same displacement.
        let tolerance_mm = pieces.missed_mm.unwrap_or(0.0).max(tolerance_mm);
        let misses = |(tet, way): &(u32, [f32; 4])| {
            let tet = *tet as usize;
            seen[tet] && curve.error_mm(&curve.bulge(tet, *way)) > tolerance_mm
        };
        if !self.edges.par_iter().with_min_len(4096).any(misses) {
            return Ok(true);
        }
        let tight = TIGHTER * tolerance_mm;
        let matter = |tet: usize| seen[tet];
        let halved = pieces.refine(MAX_PIECES, curve, tight, matter, Progress::none())?;
        self.edges = edges(pieces);
        Ok(!halved)
    }

    /// Whether a tetrahedron, moved, reaches the grid. It lies among the control points of its
    /// Bézier form.
    fn sees(&self, curve: &Curve<'_>, tet: usize) -> bool {
        let values = curve.displacement.values();
        let corners = curve.mesh.tets()[tet].map(|p| {
            let p = p as usize;
            curve.mesh.points()[p] + values[p]
        });
        let middles = TET_EDGES.map(|[a, b]| {
            let mut way = [0.0; 4];
            (way[a], way[b]) = (1.0, -1.0);
            let chord: Vector = (corners[a].coords + corners[b].coords) * 0.5;
            Point::from(chord + curve.bulge(tet, way) * 2.0)
        });
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for point in corners.iter().chain(&middles) {
            let at = self.grid.index_from_patient(point);
            for axis in 0..3 {
                low[axis] = low[axis].min(at[axis]);
                high[axis] = high[axis].max(at[axis]);
            }
        }
        let last = self.grid.size().map(|n| (n - 1) as f64);
        (0..3).all(|axis| high[axis] >= -BESIDE && low[axis] <= last[axis] + BESIDE)
    }
}

fn edges(pieces: &Pieces) -> Vec<(u32, [f32; 4])> {
    let of_piece = |parent: &crate::pieces::Parent| {
        let parent = *parent;
        TET_EDGES.into_iter().map(move |[a, b]| {
            let way = difference(parent.corners[a], parent.corners[b]);
            // Both directions are the same edge.
            let first = way.iter().copied().find(|d| *d != 0.0).unwrap_or(0.0);
            // A zero keeps its plus.
            (parent.tet, if first < 0.0 { way.map(|d| 0.0 - d) } else { way })
        })
    };
    let mut edges: Vec<(u32, [f32; 4])> =
        pieces.parents.par_iter().flat_map_iter(of_piece).collect();
    let order = |(tet, way): &(u32, [f32; 4])| (*tet, way.map(f32::to_bits));
    edges.par_sort_unstable_by_key(order);
    edges.dedup_by_key(|edge| order(edge));
    edges
}
