//! What bounds the mesh: surfaces that know how far a place lies off them.

use crate::complex::Class;
use supine_space::Vector;

/// Skin: positive outside the body.
pub(crate) const SKIN: usize = 0;
/// Chest wall: positive inside it.
pub(crate) const WALL: usize = 1;
/// The sphere: positive outside it.
pub(crate) const CUT: usize = 2;

/// The three surfaces that bound the soft tissue, in the mesher's frame (mm).
pub(crate) trait Boundary: std::fmt::Debug + Sync {
    /// Level of one surface at `p`, mm: negative on the side of the soft tissue; and its gradient.
    fn level_gradient(&self, field: usize, p: &Vector) -> (f64, Vector);

    /// Level of one surface at `p`, mm.
    fn level(&self, field: usize, p: &Vector) -> f64 {
        self.level_gradient(field, p).0
    }

    /// Levels of all three at `p`, mm.
    fn levels(&self, p: &Vector) -> [f64; 3] {
        [SKIN, WALL, CUT].map(|field| self.level(field, p))
    }

    /// Thickness of the soft tissue between skin and chest wall at `p`, mm, where it is thin; more
    /// than that where it is not.
    fn thickness(&self, p: &Vector) -> f64;

    /// Distance from `p` to the boundary of the soft tissue, mm; 0 outside.
    fn depth(&self, p: &Vector) -> f64;

    /// Distance from `p` to the nearest rim, mm, where it is near.
    fn rim_distance(&self, p: &Vector) -> f64;

    /// Edge length wanted at `p` where `usual` is that by the surfaces, mm.
    fn refined(&self, usual: f64, _p: &Vector) -> f64 {
        usual
    }

    /// The point near `p` that lies at `level` (mm) of each surface of `class`; `None` when there
    /// is none near.
    fn project(&self, class: Class, p: Vector, level: &[f64; 3]) -> Option<Vector>;
}
