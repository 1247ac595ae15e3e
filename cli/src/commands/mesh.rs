//! `supine mesh`.

use crate::args;
use crate::failure::Failure;
use crate::screen::Screen;
use std::path::Path;
use supine_exchange::{MeshFile, read_labels, write_mesh, write_problem};
use supine_fem::{Cut, Tissue};
use supine_mesh::{Displacement, Order, TetMesh};
use supine_pipeline::{RunError, mesh_region, statics};
use supine_space::{Point, Progress, Sphere};
use supine_tetrahedralise::Params;
use supine_volume::Region;

pub(crate) fn mesh(args: &args::Mesh, screen: &Screen) -> Result<u8, Failure> {
    let mesher = supine_pipeline::Mesher::from(args.mesher);
    mesher.check_built()?;
    MeshFile::of(&args.out)?;
    let sphere = Sphere::new(Point::from(args.centre.0), args.radius)
        .map_err(|e| Failure::usage(format!("--centre, --radius: {e}")))?;
    let watch = |share| screen.share("import", share);
    let labels = read_labels(&args.labels, Progress::new(&watch))?;
    let region = Region::new(&labels, sphere).map_err(RunError::from)?;
    let params = Params { tetrahedra: args.tetrahedra.get(), ..Params::default() };
    let watch = |share| screen.share("mesh", share);
    let (mesh, info) = mesh_region(&region, &params, mesher, Progress::new(&watch))?;
    write(&mesh, None, &args.out, screen)?;
    screen.warn_all(&info.warnings);
    let q = supine_mesh::quality(&mesh);
    let json = serde_json::json!({
        "mesh": args.out, "mesher": mesher.name(), "asked": info.asked, "tetrahedra": mesh.tets().len(),
        "points": mesh.points().len(), "volume_ml": mesh.total_volume() / 1000.0,
        "min_dihedral_deg": q.min_dihedral_deg, "max_dihedral_deg": q.max_dihedral_deg,
        "min_radius_ratio": q.min_radius_ratio, "warnings": info.warnings,
    });
    let text = format!(
        "{}: {} tetrahedra, dihedral angles {:.1} to {:.1} degrees, {:.1} ml",
        args.out.display(),
        mesh.tets().len(),
        q.min_dihedral_deg,
        q.max_dihedral_deg,
        mesh.total_volume() / 1000.0
    );
    screen.result(&json, &text);
    Ok(0)
}

/// Writes a mesh in the format its name ends in; as a problem for another solver with the default
/// tissue and the weight of a patient on her back.
pub(crate) fn write(
    mesh: &TetMesh,
    displacement: Option<&Displacement>,
    out: &Path,
    screen: &Screen,
) -> Result<(), Failure> {
    match MeshFile::of(out)? {
        MeshFile::Result => write_mesh(mesh, displacement, out)?,
        MeshFile::Problem => {
            let gravity = supine_space::supine();
            let problem = statics(&Tissue::default(), gravity, Order::Linear, Cut::Free);
            write_problem(mesh, &problem, out)?;
            if displacement.is_some() {
                screen.warn_all(&[format!("{}: holds no displacement", out.display())]);
            }
        }
    }
    Ok(())
}

/// The hidden command: TetGen on a surface from stdin, since TetGen may end its process.
#[cfg(feature = "tetgen")]
pub(crate) fn tetgen_worker() -> Result<u8, Failure> {
    let failed = |message| Failure { code: 3, message };
    supine_pipeline::tetgen_work().map(|()| 0).map_err(failed)
}
