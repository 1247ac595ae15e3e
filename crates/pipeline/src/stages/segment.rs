//! Segmentation: found, or brought along.

use super::import::Imported;
use crate::bench::{Bench, Done, Made};
use crate::facts::gate;
use crate::labels::{LabelOrigin, read_brought, write_dicom_labels};
use crate::outward::unnamed;
use crate::store::{Store, form, hash_of};
use crate::surfaces::write_surfaces;
use crate::{Case, RunError, Seeds, Stage};
use serde::{Deserialize, Serialize};
use std::path::Path;
use supine_exchange::{read_labels, write_labels, write_tenths};
use supine_report::{Gate, Input};
use supine_segment::{Params, Segmenter};
use supine_space::Progress;
use supine_volume::LabelMap;

/// What is known of the segmentation beside the labels.
#[derive(Serialize, Deserialize, Debug, Clone, Default)]
pub(crate) struct Facts {
    pub(crate) fat_hu: Option<f64>,
    pub(crate) muscle_hu: Option<f64>,
    /// What the whole CT was judged by; nothing when labels were brought.
    pub(crate) gates: Vec<Gate>,
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
        |store, progress| {
            read_labels(&store.path("labels.seg.nrrd")?, progress).map_err(RunError::product)
        },
        |store, progress| {
            let (labels, mut facts, warnings) = match &case.labels {
                Some(labels) => {
                    let part = progress.part(0.0, 0.9);
                    let (labels, mut warnings) = read_brought(labels, &input.input, part)?;
                    // Regions that were brought along can be named after the patient.
                    if case.export.anonymise {
                        warnings.iter_mut().for_each(|w| *w = unnamed(w));
                    }
                    (labels, Facts::default(), warnings)
                }
                None => found(store, input, &case.seeds, progress.part(0.0, 0.9))?,
            };
            facts.inputs = inputs.clone();
            write_labels(&labels, &store.path("labels.seg.nrrd")?, progress.part(0.9, 0.95))
                .map_err(RunError::product)?;
            let origin = match (&case.labels, &case.seeds) {
                (Some(_), _) => LabelOrigin::Brought,
                (None, Seeds::Automatic) => LabelOrigin::Automatic,
                (None, _) => LabelOrigin::Seeded,
            };
            if let Some(outward) = &input.outward {
                write_dicom_labels(&labels, &outward.source, origin, &store.path("labels.dcm")?)?;
            }
            progress.at(1.0)?;
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
    let params = Params { seeds: seeds.read(progress.part(0.0, 0.05))?, ..Params::default() };
    let segmenter = Segmenter::new(&input.input.ct, &params, progress.part(0.05, 0.65))?;
    let (made, info) = segmenter.segment(&params.seeds, progress.part(0.65, 0.75))?;
    let surfaces = segmenter.surfaces(&made, progress.part(0.75, 0.85))?;
    let (doubt, implants) = (segmenter.doubt(&made), segmenter.implants());
    drop(segmenter);
    if let Some(implants) = implants {
        write_labels(&implants, &store.path(IMPLANTS)?, progress.part(0.85, 0.87))
            .map_err(RunError::product)?;
    }
    write_surfaces(&surfaces, &store.path(SURFACES)?, progress.part(0.87, 0.97))?;
    write_tenths(&doubt, &store.path(DOUBT)?, progress.part(0.97, 1.0))
        .map_err(RunError::product)?;
    let facts = Facts {
        fat_hu: Some(info.fat_hu),
        muscle_hu: Some(info.muscle_hu),
        gates: info.gates.iter().map(gate).collect(),
        inputs: vec![],
    };
    Ok((made.labels, facts, info.warnings))
}

/// The implants that were found, when there are any: for the finer labels.
pub(crate) const IMPLANTS: &str = ".stages/implants.nrrd";

/// Skin and chest wall between the voxels, for the mesher.
pub(crate) const SURFACES: &str = ".stages/surfaces";
