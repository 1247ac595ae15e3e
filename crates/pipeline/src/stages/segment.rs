//! Segmentation: found, or brought along.

use super::import::Imported;
use crate::bench::{Bench, Done, Made};
use crate::store::{Store, form, hash_of};
use crate::{Case, RunError, Seeds, Stage};
use serde::{Deserialize, Serialize};
use std::path::Path;
use supine_exchange::{read_labels, write_labels, write_tenths};
use supine_report::Input;
use supine_segment::Params;
use supine_space::Progress;
use supine_volume::LabelMap;

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
        (Some(path), _) => vec![input_file("labels", path)?],
        (None, Seeds::File(path)) => vec![input_file("seeds", path)?],
        _ => vec![],
    };
    let files: Vec<&str> = inputs.iter().map(|i| i.blake3.as_str()).collect();
    let points = match &case.seeds {
        Seeds::Points(points) => Some(points),
        // A file counts by its contents.
        Seeds::Automatic | Seeds::File(_) => None,
    };
    let decided = format!("{:?} {points:?} {files:?}", Params::default());
    bench.stage(
        Stage::Segment,
        &[&input.key, &decided],
        |store| read_labels(&store.path("labels.seg.nrrd")?).map_err(RunError::Product),
        |store, progress| {
            let (labels, mut facts, warnings) = match &case.labels {
                Some(path) => brought(path, input)?,
                None => found(store, input, &case.seeds, progress)?,
            };
            facts.inputs = inputs.clone();
            write_labels(&labels, &store.path("labels.seg.nrrd")?).map_err(RunError::Product)?;
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
    let (made, info) = supine_segment::segment(&input.input.ct, &params, progress)?;
    write_tenths(&made.doubt, &store.path(DOUBT)?).map_err(RunError::Product)?;
    let facts =
        Facts { fat_hu: Some(info.fat_hu), muscle_hu: Some(info.muscle_hu), inputs: vec![] };
    Ok((made.labels, facts, info.warnings))
}

fn brought(path: &Path, input: &Imported) -> Result3 {
    let labels = read_labels(path).map_err(|source| RunError::File { role: "`labels`", source })?;
    if !same_grid(labels.grid(), input.input.ct.grid()) {
        return Err(RunError::OtherGrid);
    }
    // On the CT's own grid to the bit: files round positions to different digits.
    let labels = LabelMap::new(input.input.ct.grid().clone(), labels.into_parts().1)
        .map_err(|_| RunError::OtherGrid)?;
    Ok((labels, Facts { fat_hu: None, muscle_hu: None, inputs: vec![] }, vec![]))
}

/// Largest distance of corresponding voxel centres of two grids that are called the same, mm.
const SAME_GRID_MM: f64 = 0.01;

fn same_grid(a: &supine_space::Grid, b: &supine_space::Grid) -> bool {
    let size = a.size();
    size == b.size()
        && [[0, 0, 0], [size[0] - 1, 0, 0], [0, size[1] - 1, 0], [0, 0, size[2] - 1]]
            .into_iter()
            .all(|v| (a.centre(v) - b.centre(v)).norm() < SAME_GRID_MM)
}
