//! CT to labels: the patient's soft tissue and her chest wall as one rigid body.
//!
//! No machine learning: the body without table, gown and wire (`body`); bones and the axis of the
//! thorax (`bones`); a shell through the outer edges of the ribs (`shell`); the levels of fat
//! and muscle in this scan (`levels`); and outside the shell the surface that leaves muscle
//! inside and gland outside (`wall`). Both surfaces are one radius per ray from the axis, found
//! by semi-global aggregation (`aggregate`). The user's seeds bind that surface (`seeds`).

mod aggregate;
mod below_ribs;
mod body;
mod bones;
mod breast;
mod error;
mod frame;
mod info;
mod levels;
mod nipple;
mod paint;
mod params;
mod parts;
mod plane;
mod scan;
mod seeds;
mod sheet;
mod shell;
mod wall;

#[cfg(test)]
mod tests;

pub use breast::propose_region;
pub use error::Error;
pub use info::Info;
pub use nipple::nipple;
pub use params::{Params, Seeds};

use body::Body;
use frame::Frame;
use levels::Levels;
use scan::Scan;
use seeds::Constraints;
use sheet::Rays;
use shell::Shell;
use supine_space::Progress;
use supine_volume::{Ct, LabelMap};
use wall::Band;

/// What [`segment`] makes.
#[derive(Clone, Debug)]
pub struct Segmentation {
    /// [`supine_volume::label::OUTSIDE`], [`supine_volume::label::SOFT_TISSUE`] and
    /// [`supine_volume::label::CHEST_WALL`], which includes lungs, bones and all else within, on the
    /// grid of the CT.
    pub labels: LabelMap,
}

/// Soft tissue and chest wall of a supine chest CT.
///
/// The slices (k) must be within 20 degrees of axial; their rows and columns may run in any
/// direction. Values are HU; padding may have any value below -1024. Do not crop the CT before.
///
/// # Errors
/// When the slices are not axial, no body, lungs or ribs are found, fat and muscle cannot be told
/// apart, a parameter is out of range, a seed lies where it cannot be or two seeds exclude each
/// other, or the callback asked to stop.
pub fn segment(
    ct: &Ct,
    params: &Params,
    progress: Progress<'_>,
) -> Result<(Segmentation, Info), Error> {
    params.check()?;
    let frame = Frame::new(ct.grid())?;
    let mut body = Body::find(ct, &frame, params, progress.part(0.0, 0.3))?;
    seeds::apply_to_body(ct, &frame, &params.seeds, &mut body)?;
    bones::mark_bones(ct, &frame, params.bone_hu as f32, &mut body, progress.part(0.3, 0.4))?;
    let rays = Rays::new(&frame, bones::axis(&frame, &body)?);
    let scan = Scan { ct, frame: &frame, body: &body, rays: &rays };
    let Shell { radius: shell, ribless } = shell::shell(scan, progress.part(0.4, 0.6))?;
    let seeds = Constraints::new(scan, &params.seeds, &shell)?;
    let reach = (params.reach_mm as f32).max(seeds.highest(&rays, &shell) + 5.0);
    let band = Band::sample(scan, &shell, reach);
    progress.at(0.7)?;
    let levels = Levels::measure(&band, &rays)?;
    let wall = wall::wall(scan, (&band, &shell), (levels, &seeds), progress.part(0.7, 0.95))?;
    let mut labels = paint::paint(scan, &shell, &wall.height);
    seeds::stamp(&mut labels, &params.seeds);
    progress.at(1.0)?;
    let ribless = ribless.iter().filter(|&&r| r).count();
    let info = info::info(params, scan, levels, &wall, (ribless, seeds.len()));
    Ok((Segmentation { labels }, info))
}
