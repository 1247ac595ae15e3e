//! Which way fibres run: from the chest wall to the skin.
//!
//! Along the gradient of the solution of Laplace's equation that is 0 on the wall and 1 on the
//! skin, on linear elements; its mean over the tetrahedra around each point, weighted with their
//! volume, is interpolated in between. So they meet both surfaces nearly at right angles, as the
//! ligaments of Cooper do in the mean.

use crate::element::{Elements, quadrature};
use crate::krylov::conjugate_gradients;
use crate::recovery::recovered;
use supine_mesh::{BoundaryTag, TetMesh};
use supine_space::Vector;

/// Relative residual of the solution.
const GOAL: f64 = 1e-12;

/// Unit vectors at the quadrature points of each tetrahedron; zero where wall and skin give none.
pub(crate) fn wall_to_skin<const Q: usize>(mesh: &TetMesh) -> Vec<[Vector; Q]> {
    let at_points = gradients_at_points(mesh).unwrap_or_default();
    let places = quadrature::<Q>();
    let of = |tet: &[u32; 4]| {
        places.map(|l| {
            let mean = |(point, share): (&u32, f64)| at_points[*point as usize] * share;
            tet.iter().zip(l).map(mean).sum::<Vector>().try_normalize(0.0).unwrap_or_default()
        })
    };
    if at_points.is_empty() {
        return vec![[Vector::zeros(); Q]; mesh.tets().len()];
    }
    mesh.tets().iter().map(of).collect()
}

/// The gradient at each point, 1/mm; `None` when no solution is found.
fn gradients_at_points(mesh: &TetMesh) -> Option<Vec<Vector>> {
    let positions: Vec<Vector> = mesh.points().iter().map(|p| p.coords).collect();
    let elements = Elements::<4, 1>::new(&positions, mesh.tets().to_vec()).ok()?;
    let solution = potential(mesh, &elements)?;
    // Its gradient is a row of that of a field along x.
    let field: Vec<Vector> = solution.into_iter().map(|value| Vector::x() * value).collect();
    let gradients = recovered(&positions, &elements.nodes, mesh, &field);
    Some(gradients.into_iter().map(|gradient| gradient.row(0).transpose()).collect())
}

/// 0 on the wall, 1 on the skin, harmonic between.
fn potential(mesh: &TetMesh, elements: &Elements<4, 1>) -> Option<Vec<f64>> {
    let mut known = vec![None; mesh.points().len()];
    for (tag, value) in [(BoundaryTag::Skin, 1.0), (BoundaryTag::ChestWall, 0.0)] {
        mesh.points_on(tag).into_iter().for_each(|p| known[p as usize] = Some(value));
    }
    let apply = |x: &[f64], product: &mut [f64]| {
        product.fill(0.0);
        for (tet, (g, weight)) in
            elements.nodes.iter().zip(elements.gradients.iter().zip(&elements.weights))
        {
            let gradient: Vector =
                tet.iter().zip(&g[0]).map(|(p, g)| g * x[*p as usize]).sum::<Vector>();
            for (p, g) in tet.iter().zip(&g[0]) {
                product[*p as usize] += weight[0] * g.dot(&gradient);
            }
        }
    };
    let free = |values: &mut [f64]| {
        values.iter_mut().zip(&known).filter(|(_, k)| k.is_some()).for_each(|(v, _)| *v = 0.0);
    };
    let start: Vec<f64> = known.iter().map(|k| k.unwrap_or(0.0)).collect();
    let mut right = vec![0.0; start.len()];
    apply(&start, &mut right);
    right.iter_mut().for_each(|r| *r = -*r);
    free(&mut right);
    let mut diagonal = vec![0.0; start.len()];
    for (tet, (g, weight)) in
        elements.nodes.iter().zip(elements.gradients.iter().zip(&elements.weights))
    {
        tet.iter().zip(&g[0]).for_each(|(p, g)| {
            diagonal[*p as usize] += weight[0] * g.norm_squared();
        });
    }
    let correction = conjugate_gradients(
        |x, product| {
            apply(x, product);
            free(product);
        },
        |x| {
            x.iter_mut().zip(&diagonal).for_each(|(x, d)| *x /= d.max(f64::MIN_POSITIVE));
            true
        },
        &right,
        GOAL,
        10 * start.len(),
    )?;
    Some(start.iter().zip(&correction).map(|(s, c)| s + c).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_mesh::{block, tagged};

    /// Between two parallel planes they stand upright, near the free sides too.
    #[test]
    fn between_parallel_planes_they_stand_upright() {
        let mesh = tagged(&block([3, 3, 4], 5.0, 0.0), |c| {
            let all = |z: f64| c.iter().all(|p| (p.z - z).abs() < 1e-9);
            match (all(0.0), all(20.0)) {
                (true, _) => BoundaryTag::ChestWall,
                (_, true) => BoundaryTag::Skin,
                _ => BoundaryTag::Cut,
            }
        });
        for a in wall_to_skin::<4>(&mesh).into_iter().flatten() {
            assert!((a - Vector::z()).norm() < 1e-9, "{a}");
        }
    }

    #[test]
    fn without_skin_there_are_none() {
        let mesh = tagged(&block([2, 2, 2], 5.0, 0.1), |_| BoundaryTag::ChestWall);
        assert!(wall_to_skin::<1>(&mesh).into_iter().flatten().all(|a| a == Vector::zeros()));
    }
}
