//! The region: as given, or proposed from the breast; and whether the tumour lies in it.

use super::import::Imported;
use super::segment::{DOUBT, Facts as SegmentFacts};
use crate::bench::{Bench, Done};
use crate::facts::gate;
use crate::{Case, RunError, Stage};
use supine_exchange::read_tenths;
use supine_report::{DoubtfulPatch, Gate, WallDoubt};
use supine_segment::{Breast, DOUBTFUL_MM, Doubt, Nipple};
use supine_space::{Point, Sphere};
use supine_volume::{LabelMap, Region, Volume, label};

/// The sphere, checked against the labels.
pub(crate) struct Chosen {
    pub(crate) sphere: Sphere,
    pub(crate) proposed: bool,
    /// Soft tissue within the sphere, ml.
    pub(crate) soft_tissue_ml: f64,
    /// Chest wall within the sphere, ml.
    pub(crate) chest_wall_ml: f64,
    /// Where the nipple seems to be, LPS, mm.
    pub(crate) nipple: Option<Point>,
    /// How far the boundary of the chest wall may be wrong, tenths of mm; `None` when the labels
    /// were brought.
    pub(crate) doubt: Option<Volume<u8>>,
    /// The same within the region.
    pub(crate) wall_doubt: Option<WallDoubt>,
    /// What the region was judged by.
    pub(crate) gates: Vec<Gate>,
}

pub(crate) fn region(
    bench: &mut Bench<'_>,
    case: &Case,
    input: &Imported,
    labels: &Done<LabelMap, SegmentFacts>,
) -> Result<Chosen, RunError> {
    let doubt = match case.labels {
        Some(_) => None,
        None => Some(bench.store.path(DOUBT)?),
    };
    bench.pass(Stage::Region, |progress| {
        let read = |path| read_tenths(path, progress.part(0.0, 0.2)).map_err(RunError::product);
        let doubt = doubt.as_deref().map(read).transpose()?;
        let (ct, map) = (&input.input.ct, &labels.product);
        let found = Breast::find(map, case.breast, Some(case.tumour.centre()));
        let (breast, sphere) = match (found, case.region) {
            // Labels that were brought need not hold a whole breast when the region is given.
            (breast, Some(sphere)) => (breast.ok(), sphere),
            (breast, None) => {
                let breast = breast?;
                let sphere = breast.region(map, Some(case.tumour))?;
                (Some(breast), sphere)
            }
        };
        Region::new(map, sphere)?.check_held()?;
        progress.at(0.4)?;
        let mut warnings = check_tumour(map, case.tumour, sphere)?;
        let nipple = breast.as_ref().and_then(|breast| breast.nipple(ct, map));
        warnings.extend(nipple.and_then(guessed));
        let nipple = nipple.map(|nipple| nipple.point);
        let middle = nipple.unwrap_or(sphere.centre());
        progress.at(0.5)?;
        let found = doubt.as_ref().map(|doubt| supine_segment::doubt(map, doubt, sphere));
        progress.at(0.6)?;
        let known = found.as_ref().map(|found| (found, middle));
        let place = (sphere, case.breast);
        let checked = supine_segment::check_region(ct, map, place, breast.as_ref(), known)?;
        warnings.extend(checked.warnings);
        progress.at(0.8)?;
        let chosen = Chosen {
            wall_doubt: found.map(|found| wall_doubt(&found, middle, case)),
            doubt,
            sphere,
            proposed: case.region.is_none(),
            soft_tissue_ml: volume_ml(map, sphere, label::is_soft_tissue),
            chest_wall_ml: volume_ml(map, sphere, label::is_chest_wall),
            nipple,
            gates: checked.gates.iter().map(gate).collect(),
        };
        progress.at(1.0)?;
        Ok((chosen, warnings))
    })
}

fn guessed(nipple: Nipple) -> Option<String> {
    (!nipple.seen).then(|| {
        format!(
            "no nipple stands out on the breast: its place, {:.0?} mm, is a guess; only the level \
             of pictures and its own displacement rest on it",
            <[f64; 3]>::from(nipple.point.coords)
        )
    })
}

/// The doubt in the words of the summary.
fn wall_doubt(found: &Doubt, middle: Point, case: &Case) -> WallDoubt {
    WallDoubt {
        boundary_cm2: found.boundary_cm2,
        doubtful_cm2: found.doubtful_cm2,
        limit_mm: DOUBTFUL_MM,
        largest: found.patches.first().map(|patch| DoubtfulPatch {
            area_cm2: patch.area_cm2,
            centre_mm: patch.centre.coords.into(),
            error_mm: patch.error_mm,
            place: patch.place(&middle, case.breast).into(),
        }),
    }
}

/// The tumour must lie in the region and its centre in the patient.
fn check_tumour(
    labels: &LabelMap,
    tumour: Sphere,
    region: Sphere,
) -> Result<Vec<String>, RunError> {
    let centre = tumour.centre();
    let beyond = region.signed_distance(&centre);
    if beyond > 0.0 {
        return Err(RunError::Tumour(format!(
            "its centre lies {beyond:.1} mm outside the region (centre {:.1?} mm, radius {:.1} \
             mm); correct the centre or name a `region` that holds it",
            <[f64; 3]>::from(region.centre().coords),
            region.radius()
        )));
    }
    let here = labels.grid().voxel_at(&centre).map_or(label::OUTSIDE, |v| labels.at(v));
    if here == label::OUTSIDE {
        let message = "its centre lies outside the patient; correct the centre (LPS, mm)";
        return Err(RunError::Tumour(message.into()));
    }
    let mut warnings = Vec::new();
    if label::is_chest_wall(here) {
        warnings.push(
            "the tumour's centre lies in what was segmented as chest wall, which does not move: \
             check the segmentation there, place a soft_tissue seed or correct the centre"
                .into(),
        );
    }
    if beyond + tumour.radius() > 0.0 {
        warnings.push(format!(
            "the tumour reaches {:.1} mm beyond the region; enlarge the region",
            beyond + tumour.radius()
        ));
    }
    Ok(warnings)
}

/// Volume of the voxels of a kind within the sphere, ml.
fn volume_ml(labels: &LabelMap, sphere: Sphere, kind: fn(u8) -> bool) -> f64 {
    let grid = labels.grid();
    let inside = |n: usize| sphere.contains(&grid.centre(grid.voxel(n)));
    let voxels = labels.data().iter().enumerate().filter(|&(n, &l)| kind(l) && inside(n)).count();
    voxels as f64 * grid.voxel_volume() / 1000.0
}
