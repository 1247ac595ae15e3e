//! `supine coarsen`: fewer tetrahedra of the same tissue.

use super::mesh::{MeshDone, told, write};
use super::{Gather, Outputs, mesh_file};
use crate::folder::FinishedRun;
use crate::shared::{coarsen_run, mesh_facts};
use crate::{Error, NodeId, Observer};
use std::path::PathBuf;
use std::sync::Arc;
use supine_exchange::read_mesh;
use supine_mesh::{Deformation, transfer};
use supine_tetrahedralise::Refinement;

/// What is asked.
#[derive(Clone, Debug)]
pub struct Coarsen {
    /// A mesh, which is coarsened on its own surface; or the folder of a finished run, which is
    /// meshed again from its labels.
    pub from: PathBuf,
    /// Number of tetrahedra.
    pub tetrahedra: usize,
    /// The file of the coarse mesh.
    pub out: PathBuf,
    /// A folder for a page on its quality.
    pub report: Option<PathBuf>,
    /// Whether files that are there already may be replaced.
    pub overwrite: bool,
}

/// Makes a mesh with fewer tetrahedra, with the displacement carried over where there is one.
///
/// # Errors
/// When the input cannot be used, the number cannot be reached, or a file cannot be written.
pub fn coarsen(given: &Coarsen, observer: &dyn Observer) -> Result<MeshDone, Error> {
    mesh_file(&given.out)?;
    Outputs::beside([given.from.as_path()])
        .file("--out", Some(&given.out))
        .folder("--report", given.report.as_deref())
        .check(given.overwrite)?;
    let gather = Gather::new(observer, &[]);
    let (mesh, displacement, info) = gather.work(NodeId::Mesh, |progress| {
        if given.from.is_dir() {
            let run = FinishedRun::open(&given.from)?;
            let (carried, info) = coarsen_run(&run, given.tetrahedra, progress)?;
            return Ok((Arc::clone(carried.mesh()), Some(carried.displacement().clone()), info));
        }
        let (fine, displacement) = read_mesh(&given.from).map_err(Error::product)?;
        let fine = Arc::new(fine);
        let (mesh, info) =
            supine_tetrahedralise::coarsen(&fine, given.tetrahedra, &Refinement::None, progress)?;
        let mesh = Arc::new(mesh);
        let carried = match displacement {
            None => None,
            Some(u) => Some(transfer(&Deformation::new(fine, u)?, Arc::clone(&mesh))?),
        };
        Ok((mesh, carried.map(|carried| carried.displacement().clone()), info))
    })?;
    gather.warn_all(NodeId::Mesh, info.warnings.clone());
    write(&mesh, displacement.as_ref(), &given.out, &gather)?;
    let facts = mesh_facts(&mesh, &info);
    let done = told(&mesh, facts, &gather, &given.out, given.report.as_deref())?;
    Ok(MeshDone { displacement: Some(displacement.is_some()), ..done })
}
