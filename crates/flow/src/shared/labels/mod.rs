//! A supplied segmentation, from whatever holds it, and the labels as a DICOM object.

mod compose;
mod export;
mod roles;

pub use export::{LabelOrigin, write_dicom_labels};
pub use roles::{RegionNameError, RegionNames};

use super::of_the_patient;
use crate::Error;
use compose::{Regions, compose};
use roles::{Candidate, plan};
use std::path::PathBuf;
use supine_dicom::{RegionObject, Source, read_segmentation, read_structures, region_object};
use supine_exchange::{SuppliedLabels as ReadLabels, read_supplied_labels};
use supine_space::{Grid, Progress, Warning};
use supine_volume::{Ct, LabelMap};

/// A supplied segmentation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SuppliedLabels {
    /// Label map (NRRD, NIfTI, .seg.nrrd), DICOM segmentation or RT structure set.
    pub file: PathBuf,
    /// Which regions are which part, in a file that names its regions.
    pub names: RegionNames,
}

/// Reads a supplied segmentation onto the grid of its CT, and what is uncertain about it.
/// Its content tells what the file is.
///
/// # Errors
/// When it cannot be read, does not say which regions are the body or soft tissue and the chest
/// wall, or cannot be of this CT.
pub fn read_supplied(
    supplied: &SuppliedLabels,
    ct: &Ct,
    source: Option<&Source>,
    progress: Progress<'_>,
) -> Result<(LabelMap, Vec<Warning>), Error> {
    let path = &supplied.file;
    if let Err(source) = std::fs::metadata(path) {
        return Err(Error::Missing { key: "labels.file", path: path.into(), source });
    }
    let (grid, frame) = (ct.grid(), source.map(Source::frame_of_reference_uid));
    let frame = frame.as_deref();
    let mut warnings = Vec::new();
    let opened = open(supplied, (grid, source), &mut warnings, progress.part(0.0, 0.2))?;
    progress.at(0.2)?;
    let (labels, composed) = match opened {
        Opened::Numbers(labels) => (labels, vec![]),
        Opened::Regions(regions) => {
            let candidates: Vec<Candidate> = regions.candidates();
            let plan = plan(&candidates, &supplied.names)?;
            compose(&regions, &plan, grid, frame, progress.part(0.2, 0.8))?
        }
    };
    let (labels, more) = supine_segment::take_labels(ct, labels)?;
    warnings.extend(composed.into_iter().chain(more));
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
    supplied: &SuppliedLabels,
    (grid, source): (&Grid, Option<&Source>),
    warnings: &mut Vec<Warning>,
    progress: Progress<'_>,
) -> Result<Opened, Error> {
    let path = &supplied.file;
    let object = region_object(path).map_err(Error::LabelsObject)?;
    if object.is_some() {
        warnings.extend(of_the_patient(path, source)?);
    }
    Ok(Opened::Regions(match object {
        Some(RegionObject::Segmentation) => {
            let frame = source.map(Source::frame_of_reference_uid);
            let read =
                read_segmentation(path, grid, frame.as_deref()).map_err(Error::LabelsObject)?;
            Regions::Segmentation(Box::new(read))
        }
        Some(RegionObject::Structures) => {
            Regions::Structures(read_structures(path).map_err(Error::LabelsObject)?)
        }
        None => {
            let read = read_supplied_labels(path, progress);
            match read.map_err(|source| Error::file("labels.file", source))? {
                ReadLabels::Segments(segments) => Regions::Segments(Box::new(segments)),
                ReadLabels::Numbers(_) if supplied.names.given() => {
                    return Err(RegionNameError::Nameless.into());
                }
                ReadLabels::Numbers(labels) => return Ok(Opened::Numbers(labels)),
            }
        }
    }))
}
