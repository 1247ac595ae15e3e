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
mod levels;
mod nipple;
mod paint;
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
pub use nipple::nipple;

use body::Body;
use frame::Frame;
use levels::Levels;
use scan::Scan;
use seeds::Constraints;
use sheet::Rays;
use shell::Shell;
use supine_space::{Point, Progress};
use supine_volume::{Ct, LabelMap};
use wall::Band;

/// Points whose tissue the user knows; LPS, mm. They are never overruled.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Seeds {
    /// Points of the chest wall (rib, intercostal, pectoralis, anything they enclose).
    pub chest_wall: Vec<Point>,
    /// Points of the soft tissue (gland, fat, skin).
    pub soft_tissue: Vec<Point>,
    /// Points that are not the patient (wire, electrode, blanket): 3 mm round each are taken off.
    pub exclude: Vec<Point>,
}

/// How to segment.
#[derive(Clone, Debug, PartialEq)]
pub struct Params {
    /// The user's points.
    pub seeds: Seeds,
    /// Level between air and skin, HU. Default -400: half-way between air and tissue, a little
    /// towards the tissue as partial volume of the thin skin asks for.
    pub skin_hu: f64,
    /// Level above which smoothed tissue is bone, HU. Default 130, so that costal cartilage counts.
    pub bone_hu: f64,
    /// How far outside the ribs the wall is looked for, mm. Default 45.
    pub reach_mm: f64,
}

impl Default for Params {
    fn default() -> Self {
        Self { seeds: Seeds::default(), skin_hu: -400.0, bone_hu: 130.0, reach_mm: 45.0 }
    }
}

impl Params {
    fn check(&self) -> Result<(), Error> {
        let between = |name, value: f64, low: f64, high: f64, why| {
            if (low..=high).contains(&value) {
                Ok(())
            } else {
                Err(Error::Parameter { name, value, why })
            }
        };
        between("skin_hu", self.skin_hu, -900.0, -200.0, "it must lie within -900..-200 HU")?;
        between("bone_hu", self.bone_hu, 90.0, 400.0, "it must lie within 90..400 HU")?;
        between("reach_mm", self.reach_mm, 20.0, 80.0, "it must lie within 20..80 mm")
    }
}

/// What was found and what is doubtful.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Info {
    /// What the user should look at.
    pub warnings: Vec<String>,
    /// Mode of the fat in front of the ribs, HU.
    pub fat_hu: f64,
    /// Mode of the back muscles, HU.
    pub muscle_hu: f64,
    /// Level between air and skin that was used, HU.
    pub skin_hu: f64,
    /// Level of bone that was used, HU.
    pub bone_hu: f64,
    /// Air-filled lung, litres.
    pub lung_l: f64,
    /// Share of the slices in which the body reaches the end of the reconstructed field.
    pub truncated_share: f64,
    /// Volume of dense objects (bra wire, clasp) taken off the skin, cm³.
    pub foreign_cm3: f64,
    /// Share of the rays in front along which fat meets muscle at the surface; elsewhere the
    /// surface rests on shape alone.
    pub edge_share: f64,
    /// Slices below the ribs: the wall is carried on there under the skin and is less certain.
    pub ribless_slices: usize,
    /// Seeds of chest wall and soft tissue that were obeyed.
    pub seeds_used: usize,
}

/// Labels of a supine chest CT on its own grid: [`supine_volume::label::OUTSIDE`],
/// [`supine_volume::label::SOFT_TISSUE`] and [`supine_volume::label::CHEST_WALL`], which includes
/// lungs, bones and all else within.
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
) -> Result<(LabelMap, Info), Error> {
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
    let info = info(params, scan, levels, &wall, (ribless, seeds.len()));
    Ok((labels, info))
}

fn info(
    params: &Params,
    scan: Scan<'_>,
    levels: Levels,
    wall: &wall::Wall,
    (ribless_slices, seeds_used): (usize, usize),
) -> Info {
    let (body, rays) = (scan.body, scan.rays);
    let front: Vec<f32> = (0..wall.edge.values.len())
        .filter(|n| rays.to_back[n % sheet::RAYS] < -0.2)
        .map(|n| wall.edge.values[n])
        .collect();
    let truncated = body.truncated.iter().filter(|&&t| t).count();
    let mut info = Info {
        warnings: Vec::new(),
        fat_hu: levels.fat.into(),
        muscle_hu: levels.muscle.into(),
        skin_hu: params.skin_hu,
        bone_hu: params.bone_hu,
        lung_l: body.lung_l,
        truncated_share: truncated as f64 / body.truncated.len() as f64,
        foreign_cm3: body.foreign_cm3,
        edge_share: f64::from(front.iter().sum::<f32>()) / front.len().max(1) as f64,
        ribless_slices,
        seeds_used,
    };
    info.warnings = warnings(&info, truncated);
    info
}

/// Least share of front rays with a visible edge.
const EDGE_SHARE: f64 = 0.5;

fn warnings(info: &Info, truncated: usize) -> Vec<String> {
    let mut out = Vec::new();
    if truncated > 0 {
        out.push(format!(
            "the body reaches the end of the reconstructed field in {truncated} slices ({:.0} %): \
             skin is missing there, keep the region clear of it",
            100.0 * info.truncated_share
        ));
    }
    if info.ribless_slices > 0 {
        out.push(format!(
            "{} slices lie below the ribs: the chest wall is extrapolated there, \
             keep the region clear of them",
            info.ribless_slices
        ));
    }
    if !(30.0..=75.0).contains(&info.muscle_hu) || info.muscle_hu - info.fat_hu < 110.0 {
        out.push(format!(
            "unusual levels: fat {:.0} HU, muscle {:.0} HU; check the boundary of the chest wall",
            info.fat_hu, info.muscle_hu
        ));
    }
    if info.edge_share < EDGE_SHARE {
        out.push(format!(
            "fat meets muscle along only {:.0} % of the front of the chest wall; elsewhere its \
             boundary rests on shape alone: check it, and add seeds where it is wrong",
            100.0 * info.edge_share
        ));
    }
    out
}
