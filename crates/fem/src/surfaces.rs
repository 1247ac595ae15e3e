//! What acts on the boundary of a body beside the nodes that are held.

use crate::foundation::Foundation;
use crate::pattern::{Block, Pattern};
use crate::skin::Skin;
use crate::sliding_wall::SlidingWall;
use crate::wall_turn::Normals;
use std::sync::Arc;
use supine_space::Vector;

/// Springs on the cut, a chest wall on which the tissue slides, and skin, each if there is one; on
/// one stress-free shape. Displacements `u` are those from that shape, mm; `nodes` are those of the
/// elements.
#[derive(Clone, Debug, Default)]
pub(crate) struct Surfaces<const N: usize> {
    pub(crate) cut: Option<Arc<Foundation<N>>>,
    pub(crate) wall: Option<SlidingWall<N>>,
    pub(crate) skin: Option<Skin<N>>,
}

impl<const N: usize> Surfaces<N> {
    /// Those at elements that are to be kept, which then are renumbered.
    pub(crate) fn only(&self, keep: &[bool]) -> Self {
        Self {
            cut: self.cut.as_ref().map(|cut| Arc::new(cut.only(keep))),
            wall: self.wall.as_ref().map(|wall| wall.only(keep)),
            skin: self.skin.as_ref().map(|skin| skin.only(keep)),
        }
    }

    /// The same on the stress-free shape with nodes at `rest` (mm), which need not be in
    /// equilibrium with them.
    pub(crate) fn at_rest(&self, nodes: &[[u32; N]], rest: &[Vector]) -> Self {
        Self {
            cut: self.cut.clone(),
            wall: self.wall.as_ref().map(|wall| wall.at_rest(rest)),
            skin: self.skin.as_ref().map(|skin| skin.at_rest(nodes, rest)),
        }
    }

    /// Energy, mN mm; adds the nodal forces, mN.
    pub(crate) fn evaluate(&self, nodes: &[[u32; N]], u: &[Vector], forces: &mut [Vector]) -> f64 {
        let mut energy = 0.0;
        if let Some(cut) = &self.cut {
            cut.add_forces(nodes, u, 1.0, forces);
            energy += cut.energy(nodes, u);
        }
        if let Some(wall) = &self.wall {
            energy += wall.evaluate(nodes, u, forces);
        }
        if let Some(skin) = &self.skin {
            energy += skin.evaluate(nodes, u, forces);
        }
        energy
    }

    /// Takes off the nodal forces that do not grow with the moduli, mN.
    pub(crate) fn leave_out_given(&self, nodes: &[[u32; N]], u: &[Vector], forces: &mut [Vector]) {
        if let Some(cut) = &self.cut {
            cut.leave_out_given(nodes, u, forces);
        }
        let given = Self { cut: None, ..self.clone() };
        let mut taken = vec![Vector::zeros(); forces.len()];
        given.evaluate(nodes, u, &mut taken);
        forces.iter_mut().zip(taken).for_each(|(force, taken)| *force -= taken);
    }

    /// Adds the stiffness ∂f/∂x at a fixed stress-free shape, mN/mm, to the blocks of `pattern`.
    pub(crate) fn add_stiffness(
        &self,
        nodes: &[[u32; N]],
        u: &[Vector],
        pattern: &Pattern,
        blocks: &mut [Block],
    ) {
        if let Some(cut) = &self.cut {
            cut.add_stiffness(1.0, pattern, blocks);
        }
        if let Some(wall) = &self.wall {
            wall.add_stiffness(u, pattern, blocks);
        }
        if let Some(skin) = &self.skin {
            skin.add_stiffness(nodes, u, pattern, blocks);
        }
    }

    /// Adds ∂f/∂X at a fixed present shape x = X + u, mN/mm, to the blocks of `pattern`, which has
    /// all of them.
    pub(crate) fn add_rest_stiffness(
        &self,
        nodes: &[[u32; N]],
        u: &[Vector],
        pattern: &Pattern,
        blocks: &mut [Block],
    ) {
        if let Some(cut) = &self.cut {
            cut.add_stiffness(-1.0, pattern, blocks);
        }
        if let Some(wall) = &self.wall {
            wall.add_rest_stiffness(u, pattern, blocks);
        }
        if let Some(skin) = &self.skin {
            skin.add_rest_stiffness(nodes, u, pattern, blocks);
        }
    }

    /// Adds the change of the nodal forces when the displacement changes by `v`, mN.
    pub(crate) fn add_slope(
        &self,
        nodes: &[[u32; N]],
        u: &[Vector],
        v: &[Vector],
        forces: &mut [Vector],
    ) {
        if let Some(cut) = &self.cut {
            cut.add_forces(nodes, v, 1.0, forces);
        }
        if let Some(wall) = &self.wall {
            wall.add_slope(nodes, u, v, forces);
        }
        if let Some(skin) = &self.skin {
            skin.add_slope(nodes, u, v, forces);
        }
    }

    /// The nodes that slide, and the wall's normals where they are.
    pub(crate) fn wall_normals(&self, u: &[Vector]) -> Normals {
        self.wall.as_ref().map_or_else(Vec::new, |wall| wall.normals(u))
    }

    /// Brings nodes that slide, which went a straight way from `u` to `moved`, back onto the wall.
    pub(crate) fn follow_wall(&self, u: &[Vector], moved: &mut [Vector]) {
        if let Some(wall) = &self.wall {
            wall.follow(u, moved);
        }
    }

    /// The same for stress-free positions, which went from `positions` + `y` to `positions` +
    /// `moved`.
    pub(crate) fn follow_wall_rest(
        &self,
        positions: &[Vector],
        y: &[Vector],
        moved: &mut [Vector],
    ) {
        if let Some(wall) = &self.wall {
            wall.follow_rest(positions, y, moved);
        }
    }
}
