//! `supine warp`.

use crate::args;
use crate::failure::Failure;
use crate::screen::Screen;
use supine_dicom::ExportParams;
use supine_exchange::{read_mesh, write_ct_nifti, write_ct_nrrd};
use supine_pipeline::{CtInput, RunError};
use supine_space::{Progress, Side};
use supine_volume::Ct;
use supine_warp::Params;

const NOTE: &str = concat!(
    "DERIVED: resampled by supine ",
    env!("CARGO_PKG_VERSION"),
    " through a deformed mesh; not acquired anatomy. Linear, HU carried unchanged."
);

pub(crate) fn warp(args: &args::Warp, screen: &Screen) -> Result<u8, Failure> {
    let args::Interpolation::Linear = args.interpolation;
    let (mesh, displacement) = read_mesh(&args.mesh)?;
    let displacement = displacement.ok_or_else(|| {
        Failure::input(format!(
            "{} holds no point data `displacement` (mm): make it with `supine solve`",
            args.mesh.display()
        ))
    })?;
    let watch = |share| screen.share("import", share);
    let input = supine_pipeline::read_ct(&args.ct, args.series.as_deref(), Progress::new(&watch))?;
    let watch = |share| screen.share("warp", share);
    let params = Params::default();
    let (warped, info) =
        supine_warp::warp(&input.ct, &mesh, &displacement, &params, Progress::new(&watch))
            .map_err(RunError::from)?;
    write(args, &input, &warped, info.max_displacement_mm, screen)?;
    screen.warn_all(&info.warnings);
    let json = serde_json::json!({
        "out": args.out, "moved_voxels": info.moved_voxels,
        "vacated_voxels": info.vacated_voxels, "folded_voxels": info.folded_voxels,
        "fade_mm": info.fade_mm, "jacobian_min": info.jacobian_min,
        "jacobian_max": info.jacobian_max, "warnings": info.warnings,
    });
    let text = format!(
        "{}: {} voxels moved, Jacobian {:.2} to {:.2}",
        args.out.display(),
        info.moved_voxels,
        info.jacobian_min,
        info.jacobian_max
    );
    screen.result(&json, &text);
    Ok(0)
}

fn write(
    args: &args::Warp,
    input: &CtInput,
    warped: &Ct,
    reach_mm: f64,
    screen: &Screen,
) -> Result<(), Failure> {
    let watch = |share| screen.share("export", share);
    let progress = Progress::new(&watch);
    let name = args.out.to_string_lossy().to_lowercase();
    if name.ends_with(".nrrd") {
        return Ok(write_ct_nrrd(warped, &args.out, NOTE, progress)?);
    }
    if name.ends_with(".nii") || name.ends_with(".nii.gz") {
        return Ok(write_ct_nifti(warped, &args.out, NOTE, progress)?);
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
    let params = ExportParams {
        series_description: "DEFORMED by a given mesh".into(),
        derivation: NOTE.into(),
        image_comments: "SIMULATED DEFORMATION - not acquired anatomy".into(),
        laterality: match breast {
            args::Breast::Left => Side::Left,
            args::Breast::Right => Side::Right,
        },
        clock: source.clock(),
        software_version: env!("CARGO_PKG_VERSION").into(),
        identity: *blake3::hash(NOTE.as_bytes()).as_bytes(),
        reach_mm,
    };
    supine_dicom::write_series(warped, source, &params, &args.out, progress)?;
    Ok(())
}
