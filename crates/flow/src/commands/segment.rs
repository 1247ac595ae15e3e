//! `supine segment`: labels of a CT.

use super::{Gather, Outputs, VOLUMES, check_ending, ends, messages, session, usage};
use crate::nodes::{Chosen, Import, Region, Segment as SegmentNode, Tissues};
use crate::session::{Request, Session, Start};
use crate::shared::{SURFACES, write_dicom_labels, write_surfaces};
use crate::spec::{Spec, Value};
use crate::{Error, NodeId, Observer};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;
use supine_exchange::{write_labels, write_tenths};
use supine_report::Warning;
use supine_segment::tumour_place;
use supine_space::{Grid, Progress, Sphere};
use supine_volume::{Ct, label};

/// Keys of the table that it takes.
pub const KEYS: &[&str] = &[
    "ct",
    "series",
    "exclude",
    "assume_hu",
    "equalise_steps",
    "position",
    "seeds.file",
    "seeds.chest_wall",
    "seeds.soft_tissue",
    "seeds.exclude",
    "seeds.strokes",
    "tissues",
    "tumour.centre",
    "tumour.radius",
    "tumour.structure",
    "tumour.file",
];

/// What is asked.
#[derive(Clone, Debug)]
pub struct Segment {
    /// Values for [`KEYS`].
    pub spec: Spec,
    /// A case file for those that are not given; its seeds only when no others are.
    pub case: Option<PathBuf>,
    /// The file of the labels; `.dcm`: a DICOM segmentation.
    pub out: PathBuf,
    /// A file for how far the boundary of the chest wall may be wrong, tenths of mm.
    pub uncertainty: Option<PathBuf>,
    /// A folder for skin and chest wall between the voxels.
    pub surfaces: Option<PathBuf>,
    /// When it began: what a DICOM object bears; without it the time of the source series.
    pub start: Option<Start>,
    /// Whether files that are there already may be replaced.
    pub overwrite: bool,
}

/// What was made.
#[derive(Clone, Debug, Serialize)]
pub struct SegmentDone {
    /// The file of the labels.
    pub labels: PathBuf,
    /// Volume of the soft tissue in the whole CT, ml.
    pub soft_tissue_ml: f64,
    /// Volume of the chest wall and all it encloses, ml.
    pub chest_wall_ml: f64,
    /// Level of fat, HU.
    pub fat_hu: Option<f64>,
    /// Level of muscle, HU.
    pub muscle_hu: Option<f64>,
    /// The finer labels by name, where they were asked for.
    pub tissues: BTreeMap<String, TissueFacts>,
    /// What the user must know.
    #[serde(serialize_with = "messages")]
    pub warnings: Vec<Warning>,
}

/// What is told of a finer label.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct TissueFacts {
    /// Volume in the whole CT, ml.
    pub ml: f64,
    /// Mean of the CT in it, HU; 0 where there is none.
    pub mean_hu: f64,
}

/// Makes labels of a CT.
///
/// # Errors
/// When a stage fails, or labels are asked for as DICOM of a CT that did not come as DICOM.
pub fn segment(given: &Segment, observer: &dyn Observer) -> Result<SegmentDone, Error> {
    Outputs::beside(given.spec.files().chain(given.case.as_deref()))
        .file("--out", Some(&given.out))
        .file("--uncertainty", given.uncertainty.as_deref())
        .within("--surfaces", given.surfaces.as_deref(), &SURFACES)
        .check(given.overwrite)?;
    let kinds = [&[".dcm"], &VOLUMES[..]].concat();
    check_ending("--out", &given.out, "labels are", &kinds)?;
    if let Some(file) = &given.uncertainty {
        check_ending("--uncertainty", file, "a map of lengths is", &[".nrrd"])?;
    }
    let session = session(&spec(given)?)?;
    let gather = Gather::new(observer, &[NodeId::Region]);
    let request = Request { observer: &gather, ..Request::default() };
    let input = session.get::<Import>(&request)?;
    check_tumour(&session, &input.ct)?;
    let dicom = ends(&given.out, &[".dcm"]);
    if dicom && input.source.is_none() {
        return Err(usage(
            "--out: the CT did not come as DICOM, so no DICOM segmentation can be written; name a .seg.nrrd, .nrrd, \
             .nii.gz or .mha file",
        ));
    }
    let segmented = session.get::<SegmentNode>(&request)?;
    // Tissues are measured in a region: here the whole CT.
    session.give::<Region>(Chosen::given(whole(input.ct.grid())?), "the whole CT".into());
    let tissues = session.get::<Tissues>(&request)?;
    let labels = tissues.labels.as_ref().unwrap_or(&segmented.labels);
    gather.work(NodeId::Export, |progress| {
        match input.source.as_ref().filter(|_| dicom) {
            Some(source) => {
                let start = given.start.as_ref().map(|start| start.clock.clone());
                let clock = start.unwrap_or_else(|| source.clock());
                write_dicom_labels(labels, (source, clock), segmented.facts.origin, &given.out)?;
            }
            None => write_labels(labels, &given.out, progress).map_err(Error::product)?,
        }
        let uncertainty = segmented.uncertainty(Progress::none())?;
        if let (Some(path), Some(tenths)) = (&given.uncertainty, &uncertainty) {
            write_tenths(tenths, path, Progress::none()).map_err(Error::product)?;
        }
        let surfaces = given.surfaces.as_ref().map(|_| segmented.surfaces(progress)).transpose()?;
        if let (Some(folder), Some(surfaces)) = (&given.surfaces, surfaces.flatten()) {
            write_surfaces(&surfaces, folder, Progress::none())?;
        }
        Ok(())
    })?;
    let ml = |kind: fn(u8) -> bool| {
        let voxels = labels.data().iter().filter(|l| kind(**l)).count();
        voxels as f64 * labels.grid().voxel_volume() / 1000.0
    };
    let volumes = tissues.facts.iter().flat_map(|facts| &facts.volumes).map(|volume| {
        let mean_hu = volume.mean_hu.unwrap_or_default();
        (volume.name.clone(), TissueFacts { ml: volume.whole_ct_ml, mean_hu })
    });
    Ok(SegmentDone {
        labels: given.out.clone(),
        soft_tissue_ml: ml(label::is_soft_tissue),
        chest_wall_ml: ml(label::is_chest_wall),
        fat_hu: segmented.facts.fat_hu,
        muscle_hu: segmented.facts.muscle_hu,
        tissues: volumes.collect(),
        warnings: gather.warnings(),
    })
}

/// That a tumour lies in the CT, whether or not it becomes a label.
fn check_tumour(session: &Session, ct: &Ct) -> Result<(), Error> {
    let case_state = session.case_state();
    if case_state.case.tumour.is_some() {
        tumour_place(ct, case_state.tumour()?.sphere, None)?;
    }
    Ok(())
}

/// The values that are given, and those of the case for what is not.
fn spec(given: &Segment) -> Result<Spec, Error> {
    let Some(case) = &given.case else { return Ok(given.spec.clone()) };
    let case = Spec::read(case)?;
    let mut spec = Spec::new(case.folder());
    let seeds = |key: &&&str| key.starts_with("seeds.");
    let seeded = KEYS.iter().filter(seeds).any(|key| given.spec.get(key).is_some());
    for key in KEYS {
        let of_case = case.get(key).filter(|_| !(seeded && seeds(&key)));
        let value = given.spec.get(key).or(of_case).map(Value::json);
        spec.set(key, &value.unwrap_or_default())?;
    }
    Ok(spec)
}

/// A sphere around a grid.
fn whole(grid: &Grid) -> Result<Sphere, Error> {
    let last = grid.size().map(|n| n as f64 - 1.0);
    let middle = grid.patient_from_index(last.map(|n| 0.5 * n));
    let reach = (grid.patient_from_index(last) - middle).norm() + grid.spacing().norm();
    Sphere::new(middle, reach).map_err(|e| super::input(e.to_string()))
}
