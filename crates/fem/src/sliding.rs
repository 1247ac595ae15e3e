//! Tissue that slides without friction on a rigid body.
//!
//! A sliding node x keeps its level φ(T⁻¹ x) = φ₀, φ the distance from the body in its own frame
//! and T its pose. With out-of-balance force r and unit normal n the equilibrium is r = (r · n) n:
//! the body gives what is along its normal. Newton's method runs on the level surfaces (Absil,
//! Mahony and Sepulchre, Optimization Algorithms on Matrix Manifolds, 2008, ch. 5 and 6): rows and
//! columns of the stiffness are projected to the tangential planes P = I − n nᵀ, −(r · n) P ∇²φ P /
//! |∇φ| is added for the curvature of the surface, and each step ends by bringing the nodes back to
//! their level.

use crate::pattern::Plane;
use crate::smoothed_distance::SmoothedDistance;
use std::sync::Arc;
use supine_space::{Matrix, Pose, Vector};

/// A node that slides.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slider {
    pub(crate) node: u32,
    /// Its level, mm.
    pub(crate) level: f64,
    /// Its stress-free position, mm.
    pub(crate) rest: Vector,
    /// The nodal force of gravity, mN.
    pub(crate) load: Vector,
}

/// The nodes that slide on a rigid body.
#[derive(Debug)]
pub(crate) struct Sliding {
    pub(crate) distance: SmoothedDistance,
    pub(crate) nodes: Vec<Slider>,
    /// Elements with such nodes.
    pub(crate) around: Vec<u32>,
}

/// The same with the body at a pose.
#[derive(Clone, Debug)]
pub(crate) struct Slide {
    pub(crate) sliding: Arc<Sliding>,
    pub(crate) pose: Pose,
}

impl Slide {
    /// Unit normal of the level surface that a node lies on, and ∇²φ / |∇φ| (1/mm); `None` where
    /// the body has no normal.
    fn surface(&self, slider: &Slider, u: &[Vector]) -> Option<(Vector, Matrix)> {
        let level = self.sliding.distance.at(&self.own(&self.position(slider, u)))?;
        let steep = level.slope.norm();
        let turn = self.pose.rotation.to_rotation_matrix();
        let curvature = turn.matrix() * level.curvature * turn.matrix().transpose() / steep;
        Some((turn * level.slope / steep, curvature))
    }

    fn position(&self, slider: &Slider, u: &[Vector]) -> Vector {
        slider.rest + u[slider.node as usize]
    }

    /// A place in the frame of the body.
    fn own(&self, place: &Vector) -> Vector {
        self.pose.inverse_transform_point(&(*place).into()).coords
    }

    /// Brings the nodes back to their levels along the normal; false where that is not possible.
    pub(crate) fn bring(&self, u: &mut [Vector]) -> bool {
        for slider in &self.sliding.nodes {
            let own = self.own(&self.position(slider, u));
            let Some(found) = self.sliding.distance.brought(&own, slider.level) else {
                return false;
            };
            let place = self.pose.transform_point(&found.into()).coords;
            u[slider.node as usize] = place - slider.rest;
        }
        true
    }

    /// Takes from `forces` (of all nodes) what is along the normals; gives the square of its norm.
    pub(crate) fn project(&self, u: &[Vector], forces: &mut [Vector]) -> Option<f64> {
        let mut taken = 0.0;
        for slider in &self.sliding.nodes {
            let (normal, _) = self.surface(slider, u)?;
            let force = &mut forces[slider.node as usize];
            let along = force.dot(&normal);
            *force -= normal * along;
            taken += along * along;
        }
        Some(taken)
    }

    /// The tangential planes at `u`, where the internal forces are `forces` (mN), with the
    /// stiffness of the surface's curvature.
    pub(crate) fn planes(&self, u: &[Vector], forces: &[Vector]) -> Option<Vec<Plane>> {
        let plane = |slider: &Slider| {
            let (normal, curvature) = self.surface(slider, u)?;
            let along = (forces[slider.node as usize] - slider.load).dot(&normal);
            Some(Plane { node: slider.node, normal, stiffness: curvature * -along })
        };
        self.sliding.nodes.iter().map(plane).collect()
    }

    /// Leaves of the velocities with which the nodes would follow the body the part along the
    /// normals, with which they do, and gives what the turn of the normals does there to the forces
    /// along the surface.
    ///
    /// `turn` is that of the body (radians), `forces` are those out of balance at `u`, mN. The
    /// normal turns with the body and as the surface passes under the node: ṅ = ω × n + ∇²φ / |∇φ|
    /// (ẋ − v) in the plane.
    pub(crate) fn drag(
        &self,
        u: &[Vector],
        turn: &Vector,
        forces: &[Vector],
        velocities: &mut [Vector],
    ) -> Option<Vec<(usize, Vector)>> {
        let drag = |slider: &Slider| {
            let (normal, curvature) = self.surface(slider, u)?;
            let n = slider.node as usize;
            let along = normal * velocities[n].dot(&normal);
            let turned = turn.cross(&normal) + curvature * (along - velocities[n]);
            velocities[n] = along;
            Some((n, turned * -forces[n].dot(&normal)))
        };
        self.sliding.nodes.iter().map(drag).collect()
    }
}
