//! The base length of edges where the mesh is finer in some places.

use crate::boundary::Boundary;
use crate::fields::Fields;
use crate::params::MAX_TETRAHEDRA;
use crate::refinement::Refinement;
use crate::sizing::Sizing;
use crate::{Error, Params};
use supine_space::Vector;

/// Samples along the radius of the sphere by which the number of tetrahedra is foreseen.
const SAMPLES: i32 = 20;
/// Base lengths up to this share of the sphere's radius are tried.
const COARSEST: f64 = 1.0;
/// The number that is advised leaves this for the rest, in units of what the refined place takes.
const SPARE: f64 = 1.25;
/// That number is sought in steps of this factor.
const STEP: f64 = 1.1;

/// The base length that gives about as many tetrahedra with refinement as `usual` (mm) gives
/// without.
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
    let lowest = demand(high);
    if lowest > wanted {
        let mut needed = params.tetrahedra as f64;
        let edge = |n: f64| usual * (params.tetrahedra as f64 / n).cbrt();
        while needed < MAX_TETRAHEDRA as f64 && plain(edge(needed)) < SPARE * lowest {
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
