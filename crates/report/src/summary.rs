//! What `summary.json` holds: plain data, complete for a script.
//!
//! Lengths in mm, positions in the patient frame LPS of the CT, angles in degrees, HU as they are.
//! All numbers are finite (JSON knows no other). What differs from run to run of the same case
//! lies in [`Run`] alone; all else is reproducible to the byte.

mod agreement;
mod evaluation;
mod fit;
mod interval;
mod moved;
mod run;
mod verdict;
mod warning;

pub use agreement::{Agreement, SkinAgreement};
pub use evaluation::{EvaluatedSurface, Evaluation};
pub use fit::{OneModulus, ScanFit, TissueFit};
pub use interval::{Ellipsoid, ModulusKnown, OtherRest, TumourInterval};
pub use moved::{
    CarriedObject, CarriedPoint, CarriedRegion, DoseVolumeCurve, DoseVolumeHistogram, Movement,
    VolumeChange,
};
pub use run::{Link, Run, SourceSeries, StageTime};
pub use supine_record::{
    Addition, Consistency, Curved, Cut, DenseFate, DenseThing, DeviationParts, FitStep,
    FittedTissues, Jacobian, Law, LawFit, Membrane, ModulusOrigin, OffPlace, QualityCheck,
    RestState, STRUCTURED_MM, SkinDistances, SlidingArea, Solve, SphereRecord, StateFit,
    SurfaceDistance, TissueLevels, UncertainPatch, UncertaintyShare, UncertaintySource,
    WallUncertainty, Warp,
};
pub use verdict::{Colour, Reason, Status, Verdict};
pub use warning::Warning;
pub(crate) use warning::is_not;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Everything there is to say about a run.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct Summary {
    /// Version of this structure: [`Summary::SCHEMA`].
    pub schema: u32,
    /// Short name of the result, four hexadecimal digits of a hash of the deformed CT and its
    /// derivation; it ends the exported series' description. Absent in summaries of older versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub id: Option<String>,
    /// In a word, whether the run left what may be used: `done` with a green or amber verdict,
    /// `not-usable` with a red one. What `supine run --json` prints has an `error` too where the
    /// command ends with another code than 0.
    pub status: Status,
    /// What made the result.
    pub tool: Tool,
    /// Whether the result may be used, and why.
    pub verdict: Verdict,
    /// What the result must not be used for, one statement per entry: [`must_not_be_used_for`].
    pub must_not_be_used_for: Vec<String>,
    /// The case as it was checked, with its defaults: what `supine run` repeats the run from.
    /// Without what names files when the patient was taken out.
    pub case: serde_json::Map<String, serde_json::Value>,
    /// Which breast, on which table, with which tumour.
    pub position: Position,
    /// The files that were read.
    pub inputs: Vec<Input>,
    /// Every parameter that shaped the result, defaults included.
    pub parameters: Parameters,
    /// The series that the CT was read from; `None` when it did not come as DICOM, or the patient
    /// was taken out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<SourceSeries>,
    /// The CT as it was read.
    pub ct: CtFacts,
    /// Result of the segmentation.
    pub segmentation: Segmentation,
    /// Result of the mesher.
    pub mesh: Mesh,
    /// The tissue that was fitted to scans; absent when the case names none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fit: Option<TissueFit>,
    /// Result of the mechanics.
    pub solve: Solve,
    /// Result of the warp.
    pub warp: Warp,
    /// How the volume of each structure changes; empty in summaries of older versions.
    #[serde(default)]
    pub volumes: Vec<VolumeChange>,
    /// What a registration would be judged by; absent in summaries of older versions.
    #[serde(default)]
    pub agreement: Option<Agreement>,
    /// The tumour before and after; `None` when the case names none.
    pub tumour: Option<Movement>,
    /// How sure that is; `None` where the tumour does not lie in the tissue that was modelled.
    pub tumour_interval: Option<TumourInterval>,
    /// A scan on the operating table held against the result; absent when the case names none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub evaluation: Option<Evaluation>,
    /// The nipple before and after; `None` when it was not found.
    pub nipple: Option<Movement>,
    /// Further points that were carried along.
    pub points: Vec<CarriedPoint>,
    /// Doses, structures and segments that were carried along; absent when the case names none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub carried: Vec<CarriedObject>,
    /// Dose and volume of every structure, where a dose and structures were carried along; absent
    /// when not.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub dose_volume: Vec<DoseVolumeHistogram>,
    /// The exported series; `None` when nothing was exported.
    pub export: Option<Export>,
    /// What the user must know before trusting the result, in order of the stages.
    pub warnings: Vec<Warning>,
    /// The files that were written, `summary.json` left out; the page also leaves itself out.
    pub outputs: Vec<Output>,
    /// The results that this one rests on, from the inputs on, each with the key of its content.
    pub chain: Vec<Link>,
    /// Times, memory and threads: differ from run to run.
    pub run: Run,
}

/// What made the result.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct Tool {
    /// `supine`.
    pub name: String,
    /// Version, as in `0.1.0`.
    pub version: String,
}

/// Which breast, on which table, with which tumour.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct Position {
    /// The patient's side: `left` or `right`.
    pub breast: String,
    /// The operating table.
    #[serde(rename = "bed")]
    pub table: TablePosition,
    /// The tumour in the CT; `None` when the case names none.
    pub tumour: Option<SphereRecord>,
}

/// The tilt of the operating table.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct TablePosition {
    /// Head-up angle, degrees: positive raises the head.
    pub ap_deg: f64,
    /// Sideways angle, degrees: positive lowers the patient's left side.
    pub lat_deg: f64,
    /// Direction of gravity in the patient's frame, unit vector, LPS.
    pub gravity: [f64; 3],
}

/// A file or folder that was read.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct Input {
    /// What it served for: `ct`, `labels`, `seeds`, `points`, ...
    pub role: String,
    /// `folder`, or what the file's name ends with. Not its name: sites name files after patients.
    pub form: String,
    /// Number of files.
    pub files: usize,
    /// BLAKE3 of the content, hexadecimal; of a folder: over its files in order.
    pub blake3: String,
}

/// Every parameter that shaped the result.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct Parameters {
    /// The soft tissue and how it is loaded.
    pub tissue: Tissue,
    /// What was asked of the mesher.
    pub mesh: MeshParameters,
    /// The spherical region.
    pub region: RegionParameters,
    /// Interpolation of the CT: `linear`, `cubic` or `lanczos3`.
    pub interpolation: String,
    /// Width over which the displacement fades at the cut, mm.
    pub fade_mm: f64,
}

/// The soft tissue and how it is loaded.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct Tissue {
    /// Young's modulus, kPa; with `moduli` their mean over the mesh. It belongs to the rest state
    /// and the element order beside it.
    pub young_kpa: f64,
    /// Moduli that differ from tissue to tissue; absent when one is taken for all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub moduli: Option<Moduli>,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Density, kg/m³.
    pub density_kg_m3: f64,
    /// How it goes on beyond small strain; absent: neo-Hookean.
    #[serde(default, skip_serializing_if = "Law::is_default")]
    pub law: Law,
    /// How much a law that stiffens does so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffening: Option<f64>,
    /// Modulus that fibres from the chest wall to the skin add along themselves, over the tissue's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fibres: Option<f64>,
    /// k of the fibres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fibre_stiffening: Option<f64>,
    /// Which way they run in the CT, LPS; absent: from the chest wall to the skin.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fibre_direction: Option<[f64; 3]>,
    /// The part of the chest wall on which it slides; absent: held everywhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sliding: Option<SlidingArea>,
    /// The skin as a membrane on the tissue; absent: tissue like the rest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skin: Option<Membrane>,
    /// What is taken as stress-free.
    pub rest: RestState,
    /// Element order: 1 linear, 2 quadratic.
    pub order: u8,
    /// Condition at the cut.
    pub cut: Cut,
}

/// Moduli that differ from tissue to tissue, kPa.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct Moduli {
    /// What decided the tissue: `labels`, or `hu` between fat and gland.
    pub map: String,
    /// Fat, implants too.
    pub fat_kpa: f64,
    /// Gland.
    pub gland_kpa: f64,
    /// Skin.
    pub skin_kpa: f64,
    /// Tumour.
    pub tumour_kpa: f64,
    /// Smallest of a tetrahedron: the mean of the tissues in it.
    pub min_kpa: f64,
    /// Mean over the mesh.
    pub mean_kpa: f64,
    /// Largest of a tetrahedron.
    pub max_kpa: f64,
}

/// What was asked of the mesher.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct MeshParameters {
    /// Number of tetrahedra asked for.
    pub tetrahedra: usize,
    /// `native`, `cgal` or `tetgen`.
    pub mesher: String,
    /// Where the mesh was to be finer: `none`, `tumour` or `goal`.
    #[serde(default)]
    pub refine: String,
}

/// The spherical region.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct RegionParameters {
    /// Centre, LPS, mm.
    pub centre_mm: [f64; 3],
    /// Radius, mm.
    pub radius_mm: f64,
    /// Whether it was proposed from the breast, not given in the case.
    pub proposed: bool,
}

/// The CT as it was read.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct CtFacts {
    /// Voxels along the grid's axes.
    pub size: [usize; 3],
    /// Distance of voxel centres along the grid's axes, mm.
    pub spacing_mm: [f64; 3],
    /// Centre of the first voxel, LPS, mm.
    pub origin_mm: [f64; 3],
    /// Number of slices.
    pub slices: usize,
    /// Patient Position as in DICOM (`HFS`, `FFS`, ...); empty when the file does not say.
    pub patient_position: String,
    /// Files of the folder that were not used.
    pub left_out: Vec<LeftOut>,
}

/// A file that was not used.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct LeftOut {
    /// Its name, without the way to it.
    pub file: String,
    /// Why.
    pub reason: String,
}

/// Result of the segmentation.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct Segmentation {
    /// HU found for fat; `None` when the labels were supplied.
    pub fat_hu: Option<f64>,
    /// HU found for muscle; `None` when the labels were supplied.
    pub muscle_hu: Option<f64>,
    /// Soft tissue within the region, ml.
    pub soft_tissue_ml: f64,
    /// Chest wall within the region, with all it encloses, ml.
    pub chest_wall_ml: f64,
    /// Uncertainty of the boundary between them; `None` when the labels were supplied.
    pub uncertainty: Option<WallUncertainty>,
    /// What the whole case was judged by, and how near a warning or refusal it was.
    pub quality_checks: Vec<QualityCheck>,
    /// Finer tissues; `None` when the case did not ask for them.
    pub tissues: Option<Tissues>,
}

/// Fat, gland and other tissues. Nothing is computed from them.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct Tissues {
    /// By what they were told from each other.
    #[serde(flatten)]
    pub levels: TissueLevels,
    /// Breast density: gland over gland and fat within the region, percent of volume; `None` when
    /// there is neither.
    pub density_percent: Option<f64>,
    /// Each tissue, in the order of its label.
    pub volumes: Vec<TissueVolume>,
}

/// How much there is of a tissue.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct TissueVolume {
    /// Its name, as in the file of labels.
    pub name: String,
    /// Volume within the region, ml.
    pub region_ml: f64,
    /// Mean of the CT there, HU; `None` when there is none.
    pub mean_hu: Option<f64>,
    /// Volume in the whole CT, ml.
    pub whole_ct_ml: f64,
}

/// Result of the mesher.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Number of tetrahedra asked for.
    pub asked: usize,
    /// Number of tetrahedra made.
    pub tetrahedra: usize,
    /// Number of points.
    pub points: usize,
    /// Number of unknowns of the mechanics (three per free node).
    pub unknowns: usize,
    /// Smallest dihedral angle, degrees.
    pub min_dihedral_deg: f64,
    /// Largest dihedral angle, degrees.
    pub max_dihedral_deg: f64,
    /// Smallest radius ratio (3 r_in / R_circ; 1 is best).
    pub min_radius_ratio: f64,
    /// Mean radius ratio.
    pub mean_radius_ratio: f64,
    /// Volume, ml.
    pub volume_ml: f64,
    /// Area of the skin, mm².
    pub skin_mm2: f64,
    /// Area of the chest wall, mm².
    pub chest_wall_mm2: f64,
    /// Area of the cut, mm².
    pub cut_mm2: f64,
    /// Volume of what it was made of, ml: the soft tissue of the labels in the region, without
    /// dropped pieces, or the mesh that was coarsened.
    #[serde(default)]
    pub source_volume_ml: f64,
    /// Patches of skin, chest wall or cut smaller than a face that took their neighbour's tag.
    #[serde(default)]
    pub joined_patches: usize,
    /// How far each part of the boundary lies from what it follows.
    #[serde(default)]
    pub surfaces: Vec<SurfaceFit>,
    /// Number of dihedral angles (six per tetrahedron) in classes of 5 degrees from 0 to 180.
    #[serde(default)]
    pub dihedral_angles: Vec<usize>,
    /// Number of tetrahedra by radius ratio in classes of 0.05 from 0 to 1.
    #[serde(default)]
    pub radius_ratios: Vec<usize>,
    /// The tetrahedra with the smallest dihedral angles, worst first.
    #[serde(default)]
    pub worst: Vec<WorstTet>,
    /// Curved sides on skin and chest wall; absent when all are straight.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curved: Option<Curved>,
}

/// How far the faces of one tag lie from the surface they follow: the skin or chest wall of the
/// labels, the sphere, or the surface of the mesh that was coarsened.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct SurfaceFit {
    /// The tag: `skin`, `chest_wall` or `cut`.
    pub tag: String,
    /// How far.
    #[serde(flatten)]
    pub distance: SurfaceDistance,
}

/// A tetrahedron of poor shape.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct WorstTet {
    /// Its number in the mesh, from 0.
    pub tet: usize,
    /// Its middle, LPS, mm.
    pub place_mm: [f64; 3],
    /// Smallest dihedral angle, degrees.
    pub min_dihedral_deg: f64,
    /// Largest dihedral angle, degrees.
    pub max_dihedral_deg: f64,
    /// Radius ratio (3 r_in / R_circ; 1 is best).
    pub radius_ratio: f64,
}

/// The exported DICOM series.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct Export {
    /// Folder, relative to the run's folder.
    pub folder: String,
    /// Number of files.
    pub files: usize,
    /// Series Description, by which the planning system lists it.
    pub series_description: String,
    /// Series Instance UID.
    pub series_uid: String,
    /// Frame of Reference UID: a new one, since the tissue has moved in the source's.
    pub frame_of_reference_uid: String,
    /// Checks of the written files.
    pub verified: Checks,
    /// The registrations beside the series, when they were asked for.
    #[serde(default)]
    pub registration: Option<Registration>,
}

/// The map as registration objects: deformable for the tissue, rigid for the chest wall.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct Registration {
    /// Folder, relative to the run's folder.
    pub folder: String,
    /// Places of the grid of vectors along its axes.
    pub grid: [usize; 3],
    /// Distance of its places along its axes, mm.
    pub spacing_mm: [f64; 3],
    /// Between what a reader finds between the grid's places and the map.
    #[serde(flatten)]
    pub error: Consistency,
}

/// How many checks were passed.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct Checks {
    /// Checks passed.
    pub passed: usize,
    /// Checks made.
    pub total: usize,
}

/// A file or folder that was written.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct Output {
    /// Path relative to the run's folder, with `/`.
    pub path: String,
    /// BLAKE3 of the content, hexadecimal; of a folder: over its files in order.
    pub blake3: String,
}

/// What a simulated volume must not be used for: the entries of
/// [`Summary::must_not_be_used_for`].
pub fn must_not_be_used_for() -> Vec<String> {
    [
        "Diagnosis: it is a simulation, not an acquired image.",
        "Treatment without approval of the plan by a qualified person who has compared it with \
         the CT it was made from.",
        "Dose or density outside the simulated region: there the volume still shows the patient \
         as she lay on the CT table.",
        "Any other tilt of the table, arm position or tissue removal than the one simulated.",
    ]
    .map(String::from)
    .to_vec()
}

/// The JSON schema of `summary.json`.
pub fn summary_schema() -> serde_json::Value {
    let mut schema = schemars::schema_for!(Summary);
    schema.insert("$id".into(), format!("urn:supine:schema:summary:{}", Summary::SCHEMA).into());
    schema.into()
}

impl Summary {
    /// The local change of volume that is told: det F of all simulated tissue from the CT to the
    /// table; where it was not sampled, that of the map that carries the CT.
    pub fn local_volume(&self) -> &Jacobian {
        self.volumes.first().map_or(&self.warp.jacobian, |tissue| &tissue.jacobian)
    }

    /// Version of its structure: 3 since the tumour's interval and the verdict stand in it.
    pub const SCHEMA: u32 = 3;

    /// The summary as JSON: indented, keys in the order of the fields, ends with a line feed.
    pub fn to_json(&self) -> String {
        // Plain structs of numbers, strings and lists: there is no value that JSON cannot hold.
        let mut json = serde_json::to_string_pretty(self).unwrap_or_default();
        json.push('\n');
        json
    }
}

#[cfg(test)]
pub(crate) mod tests;
