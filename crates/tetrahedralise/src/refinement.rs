//! Where the mesh is finer than its boundary asks for.

use crate::boundary::Boundary;
use crate::fields::Fields;
use crate::sizing::Sizing;
use crate::{Error, MOST, Params};
use supine_space::{Point, Sphere, Vector};
use supine_volume::{Volume, sample_trilinear_at};

/// Samples along the radius of the sphere by which the number of tetrahedra is foreseen.
const SAMPLES: i32 = 20;
/// Base lengths up to this share of the sphere's radius are tried.
const COARSEST: f64 = 1.0;
/// The number that is advised leaves this for the rest, in units of what the refined place takes.
const SPARE: f64 = 1.25;
/// That number is sought in steps of this factor.
const STEP: f64 = 1.1;

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
        }
    }
}

/// The base length that gives about as many tetrahedra with refinement as `usual` (mm) gives without.
///
/// # Errors
/// When the refined place alone takes more.
pub(crate) fn base_length(fields: &Fields, params: &Params, usual: f64) -> Result<f64, Error> {
    if matches!(fields.refinement, Refinement::None) {
        return Ok(usual);
    }
    let step = fields.radius() / f64::from(SAMPLES);
    let along = || (-SAMPLES..=SAMPLES).map(|n| f64::from(n) * step);
    let places: Vec<Vector> = along()
        .flat_map(|z| along().flat_map(move |y| along().map(move |x| Vector::new(x, y, z))))
        .filter(|p| fields.depth(p) > 0.0)
        .collect();
    let plain = |usual| {
        let sizing = Sizing::new(fields, params, usual);
        places.iter().map(|p| sizing.at_surfaces(p).powi(-3)).sum::<f64>()
    };
    let wanted = plain(usual);
    let demand = |base| {
        let sizing = Sizing::new(fields, params, base);
        places.iter().map(|p| sizing.at(p).powi(-3)).sum::<f64>()
    };
    let (mut low, mut high) = (0.25 * usual, (COARSEST * fields.radius()).max(usual));
    let least = demand(high);
    if least > wanted {
        let mut needed = params.tetrahedra as f64;
        let edge = |n: f64| usual * (params.tetrahedra as f64 / n).cbrt();
        while needed < MOST as f64 && plain(edge(needed)) < SPARE * least {
            needed *= STEP;
        }
        let needed = needed.ceil() as usize;
        return Err(Error::TooFine { asked: params.tetrahedra, needed });
    }
    while high > 1.001 * low {
        let middle = (low * high).sqrt();
        if demand(middle) > wanted { low = middle } else { high = middle }
    }
    Ok(high)
}
