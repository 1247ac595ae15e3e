//! A coarser mesh from what a run left.

use crate::RunError;
use crate::stages::segment::SURFACES;
use crate::store::Store;
use crate::surfaces::read_surfaces;
use std::path::Path;
use supine_exchange::{read_labels, read_vtu};
use supine_mesh::{Displacement, TetMesh, transfer};
use supine_report::Summary;
use supine_space::{Point, Progress, Sphere};
use supine_tetrahedralise::{Domain, Info, Params};
use supine_volume::Region;

/// A mesh of the asked number of tetrahedra from the labels, surfaces and region of a finished run,
/// with the run's displacement carried over.
///
/// # Errors
/// When the folder is not that of a finished run, or the number cannot be reached.
pub fn coarsen_run(
    run: &Path,
    tetrahedra: usize,
    progress: Progress<'_>,
) -> Result<(TetMesh, Displacement, Info), RunError> {
    let unfinished = || RunError::Unfinished { path: run.into() };
    let text = std::fs::read_to_string(run.join("summary.json")).map_err(|_| unfinished())?;
    let summary: Summary = serde_json::from_str(&text).map_err(|_| unfinished())?;
    let store = Store::open(run, None)?;
    let (fine, displacement) =
        read_vtu(&store.path("mesh/deformed.vtu")?).map_err(RunError::Product)?;
    let displacement = displacement.ok_or_else(unfinished)?;
    let has = fine.tets().len();
    if tetrahedra >= has {
        let error = supine_tetrahedralise::Error::NotCoarser { asked: tetrahedra, has };
        return Err(RunError::Mesh(error));
    }
    let labels = read_labels(&store.path("labels.seg.nrrd")?, progress.part(0.0, 0.05))
        .map_err(RunError::product)?;
    let surfaces = read_surfaces(&store.path(SURFACES)?, &labels, progress.part(0.05, 0.15))?;
    let asked = &summary.parameters.region;
    let sphere = Sphere::new(Point::from(asked.centre_mm), asked.radius_mm);
    let region = Region::new(&labels, sphere.map_err(|_| unfinished())?)?;
    let region = region.with_surfaces(surfaces.as_ref())?;
    let domain = Domain::new(&region, &Params::default(), progress.part(0.15, 0.45))?;
    let (mesh, info) = domain.mesh(tetrahedra, progress.part(0.45, 1.0))?;
    let carried = transfer(&fine, &displacement, &mesh).map_err(|_| unfinished())?;
    Ok((mesh, carried, info))
}
