//! Tests of the whole crate.

mod fixture;
mod reference;
mod skin;
mod warp;
