//! Segmentation: found, or brought along.

use super::import::Imported;
use crate::bench::{Bench, Done, Made};
use crate::labels::{LabelOrigin, read_brought, write_dicom_labels};
use crate::store::{Store, form, hash_of};
use crate::{Case, RunError, Seeds, Stage};
use serde::{Deserialize, Serialize};
use std::path::Path;
use supine_exchange::{
    read_labels, read_signed_distance, write_labels, write_signed_distance, write_tenths,
};
use supine_report::Input;
use supine_segment::{Params, Segmenter};
use supine_space::Progress;
use supine_volume::{LabelMap, RegionError, SignedDistance, Surfaces};

/// What is known of the segmentation beside the labels.
#[derive(Serialize, Deserialize, Debug, Clone)]
pub(crate) struct Facts {
    pub(crate) fat_hu: Option<f64>,
    pub(crate) muscle_hu: Option<f64>,
    /// Files of the case that went in: labels or seeds.
    pub(crate) inputs: Vec<Input>,
}

pub(crate) fn segment(
    bench: &mut Bench<'_>,
    case: &Case,
    input: &Imported,
) -> Result<Done<LabelMap, Facts>, RunError> {
    let inputs: Vec<Input> = match (&case.labels, &case.seeds) {
        (Some(labels), _) => vec![input_file("labels", &labels.file)?],
        (None, Seeds::File(path)) => vec![input_file("seeds", path)?],
        _ => vec![],
    };
    let files: Vec<&str> = inputs.iter().map(|i| i.blake3.as_str()).collect();
    let points = match &case.seeds {
        Seeds::Points(points) => Some(points),
        // A file counts by its contents.
        Seeds::Automatic | Seeds::File(_) => None,
    };
    let names = case.labels.as_ref().map(|l| &l.names);
    let decided = format!("{:?} {points:?} {files:?} {names:?}", Params::default());
    bench.stage(
        Stage::Segment,
        &[&input.key, &decided],
        |store| read_labels(&store.path("labels.seg.nrrd")?).map_err(RunError::Product),
        |store, progress| {
            let (labels, mut facts, warnings) = match &case.labels {
                Some(labels) => {
                    let (labels, warnings) = read_brought(labels, &input.input, progress)?;
                    (labels, Facts { fat_hu: None, muscle_hu: None, inputs: vec![] }, warnings)
                }
                None => found(store, input, &case.seeds, progress)?,
            };
            facts.inputs = inputs.clone();
            write_labels(&labels, &store.path("labels.seg.nrrd")?).map_err(RunError::Product)?;
            let origin = match (&case.labels, &case.seeds) {
                (Some(_), _) => LabelOrigin::Brought,
                (None, Seeds::Automatic) => LabelOrigin::Automatic,
                (None, _) => LabelOrigin::Seeded,
            };
            write_dicom_labels(&labels, &input.input, origin, &store.path("labels.dcm")?)?;
            Ok(Made { product: labels, facts, warnings })
        },
    )
}

fn input_file(role: &'static str, path: &Path) -> Result<Input, RunError> {
    let hashed = hash_of(path).map_err(|source| RunError::Missing {
        role: if role == "labels" { "`labels`" } else { "`seeds`" },
        path: path.into(),
        source,
    })?;
    Ok(Input { role: role.into(), form: form(path), files: hashed.files, blake3: hashed.blake3 })
}

type Result3 = Result<(LabelMap, Facts, Vec<String>), RunError>;

/// The doubt about labels that were found, in the output folder.
pub(crate) const DOUBT: &str = "labels-doubt.nrrd";

fn found(store: &Store, input: &Imported, seeds: &Seeds, progress: Progress<'_>) -> Result3 {
    let params = Params { seeds: seeds.read()?, ..Params::default() };
    let segmenter = Segmenter::new(&input.input.ct, &params, progress.part(0.0, 0.8))?;
    let (made, info) = segmenter.segment(&params.seeds, progress.part(0.8, 0.9))?;
    let surfaces = segmenter.surfaces(&made, progress.part(0.9, 1.0))?;
    let doubt = segmenter.doubt(&made);
    drop(segmenter);
    write_surfaces(store, &surfaces)?;
    write_tenths(&doubt, &store.path(DOUBT)?).map_err(RunError::Product)?;
    let facts =
        Facts { fat_hu: Some(info.fat_hu), muscle_hu: Some(info.muscle_hu), inputs: vec![] };
    Ok((made.labels, facts, info.warnings))
}

const SURFACES: [&str; 2] = [".stages/surfaces/skin.nrrd", ".stages/surfaces/chest_wall.nrrd"];

/// Keeps the surfaces of found labels for the mesher.
fn write_surfaces(store: &Store, surfaces: &Surfaces) -> Result<(), RunError> {
    for (name, surface) in SURFACES.into_iter().zip([&surfaces.skin, &surfaces.chest_wall]) {
        write_signed_distance(surface, &store.path(name)?).map_err(RunError::Product)?;
    }
    Ok(())
}

/// The surfaces of found labels, on the labels' grid to the bit; none of labels brought along.
pub(crate) fn read_surfaces(
    store: &Store,
    labels: &LabelMap,
) -> Result<Option<Surfaces>, RunError> {
    let [skin, chest_wall] = SURFACES;
    if !store.path(skin)?.exists() {
        return Ok(None);
    }
    let read = |name: &str| {
        let distance = read_signed_distance(&store.path(name)?).map_err(RunError::Product)?;
        let (grid, values) = distance.into_values().into_parts();
        let (surfaces, size) = (grid.size(), labels.grid().size());
        let values = labels.with_data(values);
        let values = values.map_err(|_| RegionError::OtherGrid { surfaces, labels: size })?;
        Ok::<_, RunError>(SignedDistance::from_values(values))
    };
    Ok(Some(Surfaces { skin: read(skin)?, chest_wall: read(chest_wall)? }))
}
