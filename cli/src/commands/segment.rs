//! `supine segment`.

use crate::args;
use crate::failure::Failure;
use crate::screen::Screen;
use std::path::Path;
use supine_exchange::{write_labels, write_tenths};
use supine_pipeline::{
    Case, CtInput, LabelOrigin, RunError, Seeds, write_dicom_labels, write_surfaces,
};
use supine_segment::{Params, Segmenter, TissueShare};
use supine_space::Progress;
use supine_volume::{LabelMap, label};

/// Shares of the work done when the seeds come in, when the labels are made, and when the finer labels
/// begin.
const SEARCH: f64 = 0.7;
const MADE: f64 = 0.75;
const FOUND: f64 = 0.8;

pub(crate) fn segment(args: &args::Segment, screen: &Screen) -> Result<u8, Failure> {
    let case = args.case.as_ref().map(|path| Case::read(path).map_err(RunError::from));
    let case = case.transpose()?;
    let reading = case.as_ref().map(Case::read_params).unwrap_or_default();
    let tumour = case.as_ref().map(|c| c.tumour);
    let given = match (&args.seeds, case) {
        (Some(path), _) => Seeds::File(path.clone()),
        (None, Some(case)) => case.seeds,
        (None, None) => Seeds::Automatic,
    };
    let origin = match given {
        Seeds::Automatic => LabelOrigin::Automatic,
        _ => LabelOrigin::Seeded,
    };
    let watch = |share| screen.share("import", share);
    let progress = Progress::new(&watch);
    let params = Params { seeds: given.read(progress.part(0.0, 0.2))?, ..Params::default() };
    let part = progress.part(0.2, 1.0);
    let input = supine_pipeline::read_ct(&args.ct, &reading, part)?;
    let watch = |share| screen.share("segment", share);
    let progress = Progress::new(&watch);
    let segmenter = Segmenter::new(&input.ct, &params, progress.part(0.0, SEARCH));
    let segmenter = segmenter.map_err(RunError::from)?;
    let made = segmenter.segment(&params.seeds, progress.part(SEARCH, MADE));
    let (made, mut info) = made.map_err(RunError::from)?;
    let doubt = args.doubt.as_ref().map(|path| (segmenter.doubt(&made), path));
    let surfaces = args.surfaces.as_ref().map(|folder| {
        let made = segmenter.surfaces(&made, progress.part(MADE, FOUND));
        made.map(|surfaces| (surfaces, folder)).map_err(RunError::from)
    });
    let surfaces = surfaces.transpose()?;
    let implants = segmenter.implants();
    drop(segmenter);
    let mut labels = made.labels;
    let mut shares = Vec::new();
    if args.tissues {
        let (implants, progress) = (implants.as_ref(), progress.part(FOUND, 1.0));
        let fine = supine_segment::tissues(&input.ct, &labels, implants, tumour, progress);
        let (finer, facts) = fine.map_err(RunError::from)?;
        labels = finer;
        info.warnings.extend(facts.warnings);
        shares = facts.shares;
    }
    let watch = |share| screen.share("export", share);
    let progress = Progress::new(&watch);
    write(&labels, &input, origin, &args.out, progress)?;
    if let Some((doubt, path)) = doubt {
        write_tenths(&doubt, path, progress)?;
    }
    if let Some((surfaces, folder)) = surfaces {
        write_surfaces(&surfaces, folder, progress)?;
    }
    screen.warn_all(&info.warnings);
    let ml = |kind: fn(u8) -> bool| {
        let voxels = labels.data().iter().filter(|l| kind(**l)).count();
        voxels as f64 * labels.grid().voxel_volume() / 1000.0
    };
    let (soft, wall) = (ml(label::is_soft_tissue), ml(label::is_chest_wall));
    let json = serde_json::json!({
        "labels": args.out, "soft_tissue_ml": soft, "chest_wall_ml": wall,
        "fat_hu": info.fat_hu, "muscle_hu": info.muscle_hu, "warnings": info.warnings,
        "tissues": tissues_json(&shares),
    });
    let text = format!(
        "{}: soft tissue {soft:.0} ml, chest wall {wall:.0} ml in the whole CT",
        args.out.display()
    );
    screen.result(&json, &text);
    Ok(0)
}

/// Writes labels in the format of the file's name.
fn write(
    labels: &LabelMap,
    input: &CtInput,
    origin: LabelOrigin,
    path: &Path,
    progress: Progress<'_>,
) -> Result<(), Failure> {
    if !path.to_string_lossy().to_lowercase().ends_with(".dcm") {
        return Ok(write_labels(labels, path, progress)?);
    }
    if let Some((source, _)) = &input.dicom {
        return Ok(write_dicom_labels(labels, source, origin, path)?);
    }
    let message = "--out: the CT did not come as DICOM, so no DICOM segmentation can be written; \
                   name a .seg.nrrd, .nrrd or .nii.gz file";
    Err(Failure::usage(message))
}

/// Volume and mean of each finer label, by name.
fn tissues_json(shares: &[TissueShare]) -> serde_json::Value {
    let name = |l: u8| label::ALL.iter().find(|(n, ..)| *n == l).map_or("", |(_, name, _)| *name);
    let one = |s: &TissueShare| {
        let facts = serde_json::json!({ "ml": s.ml, "mean_hu": s.mean_hu });
        (name(s.label).to_owned(), facts)
    };
    shares.iter().map(one).collect::<serde_json::Map<_, _>>().into()
}
