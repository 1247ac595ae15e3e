//! Whether the breast of one side can be simulated in its region: what refuses, what asks for a
//! look.

use crate::breast::MISSING_SHARE;
use crate::{Breast, Error, UNCERTAIN_MM};
use rayon::prelude::*;
use supine_record::{QualityCheck, WallUncertainty};
use supine_space::{Point, Side, Sphere, Warning};
use supine_volume::{Ct, Field, LabelMap, Volume, distance_mm, label};

/// Soft tissue denser than this, this far off the chest wall, is bone or the like. Measured: none
/// in the breasts of six patients, two of them with contrast.
const BONE_HU: i16 = 200;
const OFF_WALL_MM: f32 = 10.0;
/// Skin is no bone, though noise and a sharp kernel make it as dense in spots: measured 12 cm³ on a
/// real CT, 0.1 below this, mm.
const UNDER_SKIN_MM: f32 = 4.0;
/// Volumes that warn and that refuse, cm³: an arm holds more, a clip, a calcification or a port
/// less. Chosen, not measured.
const BONE_WARNS_CM3: f64 = 1.0;
const BONE_REFUSES_CM3: f64 = 15.0;
/// Area of the region's tissue at the end of the reconstructed field that warns, cm², and the share
/// of the sphere's great circle that refuses. Measured: 0.16 where the field clips a flank.
const CUT_WARNS_CM2: f64 = 1.0;
const CUT_REFUSES: f64 = 0.3;
/// The last pixels of the field lie this near to its end, pixels: beside what was not measured, but
/// not across a corner.
const LAST: f64 = 1.01;
/// Area of a breast's thickest part at the end of the field that refuses, cm². Measured: 22 on
/// breast-rider0109's left, 0.4 on p2-full, where the field grazes the skin.
const BREAST_CUT_CM2: f64 = 3.0;
/// Thickness of the breast at the end of the volume, as a share of its greatest, that warns and
/// that refuses. Measured: 0.7 at most on six CTs, one of which cuts the breast's upper rim; 0.75
/// to 0.9 where a rim is lost; 0.83 to 1.7 where the CT ends within the breast's middle third.
const END_WARNS: f64 = 0.75;
const END_REFUSES: f64 = 0.9;
/// A breast lower than this over the tissue around it is hardly one, mm. Measured: 17 and more at
/// breasts of seven CTs, 9 and 13 on chest-cmb01068.
const THIN_MM: f64 = 14.0;
/// A breast with less than this share of the other's thickness is told. Chosen between what is
/// measured of whole breasts and of missing ones (see [`MISSING_SHARE`]).
const UNEVEN_SHARE: f64 = 0.6;
/// Share of the boundary, or area of one place, that may be uncertain before a look is asked for.
/// Chosen, not measured (docs/SEGMENTATION.md, How doubt is found, proposed 10 cm²).
const UNCERTAIN_SHARE: f64 = 0.1;
const UNCERTAIN_CM2: f64 = 8.0;

/// What [`check_region`] found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RegionCheck {
    /// What the user should look at.
    pub warnings: Vec<Warning>,
    /// What was measured, and its limits.
    pub checks: Vec<QualityCheck>,
}

/// A breast within its region, as [`check_region`] is told of it.
#[derive(Clone, Copy, Debug)]
pub struct BreastPlace<'a> {
    /// The sphere that is simulated.
    pub region: Sphere,
    /// The side of the breast.
    pub side: Side,
    /// The breast of that side, when there is one.
    pub breast: Option<&'a Breast>,
    /// The uncertainty of the chest wall's boundary within the region, where it is known.
    pub uncertainty: Option<&'a WallUncertainty>,
}

/// Checks a breast within its region; gives what the user should look at. Labels and CT are on one
/// grid; `field` is that of the CT.
///
/// # Errors
/// [`Error::BoneInBreast`] and [`Error::BreastCut`].
pub fn check_region(
    ct: &Ct,
    field: &Field,
    labels: &LabelMap,
    place: &BreastPlace<'_>,
) -> Result<RegionCheck, Error> {
    let mut out = RegionCheck::default();
    let bone_cm3 = bone_cm3(ct, labels, place.region);
    out.warnings.extend(bone(bone_cm3, &mut out.checks)?);
    out.warnings.extend(cut_by_field(field, labels, place, &mut out.checks)?);
    // A side without a breast has nothing to cut.
    if let Some(breast) = place.breast {
        out.warnings.extend(cut_by_end(breast, &mut out.checks)?);
        out.warnings.extend(thin(breast, &mut out.checks));
        out.warnings.extend(uneven(breast, &mut out.checks));
    }
    let uncertain = place.uncertainty.and_then(|found| uncertain(found, &mut out.checks));
    out.warnings.extend(uncertain);
    Ok(out)
}

/// Volume of what is as dense as bone in the soft tissue, off the chest wall and under the skin,
/// cm³.
fn bone_cm3(ct: &Ct, labels: &LabelMap, region: Sphere) -> f64 {
    let Some((start, grid)) = labels.grid().around(&region) else { return 0.0 };
    let whole = |v: [usize; 3]| [0, 1, 2].map(|a| v[a] + start[a]);
    let dense = |v: [usize; 3]| {
        label::is_soft_tissue(labels.at(whole(v)))
            && ct.at(whole(v)) > BONE_HU
            && region.contains(&grid.centre(v))
    };
    let dense: Vec<usize> =
        (0..grid.len()).into_par_iter().filter(|&n| dense(grid.voxel(n))).collect();
    if dense.is_empty() {
        return 0.0;
    }
    let from = |kind: fn(u8) -> bool| {
        distance_mm(&Volume::par_from_fn(grid.clone(), |v| kind(labels.at(whole(v)))))
    };
    let (wall, air) = (from(label::is_chest_wall), from(|l| l == label::OUTSIDE));
    let off = |&n: &usize| wall.data()[n] > OFF_WALL_MM && air.data()[n] > UNDER_SKIN_MM;
    let voxels = dense.into_iter().filter(off).count();
    voxels as f64 * grid.voxel_volume() / 1000.0
}

fn bone(bone_cm3: f64, checks: &mut Vec<QualityCheck>) -> Result<Option<Warning>, Error> {
    let what = "as dense as bone in the region's soft tissue";
    checks.push(
        QualityCheck::at_most(what, bone_cm3, "cm³")
            .warns(BONE_WARNS_CM3)
            .refuses(BONE_REFUSES_CM3),
    );
    if bone_cm3 > BONE_REFUSES_CM3 {
        return Err(Error::BoneInBreast { bone_cm3 });
    }
    Ok((bone_cm3 > BONE_WARNS_CM3).then(|| {
        let text = format!(
            "{bone_cm3:.1} cm³ as dense as bone lie in the soft tissue of the region: a device, \
             calcification, or rib outside the chest wall that was found; check the labels there"
        );
        Warning::new("bone-in-breast", text).value("volume_cm3", bone_cm3)
    }))
}

fn cut_by_field(
    field: &Field,
    labels: &LabelMap,
    &BreastPlace { region, side, breast, .. }: &BreastPlace<'_>,
    checks: &mut Vec<QualityCheck>,
) -> Result<Option<Warning>, Error> {
    let grid = labels.grid();
    let ([ni, _, nk], spacing) = (grid.size(), grid.spacing());
    // The last pixels that were measured.
    let near = field.near_end(LAST * spacing[0].max(spacing[1]));
    let last = |n: &usize| near[*n] && field.seen()[*n];
    let ends: Vec<[usize; 2]> = (0..near.len()).filter(last).map(|n| [n % ni, n / ni]).collect();
    // In the region, and where the breast is as thick as anywhere.
    let cut = |k: usize| {
        ends.iter().fold([0usize; 2], |[region_cut, breast_cut], &[i, j]| {
            let (v, at) = ([i, j, k], grid.centre([i, j, k]));
            if !label::is_soft_tissue(labels.at(v)) {
                return [region_cut, breast_cut];
            }
            let thick = breast.is_some_and(|breast| breast.share_at(&at) > END_REFUSES);
            [region_cut + usize::from(region.contains(&at)), breast_cut + usize::from(thick)]
        })
    };
    let add = |a: [usize; 2], b: [usize; 2]| [a[0] + b[0], a[1] + b[1]];
    let voxels = (0..nk).into_par_iter().map(cut).reduce(|| [0; 2], add);
    let voxel_cm2 = field.pixel_mm() * spacing[2] / 100.0;
    let [cm2, breast_cm2] = voxels.map(|voxels| voxels as f64 * voxel_cm2);
    let great_circle = std::f64::consts::PI * (region.radius() / 10.0).powi(2);
    let limit = CUT_REFUSES * great_circle;
    let what = "region's tissue at the end of the reconstructed field";
    checks.push(QualityCheck::at_most(what, cm2, "cm²").warns(CUT_WARNS_CM2).refuses(limit));
    if cm2 > limit {
        let why = format!("{cm2:.0} cm² of the region lie at the end of the reconstructed field");
        return Err(Error::BreastCut { side, why });
    }
    if breast.is_some() {
        let what = "breast's thickest part at the end of the reconstructed field";
        checks.push(QualityCheck::at_most(what, breast_cm2, "cm²").refuses(BREAST_CUT_CM2));
    }
    if breast_cm2 > BREAST_CUT_CM2 {
        let why = format!(
            "the end of the reconstructed field cuts {breast_cm2:.0} cm² of it where it is thickest"
        );
        return Err(Error::BreastCut { side, why });
    }
    Ok((cm2 > CUT_WARNS_CM2).then(|| {
        let text = format!(
            "the end of the reconstructed field cuts {cm2:.0} cm² of the region's tissue: skin is \
             missing there; make the region smaller or use a CT with a larger field"
        );
        Warning::new("region-truncated", text).value("area_cm2", cm2)
    }))
}

/// Hardly a breast: where it ends is uncertain then.
fn thin(breast: &Breast, checks: &mut Vec<QualityCheck>) -> Option<Warning> {
    let (side, mm) = (breast.side, breast.rise_mm);
    let what = "height of the breast over the tissue around it";
    checks.push(QualityCheck::at_least(what, mm, "mm").warns(THIN_MM));
    let text = format!(
        "the {side} breast stands only {mm:.0} mm over the tissue around it: hardly a breast, and where it ends is \
         uncertain; look at the region, give another one where it is wrong, and check the side"
    );
    (mm < THIN_MM).then(|| Warning::new("thin-breast", text).value("height_mm", mm))
}

/// Much less of a breast than on the other side.
fn uneven(breast: &Breast, checks: &mut Vec<QualityCheck>) -> Option<Warning> {
    let (side, percent) = (breast.side, 100.0 * breast.share_of_other?);
    let what = "thickness about the breast's place, against the other side";
    let (warns, refuses) = (100.0 * UNEVEN_SHARE, 100.0 * MISSING_SHARE);
    checks.push(QualityCheck::at_least(what, percent, "%").warns(warns).refuses(refuses));
    let text = format!(
        "the soft tissue of the {side} side has only {percent:.0} % of the thickness of the other breast, as after an operation \
         that took much of the breast, or where gland is taken for chest wall: check the side, and look at the region and at the \
         boundary of the chest wall"
    );
    (percent < warns).then(|| Warning::new("uneven-breasts", text).value("percent", percent))
}

fn cut_by_end(breast: &Breast, checks: &mut Vec<QualityCheck>) -> Result<Option<Warning>, Error> {
    let share = breast.at_ends;
    let what = "breast at the first or last slice, share of its greatest thickness";
    let (warns, refuses) = (100.0 * END_WARNS, 100.0 * END_REFUSES);
    checks.push(QualityCheck::at_most(what, 100.0 * share, "%").warns(warns).refuses(refuses));
    let text = |verb: &str| {
        format!(
            "at the first or last slice the breast {verb} {:.0} % of its greatest thickness",
            100.0 * share.min(1.0)
        )
    };
    if share > END_REFUSES {
        return Err(Error::BreastCut { side: breast.side, why: text("has") });
    }
    Ok((share > END_WARNS).then(|| {
        let text = text("still has");
        let text =
            format!("{text}: it may go on outside the CT; check that the CT holds all of it");
        Warning::new("breast-at-end", text).value("percent", 100.0 * share)
    }))
}

fn uncertain(found: &WallUncertainty, checks: &mut Vec<QualityCheck>) -> Option<Warning> {
    let largest = found.patches.first().map_or(0.0, |patch| patch.area_cm2);
    let what = "uncertain boundary, share of that in the region";
    checks.push(
        QualityCheck::at_most(what, 100.0 * found.share(), "%").warns(100.0 * UNCERTAIN_SHARE),
    );
    let what = "largest uncertain place of the boundary";
    checks.push(QualityCheck::at_most(what, largest, "cm²").warns(UNCERTAIN_CM2));
    let first = found.patches.first()?;
    if found.share() <= UNCERTAIN_SHARE && first.area_cm2 <= UNCERTAIN_CM2 {
        return None;
    }
    let text = format!(
        "{:.0} cm² ({:.0} %) of the chest wall's boundary in the region may lie more than \
         {UNCERTAIN_MM:.1} mm off; the largest place has {:.0} cm²: {}, about {:.0} mm; look at it in \
         the report and add a seed where it is wrong",
        found.uncertain_cm2,
        100.0 * found.share(),
        first.area_cm2,
        first.place,
        first.error_mm
    );
    Some(
        Warning::new("uncertain-wall", text)
            .at(&Point::from(first.centre_mm))
            .value("area_cm2", found.uncertain_cm2)
            .value("percent", 100.0 * found.share())
            .value("largest_cm2", first.area_cm2)
            .value("largest_error_mm", first.error_mm),
    )
}
