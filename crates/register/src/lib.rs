//! Surface scans brought onto the skin of a CT.
//!
//! A scan has a frame of its own. [`align`] finds the rigid pose that brings its points onto a
//! surface, and with it parameters of the surface's shape, where it has any ([`Shape`]); [`Skin`]
//! is the surface of a CT. [`by_landmarks`] and [`candidates`] find poses to begin from. A pose
//! takes the scan's frame to the patient's: LPS, mm.

mod align;
mod candidates;
mod error;
mod landmarks;
mod matches;
mod robust;
mod shape;
mod signed_distances;
mod skin;
#[cfg(test)]
mod tests;

pub use align::{Aligned, Params, Start, align, align_near};
pub use candidates::candidates;
pub use error::Error;
pub use landmarks::{Fitted, by_landmarks};
pub use matches::{Match, Matches};
pub use robust::Tukey;
pub use shape::{Posed, Prior, Rigid, Scaled, Shape};
pub use signed_distances::{Distances, signed_distances};
pub use skin::{SKIN_SPACING_MM, Skin};
