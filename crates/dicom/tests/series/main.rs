//! The crate from outside, on slices of the fixture patient that dicom-object changed and wrote.
#![expect(clippy::disallowed_methods, reason = "tests of an edge crate: files")]
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod deformed;
mod document;
mod dose;
mod exclude;
mod export;
mod geometry;
mod hazards;
mod multi_frame;
mod reading;
mod registration;
mod segmentation;
mod structures;
mod structures_out;
mod support;
mod values;
mod verify;
