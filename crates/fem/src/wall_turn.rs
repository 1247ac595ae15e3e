//! A factor made where nodes that slide on the chest wall met other normals.
//!
//! A node is tied to the wall along its normal, a thousand times as stiffly as the tissue resists.
//! Once it has slid along a bent wall its normal has turned, and in the old direction the old
//! factor still takes it for tied: conjugate gradients need a step for each such node. With Q the
//! turn of each node's normal since, Q M⁻¹ Qᵀ is as good a preconditioner as M⁻¹ was where the
//! factor M was made, and symmetric as that.

use crate::pattern::Pattern;
use nalgebra::Rotation3;
use supine_space::Vector;

/// Nodes that slide, with the normals of the wall there.
pub(crate) type Normals = Vec<(u32, Vector)>;

/// The turns of the normals of nodes that slide; rows of their unknowns.
#[derive(Debug, Default)]
pub(crate) struct WallTurn(Vec<(usize, Rotation3<f64>)>);

impl WallTurn {
    /// From the normals at which a factor was made to those at present, of the same nodes.
    pub(crate) fn new(pattern: &Pattern, then: &Normals, now: &Normals) -> Self {
        let turn = |((node, then), (_, now)): (&(u32, Vector), &(u32, Vector))| {
            Some((pattern.row(*node)?, Rotation3::rotation_between(then, now)?))
        };
        Self(then.iter().zip(now).filter_map(turn).collect())
    }

    /// Turns a vector of unknowns by Q.
    pub(crate) fn apply(&self, x: &mut [f64]) {
        self.0.iter().for_each(|(row, turn)| set(x, *row, |v| turn * v));
    }

    /// Turns a vector of unknowns by Qᵀ.
    pub(crate) fn undo(&self, x: &mut [f64]) {
        self.0.iter().for_each(|(row, turn)| set(x, *row, |v| turn.inverse_transform_vector(&v)));
    }
}

fn set(x: &mut [f64], row: usize, of: impl Fn(Vector) -> Vector) {
    let own = &mut x[row..row + 3];
    own.copy_from_slice(of(Vector::from_column_slice(own)).as_slice());
}
