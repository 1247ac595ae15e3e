//! The summary's figures from the domain types.

use supine_mesh::{BoundaryTag, TetMesh, quality};
use supine_report::{Gate, Mesh, Movement};
use supine_segment::Bound;
use supine_space::Point;

/// The mesh's part of the summary; the unknowns are known only to the solver and stay 0 here.
pub(crate) fn mesh_facts(mesh: &TetMesh, asked: usize) -> Mesh {
    let q = quality(mesh);
    Mesh {
        asked,
        tetrahedra: mesh.tets().len(),
        points: mesh.points().len(),
        unknowns: 0,
        min_dihedral_deg: q.min_dihedral_deg,
        max_dihedral_deg: q.max_dihedral_deg,
        min_radius_ratio: q.min_radius_ratio,
        mean_radius_ratio: q.mean_radius_ratio,
        volume_ml: mesh.total_volume() / 1000.0,
        skin_mm2: mesh.area(BoundaryTag::Skin),
        chest_wall_mm2: mesh.area(BoundaryTag::ChestWall),
        cut_mm2: mesh.area(BoundaryTag::Cut),
    }
}

/// A figure and its limits in the words of the summary.
pub(crate) fn gate(gate: &supine_segment::Gate) -> Gate {
    Gate {
        what: gate.what.into(),
        unit: gate.unit.into(),
        value: gate.value,
        at_most: gate.bound == Bound::AtMost,
        warns: gate.warns,
        refuses: gate.refuses,
        jointly: gate.jointly,
    }
}

/// How a point moved; one outside the mesh stays.
pub(crate) fn movement(before: Point, after: Option<Point>) -> Movement {
    Movement::new(before.coords.into(), after.unwrap_or(before).coords.into())
}
