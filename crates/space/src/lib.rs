//! Patient space: points, grids, spheres, gravity and the progress callback.
//!
//! Everything is in the DICOM patient frame LPS (x to the patient's left, y posterior, z superior),
//! in millimetres and f64. This crate knows no voxels' values, no mesh, no file. Also what every
//! stage answers with: [`Failure`] (the kind of an error), [`Warning`], [`Progress`]. Numbers that
//! are computed several at once ([`Pack`]) are here because the stages share them.
//!
//! # Example
//!
//! ```
//! use supine_space::{Grid, GridError, Matrix, Point, TablePose, Vector, sitting};
//!
//! # fn main() -> Result<(), GridError> {
//! let (size, spacing) = ([256, 256, 86], Vector::new(1.5, 1.5, 3.0));
//! let grid = Grid::new(size, spacing, Point::new(-192.0, -360.0, -720.0), Matrix::identity())?;
//! let tumour = Point::new(91.4, -248.1, -594.5);
//! assert_eq!(grid.voxel_at(&tumour), Some([189, 75, 42]));
//!
//! // A table that raises the head by 90 degrees: the patient sits.
//! let upright = TablePose { ap_deg: 90.0, lat_deg: 0.0 };
//! assert!((upright.gravity() - sitting()).norm() < 1e-12);
//! # Ok(())
//! # }
//! ```

mod failure;
mod gravity;
mod grid;
mod pack;
mod progress;
mod sphere;
mod text;
mod view;
mod warning;

pub use failure::Failure;
pub use gravity::{GRAVITY_M_S2, Posture, TablePose, sitting, supine};
pub use grid::{Grid, GridError};
pub use pack::{LANES, Pack};
pub use progress::{Beside, OneOf, Progress, Stopped, Watch};
pub use sphere::{Sphere, SphereError};
pub use text::{from_cell, from_file, separator, to_cell, visible};
pub use view::{Plane, Spot, View};
pub use warning::Warning;

/// A position in patient space, LPS, mm.
pub type Point = nalgebra::Point3<f64>;
/// A difference of positions in patient space, LPS, mm; or a direction without unit.
pub type Vector = nalgebra::Vector3<f64>;
/// A 3 x 3 matrix, mostly a direction matrix whose columns are the grid's axes in LPS.
pub type Matrix = nalgebra::Matrix3<f64>;

/// A rigid motion: what moves a body from where it was to where it is; LPS, mm.
pub type Pose = nalgebra::Isometry3<f64>;

/// The patient's own side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Towards +x in LPS.
    Left,
    /// Towards -x in LPS.
    Right,
}

impl Side {
    /// +1 for the left, -1 for the right: the sign of x in LPS.
    pub fn sign(self) -> f64 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
        }
    }
}

impl std::fmt::Display for Side {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Left => "left",
            Self::Right => "right",
        })
    }
}
