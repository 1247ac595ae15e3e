//! `supine carry`: whatever is known in the CT, in the operating position.

mod contours;
mod done;
mod dose;
mod volumes;

pub use done::{
    CarryDone, ContoursFacts, DicomDose, DoseFacts, LabelVolume, SegmentVolume, SurfaceFacts,
};

use super::usable::why_not;
use super::{Gather, Outputs, SurfaceFrame, VOLUMES, check_ending, ends, given_deformation, usage};
use crate::folder::{FinishedRun, run_around};
use crate::shared::carry::{CarryContext, CarryJob, ExportedFiles};
use crate::shared::{CtInput, bounds, read_ct};
use crate::spec::Spec;
use crate::{Error, NodeId, Observer};
use std::path::{Path, PathBuf};
use supine_dicom::{ReadParams, RegionObject, is_dose, region_object};
use supine_exchange::{
    AnyVolume, NamedPoint, VolumeKind, is_contours, is_volume_name, read_any_volume, read_points,
    write_points, write_surface,
};
use supine_mesh::{Deformation, TriSurface};
use supine_space::{Grid, Point, Warning};
use supine_warp::{Params, carry_points, carry_surface};

/// Keys of the table that it takes: for the CT before deformation.
pub const KEYS: &[&str] = &["ct", "series", "exclude", "assume_hu", "equalise_steps"];

/// What is asked.
#[derive(Clone, Debug)]
pub struct Carry {
    /// Values for [`KEYS`].
    pub spec: Spec,
    /// The folder of a finished run, or a deformed mesh.
    pub from: PathBuf,
    /// What is carried.
    pub what: PathBuf,
    /// Whether that is taken for points, whatever it is called.
    pub points: bool,
    /// Whether labels come out on the voxels of the CT, not on their own.
    pub ct_grid: bool,
    /// What a volume is taken for; else a dose if a value is not a whole number.
    pub kind: Option<CarryVolume>,
    /// Frame of surfaces whose files do not say it.
    pub frame: SurfaceFrame,
    /// The file of the result; `.dcm`: the same kind of DICOM object, of the run's series.
    pub out: PathBuf,
    /// Whether files that are there already may be replaced.
    pub overwrite: bool,
}

/// What a volume is taken for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CarryVolume {
    /// Numbers of labels, never mixed.
    Labels,
    /// A dose or another quantity that can be interpolated.
    Dose,
}

/// Carries whatever a file holds.
///
/// # Errors
/// When the file cannot be carried, belongs to another scan, or the result cannot be written.
pub fn carry(given: &Carry, observer: &dyn Observer) -> Result<CarryDone, Error> {
    let what = given.what.as_path();
    Outputs::beside(given.spec.files().chain([what, given.from.as_path()]))
        .file("--out", Some(&given.out))
        .check(given.overwrite)?;
    let gather = Gather::new(observer, &[]);
    let job = Job::new(given, &gather)?;
    check_out(given)?;
    if given.points || ends(what, &[".json"]) {
        return job.points();
    }
    if ends(what, &[".csv"]) {
        let drawn = is_contours(what).map_err(Error::product)?;
        return if drawn { job.contours() } else { job.points() };
    }
    if ends(what, &[".stl", ".ply", ".obj"]) {
        return job.surface();
    }
    if is_volume_name(what) {
        let kind = given.kind.map(|kind| match kind {
            CarryVolume::Labels => VolumeKind::Labels,
            CarryVolume::Dose => VolumeKind::Scalar,
        });
        let read = gather.work(NodeId::Import, |progress| {
            read_any_volume(what, kind, progress).map_err(Error::product)
        })?;
        return match read {
            AnyVolume::Labels(labels) => job.labels(&labels),
            AnyVolume::Scalar(dose) => job.plain_dose(&dose),
        };
    }
    if is_dose(what).map_err(Error::Carried)? {
        return job.dose();
    }
    match region_object(what).map_err(Error::Carried)? {
        Some(RegionObject::Structures) => job.structures(),
        Some(RegionObject::Segmentation) => job.segments(),
        None => Err(super::input(format!(
            "{} is not known: expected points (.csv, .mrk.json), labels or a dose (.nrrd, .nii, .nii.gz, .mha), a surface \
             (.stl, .ply, .obj), contours (.csv) or a DICOM structure set, RT dose or segmentation",
            what.display()
        ))),
    }
}

/// Refuses the name of a result that says no format for what is carried; DICOM objects come out as
/// such or as files.
fn check_out(given: &Carry) -> Result<(), Error> {
    let (what, out) = (given.what.as_path(), given.out.as_path());
    let check = |what, endings: &[&str]| check_ending("--out", out, what, endings);
    if given.points || ends(what, &[".json", ".csv"]) {
        return check("points and contours are", &[".csv", ".json"]);
    }
    if ends(what, &[".stl", ".ply", ".obj"]) {
        return check("surfaces are", &[".stl", ".ply", ".obj"]);
    }
    if is_volume_name(what) {
        return check("labels and doses are", &VOLUMES);
    }
    check("objects are", &[&[".dcm", ".csv"], &VOLUMES[..]].concat())
}

/// A closed surface smaller than this is none of a patient in mm, mm from corner to corner.
const LEAST_SURFACE_MM: f64 = 2.0;

/// That a surface is as small as one in metres read as mm.
fn in_metres(surface: &TriSurface, path: &Path) -> Option<Warning> {
    let [low, high] = bounds(surface.points().iter())?;
    let size = (high - low).norm();
    let told = || {
        let text = format!(" is only {size:.2} mm large: is it in metres? give it in mm");
        Warning::new("surface-tiny", "").name(path.display().to_string()).text(text)
    };
    (size < LEAST_SURFACE_MM).then(told)
}

fn of_unusable(run: &Path, why: &str) -> Warning {
    let (run, why) = (run.display(), why.trim_end_matches('.'));
    let text = format!(
        "{run} must not be used: {why}. What is carried from it must not be used either; a DICOM object says so"
    );
    Warning::new("run-not-usable", text)
}

/// What every kind needs.
struct Job<'a> {
    given: &'a Carry,
    gather: &'a Gather<'a>,
    /// None where a mesh was given.
    run: Option<FinishedRun>,
    /// The run must not be used.
    not_usable: bool,
    deformation: Deformation,
    reading: ReadParams,
    /// The CT before deformation, where one was given.
    ct_path: Option<PathBuf>,
}

impl<'a> Job<'a> {
    fn new(given: &'a Carry, gather: &'a Gather<'a>) -> Result<Self, Error> {
        let case = given.spec.case()?;
        let run = given.from.is_dir().then(|| FinishedRun::open(&given.from)).transpose()?;
        if let Some(why) = run.as_ref().and_then(FinishedRun::changed_mesh) {
            let run = given.from.display();
            return Err(super::input(format!("{run}: {why}; run its case again")));
        }
        let mesh = run.as_ref().map_or_else(|| given.from.clone(), FinishedRun::deformed);
        let deformation = given_deformation(&mesh)?;
        let (reading, ct_path) = (case.read_params(), case.ct);
        // Objects that lie beside the run's own, as those carried before may, change nothing of
        // what is carried.
        let why = run.as_ref().and_then(|_| why_not(&run_around(&given.from)?));
        let not_usable = why.is_some();
        gather.warn_all(NodeId::Import, why.map(|why| of_unusable(&given.from, &why)));
        Ok(Self { given, gather, run, not_usable, deformation, reading, ct_path })
    }

    fn out(&self) -> &'a Path {
        &self.given.out
    }

    /// Says that a volume does not reach what was simulated: it is of another patient, in another
    /// unit, or mirrored.
    fn warn_beside(&self, grid: &Grid) {
        let last = grid.size().map(|n| n - 1);
        let end = |n: usize, a: usize| if n >> a & 1 == 1 { last[a] } else { 0 };
        let corners: [Point; 8] =
            std::array::from_fn(|n| grid.centre([0, 1, 2].map(|a| end(n, a))));
        let of_mesh = self.deformation.mesh().points().iter();
        let (Some(volume), Some(mesh)) = (bounds(corners.iter()), bounds(of_mesh)) else { return };
        let apart = |a: usize| volume[1][a] < mesh[0][a] || volume[0][a] > mesh[1][a];
        if (0..3).any(apart) {
            let text = " does not reach what was simulated: nothing of it moves; is it of this patient, in mm, and are its axes right?";
            let name = self.given.what.display().to_string();
            self.gather
                .warn_all(NodeId::Carry, [Warning::new("volume-beside", "").name(name).text(text)]);
        }
    }

    /// Whether the result is to be a DICOM object.
    fn to_dicom(&self) -> bool {
        ends(self.out(), &[".dcm"])
    }

    /// The CT before deformation, where one was given.
    fn ct(&self) -> Result<Option<CtInput>, Error> {
        self.ct_path.as_deref().map(|path| self.read_ct(path, &self.reading)).transpose()
    }

    fn read_ct(&self, path: &Path, reading: &ReadParams) -> Result<CtInput, Error> {
        self.gather.work(NodeId::Import, |progress| read_ct(path, reading, progress))
    }

    /// The grid on which results are wanted: that of the given CT, or of the deformed one of the
    /// run.
    fn grid(&self, ct: Option<&CtInput>) -> Result<Grid, Error> {
        if let Some(ct) = ct {
            return Ok(ct.ct.grid().clone());
        }
        let run = self.run.as_ref().and_then(FinishedRun::ct);
        let path =
            run.ok_or_else(|| usage("--ct is needed: the result goes on the slices of the CT"))?;
        Ok(self.read_ct(&path, &ReadParams::default())?.ct.grid().clone())
    }

    /// What DICOM objects of the patient are held against. What a DICOM object to be written would
    /// lack is told before the work.
    fn context(&self, before: Option<&CtInput>) -> Result<CarryContext, Error> {
        let files = match &self.run {
            None => ExportedFiles::default(),
            Some(run) => ExportedFiles {
                series: run.series(),
                registration: Some(run.registration()),
                secret: run.secret()?,
                not_usable: self.not_usable,
            },
        };
        let before = before.and_then(|ct| ct.dicom.as_ref()).map(|(source, _)| source);
        let context = self
            .gather
            .work(NodeId::Import, |progress| CarryContext::of(&files, before, progress))?;
        if self.to_dicom() && context.exported().is_none() {
            return Err(usage(
                "a DICOM object (.dcm) goes with the exported CT of a run: name the folder of a run whose CT came as \
                 DICOM, or another ending",
            ));
        }
        Ok(context)
    }

    /// What a DICOM object is carried with.
    fn with<'b>(&'b self, context: &'b CarryContext) -> CarryJob<'b> {
        CarryJob { context, before: 1, deformation: &self.deformation }
    }

    fn points(&self) -> Result<CarryDone, Error> {
        let points = read_points(&self.given.what).map_err(Error::product)?;
        crate::nodes::refuse_nowhere(&points, self.deformation.mesh())?;
        let positions: Vec<_> = points.iter().map(|p| p.position).collect();
        let after = carry_points(&self.deformation, &Params::default(), &positions)?;
        let pairs = || points.iter().zip(&after);
        let carried = pairs()
            .map(|(p, a)| NamedPoint { name: p.name.clone(), position: a.unwrap_or(p.position) });
        let carried: Vec<NamedPoint> = carried.collect();
        write_points(&carried, self.out()).map_err(Error::product)?;
        let beside = crate::nodes::not_carried(&points, &after, self.deformation.mesh());
        self.gather.warn_all(NodeId::Points, beside);
        let outside = pairs().filter(|(_, a)| a.is_none()).map(|(p, _)| p.name.clone());
        let outside: Vec<String> = outside.collect();
        let carried = points.len() - outside.len();
        Ok(CarryDone::Points { points: self.out().into(), carried, outside })
    }

    fn surface(&self) -> Result<CarryDone, Error> {
        let given = super::mesh::surface(&self.given.what, self.given.frame, self.gather)?;
        self.gather.warn_all(NodeId::Import, in_metres(&given, &self.given.what));
        let (surface, carried) = self.gather.work(NodeId::Carry, |progress| {
            Ok(carry_surface(&given, &self.deformation, &Params::default(), progress)?)
        })?;
        write_surface(&surface, self.out()).map_err(Error::product)?;
        let [before_ml, after_ml] = carried.volume_ml;
        Ok(CarryDone::Surface(SurfaceFacts {
            out: self.out().into(),
            before_ml,
            after_ml,
            points: given.points().len(),
            moved_points: carried.moved_points,
            added_points: carried.added_points,
            max_displacement_mm: carried.max_displacement_mm,
            warnings: self.gather.warnings(),
        }))
    }
}
