//! A CT carried again and again by displacements that change.

use crate::collar::{Collar, Skin};
use crate::coverage::Coverage;
use crate::kept::Kept;
use crate::kernel::{Kernel, Source};
use crate::map::{Map, check_grid};
use crate::pieces::{Curve, Pieces};
use crate::raster::SLAB;
use crate::resample::Resampling;
use crate::rules::Rules;
use crate::{BODY_HU, Error, Params, undeformed};
use rayon::prelude::*;
use std::sync::Arc;
use supine_mesh::{Deformation, Displacement, Edges, Order, TetMesh};
use supine_space::{Grid, Progress};
use supine_volume::Ct;

/// A CT and a mesh in it whose displacement changes from frame to frame.
///
/// Only voxels that the frame before changed are restored, and what does not change is prepared
/// once.
#[derive(Debug)]
pub struct Frames {
    ct: Arc<Ct>,
    /// The CT on the grid of the frames, carried by nothing.
    still: Arc<Ct>,
    mesh: Arc<TetMesh>,
    edges: Edges,
    params: Params,
    /// The pieces of the last frame, the skin and collar on them, and their map.
    pieces: Pieces,
    /// When pieces are kept from frame to frame.
    kept: Option<Kept>,
    skin: Skin,
    collar: Collar,
    map: Map,
    resampling: Resampling,
    /// What the last frame changed, slab by slab.
    written: Vec<Coverage>,
}

impl Frames {
    /// Prepares `ct`, LPS, with `mesh` in it; frames have its grid.
    ///
    /// # Errors
    /// When an axis of the CT cannot be sampled or a parameter is out of range.
    pub fn new(ct: Arc<Ct>, mesh: Arc<TetMesh>, params: &Params) -> Result<Self, Error> {
        let still = Arc::clone(&ct);
        Self::prepared(ct, still, mesh, params)
    }

    /// The same with frames on another grid, LPS, which may hold a part of the tissue alone; air
    /// where there is no CT.
    ///
    /// The pieces that follow a quadratic displacement are kept from frame to frame and made finer
    /// where they miss it in the grid by more than [`Params::curve_tolerance_mm`]: within it, a
    /// frame depends on those before.
    ///
    /// # Errors
    /// When an axis of the CT or the grid cannot be sampled or a parameter is out of range.
    pub fn onto(
        ct: Arc<Ct>,
        grid: &Grid,
        mesh: Arc<TetMesh>,
        params: &Params,
    ) -> Result<Self, Error> {
        params.check()?;
        check_grid(grid)?;
        let still = Arc::new(undeformed::onto(grid, &ct, params, Progress::none())?);
        let mut frames = Self::prepared(ct, still, mesh, params)?;
        frames.kept = Some(Kept::new(grid.clone(), &frames.pieces));
        Ok(frames)
    }

    fn prepared(
        ct: Arc<Ct>,
        still: Arc<Ct>,
        mesh: Arc<TetMesh>,
        params: &Params,
    ) -> Result<Self, Error> {
        params.check()?;
        check_grid(ct.grid())?;
        let edges = Edges::new(&mesh);
        let zero = Displacement::zero(&mesh);
        let curve = Curve { mesh: &mesh, edges: &edges, displacement: &zero };
        let pieces = Pieces::new(&curve, params.curve_tolerance_mm, Progress::none())?;
        let skin = Skin::new(&ct, &pieces, params.collar_mm);
        let collar = skin.collar(&pieces);
        let map = Map::new([ct.grid(), still.grid()], &pieces, &collar);
        let resampling = resampling(&ct, still.grid(), &map, params);
        let (params, written) = (params.clone(), Vec::new());
        Ok(Self {
            ct,
            still,
            mesh,
            edges,
            params,
            pieces,
            kept: None,
            skin,
            collar,
            map,
            resampling,
            written,
        })
    }

    /// The frame of no displacement.
    pub fn still(&self) -> &Arc<Ct> {
        &self.still
    }

    /// The mesh in the CT.
    pub fn mesh(&self) -> &Arc<TetMesh> {
        &self.mesh
    }

    /// The edges of the mesh.
    pub fn edges(&self) -> &Edges {
        &self.edges
    }

    /// Makes `frame`, which holds [`Frames::still`] or the frame before, the CT carried by a
    /// deformation of the mesh.
    ///
    /// The displacement is taken as it is: to let it fade towards the cut, give what
    /// [`crate::fade`] makes of it.
    ///
    /// # Errors
    /// When it is one of another mesh.
    ///
    /// # Panics
    /// When `frame` has another number of voxels than the grid of the frames.
    pub fn next(&mut self, deformation: &Deformation, frame: &mut Ct) -> Result<(), Error> {
        self.restore(frame);
        self.paint(deformation, frame)
    }

    /// Makes `frame` [`Frames::still`] again.
    ///
    /// # Panics
    /// When `frame` has another number of voxels than the grid of the frames.
    pub fn restore(&mut self, frame: &mut Ct) {
        let (source, out) = (self.still.data(), frame.data_mut());
        assert_eq!(source.len(), out.len(), "a frame has the voxels of its grid");
        let [ni, nj, _] = self.still.grid().size();
        let slab = ni * nj * SLAB;
        let slabs = out.par_chunks_mut(slab).zip(source.par_chunks(slab)).enumerate();
        slabs.zip(&self.written).for_each(|((slab, (out, source)), written)| {
            for row in written.hulls() {
                let start = ((row.k as usize - slab * SLAB) * nj + row.j as usize) * ni;
                let row = start + row.from as usize..start + row.to as usize;
                out[row.clone()].copy_from_slice(&source[row]);
            }
        });
        self.written.clear();
    }

    /// Carries the CT in `frame`, which holds [`Frames::still`].
    ///
    /// # Errors
    /// When it is one of another mesh.
    pub fn paint(&mut self, deformation: &Deformation, frame: &mut Ct) -> Result<(), Error> {
        self.paint_seen(deformation, None, frame)
    }

    /// Makes `frame` as [`Frames::next`] does where only planes of the grid are seen (axis,
    /// number): elsewhere it then holds nothing of use.
    ///
    /// # Errors
    /// When it is one of another mesh.
    ///
    /// # Panics
    /// When `frame` has another number of voxels than the grid of the frames.
    pub fn next_seen(
        &mut self,
        deformation: &Deformation,
        planes: &[(usize, usize)],
        frame: &mut Ct,
    ) -> Result<(), Error> {
        self.restore(frame);
        self.paint_seen(deformation, Some(planes), frame)
    }

    fn paint_seen(
        &mut self,
        deformation: &Deformation,
        planes: Option<&[(usize, usize)]>,
        frame: &mut Ct,
    ) -> Result<(), Error> {
        let displacement = deformation.displacement();
        displacement.check(&self.mesh)?;
        let same = self.follow(displacement)?;
        let collar = self.skin.collar(&self.pieces);
        let grid = self.still.grid();
        if same && collar.rest == self.collar.rest {
            self.map.deform(grid, &self.pieces, &collar);
        } else {
            self.map = Map::new([self.ct.grid(), grid], &self.pieces, &collar);
            self.resampling = resampling(&self.ct, grid, &self.map, &self.params);
        }
        self.collar = collar;
        let (out, none) = (frame.data_mut(), Progress::none());
        let seen = (&self.map, planes);
        let (written, _) = self.resampling.run_seen(source(&self.ct), seen, out, none)?;
        self.written = written;
        Ok(())
    }

    /// Takes another displacement; whether its pieces are those of the frame before.
    fn follow(&mut self, displacement: &Displacement) -> Result<bool, Error> {
        let whole = self.pieces.tets.len() == self.mesh.tets().len();
        if whole && displacement.order() == Order::Linear {
            let points = self.pieces.displacement.len();
            self.pieces.displacement.copy_from_slice(&displacement.values()[..points]);
            return Ok(true);
        }
        let curve = Curve { mesh: &self.mesh, edges: &self.edges, displacement };
        if let Some(kept) = &mut self.kept {
            let same = kept.follow(&mut self.pieces, &curve, self.params.curve_tolerance_mm)?;
            if !same {
                self.skin = Skin::new(&self.ct, &self.pieces, self.params.collar_mm);
            }
            return Ok(same);
        }
        let pieces = Pieces::new(&curve, self.params.curve_tolerance_mm, Progress::none())?;
        let same = pieces.tets == self.pieces.tets && pieces.rest == self.pieces.rest;
        if !same {
            self.skin = Skin::new(&self.ct, &pieces, self.params.collar_mm);
        }
        self.pieces = pieces;
        Ok(same)
    }
}

/// Carrying `ct` onto `grid` through maps that have the CT side of `map`.
pub(crate) fn resampling(ct: &Ct, grid: &Grid, map: &Map, params: &Params) -> Resampling {
    let rules = Rules {
        air_hu: params.air_hu,
        body_hu: BODY_HU,
        kernel: Kernel::best(),
        interpolation: params.interpolation,
        supersample_below: params.supersample_below,
    };
    Resampling::new(&source(ct), grid.size(), map, rules)
}

/// A CT that is sampled.
pub(crate) fn source(ct: &Ct) -> Source<'_> {
    Source::new(ct.data(), ct.grid().size())
}
