//! What the user knows: its voxels ([`marks`]), what they ask of the surface of the chest wall
//! ([`bind`], [`pull`]) and of the labels ([`stamp`]), and what they did ([`effect`]).

mod bind;
mod effect;
mod marks;
mod pull;
mod resample;
mod stamp;

pub(crate) use bind::Constraints;
pub(crate) use effect::{Walls, warnings};
pub(crate) use marks::marks;
pub(crate) use pull::Free;
pub(crate) use stamp::stamp;
