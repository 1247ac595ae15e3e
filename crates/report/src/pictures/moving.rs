//! What lies in a plane of the CT, and how it moves.

use super::Studio;
use supine_mesh::{Below, below};
use supine_space::Plane;
use supine_space::Vector;

/// A plane with what lies below its pixels and how it moves, mm.
pub(super) struct Motion {
    pub(super) plane: Plane,
    pub(super) ground: Vec<f32>,
    pub(super) below: Vec<Below>,
    pub(super) moves: Vec<Option<Vector>>,
}

impl Motion {
    pub(super) fn new(studio: &Studio<'_>, plane: Plane) -> Self {
        let scene = studio.scene;
        let below = below(scene.mesh(), &plane);
        let move_at = |b: &Below| {
            b.map(|(tet, l)| scene.displacement().at(scene.mesh(), &studio.edges, tet, l))
        };
        let moves = below.iter().map(move_at).collect();
        Self { ground: supine_volume::sample_plane(scene.ct, &plane), plane, below, moves }
    }
}
