//! A segmentation brought along, from whatever holds it, and the labels as a DICOM object.

mod compose;
mod export;
mod roles;

pub use export::{LabelOrigin, write_dicom_labels};
pub use roles::{PartNames, RoleError};

use crate::{CtInput, RunError};
use compose::{Regions, compose};
use roles::{Candidate, plan};
use std::path::PathBuf;
use supine_dicom::{RegionObject, read_segmentation, read_structures, region_object};
use supine_space::Progress;
use supine_volume::LabelMap;

/// A segmentation brought along.
#[derive(Clone, Debug)]
pub struct Brought {
    /// Label map (NRRD, NIfTI, .seg.nrrd), DICOM segmentation or RT structure set.
    pub file: PathBuf,
    /// Which regions of a DICOM object are which part.
    pub names: PartNames,
}

/// Reads a segmentation that was brought along onto the grid of its CT, and what is doubtful about
/// it. What the file is, its content tells.
///
/// # Errors
/// When it cannot be read, does not say which regions are the body or soft tissue and the chest
/// wall, or cannot be of this CT.
pub fn read_brought(
    brought: &Brought,
    input: &CtInput,
    progress: Progress<'_>,
) -> Result<(LabelMap, Vec<String>), RunError> {
    let path = &brought.file;
    if let Err(source) = std::fs::metadata(path) {
        return Err(RunError::Missing { role: "`labels`", path: path.into(), source });
    }
    let grid = input.ct.grid();
    let frame = input.dicom.as_ref().map(|(source, _)| source.frame_of_reference_uid());
    let frame = frame.as_deref();
    let regions = match region_object(path).map_err(RunError::Regions)? {
        None if brought.names.given() => return Err(RoleError::NotDicom.into()),
        None => None,
        Some(RegionObject::Segmentation) => {
            let read = read_segmentation(path, grid, frame).map_err(RunError::Regions)?;
            Some(Regions::Segmentation(Box::new(read)))
        }
        Some(RegionObject::Structures) => {
            Some(Regions::Structures(read_structures(path).map_err(RunError::Regions)?))
        }
    };
    progress.at(0.2)?;
    let (labels, mut warnings) = match regions {
        None => {
            let read = supine_exchange::read_labels(path)
                .map_err(|source| RunError::File { role: "`labels`", source })?;
            (read, vec![])
        }
        Some(regions) => {
            let candidates: Vec<Candidate> = regions.candidates();
            let plan = plan(&candidates, &brought.names)?;
            compose(&regions, &plan, grid, frame, progress.part(0.2, 0.8))?
        }
    };
    let (labels, doubts) = supine_segment::take_labels(&input.ct, labels)?;
    warnings.extend(doubts);
    progress.at(1.0)?;
    Ok((labels, warnings))
}
