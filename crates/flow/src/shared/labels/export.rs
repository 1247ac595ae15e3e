//! Labels as a DICOM segmentation of the CT they belong to.

use crate::Error;
use std::path::Path;
use supine_dicom::{Clock, SegmentationParams, Source, write_segmentation};
use supine_volume::LabelMap;

/// How labels came about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum LabelOrigin {
    /// Found without a user's part.
    Automatic,
    /// Found with the user's seeds.
    Seeded,
    /// Supplied by the user.
    Supplied,
}

/// Writes labels as a DICOM segmentation (`.dcm`) of the series the CT came from.
///
/// # Errors
/// When the file cannot be written.
pub fn write_dicom_labels(
    labels: &LabelMap,
    (source, clock): (&Source, Clock),
    origin: LabelOrigin,
    path: &Path,
) -> Result<(), Error> {
    let version = env!("CARGO_PKG_VERSION");
    let params = SegmentationParams {
        series_description: "Labels of the supine CT [supine]".into(),
        automatic: origin == LabelOrigin::Automatic,
        algorithm: match origin {
            LabelOrigin::Automatic => format!("supine {version}"),
            LabelOrigin::Seeded => format!("supine {version} with seeds"),
            LabelOrigin::Supplied => format!("supplied to supine {version}"),
        },
        clock,
        before: 0,
        software_version: version.into(),
    };
    write_segmentation(labels, source, &params, path).map_err(Error::DicomLabels)?;
    Ok(())
}
