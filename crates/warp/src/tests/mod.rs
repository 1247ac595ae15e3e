//! Tests of the whole crate.

pub(crate) mod fixture;
mod reference;
mod skin;
mod warp;
