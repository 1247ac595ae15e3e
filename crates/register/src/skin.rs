//! The skin of a CT as a surface of triangles.

use crate::shape::vertex_normals;
use rayon::prelude::*;
use supine_space::{Point, Vector};
use supine_volume::{Layers, SignedDistance, isosurface};

/// Distance of the points of a skin from each other, mm.
pub const SKIN_SPACING_MM: f64 = 2.5;
/// So near to the end of the CT the skin is not known, mm.
const END_MM: f64 = 6.0;

/// The skin of a CT where it was seen: triangles between the voxels, counter-clockwise from
/// outside.
#[derive(Clone, Debug)]
pub struct Skin {
    points: Vec<Point>,
    triangles: Vec<[u32; 3]>,
    normals: Vec<Vector>,
}

impl Skin {
    /// The largest piece of the zero level of a distance that is negative inside the body, less
    /// what lies at the end of the CT. Values between voxels are trilinear, on a grid of
    /// [`SKIN_SPACING_MM`] along the CT's axes.
    pub fn of(distance: &SignedDistance) -> Self {
        let grid = distance.grid();
        let step = grid.spacing().map(|s| SKIN_SPACING_MM / s);
        let count =
            [0, 1, 2].map(|a| ((grid.size()[a] as f64 - 1.0) / step[a]).floor() as usize + 1);
        let at = |v: [usize; 3]| grid.patient_from_index([0, 1, 2].map(|a| v[a] as f64 * step[a]));
        let layer = |k: usize| -> Vec<f32> {
            let row = |j: usize| (0..count[0]).map(move |i| distance.at(&at([i, j, k])) as f32);
            (0..count[1]).flat_map(row).collect()
        };
        let values: Vec<Vec<f32>> = (0..count[2]).into_par_iter().map(layer).collect();
        let (points, triangles) =
            isosurface(&Layers { size: [count[0], count[1]], values: &values }, at);
        let inner = |p: &Point| {
            let v = grid.index_from_patient(p);
            (0..3).all(|a| {
                let margin = END_MM / grid.spacing()[a];
                v[a] > margin && v[a] < grid.size()[a] as f64 - 1.0 - margin
            })
        };
        let seen: Vec<bool> = points.par_iter().map(inner).collect();
        Self::piece(&points, triangles, &seen)
    }

    /// The largest piece of a surface within what was seen.
    fn piece(points: &[Point], mut triangles: Vec<[u32; 3]>, seen: &[bool]) -> Self {
        triangles.retain(|t| t.iter().all(|&p| seen[p as usize]));
        let piece = pieces(points.len(), &triangles);
        let mut count = vec![0usize; points.len()];
        triangles.iter().for_each(|t| count[piece[t[0] as usize] as usize] += 1);
        let largest = (0..points.len()).max_by_key(|&p| (count[p], std::cmp::Reverse(p)));
        triangles.retain(|t| Some(piece[t[0] as usize] as usize) == largest);
        let mut place = vec![u32::MAX; points.len()];
        let mut kept = Vec::new();
        for corner in triangles.iter_mut().flatten() {
            let old = *corner as usize;
            if place[old] == u32::MAX {
                place[old] = kept.len() as u32;
                kept.push(points[old]);
            }
            *corner = place[old];
        }
        let normals = vertex_normals(&kept, &triangles);
        Self { points: kept, triangles, normals }
    }

    /// Points, LPS, mm.
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// Triangles.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Unit normals at the points, outwards.
    pub fn normals(&self) -> &[Vector] {
        &self.normals
    }
}

/// The lowest point of the piece that each point belongs to.
fn pieces(points: usize, triangles: &[[u32; 3]]) -> Vec<u32> {
    let mut parent: Vec<u32> = (0..points as u32).collect();
    fn root(parent: &mut [u32], mut p: u32) -> u32 {
        while parent[p as usize] != p {
            parent[p as usize] = parent[parent[p as usize] as usize];
            p = parent[p as usize];
        }
        p
    }
    for t in triangles {
        let [a, b, c] = t.map(|p| root(&mut parent, p));
        let low = a.min(b).min(c);
        [a, b, c].into_iter().for_each(|p| parent[p as usize] = low);
    }
    (0..points as u32).map(|p| root(&mut parent, p)).collect()
}
