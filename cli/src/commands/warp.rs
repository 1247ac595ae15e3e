//! `supine warp`.

mod grid;

use crate::args;
use crate::failure::Failure;
use crate::screen::Screen;
use grid::output_grid;
use std::path::Path;
use supine_dicom::{ExportParams, Policy, ReadParams, Source};
use supine_exchange::{
    FieldKind, read_mesh, write_ct_nifti, write_ct_nrrd, write_field, write_scalar,
};
use supine_mesh::{Displacement, TetMesh};
use supine_pipeline::{CtInput, Outward, RunError, forgetful_anonymiser, write_registration};
use supine_report::Registration;
use supine_space::{Grid, Progress, Side};
use supine_volume::Ct;
use supine_warp::{Consistency, Interpolation, Params, consistency};

fn note(interpolation: Interpolation) -> String {
    format!(
        "DERIVED: resampled ({}) by supine {} through a deformed mesh; not acquired anatomy. HU carried \
         unchanged.",
        interpolation.name(),
        env!("CARGO_PKG_VERSION"),
    )
}

pub(crate) fn warp(args: &args::Warp, screen: &Screen) -> Result<u8, Failure> {
    let other = asked_grid(args)?;
    let (mesh, displacement) = read_mesh(&args.mesh)?;
    let displacement = displacement.ok_or_else(|| {
        Failure::input(format!(
            "{} holds no point data `displacement` (mm): make it with `supine solve`",
            args.mesh.display()
        ))
    })?;
    let watch = |share| screen.share("import", share);
    let reading = ReadParams { series: args.series.clone(), accept: args.accept.into() };
    let input = supine_pipeline::read_ct(&args.ct, &reading, Progress::new(&watch))?;
    let watch = |share| screen.share("warp", share);
    let params = Params { interpolation: args.interpolation.into(), ..Params::default() };
    let ct = input.ct.grid();
    let grid = if other { output_grid(ct, args, (&mesh, &displacement))? } else { ct.clone() };
    let progress = Progress::new(&watch);
    let (warped, info) =
        supine_warp::warp_onto(&grid, &input.ct, &mesh, &displacement, &params, progress)
            .map_err(RunError::from)?;
    let source = write(args, &input, &warped, info.max_displacement_mm, screen)?;
    let registration = match (&args.registration, &source) {
        (Some(folder), Some(source)) => {
            let watch = |share| screen.share("registration", share);
            let (map, progress) = ((&mesh, &displacement), Progress::new(&watch));
            Some(write_registration(ct, (source, &args.out), map, folder, progress)?)
        }
        _ => None,
    };
    let fields = match &args.fields {
        Some(folder) => {
            Some((folder, fields(input.ct.grid(), (&mesh, &displacement), folder, screen)?))
        }
        None => None,
    };
    screen.warn_all(&info.warnings);
    let json = serde_json::json!({
        "out": args.out, "moved_voxels": info.moved_voxels,
        "vacated_voxels": info.vacated_voxels, "folded_voxels": info.folded_voxels,
        "fade_mm": info.fade_mm, "jacobian_min": info.jacobian_min,
        "jacobian_max": info.jacobian_max, "warnings": info.warnings,
        "fields": fields.as_ref().map(|(folder, _)| folder), "registration": registration,
        "forward_then_backward": fields.as_ref().and_then(|(_, c)| c.as_ref()).map(|c| {
            serde_json::json!({
                "voxels": c.voxels, "mean_mm": c.mean_mm, "p99_mm": c.p99_mm, "max_mm": c.max_mm,
            })
        }),
    });
    let mut text = format!(
        "{}: {} voxels moved, Jacobian {:.2} to {:.2}",
        args.out.display(),
        info.moved_voxels,
        info.jacobian_min,
        info.jacobian_max
    );
    if let Some((folder, Some(c))) = &fields {
        text += &format!(
            "\n{}: fields; forward, then backward: {:.3} mm mean, {:.3} mm at 99 %, {:.3} mm at \
             most",
            folder.display(),
            c.mean_mm,
            c.p99_mm,
            c.max_mm
        );
    }
    if let (Some(folder), Some(r)) = (&args.registration, &registration) {
        text += &told(folder, r);
    }
    screen.result(&json, &text);
    Ok(0)
}

/// Whether another grid than the CT's is asked for; what does not go together is refused.
fn asked_grid(args: &args::Warp) -> Result<bool, Failure> {
    let other = args.spacing.is_some() || args.around.is_some() || args.axial.is_some();
    if other && !is_file(&args.out) {
        let message = "--spacing, --around, --axial: a DICOM series keeps the CT's grid; name a .nrrd or .nii.gz \
                       file";
        return Err(Failure::usage(message));
    }
    if args.registration.is_some() && is_file(&args.out) {
        let message =
            "--registration: a registration is of a DICOM series; name a folder for it with --out";
        return Err(Failure::usage(message));
    }
    Ok(other)
}

/// How far a reader of the registrations is off, in words.
fn told(folder: &Path, r: &Registration) -> String {
    format!(
        "\n{}: registrations; between their vectors {:.3} mm off the map in the mean, {:.3} mm at \
         99 %, {:.3} mm at most",
        folder.display(),
        r.mean_mm,
        r.p99_mm,
        r.max_mm
    )
}

/// Whether one file is to be written, not a series.
fn is_file(out: &Path) -> bool {
    let name = out.to_string_lossy().to_lowercase();
    [".nrrd", ".nii", ".nii.gz"].iter().any(|ending| name.ends_with(ending))
}

/// Writes the CT; of a DICOM series the source, as it may be named.
fn write(
    args: &args::Warp,
    input: &CtInput,
    warped: &Ct,
    reach_mm: f64,
    screen: &Screen,
) -> Result<Option<Source>, Failure> {
    let watch = |share| screen.share("export", share);
    let progress = Progress::new(&watch);
    let name = args.out.to_string_lossy().to_lowercase();
    if name.ends_with(".nrrd") {
        write_ct_nrrd(warped, &args.out, &note(args.interpolation.into()), progress)?;
        return Ok(None);
    }
    if name.ends_with(".nii") || name.ends_with(".nii.gz") {
        write_ct_nifti(warped, &args.out, &note(args.interpolation.into()), progress)?;
        return Ok(None);
    }
    let Some((source, _)) = &input.dicom else {
        let message = "--out: the CT did not come as DICOM, so no series can be written; name a \
                       .nrrd or .nii.gz file";
        return Err(Failure::usage(message));
    };
    let Some(breast) = args.breast else {
        let message = "--breast left|right is needed for a DICOM series (its Laterality)";
        return Err(Failure::usage(message));
    };
    let outward = if args.anonymise {
        Outward::anonymised(source, forgetful_anonymiser()?)
    } else {
        Outward::named(source)
    };
    let source = &outward.source;
    let params = ExportParams {
        series_description: "DEFORMED by a given mesh".into(),
        derivation: note(args.interpolation.into()),
        image_comments: "SIMULATED DEFORMATION - not acquired anatomy".into(),
        laterality: match breast {
            args::Breast::Left => Side::Left,
            args::Breast::Right => Side::Right,
        },
        clock: source.clock(),
        software_version: env!("CARGO_PKG_VERSION").into(),
        identity: *blake3::hash(note(args.interpolation.into()).as_bytes()).as_bytes(),
        reach_mm,
        policy: Policy::default(),
    };
    supine_dicom::write_series(warped, source, &params, &args.out, progress)?;
    Ok(Some(outward.source))
}

/// Writes the map as fields in both formats; how well they undo each other, unless nothing moves.
fn fields(
    grid: &Grid,
    (mesh, displacement): (&TetMesh, &Displacement),
    folder: &Path,
    screen: &Screen,
) -> Result<Option<Consistency>, Failure> {
    std::fs::create_dir_all(folder)
        .map_err(|e| Failure::output(format!("cannot make {}: {e}", folder.display())))?;
    let watch = |share| screen.share("fields", share);
    let progress = Progress::new(&watch);
    let params = Params::default();
    let fields = supine_warp::fields(grid, mesh, displacement, &params, progress.part(0.0, 0.3))
        .map_err(RunError::from)?;
    for (n, ending) in ["nrrd", "nii.gz"].into_iter().enumerate() {
        let path = |name: &str| folder.join(format!("{name}.{ending}"));
        let from = 0.3 + 0.35 * n as f64;
        let part = |a: f64, b: f64| progress.part(from + a, from + b);
        let (backward, forward) = (path("deformed_to_ct"), path("ct_to_deformed"));
        write_field(&fields.deformed_to_ct, &backward, FieldKind::Resampling, part(0.0, 0.15))?;
        write_field(&fields.ct_to_deformed, &forward, FieldKind::Modeling, part(0.15, 0.3))?;
        write_scalar(&fields.jacobian, &path("jacobian"), part(0.3, 0.35))?;
    }
    Ok(consistency(&fields))
}
