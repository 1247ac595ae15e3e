//! Where the mesh is finer than its boundary asks for.

use crate::Error;
use supine_space::{Point, Sphere};
use supine_volume::{Volume, sample_trilinear_at};

/// What the lengths of edges depend on beside the boundary. The number of tetrahedra stays the one
/// asked for: what is finer in one place makes the mesh coarser elsewhere.
#[derive(Clone, Debug, Default)]
pub enum Refinement {
    /// Nothing.
    #[default]
    None,
    /// Finer in and around a place.
    Near(Near),
    /// Lengths in units of what they would be, given on a grid (LPS) and carried on beyond it.
    Map(Volume<f32>),
    /// The longest edges wanted, mm, given on a grid (LPS) and carried on beyond it.
    Longest(Volume<f32>),
}

/// Finer in and around a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Near {
    /// The place, LPS, mm.
    pub place: Sphere,
    /// Longest edge wanted in it, mm.
    pub edge_mm: f64,
    /// Growth of that length with the distance from it, mm per mm; above 0.
    pub growth: f64,
}

impl Refinement {
    /// Checks the numbers.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let Self::Near(near) = self else { return Ok(()) };
        let setting = |name, value: f64, ok: bool, range| {
            if ok { Ok(()) } else { Err(Error::Setting { name, value, range }) }
        };
        let (edge, growth) = (near.edge_mm, near.growth);
        setting("edge_mm", edge, (0.1..=50.0).contains(&edge), "0.1 to 50")?;
        setting("growth (refinement)", growth, (0.05..=2.0).contains(&growth), "0.05 to 2")
    }

    /// The length wanted at a place (LPS) where `usual` is that without refinement, mm.
    pub(crate) fn length(&self, usual: f64, place: impl FnOnce() -> Point) -> f64 {
        match self {
            Self::None => usual,
            Self::Near(near) => {
                let off = near.place.signed_distance(&place()).max(0.0);
                usual.min(near.edge_mm + near.growth * off)
            }
            Self::Map(map) => usual * f64::from(sample_trilinear_at(map, &place())),
            Self::Longest(map) => usual.min(f64::from(sample_trilinear_at(map, &place()))),
        }
    }
}
