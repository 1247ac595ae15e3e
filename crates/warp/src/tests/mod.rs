//! Tests of the whole crate.

mod beyond;
mod carry;
mod contours;
pub(crate) mod fixture;
mod kept;
mod reference;
mod resampling;
mod skin;
mod warp;
