//! What points move along between voxels: the forward field, led on beside the skin.

use crate::origins::Skin;
use crate::{Error, Fields, Params, cell_mm};
use rayon::prelude::*;
use supine_mesh::{Place, Surround};
use supine_volume::{Volume, distance_mm};

/// From the CT to the deformed (LPS, mm), on the grid of `fields`: in the mesh their
/// `ct_to_deformed`, and beside the skin what [`crate::carry_points`] does, as far as that reaches
/// and a cell of the grid farther. Linear interpolation between voxels so moves a point on the
/// skin, or a mark beside it, as `carry_points` does; between vectors of the mesh alone it would
/// meet 0.
///
/// # Errors
/// When the displacement is not one of the mesh.
pub(crate) fn beside_skin(
    fields: &Fields,
    skin: &Skin,
    params: &Params,
) -> Result<Volume<[f32; 3]>, Error> {
    let mut vectors = fields.ct_to_deformed().clone();
    let grid = vectors.grid().clone();
    let moves = |v: &[f32; 3]| *v != [0.0; 3];
    if !vectors.data().iter().any(moves) {
        return Ok(vectors);
    }
    let layer_mm = params.collar_mm + cell_mm(&grid);
    let surround = Surround { rigid_mm: layer_mm, reach_mm: 2.0 * layer_mm };
    let motion = skin.motion(surround)?;
    // The mesh lies within a voxel of those that move.
    let near_mm = layer_mm + grid.spacing().norm();
    let distance = distance_mm(&vectors.map(moves));
    let is_beside =
        |place: &Place| matches!(place, Place::Beside(b) if b.distance_mm() <= layer_mm);
    let vector = |n: usize| {
        let place = skin.embedding.place(&grid.centre(grid.voxel(n)));
        let u = is_beside(&place).then(|| motion.at(&place)).flatten()?;
        Some([u.x as f32, u.y as f32, u.z as f32])
    };
    vectors.data_mut().par_iter_mut().enumerate().for_each(|(n, out)| {
        if !moves(out) && f64::from(distance.data()[n]) <= near_mm {
            *out = vector(n).unwrap_or(*out);
        }
    });
    Ok(vectors)
}
