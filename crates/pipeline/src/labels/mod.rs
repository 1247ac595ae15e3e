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
use supine_exchange::{BroughtLabels, read_brought_labels};
use supine_space::{Grid, Progress};
use supine_volume::LabelMap;

/// A segmentation brought along.
#[derive(Clone, Debug)]
pub struct Brought {
    /// Label map (NRRD, NIfTI, .seg.nrrd), DICOM segmentation or RT structure set.
    pub file: PathBuf,
    /// Which regions are which part, in a file that names its regions.
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
    let opened = open(brought, grid, frame, progress.part(0.0, 0.2))?;
    progress.at(0.2)?;
    let (labels, mut warnings) = match opened {
        Opened::Numbers(labels) => (labels, vec![]),
        Opened::Regions(regions) => {
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

/// What a file of labels holds.
enum Opened {
    /// The numbers of [`supine_volume::label`].
    Numbers(LabelMap),
    /// Regions by name.
    Regions(Regions),
}

fn open(
    brought: &Brought,
    grid: &Grid,
    frame: Option<&str>,
    progress: Progress<'_>,
) -> Result<Opened, RunError> {
    let path = &brought.file;
    Ok(Opened::Regions(match region_object(path).map_err(RunError::Regions)? {
        Some(RegionObject::Segmentation) => {
            let read = read_segmentation(path, grid, frame).map_err(RunError::Regions)?;
            Regions::Segmentation(Box::new(read))
        }
        Some(RegionObject::Structures) => {
            Regions::Structures(read_structures(path).map_err(RunError::Regions)?)
        }
        None => {
            let read = read_brought_labels(path, progress);
            match read.map_err(|source| RunError::file("`labels`", source))? {
                BroughtLabels::Segments(segments) => Regions::Segments(Box::new(segments)),
                BroughtLabels::Numbers(_) if brought.names.given() => {
                    return Err(RoleError::Nameless.into());
                }
                BroughtLabels::Numbers(labels) => return Ok(Opened::Numbers(labels)),
            }
        }
    }))
}
