//! What was found, and what the user should look at.

use crate::Params;
use crate::body::Device;
use crate::find_body::LUNGS_L;
use crate::levels::{Levels, MIN_CONTRAST_HU};
use crate::scan::Scan;
use crate::{radial_map, wall};
use supine_record::QualityCheck;
use supine_space::Warning;

/// What was found and what the user should look at.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Info {
    /// What the user should look at.
    pub warnings: Vec<Warning>,
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
    /// The larger ones of metal and gel among these, largest first.
    pub left_off: Vec<Device>,
    /// Volume of breast implants, ml.
    pub implant_ml: f64,
    /// Metal devices under the skin in front.
    pub devices: Vec<Device>,
    /// Share of the rays in front along which fat meets muscle at the surface; elsewhere the
    /// surface rests on shape alone.
    pub edge_share: f64,
    /// Slices below the ribs: the wall is carried on there under the skin and is less certain.
    pub ribless_slices: usize,
    /// Voxels of the CT that seeds told of.
    pub seeds_used: usize,
    /// What the whole case was judged by, and how near a refusal it was.
    pub checks: Vec<QualityCheck>,
}

/// What was counted.
pub(crate) struct Counts {
    /// Slices below the ribs.
    pub(crate) ribless_slices: usize,
    /// Voxels that seeds told of.
    pub(crate) seeds_used: usize,
}

pub(crate) fn info(
    params: &Params,
    scan: Scan<'_>,
    levels: Levels,
    wall: &wall::Wall,
    Counts { ribless_slices, seeds_used }: Counts,
) -> Info {
    let (body, rays) = (scan.body, scan.rays);
    let front: Vec<f32> = (0..wall.edge.values.len())
        .filter(|n| rays.to_back[n % radial_map::RAYS] < -0.2)
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
        left_off: body.left_off.clone(),
        implant_ml: body.implant_ml,
        devices: body.devices.clone(),
        edge_share: f64::from(front.iter().sum::<f32>()) / front.len().max(1) as f64,
        ribless_slices,
        seeds_used,
        checks: Vec::new(),
    };
    info.checks = checks(&info);
    info.warnings = warnings(&info, truncated);
    info.warnings.extend(left_off(&info.left_off));
    info
}

/// Least share of front rays with a visible edge. Measured: 0.87 to 0.98, and 0.51 where the wall
/// flooded a breast.
const EDGE_SHARE: f64 = 0.7;

/// Least distance of the levels and the level of muscle that are usual, HU (docs/SEGMENTATION.md,
/// How doubt is found: proposed there; measured are 143 to 163 and 32 to 54).
const USUAL_CONTRAST_HU: f64 = 110.0;
const USUAL_MUSCLE_HU: std::ops::RangeInclusive<f64> = 30.0..=75.0;

fn checks(info: &Info) -> Vec<QualityCheck> {
    vec![
        QualityCheck::at_least("air-filled lung", info.lung_l, "litres").refuses(LUNGS_L),
        QualityCheck::at_least("muscle above fat", info.muscle_hu - info.fat_hu, "HU")
            .warns(USUAL_CONTRAST_HU)
            .refuses(MIN_CONTRAST_HU.into()),
        QualityCheck::at_least(
            "fat meets muscle, share of the chest wall's front",
            100.0 * info.edge_share,
            "%",
        )
        .warns(100.0 * EDGE_SHARE),
        QualityCheck::at_most(
            "body cut by the end of the field, share of the slices",
            100.0 * info.truncated_share,
            "%",
        )
        .warns(0.0),
    ]
}

fn warnings(info: &Info, truncated: usize) -> Vec<Warning> {
    let mut out = Vec::new();
    let mut warn = |code, text: String| out.push(Warning::new(code, text));
    if truncated > 0 {
        warn(
            "truncated-field",
            format!(
                "the body reaches the end of the reconstructed field in {truncated} slices ({:.0} %): \
             skin is missing there, keep the region clear of it",
                100.0 * info.truncated_share
            ),
        );
    }
    if info.implant_ml > 0.0 {
        warn(
            "implants",
            format!(
                "breast implants or fluid of {:.0} ml lie in front of the chest wall: they, and muscle \
             over them, count as soft tissue and will move like breast",
                info.implant_ml
            ),
        );
    }
    for Device { ml, middle } in &info.devices {
        warn(
            "device",
            format!(
                "a metal device (a port, a pacemaker, a valve) of {ml:.1} ml with its streaks lies under the skin at {:.0} {:.0} {:.0} mm: \
                 it counts as soft tissue and will move like breast; look at the chest wall behind it",
                middle.x, middle.y, middle.z
            ),
        );
    }
    if info.ribless_slices > 0 {
        warn(
            "below-ribs",
            format!(
                "{} slices lie below the ribs: the chest wall is extrapolated there, \
             keep the region clear of them",
                info.ribless_slices
            ),
        );
    }
    if !USUAL_MUSCLE_HU.contains(&info.muscle_hu)
        || info.muscle_hu - info.fat_hu < USUAL_CONTRAST_HU
    {
        warn(
            "unusual-levels",
            format!(
                "unusual levels: fat {:.0} HU, muscle {:.0} HU; check the boundary of the chest wall",
                info.fat_hu, info.muscle_hu
            ),
        );
    }
    if info.edge_share < EDGE_SHARE {
        warn(
            "wall-without-edge",
            format!(
                "fat meets muscle along only {:.0} % of the front of the chest wall; elsewhere its \
             boundary rests on shape alone: check it, and add seeds where it is wrong",
                100.0 * info.edge_share
            ),
        );
    }
    out
}

/// How many places of what was left out are named.
const PLACES: usize = 4;

/// What was taken for an object on the skin: were it a device under it, the patient would have a
/// hole there.
fn left_off(objects: &[Device]) -> Option<Warning> {
    let first = objects.first()?;
    let ml: f64 = objects.iter().map(|one| one.ml).sum();
    let place = |Device { ml, middle: at }: &Device| {
        format!("{ml:.1} ml at {:.0} {:.0} {:.0} mm", at.x, at.y, at.z)
    };
    let mut places: Vec<String> = objects.iter().take(PLACES).map(place).collect();
    if objects.len() > PLACES {
        places.push(format!("{} smaller ones", objects.len() - PLACES));
    }
    let text = format!(
        "metal, gel or plastic that lies on the skin is left out of the patient: {}; look whether it lies on the skin there, \
         and not under it",
        places.join(", ")
    );
    Some(Warning::new("object-on-skin", text).at(&first.middle).value("volume_ml", ml))
}
