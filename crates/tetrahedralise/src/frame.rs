//! The mesher's frame.

use supine_space::{Matrix, Point, Vector};

/// Millimetres along the axes of the voxel grid, from a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    /// Its origin, LPS, mm.
    pub(crate) origin: Point,
    /// Columns: its axes in LPS.
    pub(crate) axes: Matrix,
}

impl Frame {
    /// A place of the frame in LPS, mm.
    pub(crate) fn to_patient(self, p: &Vector) -> Point {
        self.origin + self.axes * p
    }

    /// A place in LPS (mm) in the frame.
    pub(crate) fn of_patient(self, p: &Point) -> Vector {
        self.axes.tr_mul(&(p - self.origin))
    }
}
