//! The mesh of the soft tissue in the sphere.

use super::region::Chosen;
use super::segment::{Facts as SegmentFacts, SURFACES};
use crate::bench::{Bench, Done, Made};
use crate::facts::mesh_facts;
use crate::surfaces::read_surfaces;
use crate::{Case, Goal, Refine, RefineWish, RunError, Stage, mesh_region};
use supine_exchange::{read_vtu, write_vtu};
use supine_mesh::TetMesh;
use supine_tetrahedralise::Near;
use supine_volume::{LabelMap, Region};

/// Below this the solver's matrices become poor and the warp's voxels squeezed, degrees.
const POOR_DIHEDRAL_DEG: f64 = 10.0;

pub(crate) fn mesh(
    bench: &mut Bench<'_>,
    case: &Case,
    labels: &Done<LabelMap, SegmentFacts>,
    region: &Chosen,
) -> Result<Done<TetMesh, supine_report::Mesh>, RunError> {
    let params = supine_tetrahedralise::Params {
        tetrahedra: case.mesh.tetrahedra,
        ..supine_tetrahedralise::Params::default()
    };
    let refine = refine(case);
    let decided = format!("{params:?} {:?} {refine:?} {:?}", case.mesh.mesher, region.sphere);
    bench.stage(
        Stage::Mesh,
        &[&labels.key, &decided],
        |store, _| Ok(read_vtu(&store.path("mesh/rest.vtu")?).map_err(RunError::Product)?.0),
        |store, progress| {
            let surfaces =
                read_surfaces(&store.path(SURFACES)?, &labels.product, progress.part(0.0, 0.1))?;
            let region = Region::new(&labels.product, region.sphere)?;
            let region = region.with_surfaces(surfaces.as_ref())?;
            let progress = progress.part(0.1, 1.0);
            let (mesh, info) =
                mesh_region(&region, &params, (case.mesh.mesher, &refine), progress)?;
            write_vtu(&mesh, None, &store.path("mesh/rest.vtu")?).map_err(RunError::Product)?;
            let facts = mesh_facts(&mesh, &info);
            let mut warnings = info.warnings;
            if facts.min_dihedral_deg < POOR_DIHEDRAL_DEG {
                warnings.push(format!(
                    "the smallest dihedral angle is {:.1} degrees (below {POOR_DIHEDRAL_DEG}): \
                     look at the mesh before you trust the result there",
                    facts.min_dihedral_deg
                ));
            }
            Ok(Made { product: mesh, facts, warnings })
        },
    )
}

/// Where the mesh is to be finer.
fn refine(case: &Case) -> Refine {
    match case.mesh.refine {
        RefineWish::Nowhere => Refine::Nowhere,
        RefineWish::Tumour { edge_mm, growth } => {
            Refine::Near(Near { place: case.tumour, edge_mm, growth })
        }
        RefineWish::Goal => Refine::Goal(Goal {
            place: case.tumour,
            tissue: case.tissue,
            load: case.load(),
            solver: case.solver(),
        }),
    }
}
