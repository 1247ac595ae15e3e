//! The mesh of the soft tissue in the sphere.

use super::region::Chosen;
use super::segment::{Facts as SegmentFacts, SURFACES};
use crate::bench::{Bench, Done, Made};
use crate::facts::mesh_facts;
use crate::store::Store;
use crate::surfaces::read_surfaces;
use crate::{Case, Goal, Refine, RefineWish, RunError, Stage, mesh_region};
use supine_exchange::{read_vtu, write_vtu};
use supine_mesh::TetMesh;
use supine_tetrahedralise::{Curving, Domain, Near};
use supine_volume::{LabelMap, Region};

/// Below this the solver's matrices become poor and the warp's voxels squeezed, degrees.
const POOR_DIHEDRAL_DEG: f64 = 10.0;

/// The offsets of curved elements, as the displacement of the mesh.
const CURVED: &str = ".stages/curved.vtu";

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
    let (mesher, curved_sides) = (case.mesh.mesher, case.mesh.curved);
    let decided = format!("{params:?} {mesher:?} {refine:?} {curved_sides} {:?}", region.sphere);
    bench.stage(
        Stage::Mesh,
        &[&labels.key, &decided],
        |store, _| Ok(read_vtu(&store.path("mesh/rest.vtu")?).map_err(RunError::Product)?.0),
        |store, progress| {
            let surfaces =
                read_surfaces(&store.path(SURFACES)?, &labels.product, progress.part(0.0, 0.1))?;
            let region = Region::new(&labels.product, region.sphere)?;
            let region = region.with_surfaces(surfaces.as_ref())?;
            let part = progress.part(0.1, 0.9);
            let (mesh, info) = mesh_region(&region, &params, (case.mesh.mesher, &refine), part)?;
            write_vtu(&mesh, None, &store.path("mesh/rest.vtu")?).map_err(RunError::Product)?;
            let mut facts = mesh_facts(&mesh, &info);
            let mut warnings = info.warnings;
            if case.mesh.curved {
                let domain = Domain::new(&region, &params, progress.part(0.9, 1.0))?;
                let (offsets, told) = domain.curved(&mesh)?;
                write_vtu(&mesh, Some(&offsets), &store.path(CURVED)?)
                    .map_err(RunError::Product)?;
                facts.curved = Some(curved(&told));
            }
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

fn curved(told: &Curving) -> supine_report::Curved {
    let Curving { moved: nodes, shortened, mean_mm, max_mm } = *told;
    supine_report::Curved { nodes, shortened, mean_mm, max_mm }
}

/// How far the nodes of the elements lie off the straight mesh, when the case asks for curved ones.
pub(super) fn read_curved(
    store: &Store,
    case: &Case,
) -> Result<Option<supine_mesh::Displacement>, RunError> {
    if !case.mesh.curved {
        return Ok(None);
    }
    let path = store.path(CURVED)?;
    let (_, offsets) = read_vtu(&path).map_err(RunError::Product)?;
    offsets.map(Some).ok_or(RunError::NoDisplacement { path })
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
