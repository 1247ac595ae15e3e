//! Finite elements: a hyperelastic breast under gravity.
//!
//! The displacement u of the nodes minimises ∫ Ψ(F) − ∫ ρ g · u over the stress-free shape, with
//! F = I + grad u, J = det F,
//!
//! Ψ = W(Q) + λ/2 (ln J)², Q = tr FᵀF − 3 − 2 ln J, μ = E / 2(1+ν), λ = Eν / ((1+ν)(1−2ν)),
//!
//! W = μ Q / 2 for the neo-Hookean solid; [`Law`] lists the others.
//!
//! The chest wall is held; the tissue beyond the region is replaced by springs on the cut, unless
//! that is free or held ([`Cut`]); gravity turns instead of the patient. Elements are tetrahedra
//! with four nodes and one quadrature point, or ten nodes and four points. Units: mm, kPa, hence
//! forces in mN and ρ g in kPa/mm (1000 kg/m³ at 9.81 m/s²: 9.81e-3 kPa/mm). The frame is LPS.
//!
//! [`solve`] is the entry. It converges or returns an [`Error`]; it never accepts a state in which
//! an element is turned inside out.
//!
//! # Example
//!
//! A corner of tissue that hangs from the chest wall when the patient sits up.
//!
//! ```
//! use std::sync::Arc;
//! use supine_fem::{Body, Load, Params, Tissue, solve};
//! use supine_mesh::{BoundaryFace, BoundaryTag, TET_FACES, TetMesh};
//! use supine_space::{Point, Progress, sitting, supine};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let corners = [[0.0, 0.0, 0.0], [20.0, 0.0, 0.0], [0.0, 20.0, 0.0], [0.0, 0.0, 20.0]];
//! let tags = [BoundaryTag::Skin, BoundaryTag::Skin, BoundaryTag::Skin, BoundaryTag::ChestWall];
//! let face = |(points, tag): (&[usize; 3], _)| BoundaryFace { points: points.map(|p| p as u32), tag };
//! let boundary = TET_FACES.iter().zip(tags).map(face).collect();
//! let mesh = TetMesh::new(corners.map(Point::from).to_vec(), vec![[0, 1, 2, 3]], boundary)?;
//!
//! let tissue = Tissue { young_kpa: 0.6, poisson: 0.45, ..Tissue::default() };
//! let load = Load { ct: supine(), target: sitting() };
//! let body = Body::new(Arc::new(mesh), tissue);
//! let (deformation, _) = solve(&body, &load, &Params::default(), Progress::none())?;
//! let tip = deformation.displacement().values()[3];
//! assert!(tip.z < 0.0, "towards the feet, mm: {tip}");
//! # Ok(())
//! # }
//! ```

mod analysis;
mod applicator;
#[cfg(test)]
mod applicator_kept_tests;
mod background;
mod batch;
mod bilateral;
mod body;
mod boundary;
mod cavity;
mod complementarity;
mod compliance;
mod contact;
mod coupling;
mod curved;
mod dense;
mod discretisation;
mod either;
mod element;
mod error;
mod fibre_directions;
mod foundation;
#[cfg(test)]
mod foundation_tests;
mod gap;
mod goal;
mod inverse;
mod krylov;
mod linear;
mod material;
mod model;
mod newton;
mod opening;
mod outcome;
mod pairs;
mod params;
mod pattern;
mod press_problem;
mod quasi_newton;
mod recovery;
mod rest;
mod rigid;
mod sensitivity;
mod sequence;
mod site;
mod skin;
mod sliding;
mod sliding_wall;
mod smoothed_distance;
mod snap;
#[cfg(test)]
mod solve_tests;
#[cfg(test)]
mod sphere_tests;
mod support;
mod surfaces;
mod tangent;
mod tension_field;
#[cfg(test)]
mod test_mesh;
mod tilt;
mod unilateral;
mod wall;
mod wall_effect;
mod wall_shape;
mod wall_turn;
mod warm_start;

pub use applicator::{Applicator, Reaction};
pub use body::Body;
pub use contact::{Contact, Insertion};
pub use error::Error;
pub use foundation::{Spring, nodal_springs};
pub use goal::{GoalErrors, error_shares, goal_errors};
pub use outcome::Step;
pub use params::{Info, Load, Params, SQUEEZED_DET_F, Tissue, Unloading};
pub use quasi_newton::Budget;
pub use rigid::{RigidBody, Shaft, SphereOnShaft};
pub use supine_record::{Cut, Law, Membrane, RestState, SlidingArea};

pub use sensitivity::{Between, between, sensitivity};
pub use sequence::Sequence;
pub use sliding_wall::slides_everywhere;
pub use snap::{snapped, snapped_to_cavity};
pub use tilt::Tilt;
pub use wall_effect::WallNode;

use discretisation::Discretisation;
use element::{element_nodes, node_coordinates, parent_map, parent_slopes};
use rest::LoadedBody;
use std::sync::Arc;
use supine_mesh::{Deformation, Displacement, Edges, Order, TetMesh};
use supine_space::{Progress, Vector, Warning};
use warm_start::WarmStart;

/// `body` displaced from its CT shape when gravity turns from `load.ct` to `load.target`, mm.
///
/// The displacement is measured from the CT shape whatever the rest state; its order is that of
/// `params`. Same input, same bytes.
///
/// # Errors
/// When a number is out of range, nothing holds the tissue, no equilibrium or no usable unloaded
/// shape is found, memory is short, or the user stops.
pub fn solve(
    body: &Body,
    load: &Load,
    params: &Params,
    progress: Progress<'_>,
) -> Result<(Deformation, Info), Error> {
    let asked = SolveOptions { stiffer: 1.0, slope: false };
    let Solution { deformation, info, .. } = found(body, load, params, asked, progress)?;
    Ok((deformation, info))
}

/// What is asked beside the deformation under a load.
#[derive(Clone, Copy)]
struct SolveOptions {
    /// Factor of all moduli.
    stiffer: f64,
    /// Whether the derivative by the modulus is wanted.
    slope: bool,
}

/// A body under a load.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// Displaced from its CT shape, mm.
    pub deformation: Deformation,
    /// Derivative of the displacement per kPa of the mean modulus, mm/kPa, when asked for.
    pub slope: Option<Displacement>,
    /// How it was found.
    pub info: Info,
}

/// As [`solve`], for what is asked.
fn found(
    body: &Body,
    load: &Load,
    params: &Params,
    asked: SolveOptions,
    progress: Progress<'_>,
) -> Result<Solution, Error> {
    let edges = checked(body, load, params)?;
    let SolveOptions { stiffer, slope } = asked;
    let job = Job { stiffer, slope, ..Job::new(body, &edges, load, params) };
    let solved = match params.order {
        Order::Linear => {
            job.run::<4, 1>(&Discretisation::new(&job)?, &mut WarmStart::nothing(), progress)?
        }
        Order::Quadratic => {
            job.run::<10, 4>(&Discretisation::new(&job)?, &mut WarmStart::nothing(), progress)?
        }
    };
    job.solution(solved)
}

/// The edges of a body, if what is asked of it is in range.
fn checked(body: &Body, load: &Load, params: &Params) -> Result<Edges, Error> {
    body.check()?;
    load.check()?;
    params.check()?;
    body.check_curved()?;
    Ok(Edges::new(&body.mesh))
}

/// What was found, one vector per node.
pub(crate) struct Solved {
    /// Displacement from the CT shape, mm.
    pub(crate) u: Vec<Vector>,
    /// Its derivative by the mean modulus, mm/kPa, when asked for.
    pub(crate) slope: Option<Vec<Vector>>,
    /// How it was found.
    pub(crate) info: Info,
}

/// The shape of `body` that is free of stress and becomes the CT shape under `gravity` (a unit
/// vector, LPS), as displacement from the CT shape, mm. `params.rest` does not count.
///
/// # Errors
/// As [`solve`]; [`Error::NoUnloadedShape`] with a modulus at which there is such a shape.
pub fn unload(
    body: &Body,
    gravity: Vector,
    params: &Params,
    progress: Progress<'_>,
) -> Result<(Deformation, Unloading), Error> {
    let load = &Load { ct: gravity, target: gravity };
    let edges = checked(body, load, params)?;
    let job = Job::new(body, &edges, load, params);
    let (values, unloading) = match params.order {
        Order::Linear => job.unload::<4, 1>(progress)?,
        Order::Quadratic => job.unload::<10, 4>(progress)?,
    };
    Ok((deformed(&body.mesh, &edges, values)?, unloading))
}

/// The mesh displaced by these vectors of its points, and with quadratic elements of its edges, mm.
fn deformed(mesh: &Arc<TetMesh>, edges: &Edges, values: Vec<Vector>) -> Result<Deformation, Error> {
    Ok(Deformation::new(mesh.clone(), Displacement::new(mesh, edges, values)?)?)
}

/// The displacement from the CT shape of nodes at displacement `u` from the stress-free one, mm.
fn from_ct(u: &[Vector], to_ct: &[Vector]) -> Vec<Vector> {
    u.iter().zip(to_ct).map(|(u, ct)| u - ct).collect()
}

/// What is asked.
#[derive(Clone, Copy)]
pub(crate) struct Job<'a> {
    pub(crate) body: &'a Body,
    pub(crate) edges: &'a Edges,
    pub(crate) load: &'a Load,
    pub(crate) params: &'a Params,
    /// Factor of all moduli.
    pub(crate) stiffer: f64,
    /// Whether the derivative by the modulus is wanted.
    pub(crate) slope: bool,
}

impl<'a> Job<'a> {
    /// The moduli as they are, and no derivative.
    fn new(body: &'a Body, edges: &'a Edges, load: &'a Load, params: &'a Params) -> Self {
        Self { body, edges, load, params, stiffer: 1.0, slope: false }
    }

    /// Solves with elements of `N` nodes and `Q` quadrature points.
    fn run<const N: usize, const Q: usize>(
        &self,
        discretisation: &Discretisation<N, Q>,
        before: &mut WarmStart<N, Q>,
        progress: Progress<'_>,
    ) -> Result<Solved, Error> {
        let LoadedBody { u, to_ct, slope, mut info, .. } =
            self.settle(discretisation, before, progress)?;
        let u = from_ct(&u, &to_ct);
        self.warn::<N>(&discretisation.positions, &u, &mut info);
        let straight = &discretisation.straight;
        let (u, slope) = (straight.of(&u), slope.map(|slope| straight.of(&slope)));
        Ok(Solved { u, slope, info })
    }

    /// What was found as fields on the mesh.
    fn solution(&self, solved: Solved) -> Result<Solution, Error> {
        let Solved { u, slope, mut info } = solved;
        let mesh = &self.body.mesh;
        let deformation = deformed(mesh, self.edges, u)?;
        info.solve.max_displacement_mm = deformation.displacement().max_norm();
        let slope = slope.map(|s| Displacement::new(mesh, self.edges, s)).transpose()?;
        Ok(Solution { deformation, slope, info })
    }

    /// The equilibrium under the target's gravity.
    pub(crate) fn settle<const N: usize, const Q: usize>(
        &self,
        discretisation: &Discretisation<N, Q>,
        before: &mut WarmStart<N, Q>,
        progress: Progress<'_>,
    ) -> Result<LoadedBody<N, Q>, Error> {
        match self.params.rest {
            RestState::Net => rest::net(self, discretisation, before, progress),
            RestState::Unloaded => rest::unloaded(self, discretisation, before, progress),
        }
    }

    /// Mean modulus over the volume, kPa.
    pub(crate) fn young_kpa(&self) -> f64 {
        self.stiffer * self.body.mean_young_kpa()
    }

    /// The stress-free shape as displacement from the CT shape, with such elements.
    fn unload<const N: usize, const Q: usize>(
        &self,
        progress: Progress<'_>,
    ) -> Result<(Vec<Vector>, Unloading), Error> {
        let discretisation = Discretisation::<N, Q>::new(self)?;
        let rest = rest::stress_free(self, &discretisation, &mut WarmStart::nothing(), progress)?;
        let values: Vec<Vector> = rest.to_ct.iter().map(|u| -u).collect();
        Ok((discretisation.straight.of(&values), rest.unloading))
    }

    /// Positions of the nodes in the CT, mm: points, then (N = 10) the middles of the edges; off
    /// these where the body is curved.
    fn positions<const N: usize>(&self) -> Vec<Vector> {
        let mut positions: Vec<Vector> = self.body.mesh.points().iter().map(|p| p.coords).collect();
        if N == 10 {
            for [a, b] in self.edges.ends() {
                positions.push((positions[*a as usize] + positions[*b as usize]) / 2.0);
            }
        }
        if let Some(offsets) = self.offsets::<N>() {
            positions.iter_mut().zip(offsets).for_each(|(p, offset)| *p += offset);
        }
        positions
    }

    /// Says what a user should know of a result.
    fn warn<const N: usize>(&self, positions: &[Vector], u: &[Vector], info: &mut Info) {
        let nodes = element_nodes::<N>(&self.body.mesh, self.edges);
        let moved: Vec<Vector> = positions.iter().zip(u).map(|(x, u)| x + u).collect();
        let corners = node_coordinates::<N>().map(parent_slopes::<N>);
        let folded = |element: &&[u32; N]| {
            corners.iter().any(|s| parent_map(&moved, element, s).determinant() <= 0.0)
        };
        let folds = nodes.iter().filter(folded).count();
        let squeezed_at = info.solve.min_det_f_mm.into();
        let mut warn = |code, text| {
            let warning = Warning::new(code, text);
            let placed = code == "squeezed-tissue";
            info.warnings.push(if placed { warning.at(&squeezed_at) } else { warning });
        };
        if folds > 0 {
            let text = format!(
                "{folds} of {} tetrahedra fold over at a corner or mid-side: the deformed image is \
                 not to be trusted there",
                nodes.len()
            );
            warn("folded-elements", text);
        }
        if info.solve.min_det_f < SQUEEZED_DET_F {
            let [x, y, z] = info.solve.min_det_f_mm;
            let text = format!(
                "the tissue around [{x:.1}, {y:.1}, {z:.1}] mm (LPS, in the CT) is squeezed to {:.2} of \
                 its volume without load (below {SQUEEZED_DET_F}): its law is out of its depth there",
                info.solve.min_det_f
            );
            warn("squeezed-tissue", text);
        }
        if info.solve.load_steps > 1 {
            let text = format!(
                "the load had to be applied in {} steps: the solution may be one of several",
                info.solve.load_steps
            );
            warn("load-steps", text);
        }
        if N == 4 && self.body.tissue.poisson > 0.49 {
            let text = format!(
                "a Poisson ratio of {:.3} makes linear tetrahedra too stiff (volumetric locking): take order 2",
                self.body.tissue.poisson
            );
            warn("volumetric-locking", text);
        }
    }
}
