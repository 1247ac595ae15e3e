//! What other programs move images and points by: fields on the part of a grid in which something
//! moves, led on beside the skin, and the backward one into the air that the tissue left.

use crate::beside_skin::beside_skin;
use crate::coverage::{Window, holding, moving};
use crate::origins::Mapped;
use crate::{Error, Fields, Origin, Origins, Params};
use rayon::prelude::*;
use supine_mesh::Deformation;
use supine_space::{Grid, Progress};
use supine_volume::Volume;

/// Fields on one part of a grid; beyond it nothing moves.
///
/// It is one voxel wider on each side than all that moves, where the grid goes on: linear
/// interpolation at its border meets 0. Its voxels are voxels of the grid. Where nothing moves at
/// all it is the grid's first two voxels along each axis.
#[derive(Clone, Debug)]
pub struct MovingPart {
    /// The map itself, both ways, and its Jacobian: 0, 0 and 1 outside the mesh.
    pub fields: Fields,
    /// As [`resampling`] makes them, on the same voxels.
    pub resampling: Volume<[f32; 3]>,
    /// What points move along, from the CT to the deformed (LPS, mm), on the same voxels:
    /// `ct_to_deformed` in the mesh, and beside the skin what [`crate::carry_points`] does, as far
    /// as that reaches and a cell of the grid farther.
    pub points: Volume<[f32; 3]>,
}

/// Vectors by which any resampler of images makes the deformed CT, HU(x) = HU(x + v(x)): on the
/// part of `grid` in which they are not 0, one voxel wider, from the deformed to the CT (LPS, mm).
///
/// They are those of the map in the deformed mesh. Around it, as far as a cell of the grid reaches,
/// they follow the skin, so that the tissue beside it is interpolated between vectors of its own;
/// where tissue was and now is air, they lead to air as well, so that the vectors alone leave no
/// ghost of it.
///
/// # Errors
/// When an axis of the grid has a single voxel, a parameter is out of range, or the user stopped.
pub fn resampling(
    grid: &Grid,
    deformation: &Deformation,
    params: &Params,
    progress: Progress<'_>,
) -> Result<Volume<[f32; 3]>, Error> {
    let origins = Origins::new(grid, deformation, params, cell_mm(grid), progress)?;
    let vectors = led_on(&origins)?;
    crop(&vectors, moving(&vectors).wider(vectors.grid().size()))
}

/// The fields of [`crate::fields`] and the vectors of [`resampling`] on the part of `grid` in which
/// any of them moves something.
///
/// # Errors
/// When an axis of the grid has a single voxel, a parameter is out of range, or the user stopped.
pub fn moving_part(
    grid: &Grid,
    deformation: &Deformation,
    params: &Params,
    progress: Progress<'_>,
) -> Result<MovingPart, Error> {
    let Mapped { origins, fields, skin } =
        Origins::with_fields(grid, deformation, params, cell_mm(grid), progress)?;
    let vectors = led_on(&origins)?;
    let fields = match fields {
        Some(fields) => fields,
        None => Fields::new(vectors.clone(), vectors.clone(), vectors.map(|_| 1.0))?,
    };
    let points = match skin {
        Some(skin) => beside_skin(&fields, &skin, params)?,
        // Nothing moves on the grid.
        None => fields.ct_to_deformed().clone(),
    };
    let [back, forth] = [fields.deformed_to_ct(), fields.ct_to_deformed()];
    let stretched = holding(fields.jacobian(), |det| *det != 1.0);
    // The points' vectors are those of `forth` and more.
    let window =
        [moving(&vectors), moving(back), moving(&points)].into_iter().fold(stretched, Window::with);
    let window = window.wider(vectors.grid().size());
    let fields =
        Fields::new(crop(back, window)?, crop(forth, window)?, crop(fields.jacobian(), window)?)?;
    Ok(MovingPart { fields, resampling: crop(&vectors, window)?, points: crop(&points, window)? })
}

/// Somewhat more than the diagonal of a cell, mm: what follows the skin so far outside is all that
/// is interpolated within it.
pub fn cell_mm(grid: &Grid) -> f64 {
    1.01 * grid.spacing().norm()
}

/// The vectors of origins on the part of their grid in which something moves; where tissue left,
/// that of the nearest place that has one.
fn led_on(origins: &Origins) -> Result<Volume<[f32; 3]>, Error> {
    let Some((_, part)) = origins.moving() else {
        let first = origins.grid().crop([0; 3], [2; 3])?;
        return Ok(Volume::from_fn(first, |_| [0.0; 3]));
    };
    let mut known = part.map(|origin| match *origin {
        Origin::Here | Origin::Vacated => None,
        Origin::Tissue(to) | Origin::Beside(to) | Origin::BesideVacated(to) => Some(to),
    });
    let left = |n: &usize| part.data()[*n] == Origin::Vacated;
    let mut open: Vec<usize> = (0..part.grid().len()).filter(left).collect();
    loop {
        // All of a round rest on the round before: the order does not matter.
        let round: Vec<(usize, [f32; 3])> = open
            .par_iter()
            .filter_map(|&n| Some((n, beside(&known, part.grid().voxel(n))?)))
            .collect();
        if round.is_empty() {
            break;
        }
        for (n, to) in round {
            known.data_mut()[n] = Some(to);
        }
        open.retain(|&n| known.data()[n].is_none());
    }
    Ok(known.map(|to| to.unwrap_or([0.0; 3])))
}

/// The vector of the nearest neighbour that has one.
fn beside(known: &Volume<Option<[f32; 3]>>, voxel: [usize; 3]) -> Option<[f32; 3]> {
    let size = known.grid().size();
    let steps = (0..27).map(|n: usize| [n % 3, n / 3 % 3, n / 9]);
    let mut nearest: Option<(usize, [f32; 3])> = None;
    for step in steps {
        let at = [0, 1, 2].map(|a| (voxel[a] + step[a]).wrapping_sub(1));
        let away = step.iter().filter(|s| **s != 1).count();
        let better = nearest.is_none_or(|(best, _)| away < best);
        if better && (0..3).all(|a| at[a] < size[a]) {
            nearest = known.at(at).map(|to| (away, to)).or(nearest);
        }
    }
    nearest.map(|(_, to)| to)
}

/// The voxels of a window.
fn crop<T: Copy>(volume: &Volume<T>, window: Window) -> Result<Volume<T>, Error> {
    let size = [0, 1, 2].map(|a| window.end[a] - window.first[a]);
    let part = volume.grid().crop(window.first, size)?;
    Ok(Volume::from_fn(part, |at| volume.at([0, 1, 2].map(|a| at[a] + window.first[a]))))
}
