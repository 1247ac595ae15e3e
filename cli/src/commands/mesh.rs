//! `supine mesh`.

use crate::args;
use crate::failure::Failure;
use crate::screen::Screen;
use supine_exchange::{read_labels, write_vtu};
use supine_pipeline::RunError;
use supine_space::{Point, Progress, Sphere};
use supine_tetrahedralise::Params;
use supine_volume::Region;

pub(crate) fn mesh(args: &args::Mesh, screen: &Screen) -> Result<u8, Failure> {
    let args::Mesher::Native = args.mesher;
    let sphere = Sphere::new(Point::from(args.centre.0), args.radius)
        .map_err(|e| Failure::usage(format!("--centre, --radius: {e}")))?;
    let watch = |share| screen.share("import", share);
    let labels = read_labels(&args.labels, Progress::new(&watch))?;
    let region = Region::new(&labels, sphere).map_err(RunError::from)?;
    let params = Params { tetrahedra: args.tetrahedra.get(), ..Params::default() };
    let watch = |share| screen.share("mesh", share);
    let (mesh, info) =
        supine_tetrahedralise::tetrahedralise(&region, &params, Progress::new(&watch))
            .map_err(RunError::from)?;
    write_vtu(&mesh, None, &args.out)?;
    screen.warn_all(&info.warnings);
    let q = supine_mesh::quality(&mesh);
    let json = serde_json::json!({
        "mesh": args.out, "asked": info.asked, "tetrahedra": mesh.tets().len(),
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
