//! Where the value of each voxel of any grid comes from: what label maps and doses are carried by.

use crate::slid::on_slid_wall;
use crate::{Error, Fields, Params, fade, fields};
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use supine_mesh::{
    Deformation, Displacement, DisplacementError, Embedding, Locator, Motion, Place, Surround,
    TetMesh,
};
use supine_space::{Grid, Point, Progress, Stopped, Vector};
use supine_volume::{Volume, distance_mm};

/// Where the value of a voxel after deformation comes from. Vectors lead from the centre of the
/// voxel to that place in the CT (LPS, mm).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Origin {
    /// From the same place: nothing moved here.
    Here,
    /// From nowhere: the tissue that was here left.
    Vacated,
    /// From within the mesh.
    Tissue([f32; 3]),
    /// From the layer beside the skin. What is here without the deformation lies outside the mesh.
    Beside([f32; 3]),
    /// As [`Self::Beside`], and what was here left.
    BesideVacated([f32; 3]),
}

/// Shorter ways are none, mm.
const STILL_MM: f64 = 1e-3;
/// Steps in which a place beside the skin is to be found, and how near, mm.
const STEPS: usize = 24;
const FOUND_MM: f64 = 0.01;

/// The map of [`crate::warp`], backwards, on any grid.
#[derive(Clone, Debug)]
pub struct Origins {
    grid: Grid,
    /// The part of the grid in which something moves, and the voxel where it starts.
    part: Option<([usize; 3], Volume<Origin>)>,
}

impl Origins {
    /// The map on `grid`; `deformation` as the solver gave it, the fade is applied within.
    ///
    /// What lies up to `layer_mm` outside the skin moves and turns with it, as points do
    /// ([`crate::carry_points`]). Label maps need that: their voxels reach beyond the faces of a
    /// mesh.
    ///
    /// # Errors
    /// When an axis of the grid has a single voxel, a
    /// parameter is out of range, or the user stopped.
    pub fn new(
        grid: &Grid,
        deformation: &Deformation,
        params: &Params,
        layer_mm: f64,
        progress: Progress<'_>,
    ) -> Result<Self, Error> {
        Self::with_fields(grid, deformation, params, layer_mm, progress).map(|made| made.origins)
    }

    /// As [`Self::new`], and what that rests on.
    pub(crate) fn with_fields(
        grid: &Grid,
        deformation: &Deformation,
        params: &Params,
        layer_mm: f64,
        progress: Progress<'_>,
    ) -> Result<Mapped, Error> {
        crate::map::check_grid(grid)?;
        let faded = fade(deformation, params)?.deformation;
        let (mesh, u) = (faded.mesh(), faded.displacement());
        // What lies beside the skin is told of as far as points are carried there.
        let reach = u.max_norm().max(params.collar_mm);
        let margin = reach + layer_mm + 2.0 * grid.spacing().norm();
        let Some((start, part)) = part(grid, mesh, margin) else {
            let origins = Self { grid: grid.clone(), part: None };
            return Ok(Mapped { origins, fields: None, skin: None });
        };
        let fields = fields(&part, deformation, params, progress.part(0.0, 0.5))?;
        let [back, forward] = [fields.deformed_to_ct(), fields.ct_to_deformed()];
        let moves = |n: usize| length(forward.data()[n]) > STILL_MM;
        // What the tissue leaves beside a wall along which it slid stays as it is.
        let slid = on_slid_wall(mesh, u).map(|on| (on, Locator::new(mesh.clone())));
        let stays = |n: usize| {
            let Some((on, locator)) = &slid else { return false };
            locator.locate(&part.centre(part.voxel(n))).is_some_and(|place| on[place.tet])
        };
        let empty = |n: usize| back.data()[n] == [0.0, 0.0, 0.0];
        let kept: Vec<bool> = match &slid {
            None => Vec::new(),
            Some(_) => {
                let all = (0..part.len()).into_par_iter();
                all.map(|n| empty(n) && moves(n) && stays(n)).collect()
            }
        };
        let is_kept = |n: usize| kept.get(n).copied().unwrap_or_default();
        let left = |n: usize| moves(n) && !is_kept(n);
        let inside = |n: usize| match back.data()[n] {
            [0.0, 0.0, 0.0] if left(n) => Origin::Vacated,
            [0.0, 0.0, 0.0] => Origin::Here,
            to => Origin::Tissue(to),
        };
        let mut origins: Vec<Origin> = (0..part.len()).into_par_iter().map(inside).collect();
        let skin = (layer_mm > 0.0).then(|| Skin::of(&faded));
        if let Some(skin) = &skin {
            let reach = layer_mm + part.spacing().norm();
            let near = |field: &Volume<[f32; 3]>| {
                let distance = distance_mm(&field.map(|v| *v != [0.0; 3]));
                distance.map(|&d| f64::from(d) <= reach)
            };
            let (before, after) = (near(forward), near(back));
            let surround = Surround { rigid_mm: layer_mm, reach_mm: layer_mm + DECAY_MM };
            let layer = Layer { skin, motion: skin.motion(surround)?, layer_mm };
            let row = part.size()[0];
            let (rows, done) = (part.len() / row, AtomicUsize::new(0));
            origins.par_chunks_mut(row).enumerate().try_for_each(|(at, origins)| {
                for (i, origin) in origins.iter_mut().enumerate() {
                    let n = at * row + i;
                    let free = !matches!(origin, Origin::Tissue(_)) && !is_kept(n);
                    if free && (before.data()[n] || after.data()[n]) {
                        let left = matches!(origin, Origin::Vacated);
                        *origin = layer.origin(part.centre(part.voxel(n)), left);
                    }
                }
                let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                progress.at(0.5 + 0.5 * done as f64 / rows as f64)
            })?;
        }
        let part = Volume::new(part, origins)?;
        let origins = Self { grid: grid.clone(), part: Some((start, part)) };
        Ok(Mapped { origins, fields: Some(fields), skin })
    }

    /// The grid.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// The part of the grid in which something moves, and the voxel where it starts.
    pub(crate) fn moving(&self) -> Option<&([usize; 3], Volume<Origin>)> {
        self.part.as_ref()
    }

    /// Where the value of a voxel comes from.
    pub fn at(&self, voxel: [usize; 3]) -> Origin {
        let Some((start, part)) = &self.part else { return Origin::Here };
        let size = part.grid().size();
        let within = [0, 1, 2].map(|a| voxel[a].wrapping_sub(start[a]));
        if (0..3).any(|a| within[a] >= size[a]) { Origin::Here } else { part.at(within) }
    }

    /// The volume of `value(voxel, where it comes from)`, in parallel by slices.
    pub(crate) fn volume<T: Copy + Send>(
        &self,
        progress: Progress<'_>,
        value: impl Fn([usize; 3], Origin) -> T + Sync,
    ) -> Result<Volume<T>, Stopped> {
        volume(&self.grid, progress, |voxel| value(voxel, self.at(voxel)))
    }
}

/// The volume of `value(voxel)` on a grid, in parallel by slices.
pub(crate) fn volume<T: Copy + Send>(
    grid: &Grid,
    progress: Progress<'_>,
    value: impl Fn([usize; 3]) -> T + Sync,
) -> Result<Volume<T>, Stopped> {
    let [ni, nj, nk] = grid.size();
    let done = AtomicUsize::new(0);
    let first = value([0; 3]);
    let mut volume = Volume::from_fn(grid.clone(), |_| first);
    let slices = volume.data_mut().par_chunks_mut(ni * nj).enumerate();
    slices.try_for_each(|(k, slice)| {
        let voxel = |n: usize| [n % ni, n / ni, k];
        slice.iter_mut().enumerate().for_each(|(n, out)| *out = value(voxel(n)));
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        progress.at(done as f64 / nk as f64)
    })?;
    Ok(volume)
}

/// The place `centre + vector`.
pub(crate) fn there(centre: Point, vector: [f32; 3]) -> Point {
    centre + Vector::from(vector.map(f64::from))
}

fn length(v: [f32; 3]) -> f64 {
    Vector::from(v.map(f64::from)).norm()
}

/// The part of a grid within `margin` (mm) of the box of a mesh, two voxels or more along each
/// axis.
fn part(grid: &Grid, mesh: &TetMesh, margin: f64) -> Option<([usize; 3], Grid)> {
    let mut reach = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    for p in mesh.points() {
        let index = grid.index_from_patient(p);
        for a in 0..3 {
            reach[a] = [reach[a][0].min(index[a]), reach[a][1].max(index[a])];
        }
    }
    let (mut start, mut size) = ([0; 3], [0; 3]);
    for a in 0..3 {
        let (more, last) = (margin / grid.spacing()[a], grid.size()[a] - 1);
        let low = (reach[a][0] - more).floor().max(0.0);
        let high = (reach[a][1] + more).ceil().min(last as f64);
        if low > high {
            return None;
        }
        start[a] = (low as usize).min(last - 1);
        size[a] = (high as usize).max(start[a] + 1) - start[a] + 1;
    }
    grid.crop(start, size).ok().map(|part| (start, part))
}

/// Beyond the layer the motion falls to nothing within this way, so that the search of a place
/// beside the skin has no step to stumble over, mm.
const DECAY_MM: f64 = 40.0;

/// The faded displacement, and where places lie in its mesh and beside its skin.
#[derive(Debug)]
pub(crate) struct Skin {
    pub(crate) embedding: Arc<Embedding>,
    displacement: Displacement,
}

impl Skin {
    pub(crate) fn of(faded: &Deformation) -> Self {
        let embedding = Arc::new(Embedding::new(faded.mesh().clone()));
        Self { embedding, displacement: faded.displacement().clone() }
    }

    /// How places move, those beside the skin as a surround says.
    ///
    /// # Errors
    /// When the displacement is not one of the mesh.
    pub(crate) fn motion(&self, surround: Surround) -> Result<Motion, DisplacementError> {
        Motion::new(self.embedding.clone(), self.displacement.clone(), surround)
    }
}

/// What [`Origins::with_fields`] makes.
pub(crate) struct Mapped {
    pub(crate) origins: Origins,
    /// On the part of the grid in which something may move; none where the mesh lies beside the
    /// grid.
    pub(crate) fields: Option<Fields>,
    /// Where there is a layer beside the skin.
    pub(crate) skin: Option<Skin>,
}

/// What moves beside the skin.
struct Layer<'a> {
    skin: &'a Skin,
    motion: Motion,
    layer_mm: f64,
}

impl Layer<'_> {
    /// The origin of a place outside the deformed mesh.
    fn origin(&self, place: Point, left: bool) -> Origin {
        if let Some(to) = self.source(place) {
            return if left || self.leaves(place) {
                Origin::BesideVacated(to)
            } else {
                Origin::Beside(to)
            };
        }
        if left || self.leaves(place) { Origin::Vacated } else { Origin::Here }
    }

    /// Whether a place belongs to the layer in the CT, and moves.
    fn leaves(&self, place: Point) -> bool {
        let at = self.skin.embedding.place(&place);
        self.ours(&at) && self.motion.at(&at).is_some_and(|u| u.norm() > STILL_MM)
    }

    /// On a face of the mesh a place may count as within it, and yet no tetrahedron own its voxel.
    fn ours(&self, place: &Place) -> bool {
        self.holds(place) || matches!(place, Place::Inside(_))
    }

    fn holds(&self, place: &Place) -> bool {
        matches!(place, Place::Beside(beside) if beside.distance_mm() <= self.layer_mm)
    }

    /// From `place` to the place of the layer that comes here: the fixed point of X = x - u(X).
    fn source(&self, place: Point) -> Option<[f32; 3]> {
        let mut source = place;
        for _ in 0..STEPS {
            let at = self.skin.embedding.place(&source);
            let u = self.motion.at(&at)?;
            let next = place - u;
            let step = (next - source).norm();
            if step < FOUND_MM {
                let to = source - place;
                return (self.ours(&at) && to.norm() > STILL_MM)
                    .then(|| [to.x as f32, to.y as f32, to.z as f32]);
            }
            source = next;
        }
        None
    }
}
