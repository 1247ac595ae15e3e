//! The case file (TOML): as typed, and validated.

mod carry;
mod export;
mod refine;
mod stiffness;
pub use export::ExportWish;
pub use refine::RefineWish;
pub use stiffness::{StiffnessMap, StiffnessWish};

use crate::{Brought, Mesher, PartNames, RunError, Wanted, keys};
use serde::Deserialize;
use std::path::{Path, PathBuf};
use supine_dicom::{Accept, ReadParams};
use supine_fem::{Cut, Load, RestState, Tissue};
use supine_mesh::Order;
use supine_space::{BedPose, Point, Progress, Side, Sphere};
use supine_warp::Interpolation;

/// Everything that decides a run, validated. Paths are absolute or relative to the working folder.
#[derive(Clone, Debug)]
pub struct Case {
    /// DICOM folder or file, NRRD or NIfTI file.
    pub ct: PathBuf,
    /// Series Instance UID, when the folder holds several.
    pub series: Option<String>,
    /// What is accepted of a DICOM CT beyond what is safe.
    pub accept: Accept,
    /// The breast that is operated.
    pub breast: Side,
    /// The table's tilt.
    pub bed: BedPose,
    /// The tumour in the CT.
    pub tumour: Sphere,
    /// The region; proposed from the breast when absent.
    pub region: Option<Sphere>,
    /// What is asked of the mesh.
    pub mesh: MeshWish,
    /// The tissue's law.
    pub tissue: Tissue,
    /// Moduli that differ from tissue to tissue; one for all when absent.
    pub stiffness: Option<StiffnessWish>,
    /// Moduli between which the tissue's may lie, kPa.
    pub young_interval_kpa: Option<[f64; 2]>,
    /// What the CT shape is taken for.
    pub rest: RestState,
    /// What holds the cut.
    pub cut: Cut,
    /// Stiffness of the springs when `cut` is [`Cut::Spring`], kPa/mm; the tissue's own when absent.
    pub spring_kpa_mm: Option<f64>,
    /// Seeds for the segmentation.
    pub seeds: Seeds,
    /// A segmentation brought along.
    pub labels: Option<Brought>,
    /// How values between voxels of the CT are found.
    pub interpolation: Interpolation,
    /// Point lists to carry.
    pub points: Vec<PathBuf>,
    /// Doses, structure sets and segmentations to carry, in this order.
    pub carried: Vec<Wanted>,
    /// Whether fat, gland and other tissues are labelled too, for the report.
    pub tissues: bool,
    /// What is asked of what leaves in DICOM.
    pub export: ExportWish,
}

/// What is asked of the mesh.
#[derive(Clone, Copy, Debug)]
pub struct MeshWish {
    /// Number of tetrahedra.
    pub tetrahedra: usize,
    /// Order of the displacement within them.
    pub order: Order,
    /// Whether those on skin and chest wall are curved for the mechanics.
    pub curved: bool,
    /// What makes them.
    pub mesher: Mesher,
    /// Where they are smaller.
    pub refine: RefineWish,
}

/// Where the seeds come from.
#[derive(Clone, Debug, Default)]
pub enum Seeds {
    /// None: the segmentation finds its own.
    #[default]
    Automatic,
    /// A file of points, a painted map, or a folder of masks.
    File(PathBuf),
    /// Points in the case file.
    Points(supine_segment::Seeds),
}

impl Seeds {
    /// The seeds themselves, read from their file when there is one.
    ///
    /// # Errors
    /// When the file cannot be read or holds no seeds, or the callback asked to stop.
    pub fn read(&self, progress: Progress<'_>) -> Result<supine_segment::Seeds, RunError> {
        match self {
            Self::Automatic => Ok(supine_segment::Seeds::default()),
            Self::Points(seeds) => Ok(seeds.clone()),
            Self::File(path) => supine_exchange::read_seeds(path, progress)
                .map_err(|source| RunError::file("`seeds`", source)),
        }
    }
}

/// Why a case cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CaseError {
    /// The file cannot be read.
    #[error("the case file {path} cannot be read: {source}")]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// It is not TOML or a value has the wrong type.
    #[error("the case file {path} is not valid: {reason}")]
    Invalid {
        /// The file.
        path: PathBuf,
        /// Line, key and reason.
        reason: String,
    },
    /// A value is out of its range.
    #[error("`{key}` in the case file: {reason}")]
    Value {
        /// The key.
        key: &'static str,
        /// What is wrong and what to do.
        reason: String,
    },
}

#[derive(Deserialize)]
struct CaseFile {
    ct: PathBuf,
    series: Option<String>,
    #[serde(default)]
    assume_hu: bool,
    #[serde(default)]
    equalise_steps: bool,
    breast: String,
    bed: BedFile,
    tumour: SphereFile,
    region: Option<SphereFile>,
    #[serde(default)]
    mesh: MeshFile,
    #[serde(default)]
    tissue: TissueFile,
    seeds: Option<SeedsFile>,
    labels: Option<LabelsFile>,
    #[serde(default)]
    warp: WarpFile,
    #[serde(default)]
    carry: carry::CarryFile,
    #[serde(default)]
    tissues: bool,
    #[serde(default)]
    export: export::ExportFile,
}

#[derive(Deserialize)]
struct BedFile {
    ap: f64,
    lat: f64,
}

#[derive(Deserialize)]
struct SphereFile {
    centre: [f64; 3],
    radius: f64,
}

#[derive(Deserialize, Default)]
struct MeshFile {
    tetrahedra: Option<i64>,
    order: Option<i64>,
    sides: Option<String>,
    mesher: Option<String>,
    refine: Option<String>,
    tumour_edge: Option<f64>,
    tumour_growth: Option<f64>,
}

#[derive(Deserialize, Default)]
struct WarpFile {
    interpolation: Option<String>,
}

#[derive(Deserialize, Default)]
struct TissueFile {
    young: Option<f64>,
    poisson: Option<f64>,
    density: Option<f64>,
    rest: Option<String>,
    cut: Option<String>,
    spring: Option<f64>,
    map: Option<String>,
    fat: Option<f64>,
    gland: Option<f64>,
    skin: Option<f64>,
    tumour: Option<f64>,
    young_interval: Option<[f64; 2]>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum SeedsFile {
    File(PathBuf),
    Points {
        #[serde(default)]
        chest_wall: Vec<[f64; 3]>,
        #[serde(default)]
        soft_tissue: Vec<[f64; 3]>,
        #[serde(default)]
        exclude: Vec<[f64; 3]>,
    },
}

#[derive(Deserialize)]
#[serde(untagged)]
enum LabelsFile {
    File(PathBuf),
    Named {
        file: PathBuf,
        #[serde(default)]
        body: NamesFile,
        #[serde(default)]
        soft_tissue: NamesFile,
        #[serde(default)]
        chest_wall: NamesFile,
    },
}

#[derive(Deserialize)]
#[serde(untagged)]
enum NamesFile {
    One(String),
    Several(Vec<String>),
}

impl Default for NamesFile {
    fn default() -> Self {
        Self::Several(Vec::new())
    }
}

/// The tilts a table can do; beyond them a typing error is likelier than a patient.
const MAX_TILT_DEG: f64 = 90.0;

impl Case {
    /// Reads and validates a case file; relative paths in it are relative to the file.
    ///
    /// # Errors
    /// [`CaseError`], naming the key and what to do.
    pub fn read(path: &Path) -> Result<Self, CaseError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| CaseError::Unreadable { path: path.into(), source })?;
        let invalid = |reason: String| CaseError::Invalid { path: path.into(), reason };
        let table: toml::Table =
            text.parse().map_err(|e: toml::de::Error| invalid(e.to_string()))?;
        if let Some(complaint) = keys::first_unknown(&table) {
            return Err(invalid(complaint));
        }
        let file: CaseFile = toml::from_str(&text).map_err(|e| invalid(e.to_string()))?;
        Self::from_file(file, path.parent().unwrap_or(Path::new("")))
    }

    /// Every path the case names, with its key.
    pub(crate) fn inputs(&self) -> impl Iterator<Item = (&'static str, &Path)> {
        let seeds = match &self.seeds {
            Seeds::File(path) => Some(path),
            Seeds::Automatic | Seeds::Points(_) => None,
        };
        std::iter::once(("`ct`", &self.ct))
            .chain(self.labels.iter().map(|l| ("`labels`", &l.file)))
            .chain(seeds.map(|p| ("`seeds`", p)))
            .chain(self.points.iter().map(|p| ("`carry.points`", p)))
            .chain(self.carried.iter().map(|w| (w.kind.key(), &w.path)))
            .map(|(role, path)| (role, path.as_path()))
    }

    /// The change of gravity.
    pub(crate) fn load(&self) -> Load {
        Load { ct: supine_space::supine(), target: self.bed.gravity() }
    }

    /// How the CT is read when it is DICOM.
    #[must_use]
    pub fn read_params(&self) -> ReadParams {
        ReadParams { series: self.series.clone(), accept: self.accept }
    }

    /// How the displacement is solved.
    pub(crate) fn solver(&self) -> supine_fem::Params {
        let Self { rest, cut, spring_kpa_mm, .. } = *self;
        let order = self.mesh.order;
        supine_fem::Params { order, rest, cut, spring_kpa_mm, ..supine_fem::Params::default() }
    }

    fn from_file(file: CaseFile, base: &Path) -> Result<Self, CaseError> {
        let tissue_file = &file.tissue;
        let stiffness = stiffness::wish(tissue_file)?;
        let default = Tissue::default();
        Ok(Self {
            ct: base.join(file.ct),
            series: file.series,
            accept: Accept { assume_hu: file.assume_hu, equalise_steps: file.equalise_steps },
            breast: side("breast", &file.breast)?,
            bed: bed(&file.bed)?,
            tumour: sphere("tumour", &file.tumour)?,
            region: file.region.as_ref().map(|r| sphere("region", r)).transpose()?,
            mesh: mesh_wish(&file.mesh)?,
            tissue: tissue(Tissue {
                young_kpa: tissue_file.young.unwrap_or(default.young_kpa),
                poisson: tissue_file.poisson.unwrap_or(default.poisson),
                density_kg_m3: tissue_file.density.unwrap_or(default.density_kg_m3),
            })?,
            stiffness,
            young_interval_kpa: stiffness::interval(tissue_file)?,
            rest: one_of(
                "tissue.rest",
                tissue_file.rest.as_deref(),
                &[("net", RestState::Net), ("unloaded", RestState::Unloaded)],
            )?,
            cut: one_of(
                "tissue.cut",
                tissue_file.cut.as_deref(),
                &[("spring", Cut::Spring), ("free", Cut::Free), ("fixed", Cut::Fixed)],
            )?,
            spring_kpa_mm: spring(tissue_file)?,
            seeds: seeds(file.seeds, base)?,
            labels: file.labels.map(|l| labels(l, base)),
            interpolation: one_of(
                "warp.interpolation",
                file.warp.interpolation.as_deref(),
                &Interpolation::ALL.map(|i| (i.name(), i)),
            )?,
            points: file.carry.points(base),
            carried: file.carry.objects(base),
            tissues: file.tissues || stiffness.is_some(),
            export: export::wish(&file.export)?,
        })
    }
}

fn value(key: &'static str, reason: impl Into<String>) -> CaseError {
    CaseError::Value { key, reason: reason.into() }
}

/// The named choice; the first one when none is named.
fn one_of<T: Copy>(
    key: &'static str,
    given: Option<&str>,
    choices: &[(&str, T)],
) -> Result<T, CaseError> {
    let Some(given) = given else { return Ok(choices[0].1) };
    let found = choices.iter().find(|(name, _)| *name == given);
    found.map(|(_, choice)| *choice).ok_or_else(|| {
        let names: Vec<String> = choices.iter().map(|(name, _)| format!("\"{name}\"")).collect();
        value(key, format!("\"{given}\" is none of {}", names.join(", ")))
    })
}

/// The side of a name.
///
/// # Errors
/// When it is neither `left` nor `right`.
pub fn side(key: &'static str, name: &str) -> Result<Side, CaseError> {
    one_of(key, Some(name), &[("left", Side::Left), ("right", Side::Right)])
}

fn bed(file: &BedFile) -> Result<BedPose, CaseError> {
    for (key, angle) in [("bed.ap", file.ap), ("bed.lat", file.lat)] {
        if angle.is_nan() || angle.abs() > MAX_TILT_DEG {
            let reason = format!("{angle} degrees is not a tilt between -90 and 90");
            return Err(value(key, reason));
        }
    }
    Ok(BedPose { ap_deg: file.ap, lat_deg: file.lat })
}

fn sphere(key: &'static str, file: &SphereFile) -> Result<Sphere, CaseError> {
    Sphere::new(Point::from(file.centre), file.radius).map_err(|e| value(key, e.to_string()))
}

fn mesh_wish(file: &MeshFile) -> Result<MeshWish, CaseError> {
    let mesher = mesher("mesh.mesher", file.mesher.as_deref())?;
    let refine = refine::wish(file)?;
    if mesher != Mesher::Native && refine != RefineWish::Nowhere {
        let reason = format!("the mesher {} cannot: use native or leave it out", mesher.name());
        return Err(value("mesh.refine", reason));
    }
    let order = match file.order {
        None | Some(2) => Order::Quadratic,
        Some(1) => Order::Linear,
        Some(n) => return Err(value("mesh.order", format!("{n} is neither 1 nor 2"))),
    };
    let sides = [("straight", false), ("curved", true)];
    let curved = one_of("mesh.sides", file.sides.as_deref(), &sides)?;
    if curved && order == Order::Linear {
        return Err(value("mesh.sides", "only elements of order 2 can be curved"));
    }
    let asked =
        file.tetrahedra.unwrap_or(supine_tetrahedralise::Params::default().tetrahedra as i64);
    match usize::try_from(asked) {
        Ok(tetrahedra) if tetrahedra > 0 => {
            Ok(MeshWish { tetrahedra, order, curved, mesher, refine })
        }
        _ => Err(value(
            "mesh.tetrahedra",
            format!("{asked} tetrahedra cannot be made: ask for 1000 to 100000"),
        )),
    }
}

/// The mesher of a name, if this program was built with it.
fn mesher(key: &'static str, name: Option<&str>) -> Result<Mesher, CaseError> {
    let mesher = one_of(key, name, &Mesher::ALL.map(|m| (m.name(), m)))?;
    mesher.check_built().map_err(|e| value(key, e.to_string()))?;
    Ok(mesher)
}

/// The stiffness of the springs at the cut, kPa/mm.
fn spring(tissue: &TissueFile) -> Result<Option<f64>, CaseError> {
    let springs = matches!(tissue.cut.as_deref(), None | Some("spring"));
    match tissue.spring {
        Some(_) if !springs => Err(value("tissue.spring", "only with `cut = \"spring\"`")),
        Some(k) if !k.is_finite() || k < 0.0 => {
            Err(value("tissue.spring", format!("{k} kPa/mm is no stiffness: 0 or more")))
        }
        given => Ok(given),
    }
}

fn tissue(tissue: Tissue) -> Result<Tissue, CaseError> {
    tissue.check().map_err(|e| value("tissue", e.to_string()))?;
    Ok(tissue)
}

fn seeds(file: Option<SeedsFile>, base: &Path) -> Result<Seeds, CaseError> {
    let points = |list: Vec<[f64; 3]>| -> Result<Vec<Point>, CaseError> {
        if list.iter().flatten().all(|c| c.is_finite()) {
            Ok(list.into_iter().map(Point::from).collect())
        } else {
            Err(value("seeds", "a coordinate is not finite"))
        }
    };
    Ok(match file {
        None => Seeds::Automatic,
        Some(SeedsFile::File(path)) => Seeds::File(base.join(path)),
        Some(SeedsFile::Points { chest_wall, soft_tissue, exclude }) => {
            Seeds::Points(supine_segment::Seeds {
                chest_wall: points(chest_wall)?,
                soft_tissue: points(soft_tissue)?,
                exclude: points(exclude)?,
                painted: vec![],
            })
        }
    })
}

fn labels(file: LabelsFile, base: &Path) -> Brought {
    let names = |given| match given {
        NamesFile::One(name) => vec![name],
        NamesFile::Several(names) => names,
    };
    match file {
        LabelsFile::File(path) => Brought { file: base.join(path), names: PartNames::default() },
        LabelsFile::Named { file, body, soft_tissue, chest_wall } => Brought {
            file: base.join(file),
            names: PartNames {
                body: names(body),
                soft_tissue: names(soft_tissue),
                chest_wall: names(chest_wall),
            },
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MINIMAL: &str = "ct = 'ct'\nbreast = 'left'\nbed = { ap = 7.0, lat = 5.0 }\n\
                           tumour = { centre = [1.0, 2.0, 3.0], radius = 10.0 }\n";

    fn read(text: &str) -> Result<Case, CaseError> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("case.toml");
        std::fs::write(&path, text).unwrap();
        Case::read(&path)
    }

    #[test]
    fn four_keys_suffice() {
        let case = read(MINIMAL).unwrap();
        assert_eq!(case.breast, Side::Left);
        assert_eq!(case.mesh.order, Order::Quadratic);
        assert!((case.tissue.young_kpa - 0.609).abs() < 1e-12);
        assert!(case.ct.ends_with("ct") && case.ct != Path::new("ct"), "relative to the file");
    }

    #[test]
    fn whole_numbers_are_numbers() {
        assert!(read(&MINIMAL.replace("7.0", "7")).is_ok());
    }

    #[test]
    fn labels_are_a_file_or_a_file_with_names() {
        let labels = |text: &str| read(&format!("{MINIMAL}{text}\n")).unwrap().labels.unwrap();
        let plain = labels("labels = 'l.seg.nrrd'");
        assert!(plain.file.ends_with("l.seg.nrrd") && plain.names == PartNames::default());
        let named = labels("labels = { file = 'rs.dcm', body = 'Ext', chest_wall = ['A', 'B'] }");
        assert_eq!(named.names.body, ["Ext"]);
        assert_eq!(named.names.chest_wall, ["A", "B"]);
        let error = read(&format!("{MINIMAL}labels = {{ file = 'x', chestwall = 'A' }}\n"));
        assert!(error.unwrap_err().to_string().contains("`labels.chest_wall`"));
    }

    #[test]
    fn a_mesher_that_was_not_built_in_is_refused_with_what_to_do() {
        for mesher in Mesher::ALL {
            let case = read(&format!("{MINIMAL}mesh = {{ mesher = '{}' }}\n", mesher.name()));
            if mesher.check_built().is_ok() {
                assert_eq!(case.unwrap().mesh.mesher, mesher);
            } else {
                let error = case.unwrap_err().to_string();
                let build = format!("--features {}", mesher.name());
                assert!(error.contains("`mesh.mesher`") && error.contains(&build), "{error}");
            }
        }
    }

    #[test]
    fn moduli_by_tissue_are_kpa_or_proportions() {
        let stiffness = |text: &str| {
            let case = read(&format!("{MINIMAL}tissue = {{ {text} }}\n")).unwrap();
            assert_eq!(case.tissues, case.stiffness.is_some());
            case.stiffness
        };
        assert_eq!(stiffness("map = 'none'"), None);
        let given = stiffness("map = 'labels', fat = 0.5, gland = 2.2").unwrap();
        assert_eq!((given.mean_kpa, given.map), (None, StiffnessMap::Labels));
        assert_eq!(given.kpa[..2], [0.5, 2.2]);
        let proportions = stiffness("map = 'hu', young = 0.8").unwrap();
        assert_eq!((proportions.mean_kpa, proportions.kpa[0]), (Some(0.8), 1.0));
        assert!((given.kpa[2] / given.kpa[0] - proportions.kpa[2]).abs() < 1e-12);
    }

    #[test]
    fn each_bad_value_names_its_key() {
        for (line, key) in [
            ("mesh = { tetrahedra = 0 }", "mesh.tetrahedra"),
            ("mesh = { order = 3 }", "mesh.order"),
            ("mesh = { order = 1, sides = 'curved' }", "mesh.sides"),
            ("mesh = { mesher = 'magic' }", "mesh.mesher"),
            ("mesh = { refine = 'tumor' }", "mesh.refine"),
            ("mesh = { refine = 'tumour', tumour_edge = 0 }", "mesh.tumour_edge"),
            ("mesh = { refine = 'goal', tumour_growth = 0.3 }", "mesh.tumour_growth"),
            ("warp = { interpolation = 'spline' }", "warp.interpolation"),
            ("tissue = { poisson = 0.5 }", "tissue"),
            ("tissue = { map = 'label' }", "tissue.map"),
            ("tissue = { gland = 2.0 }", "tissue.map"),
            ("tissue = { map = 'labels', gland = 2.0 }", "tissue.fat"),
            ("tissue = { map = 'labels', fat = 0.5, young = 0.6 }", "tissue.young"),
            ("tissue = { map = 'hu', fat = 0.5, skin = -1 }", "tissue.skin"),
            ("tissue = { young_interval = [0.9, 0.4] }", "tissue.young_interval"),
            ("tissue = { rest = 'nett' }", "tissue.rest"),
            ("tissue = { cut = 'sprung' }", "tissue.cut"),
            ("tissue = { spring = -1.0 }", "tissue.spring"),
            ("tissue = { cut = 'free', spring = 0.1 }", "tissue.spring"),
            ("region = { centre = [0, 0, 0], radius = -1 }", "region"),
            ("tisue = { young = 1.0 }", "tissue"),
        ] {
            let error = read(&format!("{MINIMAL}{line}\n")).unwrap_err().to_string();
            assert!(error.contains(&format!("`{key}`")), "{line}: {error}");
        }
        let error = read(&MINIMAL.replace("breast", "brest")).unwrap_err().to_string();
        assert!(error.contains("`breast`"), "{error}");
        let error = read(&MINIMAL.replace("ap = 7.0", "ap = 700.0")).unwrap_err().to_string();
        assert!(error.contains("`bed.ap`"), "{error}");
        let error = read("ct = 'ct'\n").unwrap_err().to_string();
        assert!(error.contains("missing field `breast`"), "{error}");
    }
}
