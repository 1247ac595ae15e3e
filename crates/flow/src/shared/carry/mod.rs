//! A patient's own dose, structures and segments in the operating position, as objects of the
//! exported CT.

mod context;
mod contours;
mod dose;
mod dose_volume;
mod job;
mod kinds;
mod object;
mod segments;

pub(crate) use context::{CarryContext, ExportedFiles};
pub(crate) use contours::{CarriedContours, carry_named_contours};
pub(crate) use dose::{NOT_ANEW, carry_with_totals, dose_doubts, not_anew};
pub(crate) use dose_volume::histograms;
pub(crate) use job::{CarriedDose, CarryJob, max_gy};
pub use kinds::{CarriedFile, CarriedKind};
pub(crate) use object::{Given, GivenObject, MovedObject, file_names};
