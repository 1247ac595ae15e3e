//! `supine carry`: whatever is known in the CT, in the operating position.

mod contours;
mod dose;
mod labels;
mod points;
mod segments;
mod surface;

use crate::args;
use crate::failure::Failure;
use crate::screen::Screen;
use std::path::{Path, PathBuf};
use supine_dicom::{ReadParams, RegionObject, is_dose, region_object};
use supine_exchange::{AnyVolume, VolumeKind, is_contours, read_any_volume, read_mesh};
use supine_mesh::{Displacement, TetMesh};
use supine_pipeline::{Company, CtInput, RunError, read_ct};
use supine_space::Progress;

pub(crate) fn carry(args: &args::Carry, screen: &Screen) -> Result<u8, Failure> {
    let (Some(from), Some(what)) =
        (args.run.as_ref().or(args.from.as_ref()), args.points.as_ref().or(args.what.as_ref()))
    else {
        return Err(Failure::usage("a run or mesh, and what is to be carried, are needed"));
    };
    let job = Job::new(args, from, what, screen)?;
    let name = what.file_name().map(|n| n.to_string_lossy().to_lowercase()).unwrap_or_default();
    let ends = |endings: &[&str]| endings.iter().any(|e| name.ends_with(e));
    if args.points.is_some() || ends(&[".json"]) {
        return points::carry(&job);
    }
    if ends(&[".csv"]) {
        return if is_contours(what)? { contours::carry_csv(&job) } else { points::carry(&job) };
    }
    if ends(&[".stl", ".ply", ".obj"]) {
        return surface::carry(&job);
    }
    if ends(&[".nrrd", ".nii", ".nii.gz"]) {
        let watch = |share| screen.share("import", share);
        let kind = args.kind.map(VolumeKind::from);
        return match read_any_volume(what, kind, Progress::new(&watch))? {
            AnyVolume::Labels(given) => labels::carry(&job, &given),
            AnyVolume::Scalar(given) => dose::carry(&job, &given),
        };
    }
    if is_dose(what)? {
        return dose::carry_dicom(&job);
    }
    match region_object(what)? {
        Some(RegionObject::Structures) => contours::carry_structures(&job),
        Some(RegionObject::Segmentation) => segments::carry(&job),
        None => Err(Failure::input(format!(
            "{} is not known: expected points (.csv, .mrk.json), labels or a dose (.nrrd, .nii, \
             .nii.gz), a surface (.stl, .ply, .obj), contours (.csv) or a DICOM structure set, \
             RT dose or segmentation",
            what.display()
        ))),
    }
}

/// What every kind needs.
struct Job<'a> {
    args: &'a args::Carry,
    /// The run or mesh.
    from: &'a Path,
    /// What is carried.
    what: &'a Path,
    mesh: TetMesh,
    displacement: Displacement,
    screen: &'a Screen,
}

impl<'a> Job<'a> {
    fn new(
        args: &'a args::Carry,
        from: &'a Path,
        what: &'a Path,
        screen: &'a Screen,
    ) -> Result<Self, Failure> {
        let (mesh, displacement) = deformed(from, args.run.is_some())?;
        Ok(Self { args, from, what, mesh, displacement, screen })
    }

    fn map(&self) -> (&TetMesh, &Displacement) {
        (&self.mesh, &self.displacement)
    }

    /// The CT that `--ct` names.
    fn ct(&self) -> Result<Option<CtInput>, Failure> {
        let Some(path) = &self.args.ct else { return Ok(None) };
        Ok(Some(self.read_ct(path)?))
    }

    /// A CT on whose grid results are wanted: that of `--ct`, or the deformed one of the run.
    fn ct_for_grid(&self) -> Result<CtInput, Failure> {
        if let Some(ct) = self.ct()? {
            return Ok(ct);
        }
        let exported = [self.from.join("ct.nrrd"), self.from.join("ct")];
        let run = exported.iter().find(|path| path.exists());
        let path: &PathBuf = run.ok_or_else(|| {
            Failure::usage("--ct is needed: the result goes on the slices of the CT")
        })?;
        self.read_ct(path)
    }

    /// Whether the result is to be a DICOM object.
    fn to_dicom(&self) -> bool {
        self.args.out.extension().is_some_and(|e| e.eq_ignore_ascii_case("dcm"))
    }

    /// What DICOM objects of the patient are held against; `before` is what `--ct` names. What a DICOM object to be
    /// written would lack is told before the work.
    fn company(&self, before: Option<&CtInput>) -> Result<Company, Failure> {
        let source = before.and_then(|ct| ct.dicom.as_ref()).map(|(source, _)| source);
        let watch = |share| self.screen.share("import", share);
        let company = Company::of(self.from, source, Progress::new(&watch))?;
        if self.to_dicom() && company.exported().is_none() {
            return Err(Failure::usage(
                "a DICOM object (.dcm) goes with the exported CT of a run: name the folder of a \
                 run whose CT came as DICOM, or another ending",
            ));
        }
        Ok(company)
    }

    fn read_ct(&self, path: &Path) -> Result<CtInput, Failure> {
        let watch = |share| self.screen.share("import", share);
        let reading =
            ReadParams { series: self.args.series.clone(), accept: self.args.accept.into() };
        Ok(read_ct(path, &reading, Progress::new(&watch))?)
    }
}

/// The mesh of a run, or a mesh, with its displacement.
fn deformed(from: &Path, run: bool) -> Result<(TetMesh, Displacement), Failure> {
    let folder = run || from.is_dir();
    let path = if folder { from.join("mesh").join("deformed.vtu") } else { from.into() };
    let shown = from.display();
    if folder && !path.is_file() {
        return Err(Failure::input(format!("{shown} is not the folder of a finished run")));
    }
    let (mesh, displacement) = read_mesh(&path)?;
    let displacement = displacement.ok_or_else(|| {
        Failure::input(format!(
            "{} holds no point data `displacement` (mm): make it with `supine solve`",
            path.display()
        ))
    })?;
    Ok((mesh, displacement))
}

/// Errors of the warp, as those of a run.
fn warped(error: supine_warp::Error) -> Failure {
    RunError::from(error).into()
}

/// A stop, as that of a run.
fn stopped(stopped: supine_space::Stopped) -> Failure {
    warped(stopped.into())
}
