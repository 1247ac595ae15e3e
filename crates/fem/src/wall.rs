//! The free surface of tissue before a rigid body.

use crate::gap::{Gap, Surface};
use supine_space::{Pose, Vector};

/// Nodes at which the tissue can be touched.
#[derive(Debug)]
pub(crate) struct Wall {
    /// The surface of the body.
    pub(crate) surface: Surface,
    /// The nodes of the tissue's free surface that are not held, in rising order.
    pub(crate) nodes: Vec<u32>,
    /// The other nodes that are free: within the tissue.
    pub(crate) within: Vec<u32>,
    /// Stress-free positions of all nodes, mm.
    pub(crate) rest: Vec<Vector>,
    /// Nodes nearer to the body than this are in reach, mm.
    pub(crate) margin_mm: f64,
}

/// A node that the body presses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Press {
    pub(crate) node: u32,
    /// The part of the body that presses it.
    pub(crate) part: usize,
    /// How much, mN.
    pub(crate) force: f64,
    /// Where to: the unit normal of the body.
    pub(crate) normal: Vector,
}

/// The body at a pose, drawn in by `opening_mm` all around.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Target<'a> {
    pub(crate) pose: &'a Pose,
    pub(crate) opening_mm: f64,
}

impl<'a> Target<'a> {
    /// The body as it is.
    pub(crate) fn at(pose: &'a Pose) -> Self {
        Self { pose, opening_mm: 0.0 }
    }
}

impl Wall {
    /// Where a node is at displacement `u`.
    pub(crate) fn place(&self, node: u32, u: &[Vector]) -> Vector {
        self.rest[node as usize] + u[node as usize]
    }

    /// The gap of a place before a part.
    pub(crate) fn gap(&self, part: usize, place: &Vector, target: Target<'_>) -> Option<Gap> {
        let gap = self.surface.gap(part, target.pose, place)?;
        Some(Gap { mm: gap.mm + target.opening_mm, ..gap })
    }

    /// The smallest gap of a node, mm.
    fn least(&self, node: u32, u: &[Vector], target: Target<'_>) -> f64 {
        self.surface.least(target.pose, &self.place(node, u)) + target.opening_mm
    }

    /// The smallest gap of the surface, mm; infinite where the body is out of reach of all of it.
    pub(crate) fn clearance(&self, u: &[Vector], target: Target<'_>) -> f64 {
        self.nodes.iter().map(|&n| self.least(n, u, target)).fold(f64::INFINITY, f64::min)
    }

    /// How far the surface lies within the body in all, mm.
    pub(crate) fn violation(&self, u: &[Vector], target: Target<'_>) -> f64 {
        let mut sum = 0.0;
        for &node in &self.nodes {
            let place = self.place(node, u);
            for part in 0..self.surface.parts() {
                let gap = self.gap(part, &place, target);
                sum += gap.map_or(0.0, |gap| (-gap.mm).max(0.0));
            }
        }
        sum
    }

    /// Moves nodes of the surface that lie deeper in the body than the `left` share of how deep
    /// they lay at `before` back to there, along the normals: on the straight way between two
    /// places on a body a node passes through it.
    pub(crate) fn keep_out(
        &self,
        u: &mut [Vector],
        (before, left): (&[Vector], f64),
        target: Target<'_>,
    ) {
        for &node in &self.nodes {
            for _ in 0..self.surface.parts() {
                for part in 0..self.surface.parts() {
                    let Some(gap) = self.gap(part, &self.place(node, u), target) else { continue };
                    if gap.mm >= 0.0 {
                        continue;
                    }
                    let old = self.gap(part, &self.place(node, before), target);
                    let deepest = old.map_or(0.0, |old| left * old.mm.min(0.0));
                    u[node as usize] += gap.normal * (deepest - gap.mm).max(0.0);
                }
            }
        }
    }

    /// Moves nodes that are pressed onto the body along the normals.
    pub(crate) fn put_on(&self, u: &mut [Vector], presses: &[Press], target: Target<'_>) {
        for press in presses {
            if let Some(gap) = self.gap(press.part, &self.place(press.node, u), target) {
                u[press.node as usize] -= gap.normal * gap.mm;
            }
        }
    }

    /// The nodes of the surface nearer to the body than `mm`, and those on which there are forces.
    pub(crate) fn reach(
        &self,
        u: &[Vector],
        forces: &[(u32, Vector)],
        (target, mm): (Target<'_>, f64),
    ) -> Vec<u32> {
        let pressed = |n: &u32| forces.binary_search_by_key(n, |(node, _)| *node).is_ok();
        let near = |n: &&u32| self.least(**n, u, target) < mm || pressed(n);
        self.nodes.iter().filter(near).copied().collect()
    }

    /// Whether a node of the surface that is not among `known` is nearer to the body than `mm`.
    pub(crate) fn misses(
        &self,
        known: &[u32],
        u: &[Vector],
        (target, mm): (Target<'_>, f64),
    ) -> bool {
        let unknown = self.nodes.iter().filter(|n| known.binary_search(n).is_err());
        unknown.into_iter().any(|&n| self.least(n, u, target) < mm)
    }

    /// Whether no node is within the body by more than `mm` and those that are pressed lie on it to
    /// `mm`.
    pub(crate) fn fits(
        &self,
        u: &[Vector],
        presses: &[Press],
        (target, mm): (Target<'_>, f64),
    ) -> bool {
        let on = |press: &Press| {
            let gap = self.gap(press.part, &self.place(press.node, u), target);
            press.force <= 0.0 || gap.is_some_and(|gap| gap.mm <= mm)
        };
        self.clearance(u, target) >= -mm && presses.iter().all(on)
    }

    /// A node within the tissue that lies in the body by more than `mm`: the body is where the
    /// tissue has no surface to meet it.
    pub(crate) fn buried(&self, u: &[Vector], (target, mm): (Target<'_>, f64)) -> Option<Vector> {
        let deep = self.within.iter().find(|&&n| self.least(n, u, target) < -mm);
        deep.map(|&n| self.place(n, u))
    }
}
