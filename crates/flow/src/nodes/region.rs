//! The region: as given, or proposed from the breast; and whether the tumour lies in it.

use super::{Import, Segment, Segmented, Tumour};
use crate::case_state::CaseState;
use crate::graph::{Node, Outs};
use crate::work::Work;
use crate::{Error, NodeId};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use supine_report::{QualityCheck, SphereRecord, UncertainPatch, WallUncertainty};
use supine_segment::{Breast, BreastPlace, Nipple};
use supine_space::{Point, Progress, Side, Sphere, Warning};
use supine_volume::{Ct, Field, LabelMap, label};

/// A tumour of less density lies in lung, HU: lungs are -900 to -700, fat is -100.
const LUNG_HU: f64 = -400.0;
/// The uncertain places of the chest wall that are told one by one.
const PATCHES: usize = 12;

pub(crate) struct Region;

#[derive(Serialize)]
pub(crate) struct NodeInputs {
    left: bool,
    tumour: SphereRecord,
    region: Option<SphereRecord>,
}

/// The sphere, checked against the labels.
#[derive(Serialize, Deserialize, Clone, Debug)]
pub(crate) struct Chosen {
    region: SphereRecord,
    pub(crate) proposed: bool,
    /// Soft tissue within the sphere, ml.
    pub(crate) soft_tissue_ml: f64,
    /// Chest wall within the sphere, ml.
    pub(crate) chest_wall_ml: f64,
    /// Where the nipple seems to be, LPS, mm.
    nipple: Option<[f64; 3]>,
    /// How far the boundary of the chest wall may be wrong within the region; `None` of supplied
    /// labels.
    pub(crate) uncertainty: Option<WallUncertainty>,
    /// What the region was judged by.
    pub(crate) checks: Vec<QualityCheck>,
    /// What was measured of the CT, for the mesh, which needs no CT else; `None` without one.
    field: Option<KeptField>,
}

/// A field as records hold it.
#[derive(Serialize, Deserialize, Clone, Debug)]
struct KeptField {
    size: [usize; 2],
    spacing_mm: [f64; 2],
    /// [`Field::runs`].
    runs: Vec<usize>,
}

impl From<&Field> for KeptField {
    fn from(field: &Field) -> Self {
        Self { size: field.size(), spacing_mm: field.spacing(), runs: field.runs() }
    }
}

impl Chosen {
    /// A sphere that was given, without a CT to judge it by.
    pub(crate) fn given(sphere: Sphere) -> Self {
        Self {
            region: sphere.into(),
            proposed: false,
            soft_tissue_ml: 0.0,
            chest_wall_ml: 0.0,
            nipple: None,
            uncertainty: None,
            checks: vec![],
            field: None,
        }
    }

    /// What was measured of the CT, where that is known.
    pub(crate) fn field(&self) -> Option<Field> {
        let KeptField { size, spacing_mm, runs } = self.field.as_ref()?;
        Field::of_runs(*size, *spacing_mm, runs)
    }

    pub(crate) fn sphere(&self) -> Result<Sphere, Error> {
        Ok(self.region.sphere()?)
    }

    pub(crate) fn nipple(&self) -> Option<Point> {
        self.nipple.map(Point::from)
    }
}

impl Node for Region {
    const ID: NodeId = NodeId::Region;
    const METHOD: u32 = 10;
    const KEPT: bool = true;
    const BY_VALUE: bool = true;
    type NodeInputs = NodeInputs;
    type Parents = (Import, Tumour, Segment);
    type Out = Chosen;

    fn inputs(case_state: &CaseState) -> Result<NodeInputs, Error> {
        let case = &case_state.case;
        let left = case.breast()? == Side::Left;
        let tumour = case_state.tumour()?.sphere.into();
        Ok(NodeInputs { left, tumour, region: case.region.map(SphereRecord::from) })
    }

    fn run(
        inputs: &NodeInputs,
        (input, _, segmented): Outs<Self>,
        work: &Work<'_>,
    ) -> Result<Chosen, Error> {
        let side = if inputs.left { Side::Left } else { Side::Right };
        let tumour = inputs.tumour.sphere()?;
        let (ct, map, progress) = (&input.ct, &segmented.labels, work.progress);
        let detected = Breast::find(map, side, Some(tumour.centre()));
        let (breast, sphere) = match (detected, inputs.region) {
            // Labels that were supplied need not hold a whole breast when the region is given.
            (breast, Some(ball)) => {
                work.warn_all(breast.as_ref().err().and_then(missing));
                (breast.ok(), ball.sphere()?)
            }
            (breast, None) => {
                let breast = breast?;
                let (sphere, told) = breast.region(map, Some(tumour))?;
                work.warn_all(told);
                (Some(breast), sphere)
            }
        };
        supine_volume::Region::new(Arc::clone(map), sphere)?.check_held()?;
        progress.at(0.4)?;
        check_tumour(ct, map, tumour, sphere, work)?;
        let nipple = breast.as_ref().and_then(|breast| breast.nipple(ct, map));
        work.warn_all(nipple.and_then(guessed));
        let nipple = nipple.map(|nipple| nipple.point);
        let middle = breast.as_ref().map_or(sphere.centre(), Breast::centre);
        progress.at(0.5)?;
        let tenths = segmented.uncertainty(progress.part(0.5, 0.6))?;
        let from = (&middle, side);
        let uncertainty =
            tenths.map(|tenths| supine_segment::wall_uncertainty(map, &tenths, sphere, from));
        progress.at(0.6)?;
        let place = BreastPlace {
            region: sphere,
            side,
            breast: breast.as_ref(),
            uncertainty: uncertainty.as_ref(),
        };
        let checked = supine_segment::check_region(ct, &input.field, map, &place)?;
        work.warn_all(checked.warnings);
        progress.at(0.8)?;
        Ok(Chosen {
            uncertainty: uncertainty.map(|mut found| {
                found.patches.truncate(PATCHES);
                found
            }),
            proposed: inputs.region.is_none(),
            soft_tissue_ml: volume_ml(map, sphere, label::is_soft_tissue),
            chest_wall_ml: volume_ml(map, sphere, label::is_chest_wall),
            nipple: nipple.map(|nipple| nipple.coords.into()),
            checks: checked.checks.clone(),
            region: sphere.into(),
            field: Some((&input.field).into()),
        })
    }

    fn facts(out: &Chosen) -> Result<serde_json::Value, Error> {
        Ok(serde_json::to_value(out)?)
    }

    fn load(facts: serde_json::Value, _: &Work<'_>) -> Result<Chosen, Error> {
        Ok(serde_json::from_value(facts)?)
    }
}

impl Segmented {
    /// What is meshed.
    pub(crate) fn region(
        &self,
        sphere: Sphere,
        progress: Progress<'_>,
    ) -> Result<supine_volume::Region, Error> {
        let surfaces = self.surfaces(progress)?;
        Ok(supine_volume::Region::new(Arc::clone(&self.labels), sphere)?.with_surfaces(surfaces)?)
    }
}

/// A region that was given holds where a breast should be, and the other side bears one.
fn missing(error: &supine_segment::Error) -> Option<Warning> {
    matches!(error, supine_segment::Error::BreastMissing { .. })
        .then(|| Warning::new("breast-missing", error.to_string()))
}

fn guessed(nipple: Nipple) -> Option<Warning> {
    let place = <[f64; 3]>::from(nipple.point.coords);
    let text = format!(
        "no nipple stands out on the breast: its place, {place:.0?} mm, is a guess; only the level \
         of pictures and its inputs displacement rest on it"
    );
    (!nipple.seen).then(|| Warning::new("nipple-guessed", text).at(&nipple.point))
}

impl Chosen {
    /// The uncertain places of the chest wall, the largest first.
    pub(crate) fn patches(&self) -> &[UncertainPatch] {
        self.uncertainty.as_ref().map_or(&[], |uncertainty| &uncertainty.patches)
    }
}

/// How far the tumour's centre lies beyond the region's surface, mm; negative, as it must lie
/// within.
///
/// # Errors
/// [`Error::Tumour`] when it lies outside.
pub(crate) fn beyond_region(tumour: Sphere, region: Sphere) -> Result<f64, Error> {
    let beyond = region.signed_distance(&tumour.centre());
    if beyond <= 0.0 {
        return Ok(beyond);
    }
    Err(Error::Tumour(format!(
        "its centre lies {beyond:.1} mm outside the region (centre {:.1?} mm, radius {:.1} mm); correct the centre or \
         name a `region` that holds it",
        <[f64; 3]>::from(region.centre().coords),
        region.radius()
    )))
}

/// The tumour must lie in the region and its centre in the patient.
fn check_tumour(
    ct: &Ct,
    labels: &LabelMap,
    tumour: Sphere,
    region: Sphere,
    work: &Work<'_>,
) -> Result<(), Error> {
    let centre = tumour.centre();
    let beyond = beyond_region(tumour, region)?;
    let here = labels.grid().voxel_at(&centre).map_or(label::OUTSIDE, |v| labels.at(v));
    if here == label::OUTSIDE {
        let message = "its centre lies outside the patient; correct the centre (LPS, mm)";
        return Err(Error::Tumour(message.into()));
    }
    if label::is_chest_wall(here) && mean_hu(ct, tumour) < LUNG_HU {
        let text = "the tumour's centre lies in lung: correct the centre or the side";
        work.warn(Warning::new("tumour-in-lung", text).at(&centre));
    } else if label::is_chest_wall(here) {
        let text = "the tumour's centre lies in what was segmented as chest wall, which does not move: \
                    check the segmentation there, place a soft-tissue seed or correct the centre";
        work.warn(Warning::new("tumour-in-chest-wall", text).at(&centre));
    }
    let reach = beyond + tumour.radius();
    if reach > 0.0 {
        let text =
            format!("the tumour reaches {reach:.1} mm beyond the region; enlarge the region");
        work.warn(Warning::new("tumour-beyond-region", text).at(&centre));
    }
    Ok(())
}

/// Mean of the CT within half the sphere's radius, HU.
fn mean_hu(ct: &Ct, sphere: Sphere) -> f64 {
    let Ok(core) = Sphere::new(sphere.centre(), sphere.radius() / 2.0) else { return 0.0 };
    let Some((start, part)) = ct.grid().around(&core) else { return 0.0 };
    let (mut sum, mut count) = (0.0, 0.0);
    for n in 0..part.len() {
        let voxel = part.voxel(n);
        if core.contains(&part.centre(voxel)) {
            sum += f64::from(ct.at([0, 1, 2].map(|a| voxel[a] + start[a])));
            count += 1.0;
        }
    }
    sum / f64::max(count, 1.0)
}

/// Volume of the voxels of a kind within the sphere, ml.
fn volume_ml(labels: &LabelMap, sphere: Sphere, kind: fn(u8) -> bool) -> f64 {
    let grid = labels.grid();
    let Some((start, part)) = grid.around(&sphere) else { return 0.0 };
    let whole = |n: usize| {
        let voxel = part.voxel(n);
        [0, 1, 2].map(|a| voxel[a] + start[a])
    };
    let counts = |v: [usize; 3]| kind(labels.at(v)) && sphere.contains(&grid.centre(v));
    let voxels = (0..part.len()).into_par_iter().filter(|&n| counts(whole(n))).count();
    voxels as f64 * grid.voxel_volume() / 1000.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_segment::Error;

    #[test]
    fn a_region_in_place_of_a_breast_is_told_and_labels_without_any_are_not() {
        let side = Side::Left;
        let at = [75.0, -60.0, 0.0];
        let told = missing(&Error::BreastMissing { side, own_mm: 9.0, other_mm: 40.0, at });
        let text = told.unwrap().to_string();
        assert!(text.contains("left") && text.contains("9 mm") && text.contains("40 mm"), "{text}");
        assert!(missing(&Error::NoBreast { side, why: "none" }).is_none());
    }
}
