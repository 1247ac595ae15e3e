//! The user's points: what they ask of the surface ([`bind`]) and of the labels ([`stamp`]).

mod bind;
mod stamp;

pub(crate) use bind::Constraints;
pub(crate) use stamp::{check, stamp};

pub(crate) const WALL: &str = "chest-wall";
pub(crate) const SOFT: &str = "soft-tissue";
pub(crate) const EXCLUDE: &str = "exclude";
