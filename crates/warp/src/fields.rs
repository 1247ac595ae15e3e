//! The map as vector fields on a grid, and its Jacobian.

use crate::coverage::{Coverage, Window, moving};
use crate::element::Gradient;
use crate::fade::Prepared;
use crate::map::{Map, check_grid};
use crate::pieces::{Parent, Pieces};
use crate::pullback::Pullback;
use crate::raster::{Raster, SLAB};
use crate::rows::Span;
use crate::{Error, Params, collar::Collar};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};
use supine_mesh::Deformation;
use supine_space::{Grid, Progress, Stopped, Vector};
use supine_volume::Volume;

/// The map of [`crate::warp`] on a grid.
#[derive(Clone, Debug)]
pub struct Fields {
    deformed_to_ct: Volume<[f32; 3]>,
    ct_to_deformed: Volume<[f32; 3]>,
    jacobian: Volume<f32>,
    /// Outside these, `deformed_to_ct` and `ct_to_deformed` are 0.
    deformed: Window,
    ct: Window,
}

impl Fields {
    /// Fields that were kept: those of [`fields`], as its accessors give them.
    ///
    /// # Errors
    /// [`Error::Grids`] when they do not share a grid.
    pub fn new(
        deformed_to_ct: Volume<[f32; 3]>,
        ct_to_deformed: Volume<[f32; 3]>,
        jacobian: Volume<f32>,
    ) -> Result<Self, Error> {
        let grid = deformed_to_ct.grid();
        if ct_to_deformed.grid() != grid || jacobian.grid() != grid {
            return Err(Error::Grids);
        }
        let (deformed, ct) = (moving(&deformed_to_ct), moving(&ct_to_deformed));
        Ok(Self { deformed_to_ct, ct_to_deformed, jacobian, deformed, ct })
    }

    /// At a voxel of the deformed CT: where its tissue was, minus where it is (LPS, mm). Resampling
    /// pulls values along this field. Zero outside the deformed mesh.
    pub fn deformed_to_ct(&self) -> &Volume<[f32; 3]> {
        &self.deformed_to_ct
    }

    /// At a voxel of the CT: the displacement of its tissue (LPS, mm). Points move along this
    /// field. Zero outside the mesh.
    pub fn ct_to_deformed(&self) -> &Volume<[f32; 3]> {
        &self.ct_to_deformed
    }

    /// At a voxel of the CT: det F of its tissue, the ratio of volumes after and before. One
    /// outside the mesh.
    pub fn jacobian(&self) -> &Volume<f32> {
        &self.jacobian
    }

    /// The vectors of `deformed_to_ct` that are not 0, row by row.
    pub(crate) fn backward(&self) -> impl ParallelIterator<Item = ([usize; 3], [f32; 3])> {
        vectors(&self.deformed_to_ct, self.deformed)
    }

    /// As [`Self::backward`], of `ct_to_deformed`.
    pub(crate) fn forward(&self) -> impl ParallelIterator<Item = ([usize; 3], [f32; 3])> {
        vectors(&self.ct_to_deformed, self.ct)
    }
}

/// The vectors of `field` that are not 0, all of them within `window`, in their order in memory.
fn vectors(
    field: &Volume<[f32; 3]>,
    window: Window,
) -> impl ParallelIterator<Item = ([usize; 3], [f32; 3])> {
    let Window { first, end } = window;
    let rows = if window.is_empty() { 0 } else { end[1] - first[1] };
    (first[2]..end[2]).into_par_iter().flat_map_iter(move |k| {
        (0..rows).flat_map(move |row| {
            let j = first[1] + row;
            let start = field.grid().offset([0, j, k]);
            let row = &field.data()[start + first[0]..start + end[0]];
            let moved = row.iter().enumerate().filter(|(_, v)| **v != [0.0; 3]);
            moved.map(move |(i, v)| ([first[0] + i, j, k], *v))
        })
    })
}

/// The map of [`crate::warp`] as fields on `grid`; the collar outside the skin is not part of it.
///
/// # Errors
/// When an axis of the grid has a single voxel, a parameter is out of range, or the user stopped.
pub fn fields(
    grid: &Grid,
    deformation: &Deformation,
    params: &Params,
    progress: Progress<'_>,
) -> Result<Fields, Error> {
    check_grid(grid)?;
    let prepared = Prepared::new(deformation, params)?;
    let curve = prepared.curve();
    let pieces = Pieces::new(&curve, params.curve_tolerance_mm, progress.part(0.0, 0.1))?;
    let map = Map::new([grid; 2], &pieces, &Collar::default());
    let gradients: Vec<Gradient> = (0..curve.mesh.tets().len())
        .into_par_iter()
        .map(|tet| Gradient::new(curve.mesh, curve.edges, curve.displacement, tet))
        .collect();
    progress.at(0.1)?;
    let size = grid.size();
    let slab = size[0] * size[1] * SLAB;
    // Memory that is asked for zeroed is not touched where nothing is written.
    let (mut back, mut forth) = (vec![[0f32; 3]; grid.len()], vec![[0f32; 3]; grid.len()]);
    let mut dets = vec![0f32; grid.len()];
    let raster = Raster::new(&map.deformed, &map.tets, size);
    let deformed = raster.whole();
    let side = Direction { raster: &raster, to: &map.rest, grid };
    let slabs = back.par_chunks_mut(slab);
    side.paint(
        slabs,
        progress.part(0.1, 0.5),
        |_| (),
        |out, at, owned| {
            out[at] = owned.way_mm(grid);
        },
    )?;
    let raster = Raster::new(&map.rest, &map.tets, size);
    let ct = raster.whole();
    let side = Direction { raster: &raster, to: &map.deformed, grid };
    let slabs = forth.par_chunks_mut(slab).zip(dets.par_chunks_mut(slab));
    let begin = |(_, dets): &mut (&mut [[f32; 3]], &mut [f32])| dets.fill(1.0);
    side.paint(slabs, progress.part(0.5, 1.0), begin, |(vectors, dets), at, owned| {
        let parent = &pieces.parents[owned.piece];
        let det = gradients[parent.tet as usize].det(within(parent, owned.weights));
        (vectors[at], dets[at]) = (owned.way_mm(grid), det as f32);
    })?;
    Ok(Fields {
        deformed_to_ct: Volume::new(grid.clone(), back)?,
        ct_to_deformed: Volume::new(grid.clone(), forth)?,
        jacobian: Volume::new(grid.clone(), dets)?,
        deformed,
        ct,
    })
}

/// Ways below this are those of tissue at rest, mm: places in indices up to 8192 are rounded to
/// 1e-12.
const ROUNDING_MM: f64 = 1e-9;

/// Barycentric coordinates in the parent from those in the piece.
fn within(parent: &Parent, weights: [f64; 4]) -> [f64; 4] {
    [0, 1, 2, 3].map(|c| (0..4).map(|v| weights[v] * f64::from(parent.corners[v][c])).sum())
}

/// A voxel and the piece that owns it.
struct Owned {
    piece: usize,
    /// Barycentric coordinates in the piece.
    weights: [f64; 4],
    /// The voxel and its place on the other side of the map, as indices.
    voxel: [f64; 3],
    place: [f64; 3],
}

impl Owned {
    /// From the voxel to its place on the other side, LPS, mm; exactly 0 where nothing but rounding
    /// moves it.
    fn way_mm(&self, grid: &Grid) -> [f32; 3] {
        let index = Vector::from([0, 1, 2].map(|a| self.place[a] - self.voxel[a]));
        let mm = grid.direction() * index.component_mul(&grid.spacing());
        if mm.amax() < ROUNDING_MM {
            return [0.0; 3];
        }
        [mm.x as f32, mm.y as f32, mm.z as f32]
    }
}

/// One direction of the map.
struct Direction<'a> {
    /// The pieces on the side on which voxels are owned.
    raster: &'a Raster<'a>,
    /// Their vertices on the other side.
    to: &'a [[f64; 3]],
    grid: &'a Grid,
}

impl Direction<'_> {
    /// Calls `begin` for each of `slabs`, and `write` for each voxel in them that is owned, with
    /// its place in the slab.
    fn paint<S: Send>(
        &self,
        slabs: impl IndexedParallelIterator<Item = S>,
        progress: Progress<'_>,
        begin: impl Fn(&mut S) + Sync,
        write: impl Fn(&mut S, usize, &Owned) + Sync,
    ) -> Result<(), Stopped> {
        let [ni, nj, nk] = self.grid.size();
        let done = AtomicUsize::new(0);
        slabs.enumerate().try_for_each(|(slab, mut out)| {
            begin(&mut out);
            let mut met = Coverage::new(self.raster.window(slab));
            self.raster.scan(slab, &mut |piece: usize, spans: &[Span]| {
                let target = self.raster.vertices_of(piece).map(|v| self.to[v]);
                let pullback = Pullback::new(self.raster.corners(piece), target);
                for span in spans.iter().flat_map(Span::voxels) {
                    if met.mark(&span) == 0 {
                        let [i, j, k] = [span.from, span.j, span.k].map(|n| n as usize);
                        let voxel = [i, j, k].map(|n| n as f64);
                        let (weights, place) = (pullback.weights(voxel), pullback.at(voxel));
                        let owned = Owned { piece, weights, voxel, place };
                        write(&mut out, ((k - slab * SLAB) * nj + j) * ni + i, &owned);
                    }
                }
            });
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            progress.at(done as f64 / nk.div_ceil(SLAB) as f64)
        })
    }
}
