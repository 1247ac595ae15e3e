//! Points carried along.

use crate::{Error, Params, fade};
use std::sync::Arc;
use supine_mesh::{Deformation, Embedding, Motion, Place, Surround};
use supine_space::Point;

/// Points of the CT (LPS, mm) at the operating position (LPS, mm).
///
/// Exact within a tetrahedron for linear and quadratic displacements. A point up to
/// `params.collar_mm` outside the skin of the mesh, like a nipple or a mark on the skin, moves and
/// turns with the nearest point of that skin, as the CT does. `None` for all other points: they do
/// not move. `deformation` as the solver gave it, the fade is applied within.
///
/// # Errors
/// When a parameter is out of range.
pub fn carry_points(
    deformation: &Deformation,
    params: &Params,
    points: &[Point],
) -> Result<Vec<Option<Point>>, Error> {
    let faded = fade(deformation, params)?.deformation;
    let embedding = Arc::new(Embedding::new(faded.mesh().clone()));
    let surround = Surround { rigid_mm: params.collar_mm, ..Surround::default() };
    let motion = Motion::new(embedding.clone(), faded.displacement().clone(), surround)?;
    let carry = |p: &Point| {
        let place = embedding.place(p);
        let carried = match &place {
            Place::Inside(_) => true,
            Place::Beside(beside) => beside.distance_mm() <= params.collar_mm,
            Place::Wall | Place::Beyond => false,
        };
        carried.then(|| motion.at(&place).map(|u| p + u)).flatten()
    };
    Ok(points.iter().map(carry).collect())
}
