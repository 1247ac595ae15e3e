//! DICOM CT series, segmentations and structure sets in, series and segmentations out; inspection and verification of exports.
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
//! - [`read_structures`]: regions of interest drawn as contours
//! - [`verify_export`]: what no validator notices about an exported series
//!
//! Positions are LPS, mm; values are HU. No message carries the patient's name, ID or dates.
#![expect(clippy::disallowed_methods, reason = "edge crate: files")]

mod anonymise;
mod data_set;
mod derived;
mod error;
mod export;
mod folder;
mod geometry;
mod inspect;
mod multi_frame;
mod number;
mod object;
mod padding;
mod pixels;
mod plausible;
mod policy;
mod read;
mod segmentation;
mod slice;
mod structures;
mod uid;
mod verify;

pub use anonymise::Anonymiser;
pub use error::{Error, ErrorKind};
pub use export::{Clock, ExportParams, WriteInfo, write_series};
pub use folder::{LeftOut, SeriesSummary};
pub use inspect::{
    Depth, GridReport, Inspection, KindCount, PixelReport, SeriesReport, SlicePixels, inspect,
};
pub use object::{RegionObject, region_object};
pub use policy::Policy;
pub use read::{ReadInfo, ReadParams, Source, read_series};
pub use segmentation::{
    Meaning, Segment, Segmentation, SegmentationInfo, SegmentationParams, read_segmentation,
    write_segmentation,
};
pub use structures::{Roi, Structures, read_structures};
pub use verify::{Check, Expected, Verification, verify_export};
