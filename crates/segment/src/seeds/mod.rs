//! What the user knows: its voxels ([`marks`], [`brush`]), what they ask of the surface of the
//! chest wall ([`bend`], [`bind`], [`pull`]) and of the labels ([`stamp`]), and what they did
//! ([`effect`]).

mod bend;
mod bind;
mod brush;
mod effect;
mod marks;
mod pull;
mod refusal;
mod resample;
mod stamp;

pub(crate) use bend::bent;
pub(crate) use bind::Constraints;
pub(crate) use effect::{Walls, warnings};
pub use marks::check_seeds_lie_in;
pub(crate) use marks::marks;
pub(crate) use pull::Free;
pub(crate) use stamp::stamp;
