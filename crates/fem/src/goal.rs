//! Where a mesh should be finer for the displacement at one place.
//!
//! The error of a quantity J(u) is about Σ_T η_T with η_T the error of the solution in tetrahedron
//! T weighted by that of the adjoint solution z, K(u) z = ∂J/∂u (Becker and Rannacher, Acta
//! Numerica 2001). Both errors are taken from the gradients: what a gradient lacks to the
//! continuous one that is recovered from the tetrahedra around each point (Zienkiewicz and Zhu
//! 1987).

use crate::discretisation::Discretisation;
use crate::element::shape;
use crate::newton::KnownEquilibrium;
use crate::recovery::{averaged, corner_gradients};
use crate::tangent::Tangent;
use crate::wall_effect::WallNode;
use crate::{Body, Error, Job, Load, Params, RestState, checked};
use supine_mesh::{Locator, Order, TetMesh};
use supine_space::{Matrix, Point, Progress, Sphere, Vector};

/// Samples of the goal across its diameter.
const ACROSS: usize = 5;

/// What each tetrahedron adds to the error of the mean displacement of the tissue within `goal`
/// (LPS, mm), an estimate in mm. Their proportions count: shares of several tetrahedra cancel, and
/// on coarse meshes the recovered gradients are far off themselves.
///
/// The elements are taken for straight even where `body.curved` has them follow skin and chest
/// wall, and the CT shape for free of stress whatever `params.rest` says: where the mesh should be
/// fine hardly depends on either. What curved elements take off the error itself is not in the
/// shares: their sum is that of straight elements.
///
/// # Errors
/// As [`crate::solve`]; [`Error::GoalOutside`] when no tissue of the mesh lies within `goal`.
pub fn error_shares(
    body: &Body,
    load: &Load,
    params: &Params,
    goal: &Sphere,
    progress: Progress<'_>,
) -> Result<Vec<f64>, Error> {
    Ok(goal_errors(body, load, params, goal, progress)?.shares)
}

/// What the displacement of a place rests on: its error by the mesh, and what the place of the
/// chest wall does to it.
#[derive(Clone, Debug, PartialEq)]
pub struct GoalErrors {
    /// Mean displacement of the tissue within the goal, mm.
    pub displacement: Vector,
    /// What each tetrahedron adds to the error of the mean displacement, mm: see [`error_shares`].
    pub shares: Vec<f64>,
    /// What each node of the chest wall does to it.
    pub wall: Vec<WallNode>,
}

/// What the mean displacement of the tissue within `goal` (LPS, mm) rests on; as [`error_shares`],
/// and the elements are straight and the CT shape free of stress here too.
///
/// # Errors
/// As [`error_shares`].
pub fn goal_errors(
    body: &Body,
    load: &Load,
    params: &Params,
    goal: &Sphere,
    progress: Progress<'_>,
) -> Result<GoalErrors, Error> {
    let edges = checked(body, load, params)?;
    let params = Params { rest: RestState::Net, ..*params };
    let body = &Body { curved: None, ..body.clone() };
    let job = Job::new(body, &edges, load, &params);
    match params.order {
        Order::Linear => job.goal_errors::<4, 1>(goal, progress),
        Order::Quadratic => job.goal_errors::<10, 4>(goal, progress),
    }
}

impl Job<'_> {
    fn goal_errors<const N: usize, const Q: usize>(
        &self,
        goal: &Sphere,
        progress: Progress<'_>,
    ) -> Result<GoalErrors, Error> {
        let discretisation = Discretisation::<N, Q>::new(self)?;
        let Discretisation { positions, held, .. } = &discretisation;
        let means = self.means(goal, &discretisation.elements.nodes, positions.len())?;
        let model = self.model(&discretisation);
        let load = model.elements.load(held.len(), self.force());
        let (zero, goal) = (discretisation.zero(), self.params.tolerance);
        let tangent = Tangent::new(&discretisation.lower).map_err(|_| discretisation.memory())?;
        let mut newton = self.newton(&model, tangent, held);
        let equilibrium = newton
            .equilibrium(&load, &zero, KnownEquilibrium { u: &zero, load: &zero }, goal, progress)
            .map_err(|halt| newton.failed(halt, self.params.tolerance))?;
        let lack =
            |field: &[Vector]| missing(positions, &model.elements.nodes, &self.body.mesh, field);
        let own = lack(&equilibrium.u);
        let means = means.each_ref().map(Vec::as_slice);
        let adjoints = newton
            .linearised(&equilibrium.u, means)
            .map_err(|_| Error::Memory { unknowns: newton.unknowns() })?
            .ok_or(Error::Singular)?;
        let theirs = adjoints.each_ref().map(|adjoint| lack(adjoint));
        let weight = |t: usize| 2.0 * model.materials[t].shear_kpa();
        let share = |t: usize| {
            let of_adjoints = theirs.iter().map(|z| z[t] * z[t]).sum::<f64>().sqrt();
            weight(t) * own[t] * of_adjoints
        };
        let shares = (0..self.body.mesh.tets().len()).map(share).collect();
        let displacement = Vector::from(
            means.map(|mean| mean.iter().zip(&equilibrium.u).map(|(m, u)| m.dot(u)).sum()),
        );
        let wall =
            self.wall(&model, positions, &equilibrium.u, &adjoints).ok_or(Error::Singular)?;
        Ok(GoalErrors { displacement, shares, wall })
    }

    /// The mean displacement within `goal` in each direction as nodal weights.
    fn means<const N: usize>(
        &self,
        goal: &Sphere,
        elements: &[[u32; N]],
        nodes: usize,
    ) -> Result<[Vec<Vector>; 3], Error> {
        let locator = Locator::new(self.body.mesh.clone());
        let places: Vec<_> = samples(goal).filter_map(|p| locator.locate(&p)).collect();
        if places.is_empty() {
            return Err(Error::GoalOutside { centre: goal.centre().coords.into() });
        }
        let mut weights = vec![0.0; nodes];
        for place in &places {
            for (node, value) in elements[place.tet].iter().zip(shape::<N>(place.weights)) {
                weights[*node as usize] += value / places.len() as f64;
            }
        }
        let along = |axis: Vector| weights.iter().map(|w| axis * *w).collect();
        Ok([Vector::x(), Vector::y(), Vector::z()].map(along))
    }
}

/// Places spread evenly within a sphere.
fn samples(sphere: &Sphere) -> impl Iterator<Item = Point> {
    let step = 2.0 * sphere.radius() / ACROSS as f64;
    let middle = (ACROSS / 2) as f64;
    let along = move |n: usize| (n as f64 - middle) * step;
    (0..ACROSS.pow(3))
        .map(move |n| [n % ACROSS, n / ACROSS % ACROSS, n / ACROSS / ACROSS].map(along))
        .map(|offset| sphere.centre() + Vector::from(offset))
        .filter(|p| sphere.contains(p))
}

/// L2 norm over each tetrahedron of what the gradient of a field lacks to the recovered one.
fn missing<const N: usize>(
    positions: &[Vector],
    elements: &[[u32; N]],
    mesh: &TetMesh,
    field: &[Vector],
) -> Vec<f64> {
    let own = corner_gradients(positions, elements, field);
    let recovered = averaged(mesh, &own);
    let lack = |t: usize| {
        let of = |(p, g): (&u32, &Matrix)| (recovered[*p as usize] - g).norm_squared();
        let mean = mesh.tets()[t].iter().zip(&own[t]).map(of).sum::<f64>() / 4.0;
        (mean * mesh.volume(t)).sqrt()
    };
    (0..elements.len()).map(lack).collect()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::test_mesh::block;
    use crate::{Tissue, solve};
    use std::sync::Arc;
    use supine_mesh::Edges;

    pub(crate) const SIDE_MM: f64 = 60.0;

    pub(crate) fn load() -> Load {
        Load { ct: Vector::y(), target: Vector::new(0.5, 0.75f64.sqrt(), 0.0) }
    }

    /// So stiff that the response is nearly linear.
    pub(crate) fn tissue() -> Tissue {
        Tissue { young_kpa: 12.0, ..Tissue::default() }
    }

    pub(crate) fn goal() -> Sphere {
        Sphere::new(Point::new(20.0, 30.0, 40.0), 8.0).unwrap()
    }

    pub(crate) fn solver(order: Order) -> Params {
        Params { order, ..Params::default() }
    }

    /// A cube held at z = 0, with so many cells along each side.
    pub(crate) fn cube(cells: usize) -> Arc<TetMesh> {
        block([cells; 3], SIDE_MM / cells as f64, 0.1)
    }

    fn shares(mesh: &Arc<TetMesh>, order: Order) -> Vec<f64> {
        error_shares(
            &Body::new(mesh.clone(), tissue()),
            &load(),
            &solver(order),
            &goal(),
            Progress::none(),
        )
        .unwrap()
    }

    /// Mean displacement at the goal's samples.
    pub(crate) fn mean(mesh: &Arc<TetMesh>, order: Order) -> Vector {
        let (u, _) =
            solve(&Body::new(mesh.clone(), tissue()), &load(), &solver(order), Progress::none())
                .unwrap();
        let (edges, locator) = (Edges::new(mesh), Locator::new(mesh.clone()));
        let found: Vec<_> = samples(&goal()).filter_map(|p| locator.locate(&p)).collect();
        let sum: Vector =
            found.iter().map(|l| u.displacement().at(mesh, &edges, l.tet, l.weights)).sum();
        sum / found.len() as f64
    }

    #[test]
    fn the_estimate_is_near_the_error_and_falls_with_it() {
        let truth = mean(&cube(6), Order::Quadratic);
        let [coarse, fine] = [4, 8].map(cube);
        let estimate = |mesh: &Arc<TetMesh>| shares(mesh, Order::Linear).iter().sum::<f64>();
        let (before, after) = (estimate(&coarse), estimate(&fine));
        for (mesh, estimate) in [(&coarse, before), (&fine, after)] {
            let error = (mean(mesh, Order::Linear) - truth).norm();
            assert!(0.5 * error < estimate && estimate < 10.0 * error, "{error} {estimate}");
        }
        // The edge of the wall limits how fast.
        assert!(before / after > 1.4, "{before} {after}");
        let quadratic = shares(&coarse, Order::Quadratic).iter().sum::<f64>();
        assert!(quadratic < before, "{quadratic} {before}");
    }

    #[test]
    fn shares_are_larger_near_the_goal_and_the_wall_than_in_a_far_corner() {
        let mesh = cube(8);
        let shares = shares(&mesh, Order::Linear);
        let mean_near = |p: Point| {
            let near = |t: &usize| {
                let middle = mesh.corners(*t).iter().map(|c| c.coords).sum::<Vector>() / 4.0;
                (middle - p.coords).norm() < 12.0
            };
            let near: Vec<f64> = (0..shares.len()).filter(near).map(|t| shares[t]).collect();
            near.iter().sum::<f64>() / near.len() as f64
        };
        let far = mean_near(Point::new(55.0, 55.0, 55.0));
        let (goal, wall) = (mean_near(goal().centre()), mean_near(Point::new(5.0, 30.0, 3.0)));
        assert!(goal > 3.0 * far && wall > 3.0 * far, "{goal} {wall} {far}");
    }

    #[test]
    fn a_goal_outside_the_mesh_is_refused() {
        let away = Sphere::new(Point::new(200.0, 0.0, 0.0), 5.0).unwrap();
        let found = error_shares(
            &Body::new(cube(2), tissue()),
            &load(),
            &Params::default(),
            &away,
            Progress::none(),
        );
        assert!(matches!(found, Err(Error::GoalOutside { .. })), "{found:?}");
    }
}
