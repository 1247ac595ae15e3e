//! A case: the values of a specification as the types of the field, with what they say together.

use super::error::{CaseError, value};
use super::read::Values;
use super::table::{CLIPPED, Preset, SAME_FRAME, TABLE, position};
use super::value::Value;
use super::{canonical, mesh, tissue};
use crate::shared::{CarriedFile, CarriedKind, RegionNames, SuppliedLabels};
use serde_json::{Map, Value as Json};
use std::path::PathBuf;
use supine_dicom::{Accept, Clock, Policy, ReadParams};
use supine_fem::{Cut, Load, RestState, Tissue};
use supine_space::{BedPose, Point, Side, Sphere};
use supine_volume::{SeedKind, Stroke};
use supine_warp::Interpolation;

pub use mesh::{MeshSpec, Refinement};
pub use tissue::{FitScans, ScansSpec, Stiffness, StiffnessMap};

/// Everything that decides a result, checked. What a command does not need may be absent; who needs
/// it asks by the methods that name what is missing.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// DICOM folder or file of it, NRRD or NIfTI file.
    pub ct: Option<PathBuf>,
    /// Series Instance UID, when the folder holds several.
    pub series: Option<String>,
    /// Files of the CT to leave out, by their paths below its folder.
    pub exclude: Vec<String>,
    /// What is accepted of a DICOM CT beyond what is safe.
    pub accept: Accept,
    /// The breast that is operated.
    pub breast: Option<Side>,
    /// The table's tilt.
    pub bed: Option<BedPose>,
    /// The tumour in the CT.
    pub tumour: Option<TumourSpec>,
    /// The region; proposed from the breast when absent.
    pub region: Option<Sphere>,
    /// What is asked of the mesh.
    pub mesh: MeshSpec,
    /// The tissue's law.
    pub tissue: Tissue,
    /// Moduli that differ from tissue to tissue; one for all when absent.
    pub stiffness: Option<Stiffness>,
    /// Moduli between which the tissue's may lie, kPa.
    pub young_interval_kpa: Option<[f64; 2]>,
    /// How far off the tumour's place may be for a green verdict, mm.
    pub tolerance_mm: f64,
    /// Warnings that the planner has looked at, by [`crate::warning_id`].
    pub seen: Vec<String>,
    /// What the CT shape is taken for.
    pub rest: RestState,
    /// What holds the cut.
    pub cut: Cut,
    /// Stiffness of the springs when `cut` is [`Cut::Spring`], kPa/mm; the tissue's own when
    /// absent.
    pub spring_kpa_mm: Option<f64>,
    /// Surface scans: to fit the modulus, and to hold the result against.
    pub scans: Option<ScansSpec>,
    /// Seeds for the segmentation.
    pub seeds: SeedsSpec,
    /// A segmentation in place of one that is made.
    pub labels: Option<SuppliedLabels>,
    /// How values between voxels of the CT are found.
    pub interpolation: Interpolation,
    /// Point lists to carry.
    pub points: Vec<PathBuf>,
    /// Doses, structure sets and segmentations to carry, in this order.
    pub carried: Vec<CarriedFile>,
    /// Whether fat, gland and other tissues are labelled too.
    pub tissues: bool,
    /// What is asked of what leaves in DICOM.
    pub export: ExportSpec,
    /// Every value, defaults included.
    canonical: Map<String, Json>,
}

/// Where the tumour is.
#[derive(Clone, Debug, PartialEq)]
pub enum TumourSpec {
    /// A sphere in the CT, LPS, mm.
    Sphere(Sphere),
    /// A region of a structure set: the sphere of its volume about its centroid.
    Structure {
        /// Its name.
        name: String,
        /// The structure set.
        file: PathBuf,
    },
}

impl TumourSpec {
    /// The sphere, where it is known without a file.
    pub fn sphere(&self) -> Option<Sphere> {
        match self {
            Self::Sphere(sphere) => Some(*sphere),
            Self::Structure { .. } => None,
        }
    }
}

/// Seeds for the segmentation: all of these together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SeedsSpec {
    /// Files of points, painted maps, folders of masks.
    pub files: Vec<PathBuf>,
    /// Points with what they say of their place; LPS, mm.
    pub points: Vec<(SeedKind, Point)>,
    /// Strokes of a brush.
    pub strokes: Vec<Stroke>,
}

impl SeedsSpec {
    /// Whether there are none: the segmentation finds its own.
    pub fn is_empty(&self) -> bool {
        self.files.is_empty() && self.points.is_empty() && self.strokes.is_empty()
    }
}

/// What is asked of the DICOM objects of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExportSpec {
    /// Whether they lack the patient (PS3.15 E.1).
    pub anonymise: bool,
    /// Whether registrations go with the series.
    pub registration: bool,
    /// Whether a structure set of what was simulated goes with the series.
    pub structures: bool,
    /// Whether the report goes with the series as a PDF.
    pub pdf: bool,
    /// Departures from what is safest.
    pub policy: Policy,
    /// Date and time that the objects bear; none for those of the run.
    pub clock: Option<Clock>,
}

impl Case {
    /// The scans to which the modulus is fitted.
    pub fn fit_scans(&self) -> Option<&FitScans> {
        self.scans.as_ref()?.fit.as_ref()
    }

    /// The case of a specification's values.
    ///
    /// # Errors
    /// [`CaseError::Value`] when values contradict each other, [`CaseError::Missing`] when half of
    /// a pair is missing.
    pub(super) fn of(values: &Values) -> Result<Self, CaseError> {
        let given = Given(values);
        let stiffness = tissue::stiffness(given)?;
        let mut case = Self {
            ct: given.file("ct"),
            series: given.text("series"),
            exclude: given.names("exclude"),
            accept: Accept {
                assume_hu: given.switch("assume_hu"),
                equalise_steps: given.switch("equalise_steps"),
            },
            breast: given.choice("breast").map(|word| match word {
                "left" => Side::Left,
                _ => Side::Right,
            }),
            bed: bed(given)?,
            tumour: tumour(given)?,
            seen: given.names("report.seen"),
            tolerance_mm: given.number("tolerance").unwrap_or(supine_report::TOLERANCE_MM),
            region: sphere(given, ["region.centre", "region.radius"])?,
            mesh: mesh::spec(given)?,
            tissue: tissue::law(given),
            stiffness,
            young_interval_kpa: tissue::young_interval(given)?,
            rest: match given.word("tissue.rest") {
                "unloaded" => RestState::Unloaded,
                _ => RestState::Net,
            },
            cut: tissue::cut(given),
            spring_kpa_mm: tissue::spring(given)?,
            scans: tissue::scans(given)?,
            seeds: seeds(given),
            labels: labels(given)?,
            interpolation: interpolation(given),
            points: given.files("carry.points"),
            carried: carried(given),
            tissues: given.switch("tissues") || stiffness.is_some(),
            export: export(given)?,
            canonical: Map::new(),
        };
        case.canonical = canonical::object(&case, values);
        Ok(case)
    }

    /// Every value that made a result, defaults included, as keys within tables: what a summary
    /// holds and a case file may hold. Two cases with the same values are the same.
    pub fn canonical(&self) -> &Map<String, Json> {
        &self.canonical
    }

    /// The typed values alone.
    #[cfg(test)]
    pub(super) fn without_canonical(mut self) -> Self {
        self.canonical.clear();
        self
    }

    /// The same without what may say who the patient is: for a summary without the patient.
    pub(crate) fn nameless(&self) -> Map<String, Json> {
        canonical::nameless(&self.canonical)
    }

    /// The CT.
    ///
    /// # Errors
    /// [`CaseError::Missing`].
    pub fn ct(&self) -> Result<&PathBuf, CaseError> {
        self.ct.as_ref().ok_or_else(|| missing("ct"))
    }

    /// The side.
    ///
    /// # Errors
    /// [`CaseError::Missing`].
    pub fn breast(&self) -> Result<Side, CaseError> {
        self.breast.ok_or_else(|| missing("breast"))
    }

    /// The tilt.
    ///
    /// # Errors
    /// [`CaseError::Missing`].
    pub fn bed(&self) -> Result<BedPose, CaseError> {
        self.bed.ok_or_else(|| missing("bed.ap"))
    }

    /// The tumour.
    ///
    /// # Errors
    /// [`CaseError::Missing`].
    pub fn tumour(&self) -> Result<&TumourSpec, CaseError> {
        self.tumour.as_ref().ok_or_else(|| missing("tumour.centre"))
    }

    /// The change of gravity.
    ///
    /// # Errors
    /// [`CaseError::Missing`].
    pub(crate) fn load(&self) -> Result<Load, CaseError> {
        Ok(Load { ct: supine_space::supine(), target: self.bed()?.gravity() })
    }

    /// How the CT is read when it is DICOM.
    #[must_use]
    pub fn read_params(&self) -> ReadParams {
        ReadParams {
            series: self.series.clone(),
            exclude: self.exclude.clone(),
            accept: self.accept,
        }
    }
}

pub(super) fn missing(key: &'static str) -> CaseError {
    let what = position(key).map_or("", |n| TABLE[n].help);
    CaseError::Missing { key, what }
}

/// Values by key.
#[derive(Clone, Copy)]
pub(super) struct Given<'a>(pub(super) &'a Values);

impl<'a> Given<'a> {
    pub(super) fn get(self, key: &str) -> Option<&'a Value> {
        self.0.get(&position(key)?)
    }

    pub(super) fn number(self, key: &str) -> Option<f64> {
        match self.get(key) {
            Some(Value::Number(x)) => Some(*x),
            Some(_) => None,
            None => match TABLE[position(key)?].default {
                Preset::Number(x) => Some(x),
                _ => None,
            },
        }
    }

    pub(super) fn whole(self, key: &str) -> usize {
        match (self.get(key), position(key).map(|n| TABLE[n].default)) {
            (Some(Value::Whole(n)), _) => *n as usize,
            (None, Some(Preset::Whole(n))) => n as usize,
            _ => 0,
        }
    }

    pub(super) fn switch(self, key: &str) -> bool {
        match (self.get(key), position(key).map(|n| TABLE[n].default)) {
            (Some(Value::Switch(on)), _) => *on,
            (None, Some(Preset::Switch(on))) => on,
            _ => false,
        }
    }

    pub(super) fn choice(self, key: &str) -> Option<&'static str> {
        match (self.get(key), position(key).map(|n| TABLE[n].default)) {
            (Some(Value::Choice(word)), _) => Some(word),
            (None, Some(Preset::Choice(word))) => Some(word),
            _ => None,
        }
    }

    /// The word of a choice that has a default.
    pub(super) fn word(self, key: &str) -> &'static str {
        self.choice(key).unwrap_or_default()
    }

    fn text(self, key: &str) -> Option<String> {
        match self.get(key) {
            Some(Value::Text(text)) => Some(text.clone()),
            _ => None,
        }
    }

    pub(super) fn file(self, key: &str) -> Option<PathBuf> {
        match self.get(key) {
            Some(Value::File(path)) => Some(path.clone()),
            _ => None,
        }
    }

    fn files(self, key: &str) -> Vec<PathBuf> {
        match self.get(key) {
            Some(Value::Files(all)) => all.clone(),
            _ => Vec::new(),
        }
    }

    fn names(self, key: &str) -> Vec<String> {
        match self.get(key) {
            Some(Value::Names(all)) => all.clone(),
            _ => Vec::new(),
        }
    }

    fn points(self, key: &str) -> Vec<Point> {
        match self.get(key) {
            Some(Value::Points(all)) => all.iter().copied().map(Point::from).collect(),
            _ => Vec::new(),
        }
    }
}

fn bed(given: Given<'_>) -> Result<Option<BedPose>, CaseError> {
    match (given.number("bed.ap"), given.number("bed.lat")) {
        (None, None) => Ok(None),
        (Some(ap_deg), Some(lat_deg)) => Ok(Some(BedPose { ap_deg, lat_deg })),
        (None, Some(_)) => Err(missing("bed.ap")),
        (Some(_), None) => Err(missing("bed.lat")),
    }
}

fn sphere(given: Given<'_>, keys: [&'static str; 2]) -> Result<Option<Sphere>, CaseError> {
    let [centre, radius] = keys;
    match (given.get(centre), given.number(radius)) {
        (None, None) => Ok(None),
        (Some(Value::Point(at)), Some(r)) => {
            Sphere::new(Point::from(*at), r).map(Some).map_err(|e| value(radius, e.to_string()))
        }
        (None, _) => Err(missing(centre)),
        (Some(_), _) => Err(missing(radius)),
    }
}

fn tumour(given: Given<'_>) -> Result<Option<TumourSpec>, CaseError> {
    let sphere = sphere(given, ["tumour.centre", "tumour.radius"]);
    match (given.text("tumour.structure"), given.file("tumour.file")) {
        (None, None) => Ok(sphere?.map(TumourSpec::Sphere)),
        (Some(_), None) => Err(missing("tumour.file")),
        (None, Some(_)) => Err(missing("tumour.structure")),
        (Some(name), Some(file)) if matches!(sphere, Ok(None)) => {
            Ok(Some(TumourSpec::Structure { name, file }))
        }
        _ => Err(value(
            "tumour.structure",
            "it gives centre and radius: leave `tumour.centre` and `tumour.radius` out, or leave the structure out",
        )),
    }
}

fn seeds(given: Given<'_>) -> SeedsSpec {
    let kinds = [
        (SeedKind::ChestWall, "seeds.chest_wall"),
        (SeedKind::SoftTissue, "seeds.soft_tissue"),
        (SeedKind::Exclude, "seeds.exclude"),
    ];
    let points = kinds
        .into_iter()
        .flat_map(|(kind, key)| given.points(key).into_iter().map(move |at| (kind, at)));
    let strokes = match given.get("seeds.strokes") {
        Some(Value::Strokes(all)) => all.clone(),
        _ => Vec::new(),
    };
    SeedsSpec { files: given.files("seeds.file"), points: points.collect(), strokes }
}

fn labels(given: Given<'_>) -> Result<Option<SuppliedLabels>, CaseError> {
    let names = RegionNames {
        body: given.names("labels.body"),
        soft_tissue: given.names("labels.soft_tissue"),
        chest_wall: given.names("labels.chest_wall"),
    };
    match given.file("labels.file") {
        Some(file) => Ok(Some(SuppliedLabels { file, names })),
        None if names == RegionNames::default() => Ok(None),
        None => Err(missing("labels.file")),
    }
}

fn interpolation(given: Given<'_>) -> Interpolation {
    let word = given.word("warp.interpolation");
    Interpolation::ALL.into_iter().find(|i| i.name() == word).unwrap_or_default()
}

fn carried(given: Given<'_>) -> Vec<CarriedFile> {
    let of = |kind: CarriedKind| {
        given.files(kind.key()).into_iter().map(move |path| CarriedFile { kind, path })
    };
    CarriedKind::ALL.into_iter().flat_map(of).collect()
}

fn clock(given: Given<'_>, anonymise: bool) -> Result<Option<Clock>, CaseError> {
    let Some(text) = given.text("export.clock") else { return Ok(None) };
    if anonymise {
        let reason = "de-identified objects bear no date of the run: leave `export.clock` or `export.anonymise` out";
        return Err(value("export.clock", reason));
    }
    let read = Clock::parse(&text);
    let bad = || value("export.clock", "is no date and time: write it as 2026-03-01 14:05:00");
    read.ok_or_else(bad).map(Some)
}

fn export(given: Given<'_>) -> Result<ExportSpec, CaseError> {
    let same_frame = given.word("export.frame") == SAME_FRAME;
    let asked = match given.get("export.registration") {
        Some(Value::Switch(on)) => Some(*on),
        _ => None,
    };
    if same_frame && asked == Some(true) {
        let reason = "a registration leads from one frame of reference to another, and \
                      `export.frame` asks for one alone";
        return Err(value("export.registration", reason));
    }
    let anonymise = given.switch("export.anonymise");
    Ok(ExportSpec {
        anonymise,
        clock: clock(given, anonymise)?,
        structures: given.switch("export.structures"),
        pdf: given.switch("export.pdf"),
        registration: !same_frame && asked.unwrap_or(true),
        policy: Policy {
            new_study: given.word("export.study") == "new",
            keep_equipment: given.word("export.equipment") == "scanner",
            same_frame,
            clip_padding: given.word("export.padding") == CLIPPED,
        },
    })
}
