//! `supine coarsen`.

use crate::args;
use crate::failure::Failure;
use crate::screen::Screen;
use supine_exchange::{MeshFile, read_vtu};
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
        let (fine, displacement) = read_vtu(&args.from)?;
        let coarse = supine_tetrahedralise::coarsen(&fine, tetrahedra, progress);
        let (mesh, info) = coarse.map_err(RunError::from)?;
        let carried = displacement.map(|u| supine_mesh::transfer(&fine, &u, &mesh)).transpose();
        let carried = carried.map_err(|e| Failure::input(format!("{}: {e}", args.from.display())));
        (mesh, carried?, info)
    };
    super::mesh::write(&mesh, displacement.as_ref(), &args.out, screen)?;
    screen.warn_all(&info.warnings);
    let surfaces: serde_json::Map<_, _> = info
        .deviation
        .iter()
        .map(|d| {
            let facts = serde_json::json!({ "mean_mm": d.mean_mm, "max_mm": d.max_mm });
            (d.tag.name().to_owned(), facts)
        })
        .collect();
    let q = info.quality;
    let json = serde_json::json!({
        "mesh": args.out, "tetrahedra": mesh.tets().len(), "points": mesh.points().len(),
        "min_dihedral_deg": q.min_dihedral_deg, "max_dihedral_deg": q.max_dihedral_deg,
        "min_radius_ratio": q.min_radius_ratio, "volume_ml": info.volume_mm3 / 1000.0,
        "volume_before_ml": info.label_volume_mm3 / 1000.0, "surfaces": surfaces,
        "displacement": displacement.is_some(), "warnings": info.warnings,
    });
    let far = info.deviation.iter().map(|d| d.max_mm).fold(0.0, f64::max);
    let text = format!(
        "{}: {} tetrahedra, dihedral angles {:.1} to {:.1} degrees, surface within {far:.2} mm",
        args.out.display(),
        mesh.tets().len(),
        q.min_dihedral_deg,
        q.max_dihedral_deg,
    );
    screen.result(&json, &text);
    Ok(0)
}
