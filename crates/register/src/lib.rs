//! Surface scans brought onto the skin of a CT.
//!
//! A scan has a frame of its own. [`align`] finds the rigid pose that brings its points onto a
//! surface, and with it parameters of the surface's shape, where it has any ([`Shape`]); [`Skin`]
//! is the surface of a CT. [`by_landmarks`] and [`candidates`] find poses to begin from. A pose
//! takes the scan's frame to the patient's: LPS, mm.
//!
//! ```
//! use supine_register::by_landmarks;
//! use supine_space::{Point, Pose};
//!
//! # fn main() -> Result<(), supine_register::Error> {
//! let moved = Pose::translation(5.0, -3.0, 8.0);
//! let marks = [[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [0.0, 80.0, 0.0]].map(Point::from);
//! let found = by_landmarks(&marks.map(|mark| (mark, moved * mark)))?;
//! assert!(found.rms_mm < 1e-9 && (found.pose * marks[1] - moved * marks[1]).norm() < 1e-9);
//! # Ok(())
//! # }
//! ```

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
