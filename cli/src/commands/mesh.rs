//! `supine mesh`.

use crate::args;
use crate::failure::Failure;
use crate::screen::Screen;
use std::path::Path;
use supine_exchange::{
    MeshFile, SurfaceFrame, read_labels, read_surface, write_mesh, write_problem,
};
use supine_fem::Tissue;
use supine_mesh::{Displacement, Order, TetMesh, TriSurface};
use supine_pipeline::{Refine, RunError, mesh_facts, mesh_region, statics};
use supine_space::{Point, Progress, Sphere};
use supine_tetrahedralise::{Info, Near, Params, Piece, Solids};
use supine_volume::{LabelMap, Region, Surfaces};

pub(crate) fn mesh(args: &args::Mesh, screen: &Screen) -> Result<u8, Failure> {
    let mesher = supine_pipeline::Mesher::from(args.mesher);
    mesher.check_built()?;
    MeshFile::of(&args.out)?;
    let sphere = Sphere::new(Point::from(args.centre.0), args.radius)
        .map_err(|e| Failure::usage(format!("--centre, --radius: {e}")))?;
    let refine = refine(args)?;
    mesher.check_refines(&refine)?;
    let piece = match args.piece {
        args::Piece::Largest => Piece::Largest,
        args::Piece::Centre => Piece::Centre,
    };
    let params = Params { tetrahedra: args.tetrahedra.get(), piece, ..Params::default() };
    let source = source(args, sphere, &params, screen)?;
    let region = Region::new(&source.labels, sphere)
        .and_then(|region| region.with_surfaces(source.surfaces.as_ref()))
        .map_err(RunError::from)?;
    let watch = |share| screen.share("mesh", share);
    let (mesh, mut info) = mesh_region(&region, &params, (mesher, &refine), Progress::new(&watch))?;
    info.warnings.splice(0..0, source.warnings);
    write(&mesh, None, &args.out, screen)?;
    let more = serde_json::json!({ "mesher": mesher.name() });
    tell(&mesh, &info, (&args.out, args.report.as_deref()), more, screen)
}

/// Says what a mesh is like, and writes the page on it when one is asked for. `more` joins what is said
/// in JSON.
pub(crate) fn tell(
    mesh: &TetMesh,
    info: &Info,
    (out, report): (&Path, Option<&Path>),
    more: serde_json::Value,
    screen: &Screen,
) -> Result<u8, Failure> {
    screen.warn_all(&info.warnings);
    let facts = mesh_facts(mesh, info);
    if let Some(folder) = report {
        let watch = |share| screen.share("report", share);
        supine_report::write_mesh(mesh, &facts, &info.warnings, folder, Progress::new(&watch))
            .map_err(RunError::from)?;
    }
    let mut json = serde_json::json!({ "mesh": out, "warnings": info.warnings, "report": report });
    let facts_json = serde_json::to_value(&facts).unwrap_or_default();
    for part in [facts_json, more] {
        let (Some(json), serde_json::Value::Object(part)) = (json.as_object_mut(), part) else {
            continue;
        };
        json.extend(part);
    }
    // Nothing is solved here.
    json.as_object_mut().map(|json| json.remove("unknowns"));
    let far = facts.surfaces.iter().map(|s| s.max_mm).fold(0.0, f64::max);
    let text = format!(
        "{}: {} tetrahedra, dihedral angles {:.1} to {:.1} degrees, {:.1} ml, surface within {far:.2} mm",
        out.display(),
        facts.tetrahedra,
        facts.min_dihedral_deg,
        facts.max_dihedral_deg,
        facts.volume_ml
    );
    screen.result(&json, &text);
    Ok(0)
}

/// Where the mesh is to be finer.
fn refine(args: &args::Mesh) -> Result<Refine, Failure> {
    let (Some(args::Four([x, y, z, radius])), Some(edge_mm)) = (args.finer_in, args.finer_edge)
    else {
        return Ok(Refine::Nowhere);
    };
    let place = Sphere::new(Point::new(x, y, z), radius);
    let place = place.map_err(|e| Failure::usage(format!("--finer-in: {e}")))?;
    Ok(Refine::Near(Near { place, edge_mm, growth: args.finer_growth }))
}

/// What is meshed.
struct Source {
    labels: LabelMap,
    /// Skin and chest wall where they are known between the voxels.
    surfaces: Option<Surfaces>,
    /// What was taken for granted.
    warnings: Vec<String>,
}

/// The labels, or the surfaces on a grid around the sphere.
fn source(
    args: &args::Mesh,
    sphere: Sphere,
    params: &Params,
    screen: &Screen,
) -> Result<Source, Failure> {
    let watch = |share| screen.share("import", share);
    let progress = Progress::new(&watch);
    if let Some(labels) = &args.labels {
        let labels = read_labels(labels, progress)?;
        return Ok(Source { labels, surfaces: None, warnings: vec![] });
    }
    let (Some(skin), Some(chest_wall)) = (&args.skin, &args.chest_wall) else {
        return Err(Failure::usage("--labels, or --skin and --chest-wall, are needed"));
    };
    let mut warnings = Vec::new();
    let skin = surface(skin, args.frame, &mut warnings)?;
    let chest_wall = surface(chest_wall, args.frame, &mut warnings)?;
    let solids = Solids::new(&skin, &chest_wall, sphere, params, progress);
    let Solids { labels, surfaces, warnings: more } = solids.map_err(RunError::from)?;
    warnings.extend(more);
    Ok(Source { labels, surfaces: Some(surfaces), warnings })
}

/// A surface in LPS; warns of what was taken for granted about it.
pub(crate) fn surface(
    path: &Path,
    frame: args::Frame,
    warnings: &mut Vec<String>,
) -> Result<TriSurface, Failure> {
    let frame = match frame {
        args::Frame::Lps => SurfaceFrame::Lps,
        args::Frame::Ras => SurfaceFrame::Ras,
    };
    let (surface, said) = read_surface(path, frame)?;
    let name = path.display();
    if said.is_none() {
        let frame = frame.name();
        warnings.push(format!("{name} does not say its frame: taken as {frame} (--frame)"));
    }
    if surface.was_inside_out() {
        warnings.push(format!("{name} was inside out and was turned"));
    }
    Ok(surface)
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
            let problem = statics(&Tissue::default(), gravity, Order::Linear, false);
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
