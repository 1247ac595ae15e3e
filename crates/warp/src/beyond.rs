//! Tissue that comes from where the scanner measured nothing.

use crate::origins::there;
use crate::{BODY_HU, Error, Origins, Params};
use rayon::prelude::*;
use supine_mesh::Deformation;
use supine_space::{Point, Progress, Vector};
use supine_volume::{Ct, Field};

/// A way back is looked at in steps of at most this share of a pixel. Chosen, not measured.
const STEP_PIXELS: f64 = 0.5;

/// Volume of the soft tissue that [`crate::warp`] would have to bring in from beyond the end of
/// `field`, what was measured of the CT, mm³: voxels within it whose tissue was beyond, as far as
/// the mesh leads on. They hold air, or what the CT has in place of a measurement. The end of the
/// mesh at the skin does not count.
///
/// # Errors
/// As [`crate::warp`].
pub fn beyond_field_mm3(
    ct: &Ct,
    field: &Field,
    deformation: &Deformation,
    params: &Params,
    progress: Progress<'_>,
) -> Result<f64, Error> {
    if !is_near_end(ct, field, deformation) {
        return Ok(0.0);
    }
    let made = Origins::with_fields(ct.grid(), deformation, params, 0.0, progress)?;
    let Some(fields) = made.fields else { return Ok(0.0) };
    let (back, way) = (fields.deformed_to_ct(), Way { ct, field });
    let is_beyond = |v: [usize; 3], to: [f32; 3]| way.ends_beyond(back.grid().centre(v), to);
    let come = fields.backward().filter(|&(v, to)| is_beyond(v, to)).count();
    // What the tissue left: what is to follow it moves as it did.
    let left = fields.forward().filter(|&(v, _)| back.at(v) == [0.0; 3]);
    let left = left.filter(|&(v, to)| is_beyond(v, to.map(|c| -c))).count();
    Ok((come + left) as f64 * ct.grid().voxel_volume())
}

/// Whether any of the mesh lies as near to the end of the field as anything moves.
fn is_near_end(ct: &Ct, field: &Field, deformation: &Deformation) -> bool {
    let near = field.near_end(deformation.displacement().max_norm() + field.pixel_mm());
    let mut pixels = deformation.mesh().points().iter().map(|p| field.pixel(ct.grid(), p));
    pixels.any(|pixel| pixel.is_none_or(|n| near[n]))
}

/// The way back from a voxel to where its tissue was.
struct Way<'a> {
    ct: &'a Ct,
    field: &'a Field,
}

impl Way<'_> {
    /// Whether it begins within the field and leaves it out of tissue.
    fn ends_beyond(&self, from: Point, to: [f32; 3]) -> bool {
        let steps = Vector::from(to.map(f64::from)).norm() / (STEP_PIXELS * self.field.pixel_mm());
        let steps = steps.ceil().max(1.0) as usize;
        let at = |n: usize| there(from, to.map(|c| c * n as f32 / steps as f32));
        let first_beyond = (0..=steps).find(|&n| !self.is_seen(&at(n)));
        let last = first_beyond.and_then(|n| n.checked_sub(1)).map(at);
        last.is_some_and(|last| self.is_tissue(&last))
    }

    fn is_seen(&self, p: &Point) -> bool {
        self.field.pixel(self.ct.grid(), p).is_some_and(|n| self.field.seen()[n])
    }

    fn is_tissue(&self, p: &Point) -> bool {
        self.ct.grid().voxel_at(p).is_some_and(|voxel| self.ct.at(voxel) >= BODY_HU)
    }
}
