//! The summary's figures from the domain types.

use supine_mesh::{BoundaryTag, TetMesh, quality, spread, tet_quality};
use supine_report::{Mesh, Movement, SurfaceFit, WorstTet};
use supine_space::{Point, Vector};
use supine_tetrahedralise::Deviation;

/// The worst tetrahedra that are named.
const NAMED: usize = 5;

/// The mesh's part of the summary; the unknowns are known only to the solver and stay 0 here.
pub fn mesh_facts(mesh: &TetMesh, info: &supine_tetrahedralise::Info) -> Mesh {
    let q = quality(mesh);
    let spread = spread(mesh, NAMED);
    Mesh {
        asked: info.asked,
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
        source_volume_ml: info.label_volume_mm3 / 1000.0,
        joined_patches: info.joined_patches,
        surfaces: info.deviation.iter().map(surface_fit).collect(),
        dihedral_angles: spread.dihedral.to_vec(),
        radius_ratios: spread.radius_ratio.to_vec(),
        curved: None,
        worst: spread.worst.into_iter().map(|tet| worst_tet(mesh, tet)).collect(),
    }
}

fn surface_fit(d: &Deviation) -> SurfaceFit {
    SurfaceFit { tag: d.tag.name().into(), distance: d.distance }
}

fn worst_tet(mesh: &TetMesh, tet: usize) -> WorstTet {
    let corners = mesh.corners(tet);
    let shape = tet_quality(&corners);
    WorstTet {
        tet,
        place_mm: (corners.iter().map(|c| c.coords).sum::<Vector>() / 4.0).into(),
        min_dihedral_deg: shape.min_dihedral_deg,
        max_dihedral_deg: shape.max_dihedral_deg,
        radius_ratio: shape.radius_ratio,
    }
}

/// How a point moved; one outside the mesh stays.
pub(crate) fn movement(before: Point, after: Option<Point>) -> Movement {
    Movement::new(before.coords.into(), after.unwrap_or(before).coords.into())
}

/// By what a case file knows a warning that the planner has looked at: another message is another
/// warning.
pub fn warning_id(warning: &supine_report::Warning) -> String {
    let told = format!("{}\n{}\n{}", warning.stage, warning.code, warning.message);
    format!("{}-{}", warning.code, &blake3::hash(told.as_bytes()).to_hex()[..12])
}

/// A warning as a summary holds it, without what a site named where that may be the patient.
pub(crate) fn told(
    node: crate::NodeId,
    warning: &supine_space::Warning,
    nameless: bool,
) -> supine_report::Warning {
    supine_report::Warning {
        stage: node.name().into(),
        code: warning.code().into(),
        message: if nameless { warning.without_names() } else { warning.to_string() },
        advice: node.advice().into(),
        values: warning.values().iter().map(|(name, value)| ((*name).into(), *value)).collect(),
        place_mm: warning.place(),
        seen: false,
    }
}
