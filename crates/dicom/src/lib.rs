//! DICOM CT series, segmentations, structure sets and doses in and out, registrations out;
//! inspection and verification of exports.
//!
//! A file is walked by this crate's own parser, which checks every length before it believes it and
//! keeps every value byte for byte: no library sees a file first, because none refuses a lying
//! length, a bomb or a deep nesting, and none keeps the strings that an export has to repeat
//! (see `data_set`). Stored values are masked to Bits Stored, sign-extended and rescaled here.
//!
//! - [`read_series`]: a folder or one file of it → [`supine_volume::Ct`], [`Source`], [`ReadInfo`]
//! - [`inspect`]: what a folder holds, and whether it can be used
//! - [`write_series`]: a volume on the grid of its source → a derived CT series
//! - [`read_segmentation`], [`write_segmentation`]: segments on the voxels of a CT
//! - [`read_structures`], [`write_structures`]: regions of interest drawn as contours
//! - [`read_dose`], [`write_dose`]: absorbed dose on a grid
//! - [`write_deformable`], [`write_chest_wall`]: registrations of an exported series with its
//!   source
//! - [`write_document`]: a PDF of the patient beside an exported series
//! - [`object_files`], [`file_header`], [`Identifier`]: objects that travel unchanged over a
//!   network
//! - [`verify_export`]: what no validator notices about an exported series
//!
//! Positions are LPS, mm; values are HU. No message carries the patient's name, ID or dates.
//!
//! ```
//! use std::path::Path;
//! use supine_dicom::{Accept, Depth, inspect};
//! use supine_space::Progress;
//!
//! # fn main() -> Result<(), supine_dicom::Error> {
//! // The synthetic patient of this repository.
//! let folder = Path::new("../../fixtures/patient/ct");
//! let inspection = inspect(folder, Depth::Headers, Accept::default(), Progress::none())?;
//! assert_eq!(inspection.usable().count(), 1);
//! # Ok(())
//! # }
//! ```
#![expect(clippy::disallowed_methods, reason = "edge crate: files")]

mod accept;
mod acquisitions;
mod anonymise;
mod character_set;
mod clock;
mod companion;
mod data_set;
mod deformed;
mod derived;
mod document;
mod dose;
mod equalise;
mod error;
mod excluded;
mod export;
mod files;
mod folder;
mod form;
mod geometry;
mod inspect;
mod multi_frame;
mod number;
mod object;
mod object_file;
mod padding;
mod patient_identity;
mod pixel_format;
mod pixels;
mod plausible;
mod policy;
mod read;
mod registration;
mod segmentation;
mod series;
mod series_summary;
mod slice;
mod source;
mod structures;
mod tilt;
mod uid;
mod verify;
mod warnings;
mod whole_file;

pub use accept::Accept;
pub use anonymise::Anonymiser;
pub use clock::Clock;
pub use companion::{CompanionParams, ObjectReference};
pub use deformed::{DEFORMED_ALREADY, tells_deformation};
pub use document::{Document, write_document};
pub use dose::{Dose, DoseInfo, read_dose, write_dose};
pub use error::Error;
pub use excluded::{LeftOut, LeftOutReason};
pub use export::{ExportParams, WriteInfo, write_series};
pub use files::{source_files, source_folder};
pub use geometry::lay_otherwise;
pub use inspect::{
    Depth, GridReport, Inspection, KindCount, PixelReport, PlanObject, PlanObjectKind,
    SeriesReport, SlicePixels, inspect,
};
pub use object::{RegionObject, has_marker, is_dose, region_object};
pub use object_file::{
    Identifier, NOT_USABLE, ObjectFile, ObjectFiles, Owner, class_name, file_header,
    implementation, implicit_data_set, is_ct, is_registration, is_uid, object_files, syntax_name,
};
pub use plausible::refuse_implausible;
pub use policy::Policy;
pub use read::{ReadInfo, ReadParams, read_series};
pub use registration::{Deformable, read_deformable, write_chest_wall, write_deformable};
pub use segmentation::{
    Meaning, Segment, Segmentation, SegmentationInfo, SegmentationParams, frame_of_reference,
    read_segmentation, write_carried_segmentation, write_segmentation,
};
pub use series_summary::SeriesSummary;
pub use source::Source;
pub use structures::{
    Drawing, Line, LineKind, Named, Roi, Structures, StructuresInfo, oddly_drawn, read_structures,
    write_structures,
};
pub use supine_record::PatientIdentity;
pub use verify::{Check, Expected, Original, Verification, verify_export};
