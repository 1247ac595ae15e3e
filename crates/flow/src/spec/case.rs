//! A case: the values of a specification as the types of the field.

use crate::shared::{CarriedFile, Mesher, SuppliedLabels};
use serde_json::{Map, Value as Json};
use std::path::PathBuf;
use supine_dicom::{Accept, Clock, Policy, ReadParams};
use supine_fem::{Cut, Membrane, RestState, SlidingArea, Tissue};
use supine_mesh::Order;
use supine_report::{DoseTolerance, TOLERANCE_MM};
use supine_space::{Point, Posture, Side, Sphere, TablePose};
use supine_volume::{SeedKind, Stroke};
use supine_warp::Interpolation;

/// Everything that decides a result, checked. What a command does not need may be absent; who needs
/// it asks by the methods that name what is missing.
///
/// Fields are values that go together, or that become types of the field. A value that a stage
/// needs as it stands has none: it is asked for by its key.
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
    /// How the patient lay when the CT was taken.
    pub position: Posture,
    /// The breast that is operated.
    pub breast: Option<Side>,
    /// The table's tilt.
    pub table: Option<TablePose>,
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
    /// What the CT shape is taken for.
    pub rest: RestState,
    /// What holds the cut.
    pub cut: Cut,
    /// Stiffness of the springs when `cut` is [`Cut::Spring`], kPa/mm; the tissue's own when
    /// absent.
    pub spring_kpa_mm: Option<f64>,
    /// Where the tissue slides on the chest wall; held everywhere when absent.
    pub sliding: Option<SlidingArea>,
    /// The skin as a membrane; tissue like the rest when absent.
    pub skin: Option<Membrane>,
    /// What the patient on the table has otherwise than in the CT.
    pub posture: PostureSpec,
    /// How well the tumour's place is to be known.
    pub tolerance: Tolerance,
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
    pub(super) canonical: Map<String, Json>,
}

/// How well the tumour's place is to be known for a green verdict.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// How far off it may be, where that was asked, mm.
    pub place_mm: Option<f64>,
    /// What was asked as dose.
    pub dose: Option<DoseTolerance>,
}

impl Tolerance {
    /// How far off it may be, mm: the less where both were asked.
    pub fn mm(&self) -> f64 {
        let asked = self.place_mm.into_iter().chain(self.dose.map(|dose| dose.mm()));
        asked.reduce(f64::min).unwrap_or(TOLERANCE_MM)
    }
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

/// What is asked of the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshSpec {
    /// Number of tetrahedra.
    pub tetrahedra: usize,
    /// Order of the displacement within them.
    pub order: Order,
    /// Whether those on skin and chest wall are curved for the mechanics.
    pub curved: bool,
    /// What makes them.
    pub mesher: Mesher,
    /// Whether the piece of soft tissue that holds the sphere's centre is meshed, not the largest.
    pub centre_piece: bool,
    /// Where they are smaller.
    pub refine: Refinement,
}

/// Where the tetrahedra are to be smaller.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Refinement {
    /// Nowhere.
    #[default]
    Nowhere,
    /// In and around the tumour.
    Tumour {
        /// Longest edge wanted in it, mm.
        edge_mm: f64,
        /// Growth of that length with the distance from it, mm per mm.
        growth: f64,
    },
    /// Where the tumour's displacement depends on it.
    Goal,
}

impl Refinement {
    /// Name in case files and in the summary.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Nowhere => "none",
            Self::Tumour { .. } => "tumour",
            Self::Goal => "goal",
        }
    }
}

/// What a modulus that differs from place to place is read from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StiffnessMap {
    /// The finer labels.
    Labels,
    /// The CT: from fat to gland as the HU go from the level of the one to that of the other.
    Hounsfield,
}

impl StiffnessMap {
    /// Name in case files and in the summary.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Labels => "labels",
            Self::Hounsfield => "hu",
        }
    }

    /// The one of this name.
    pub(crate) fn named(name: &str) -> Self {
        if name == Self::Hounsfield.name() { Self::Hounsfield } else { Self::Labels }
    }
}

/// Moduli that differ from tissue to tissue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stiffness {
    /// What decides the tissue.
    pub map: StiffnessMap,
    /// Young's moduli of fat, gland, skin and tumour: kPa, or proportions when `mean_kpa` is given.
    pub kpa: [f64; 4],
    /// The mean over the mesh to which the proportions are scaled, kPa.
    pub mean_kpa: Option<f64>,
    /// Whether the case gives them; else they are those of the method.
    pub given: bool,
}

/// What the patient on the table has otherwise than in the CT beside the tilt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PostureSpec {
    /// The probability that her arms lie otherwise.
    pub arms_moved: f64,
    /// How far breath takes the breast, with 95 % probability, mm.
    pub breathing_mm: f64,
}

impl PostureSpec {
    /// How the arms lie, in the words of a case.
    pub(super) const ARMS: [&str; 3] = ["unknown", "as in the CT", "moved"];
    /// How far breath takes the breast when nothing is said, mm: 2.0 ± 0.7 in 100 women (4D CT,
    /// Cancers 18, 2026, 10.3390/cancers18132142).
    pub(super) const BREATHING_MM: f64 = 2.0;
}

/// Surface scans of the patient.
#[derive(Clone, Debug, PartialEq)]
pub struct ScansSpec {
    /// Those to which the modulus is fitted.
    pub fit: Option<FitScans>,
    /// The patient on the operating table.
    pub intraop: Option<PathBuf>,
    /// Landmarks of the scans and the CT.
    pub landmarks: Option<PathBuf>,
    /// Unit of length; found when absent.
    pub unit: Option<&'static str>,
}

/// Scans to which the modulus is fitted.
#[derive(Clone, Debug, PartialEq)]
pub struct FitScans {
    /// The patient sitting.
    pub sitting: PathBuf,
    /// How far she leaned back there, degrees; negative: forward.
    pub lean_deg: f64,
    /// The patient lying as in the CT.
    pub supine: Option<PathBuf>,
    /// Rest states that are fitted: the one of the case, or both.
    pub states: Vec<RestState>,
    /// Whether other laws are held against the scan: where the case has plain tissue that is held
    /// on the chest wall, and does not want none.
    pub laws: bool,
}

impl Case {
    /// The scans to which the modulus is fitted.
    pub fn fit_scans(&self) -> Option<&FitScans> {
        self.scans.as_ref()?.fit.as_ref()
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

    /// The number of a key, or its default, in the unit of its row of the table.
    pub fn number(&self, key: &str) -> Option<f64> {
        self.at(key)?.as_f64()
    }

    /// The names of a key.
    pub fn names(&self, key: &str) -> Vec<String> {
        let all = self.at(key).and_then(Json::as_array).into_iter().flatten();
        all.filter_map(|name| Some(name.as_str()?.to_owned())).collect()
    }

    /// The value of a key, or its default.
    fn at(&self, key: &str) -> Option<&Json> {
        match key.split_once('.') {
            None => self.canonical.get(key),
            Some((table, name)) => self.canonical.get(table)?.get(name),
        }
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
