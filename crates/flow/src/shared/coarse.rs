//! A coarser mesh from what a run left.

use super::read_surfaces;
use crate::Error;
use crate::folder::FinishedRun;
use std::sync::Arc;
use supine_exchange::{read_labels, read_vtu};
use supine_mesh::{Deformation, transfer};
use supine_space::Progress;
use supine_tetrahedralise::{Domain, Info, Params};
use supine_volume::Region;

/// A mesh of the asked number of tetrahedra from the labels, surfaces and region of a finished run,
/// with the run's displacement carried over.
///
/// # Errors
/// When the folder is not that of a finished run, or the number cannot be reached.
pub fn coarsen_run(
    run: &FinishedRun,
    tetrahedra: usize,
    progress: Progress<'_>,
) -> Result<(Deformation, Info), Error> {
    let sphere = run.region()?;
    let path = run.deformed();
    let (fine, displacement) = read_vtu(&path).map_err(Error::product)?;
    let displacement = displacement.ok_or(Error::NoDisplacement { path: path.clone() })?;
    let fine = Deformation::new(Arc::new(fine), displacement)?;
    let has = fine.mesh().tets().len();
    if tetrahedra >= has {
        let error = supine_tetrahedralise::Error::NotCoarser { asked: tetrahedra, has };
        return Err(Error::Mesh(error));
    }
    let labels = read_labels(&run.labels(), progress.part(0.0, 0.05)).map_err(Error::product)?;
    let labels = Arc::new(labels);
    let surfaces = read_surfaces(&run.surfaces(), &labels, progress.part(0.05, 0.15))?;
    let region = Region::new(Arc::clone(&labels), sphere)?;
    let region = region.with_surfaces(surfaces.map(Arc::new))?;
    let domain = Domain::new(&region, &Params::default(), progress.part(0.15, 0.45))?;
    let (mesh, info) = domain.mesh(tetrahedra, progress.part(0.45, 1.0))?;
    let carried = transfer(&fine, Arc::new(mesh)).map_err(|_| Error::Unfinished { path })?;
    Ok((carried, info))
}
