//! Points carried along.

use crate::{Error, Params, map::Prepared};
use supine_mesh::{Displacement, Locator, TetMesh};
use supine_space::Point;

/// Points of the CT (LPS, mm) at the operating position (LPS, mm); `None` for points outside the
/// mesh, which do not move.
///
/// Exact within a tetrahedron for linear and quadratic displacements; `displacement` as the solver
/// gave it, the fade is applied within.
///
/// # Errors
/// When the displacement belongs to another mesh or a parameter is out of range.
pub fn carry_points(
    mesh: &TetMesh,
    displacement: &Displacement,
    params: &Params,
    points: &[Point],
) -> Result<Vec<Option<Point>>, Error> {
    let prepared = Prepared::new(mesh, displacement, params)?;
    let locator = Locator::new(mesh);
    let carry = |p: &Point| {
        let at = locator.locate(p)?;
        Some(p + prepared.displacement.at(mesh, &prepared.edges, at.tet, at.weights))
    };
    Ok(points.iter().map(carry).collect())
}
