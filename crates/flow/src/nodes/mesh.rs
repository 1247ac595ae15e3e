//! The mesh of the soft tissue in the sphere.

use super::{Region, Segment};
use crate::case_state::CaseState;
use crate::graph::{Node, Outs};
use crate::nodes::law::Law;
use crate::shared::{Goal, Mesher, Refine, mesh_facts, mesh_region};
use crate::spec::Refinement;
use crate::work::Work;
use crate::{Error, NodeId};
use serde::Serialize;
use std::sync::Arc;
use supine_exchange::{read_vtu, write_vtu};
use supine_mesh::{BoundaryTag, Displacement, TetMesh, quality};
use supine_report::SphereRecord;
use supine_space::{Grid, Point, Warning};
use supine_tetrahedralise::{Domain, Info, Near, Params, Piece};
use supine_volume::Field;

pub(crate) struct Mesh;

/// Below this the solver's matrices become poor and the warp's voxels squeezed, degrees: chosen,
/// not measured.
const POOR_DIHEDRAL_DEG: f64 = 10.0;
/// A face this near to the end of the field belongs to it, pixels: labels end on whole pixels,
/// which a mesh smooths.
const NEAR_PIXELS: f64 = 1.6;

#[derive(Serialize)]
pub(crate) struct NodeInputs {
    tetrahedra: usize,
    mesher: &'static str,
    curved: bool,
    centre_piece: bool,
    refine: OwnRefine,
}

/// Where it is finer, with what that rests on.
#[derive(Serialize)]
enum OwnRefine {
    Nowhere,
    Tumour { place: SphereRecord, edge_mm: f64, growth: f64 },
    Goal { place: SphereRecord, law: Box<Law> },
}

/// The mesh in the CT shape.
#[derive(Debug)]
pub(crate) struct Meshed {
    pub(crate) mesh: Arc<TetMesh>,
    /// How far the nodes of curved elements lie off the straight mesh, mm.
    pub(crate) curved: Option<Displacement>,
    pub(crate) facts: supine_report::Mesh,
}

/// The skin that is none: where the CT ends, tissue goes on, and its faces are part of the cut.
fn cut_by_field(mesh: TetMesh, field: &Field, grid: &Grid) -> TetMesh {
    let near = field.near_end(NEAR_PIXELS * field.pixel_mm());
    let ends = |at: &Point| field.pixel(grid, at).is_none_or(|pixel| near[pixel]);
    mesh.tagged(|middle, tag| match tag {
        BoundaryTag::Skin if ends(middle) => BoundaryTag::Cut,
        tag => tag,
    })
}

impl Meshed {
    /// A mesh that is given in place of being made.
    pub(crate) fn given(mesh: Arc<TetMesh>) -> Self {
        let info = Info {
            warnings: vec![],
            asked: mesh.tets().len(),
            tetrahedra: mesh.tets().len(),
            points: mesh.points().len(),
            quality: quality(&mesh),
            edge_mm: 0.0,
            dropped_components: 0,
            dropped_volume_mm3: 0.0,
            joined_patches: 0,
            deviation: vec![],
            rim_mm: 0.0,
            volume_mm3: mesh.total_volume(),
            label_volume_mm3: mesh.total_volume(),
        };
        let facts = mesh_facts(&mesh, &info);
        Self { mesh, curved: None, facts }
    }
}

impl Node for Mesh {
    const ID: NodeId = NodeId::Mesh;
    const METHOD: u32 = 3;
    const KEPT: bool = true;
    type NodeInputs = NodeInputs;
    type Parents = (Segment, Region);
    type Out = Meshed;

    fn inputs(case_state: &CaseState) -> Result<NodeInputs, Error> {
        let case = &case_state.case;
        let refine = match case.mesh.refine {
            Refinement::Nowhere => OwnRefine::Nowhere,
            Refinement::Tumour { edge_mm, growth } => {
                OwnRefine::Tumour { place: case_state.tumour()?.sphere.into(), edge_mm, growth }
            }
            Refinement::Goal => OwnRefine::Goal {
                place: case_state.tumour()?.sphere.into(),
                law: Law::of(case)?.into(),
            },
        };
        Ok(NodeInputs {
            tetrahedra: case.mesh.tetrahedra,
            mesher: case.mesh.mesher.name(),
            curved: case.mesh.curved,
            centre_piece: case.mesh.centre_piece,
            refine,
        })
    }

    fn run(
        inputs: &NodeInputs,
        (segmented, chosen): Outs<Self>,
        work: &Work<'_>,
    ) -> Result<Meshed, Error> {
        let progress = work.progress;
        let region = segmented.region(chosen.sphere()?, progress.part(0.0, 0.1))?;
        let piece = if inputs.centre_piece { Piece::Centre } else { Piece::Largest };
        let params = Params { tetrahedra: inputs.tetrahedra, piece, ..Params::default() };
        let mesher =
            Mesher::ALL.into_iter().find(|m| m.name() == inputs.mesher).unwrap_or_default();
        let refine = inputs.refine.refine()?;
        let (mesh, info) =
            mesh_region(&region, &params, (mesher, &refine), progress.part(0.1, 0.9))?;
        work.warn_all(info.warnings.iter().cloned());
        let bent = match inputs.curved {
            false => None,
            true => {
                let domain = Domain::new(&region, &params, progress.part(0.9, 1.0))?;
                Some(domain.curved(&mesh)?)
            }
        };
        let mesh = match chosen.field() {
            Some(field) => cut_by_field(mesh, &field, segmented.labels.grid()),
            None => mesh,
        };
        let mut facts = mesh_facts(&mesh, &info);
        facts.curved = bent.as_ref().map(|(_, curved)| *curved);
        let curved = bent.map(|(offsets, _)| offsets);
        work.warn_all(poor(&facts));
        Ok(Meshed { mesh: Arc::new(mesh), curved, facts })
    }

    fn save(out: &Meshed, work: &Work<'_>) -> Result<(), Error> {
        write_vtu(&out.mesh, None, &work.place("mesh")?).map_err(Error::product)?;
        if let Some(offsets) = &out.curved {
            write_vtu(&out.mesh, Some(offsets), &work.place("curved")?).map_err(Error::product)?;
        }
        Ok(())
    }

    fn facts(out: &Meshed) -> Result<serde_json::Value, Error> {
        Ok(serde_json::to_value(&out.facts)?)
    }

    fn load(facts: serde_json::Value, work: &Work<'_>) -> Result<Meshed, Error> {
        let facts: supine_report::Mesh = serde_json::from_value(facts)?;
        let (mesh, _) = read_vtu(&work.place("mesh")?).map_err(Error::product)?;
        let curved = match facts.curved {
            None => None,
            Some(_) => {
                let path = work.place("curved")?;
                let (_, offsets) = read_vtu(&path).map_err(Error::product)?;
                Some(offsets.ok_or(Error::NoDisplacement { path })?)
            }
        };
        Ok(Meshed { mesh: Arc::new(mesh), curved, facts })
    }
}

impl OwnRefine {
    /// What the mesher has to know.
    fn refine(&self) -> Result<Refine, Error> {
        Ok(match self {
            Self::Nowhere => Refine::Nowhere,
            Self::Tumour { place, edge_mm, growth } => {
                Refine::Near(Near { place: place.sphere()?, edge_mm: *edge_mm, growth: *growth })
            }
            Self::Goal { place, law } => Refine::Goal(Box::new(Goal {
                place: place.sphere()?,
                tissue: law.tissue(),
                load: law.load(),
                solver: law.solver(),
            })),
        })
    }
}

fn poor(facts: &supine_report::Mesh) -> Option<Warning> {
    let angle = facts.min_dihedral_deg;
    let text = format!(
        "the smallest dihedral angle is {angle:.1} degrees (below {POOR_DIHEDRAL_DEG}): \
         look at the mesh before you trust the result there"
    );
    (angle < POOR_DIHEDRAL_DEG)
        .then(|| Warning::new("poor-dihedral-angle", text).value("degrees", angle))
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_mesh::BoundaryFace;
    use supine_space::{Matrix, Vector};
    use supine_volume::Volume;

    #[test]
    fn skin_at_the_circle_is_cut_and_elsewhere_stays() {
        let grid =
            Grid::new([101, 101, 4], Vector::repeat(1.0), Point::origin(), Matrix::identity());
        let hu = |[i, j, k]: [usize; 3]| match (i as f64 - 50.0).hypot(j as f64 - 50.0) {
            r if r > 40.0 => -1024,
            _ => -1000 + ((7 * i + 13 * j + 29 * k) % 31) as i16,
        };
        let ct = Volume::from_fn(grid.unwrap(), hu);
        let field = Field::found(&ct);
        // Four faces, of which one lies at the circle.
        let at = [[90.0, 47.0, 0.0], [90.0, 53.0, 0.0], [90.0, 50.0, 3.0], [60.0, 50.0, 1.0]];
        let points = at.map(Point::from).to_vec();
        let faces = [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]];
        let tag = BoundaryTag::Skin;
        let faces = faces.map(|points| BoundaryFace { points, tag }).to_vec();
        let mesh = TetMesh::new(points, vec![[0, 2, 1, 3]], faces).unwrap();
        let tags: Vec<_> =
            cut_by_field(mesh, &field, ct.grid()).boundary().iter().map(|face| face.tag).collect();
        assert_eq!(tags, [BoundaryTag::Cut, tag, tag, tag]);
    }
}
