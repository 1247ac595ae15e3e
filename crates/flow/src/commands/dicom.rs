//! `supine inspect` and `supine verify-export`: DICOM files as they are.

use super::{Gather, check_there, input};
use crate::spec::Spec;
use crate::{Error, NodeId, Observer};
use std::path::{Path, PathBuf};
use supine_dicom::{Depth, Expected, Original, Policy};
use supine_exchange::{is_volume_elsewhere, is_volume_name, read_ct};
use supine_space::Progress;

pub use supine_dicom::{
    Inspection, PixelReport, PlanObject, PlanObjectKind, SeriesReport, Verification,
};

/// Keys of the table that both take.
pub const KEYS: &[&str] = &["assume_hu", "equalise_steps"];

/// What is asked of `supine inspect`.
#[derive(Clone, Debug)]
pub struct Inspect {
    /// Values for [`KEYS`].
    pub spec: Spec,
    /// A folder, or a file of a series.
    pub path: PathBuf,
    /// Whether every slice is decoded too.
    pub pixels: bool,
}

/// Looks at what a folder of DICOM holds.
///
/// # Errors
/// When it cannot be read.
pub fn inspect(given: &Inspect, observer: &dyn Observer) -> Result<Inspection, Error> {
    check_there(&given.path)?;
    check_dicom(&given.path)?;
    let depth = if given.pixels { Depth::Pixels } else { Depth::Headers };
    let accept = given.spec.case()?.accept;
    Gather::new(observer, &[]).work(NodeId::Import, |progress| {
        supine_dicom::inspect(&given.path, depth, accept, progress).map_err(failed)
    })
}

/// That a file is no volume of another format, by its name.
fn check_dicom(path: &Path) -> Result<(), Error> {
    if !path.is_file() || supine_dicom::has_marker(path) {
        return Ok(());
    }
    if is_volume_elsewhere(path) {
        read_ct(path, Progress::none()).map_err(|error| Error::file("ct", error))?;
    }
    if is_volume_name(path) {
        let path = path.display();
        let text = format!(
            "{path} is no DICOM, which is what `inspect` looks at; `supine check` looks at a case that names it as its CT"
        );
        return Err(input(text));
    }
    Ok(())
}

/// What is asked of `supine verify-export`.
#[derive(Clone, Debug)]
pub struct Verify {
    /// Values for [`KEYS`].
    pub spec: Spec,
    /// The exported series.
    pub dir: PathBuf,
    /// The series it was made from; without it much cannot be checked.
    pub source: Option<PathBuf>,
    /// A study of its own is expected.
    pub new_study: bool,
    /// The scanner is expected as the equipment.
    pub keep_equipment: bool,
    /// The source's frame of reference is expected.
    pub same_frame: bool,
    /// Values below -1024 HU are expected to be clipped.
    pub clip_padding: bool,
}

/// Checks what no validator notices about an exported series.
///
/// # Errors
/// When it or its source cannot be read; whatever is wrong with it is part of the answer.
pub fn verify_export(given: &Verify, observer: &dyn Observer) -> Result<Verification, Error> {
    [Some(&given.dir), given.source.as_ref()]
        .into_iter()
        .flatten()
        .try_for_each(|p| check_there(p))?;
    let &Verify { new_study, keep_equipment, same_frame, clip_padding, .. } = given;
    let policy = Policy { new_study, keep_equipment, same_frame, clip_padding };
    let expected = Expected { policy, anonymiser: None, accept: given.spec.case()?.accept };
    let source = given.source.as_deref().map(Original::Files);
    Gather::new(observer, &[]).work(NodeId::Export, |progress| {
        supine_dicom::verify_export(&given.dir, source, expected, progress).map_err(failed)
    })
}

fn failed(error: supine_dicom::Error) -> Error {
    match error {
        supine_dicom::Error::Stopped(_) => Error::Stopped,
        other => Error::Dicom(other),
    }
}
