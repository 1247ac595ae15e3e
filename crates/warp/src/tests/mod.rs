//! Tests of the whole crate.

mod carry;
pub(crate) mod fixture;
mod reference;
mod skin;
mod warp;
