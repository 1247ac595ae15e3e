//! DICOM CT series, segmentations, structure sets and doses in and out, registrations out; inspection and
//! verification of exports.
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
//! - [`write_deformable`], [`write_chest_wall`]: registrations of an exported series with its source
//! - [`object_files`], [`file_header`], [`Identifier`]: objects that travel unchanged over a network
//! - [`verify_export`]: what no validator notices about an exported series
//!
//! Positions are LPS, mm; values are HU. No message carries the patient's name, ID or dates.
#![expect(clippy::disallowed_methods, reason = "edge crate: files")]

mod accept;
mod anonymise;
mod companion;
mod data_set;
mod derived;
mod dose;
mod equalise;
mod error;
mod export;
mod folder;
mod geometry;
mod inspect;
mod multi_frame;
mod number;
mod object;
mod object_file;
mod padding;
mod pixels;
mod plausible;
mod policy;
mod read;
mod registration;
mod segmentation;
mod slice;
mod structures;
mod uid;
mod verify;
mod whole_file;

pub use accept::Accept;
pub use anonymise::Anonymiser;
pub use companion::{CompanionParams, ObjectReference};
pub use dose::{Dose, DoseInfo, read_dose, write_dose};
pub use error::{Error, ErrorKind};
pub use export::{Clock, ExportParams, WriteInfo, write_series};
pub use folder::{LeftOut, SeriesSummary};
pub use inspect::{
    Depth, GridReport, Inspection, KindCount, PixelReport, SeriesReport, SlicePixels, inspect,
};
pub use object::{RegionObject, is_dose, region_object};
pub use object_file::{
    Identifier, ObjectFile, ObjectFiles, class_name, file_header, implementation,
    implicit_data_set, is_uid, object_files, syntax_name,
};
pub use policy::Policy;
pub use read::{ReadInfo, ReadParams, Source, read_series};
pub use registration::{Deformable, read_deformable, write_chest_wall, write_deformable};
pub use segmentation::{
    Meaning, Segment, Segmentation, SegmentationInfo, SegmentationParams, frame_of_reference,
    read_segmentation, write_carried_segmentation, write_segmentation,
};
pub use structures::{
    Drawing, Line, LineKind, Roi, Structures, StructuresInfo, read_structures, write_structures,
};
pub use verify::{Check, Expected, Verification, verify_export};
