//! `supine coarsen`.

use crate::args;
use crate::failure::Failure;
use crate::screen::Screen;
use supine_exchange::{MeshFile, read_mesh};
use supine_pipeline::{RunError, coarsen_run};
use supine_space::Progress;

pub(crate) fn coarsen(args: &args::Coarsen, screen: &Screen) -> Result<u8, Failure> {
    MeshFile::of(&args.out)?;
    let watch = |share| screen.share("coarsen", share);
    let (progress, tetrahedra) = (Progress::new(&watch), args.tetrahedra.get());
    let (mesh, displacement, info) = if args.from.is_dir() {
        let (mesh, displacement, info) = coarsen_run(&args.from, tetrahedra, progress)?;
        (mesh, Some(displacement), info)
    } else {
        let (fine, displacement) = read_mesh(&args.from)?;
        let coarse = supine_tetrahedralise::coarsen(&fine, tetrahedra, progress);
        let (mesh, info) = coarse.map_err(RunError::from)?;
        let carried = displacement.map(|u| supine_mesh::transfer(&fine, &u, &mesh)).transpose();
        let carried = carried.map_err(|e| Failure::input(format!("{}: {e}", args.from.display())));
        (mesh, carried?, info)
    };
    super::mesh::write(&mesh, displacement.as_ref(), &args.out, screen)?;
    let more = serde_json::json!({ "displacement": displacement.is_some() });
    super::mesh::tell(&mesh, &info, (&args.out, args.report.as_deref()), more, screen)
}
