//! The map as vector fields on a grid, and its Jacobian.

use crate::coverage::Coverage;
use crate::element::Gradient;
use crate::map::{Map, Prepared, check_grid};
use crate::pieces::{Curve, Parent, Pieces};
use crate::pullback::Pullback;
use crate::raster::{Raster, SLAB};
use crate::rows::Span;
use crate::{Error, Params, collar::Collar};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};
use supine_mesh::{Displacement, TetMesh};
use supine_space::{Grid, Progress, Stopped, Vector};
use supine_volume::Volume;

/// The map of [`crate::warp`] on a grid.
#[derive(Clone, Debug)]
pub struct Fields {
    /// At a voxel of the deformed CT: where its tissue was, minus where it is (LPS, mm). Resampling
    /// pulls values along this field. Zero outside the deformed mesh.
    pub deformed_to_ct: Volume<[f32; 3]>,
    /// At a voxel of the CT: the displacement of its tissue (LPS, mm). Points move along this
    /// field. Zero outside the mesh.
    pub ct_to_deformed: Volume<[f32; 3]>,
    /// At a voxel of the CT: det F of its tissue, the ratio of volumes after and before. One
    /// outside the mesh.
    pub jacobian: Volume<f32>,
}

/// The map of [`crate::warp`] as fields on `grid`; the collar outside the skin is not part of it.
///
/// # Errors
/// When the displacement belongs to another mesh, an axis of the grid has a single voxel, a
/// parameter is out of range, or the user stopped.
pub fn fields(
    grid: &Grid,
    mesh: &TetMesh,
    displacement: &Displacement,
    params: &Params,
    progress: Progress<'_>,
) -> Result<Fields, Error> {
    check_grid(grid)?;
    let Prepared { edges, displacement, .. } = Prepared::new(mesh, displacement, params)?;
    let curve = Curve { mesh, edges: &edges, displacement: &displacement };
    let pieces = Pieces::new(&curve, params.curve_tolerance_mm, progress.part(0.0, 0.1))?;
    let map = Map::new([grid; 2], &pieces, &Collar::default());
    let gradients: Vec<Gradient> = (0..mesh.tets().len())
        .into_par_iter()
        .map(|tet| Gradient::new(mesh, &edges, &displacement, tet))
        .collect();
    progress.at(0.1)?;
    let backward = Side { from: &map.deformed, to: &map.rest, map: &map, grid };
    let forward = Side { from: &map.rest, to: &map.deformed, map: &map, grid };
    let deformed_to_ct =
        backward.paint([0.0; 3], progress.part(0.1, 0.5), |_, p, q, _| difference(grid, p, q))?;
    let both =
        forward.paint(([0.0; 3], 1.0), progress.part(0.5, 1.0), |piece, p, q, weights| {
            let parent = &pieces.parents[piece];
            let det = gradients[parent.tet as usize].det(within(parent, weights));
            (difference(grid, p, q), det as f32)
        })?;
    Ok(Fields { deformed_to_ct, ct_to_deformed: both.map(|b| b.0), jacobian: both.map(|b| b.1) })
}

/// Barycentric coordinates in the parent from those in the piece.
fn within(parent: &Parent, weights: [f64; 4]) -> [f64; 4] {
    [0, 1, 2, 3].map(|c| (0..4).map(|v| weights[v] * f64::from(parent.corners[v][c])).sum())
}

/// q - p in patient space, mm, from continuous indices.
fn difference(grid: &Grid, p: [f64; 3], q: [f64; 3]) -> [f32; 3] {
    let index = Vector::from([0, 1, 2].map(|a| q[a] - p[a]));
    let mm = grid.direction() * index.component_mul(&grid.spacing());
    [mm.x as f32, mm.y as f32, mm.z as f32]
}

/// One direction of the map: voxels are owned on the `from` side.
struct Side<'a> {
    from: &'a [[f64; 3]],
    to: &'a [[f64; 3]],
    map: &'a Map,
    grid: &'a Grid,
}

impl Side<'_> {
    /// The volume of `value(piece, voxel, its place on the other side, barycentric coordinates)`
    /// for owned voxels, `outside` elsewhere.
    fn paint<T: Copy + Send + Sync>(
        &self,
        outside: T,
        progress: Progress<'_>,
        value: impl Fn(usize, [f64; 3], [f64; 3], [f64; 4]) -> T + Sync,
    ) -> Result<Volume<T>, Error> {
        let size = self.grid.size();
        let [ni, nj, nk] = size;
        let raster = Raster::new(self.from, &self.map.tets, size);
        let target = |tet: usize| self.map.tets[tet].map(|v| self.to[v as usize]);
        let mut volume = Volume::from_fn(self.grid.clone(), |_| outside);
        let done = AtomicUsize::new(0);
        let slabs = volume.data_mut().par_chunks_mut(ni * nj * SLAB).enumerate();
        slabs.try_for_each(|(slab, out)| -> Result<(), Stopped> {
            let mut met = Coverage::new(raster.window(slab));
            raster.scan(slab, &mut |tet: usize, spans: &[Span]| {
                let pullback = Pullback::new(raster.corners(tet), target(tet));
                for voxel in spans.iter().flat_map(Span::voxels) {
                    if met.mark(&voxel) == 0 {
                        let [i, j, k] = [voxel.from, voxel.j, voxel.k].map(|n| n as usize);
                        let p = [i, j, k].map(|n| n as f64);
                        out[((k - slab * SLAB) * nj + j) * ni + i] =
                            value(tet, p, pullback.at(p), pullback.weights(p));
                    }
                }
            });
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            progress.at(done as f64 / nk.div_ceil(SLAB) as f64)
        })?;
        Ok(volume)
    }
}
