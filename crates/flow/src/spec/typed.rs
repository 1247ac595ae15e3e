//! How the values of a specification become a case, and what they must say together.

use super::case::{Case, ExportSpec, SeedsSpec, Tolerance, TumourSpec};
use super::error::{CaseError, value};
use super::given::{Given, missing};
use super::read::Values;
use super::table::{CLIPPED, SAME_FRAME};
use super::value::Value;
use super::{boundary, canonical, mesh, tissue};
use crate::shared::{CarriedFile, CarriedKind, RegionNames, SuppliedLabels};
use serde_json::{Map, Value as Json};
use std::path::PathBuf;
use supine_dicom::{Accept, Clock, Policy};
use supine_fem::{Load, RestState};
use supine_report::DoseTolerance;
use supine_space::{Point, Posture, Side, Sphere, TablePose, Vector, sitting, supine};
use supine_volume::SeedKind;
use supine_warp::Interpolation;

impl Case {
    /// The case of a specification's values.
    ///
    /// # Errors
    /// [`CaseError::Value`] when values contradict each other, [`CaseError::Missing`] when half of
    /// a pair is missing.
    pub(super) fn of(values: &Values) -> Result<Self, CaseError> {
        let given = Given(values);
        let stiffness = tissue::stiffness(given)?;
        tissue::check_stiffening(given)?;
        let mut case = Self {
            ct: given.file("ct"),
            series: given.text("series"),
            exclude: given.names("exclude"),
            accept: Accept {
                assume_hu: given.switch("assume_hu"),
                equalise_steps: given.switch("equalise_steps"),
            },
            position: Posture::named(given.word("position")).unwrap_or_default(),
            breast: given.choice("breast").map(|word| match word {
                "left" => Side::Left,
                _ => Side::Right,
            }),
            table: table_pose(given)?,
            tumour: tumour(given)?,
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
            sliding: boundary::sliding(given)?,
            skin: boundary::skin(given)?,
            posture: boundary::posture(given),
            tolerance: tolerance(given)?,
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
    pub fn table_pose(&self) -> Result<TablePose, CaseError> {
        self.table.ok_or_else(|| missing("table.ap"))
    }

    /// The tumour.
    ///
    /// # Errors
    /// [`CaseError::Missing`].
    pub fn tumour(&self) -> Result<&TumourSpec, CaseError> {
        self.tumour.as_ref().ok_or_else(|| missing("tumour.centre"))
    }

    /// The change of gravity from that of the CT to a direction (LPS, a unit vector).
    pub(crate) fn load_to(&self, target: Vector) -> Load {
        Load { ct: self.position.gravity(), target }
    }

    /// The change of gravity to that of the scan of the sitting patient, as far as she is said to
    /// lean back in it.
    pub(crate) fn load_of_sitting(&self) -> Load {
        let lean_deg = self.fit_scans().map_or(0.0, |scans| scans.lean_deg);
        let (sin, cos) = lean_deg.to_radians().sin_cos();
        self.load_to(sitting() * cos + supine() * sin)
    }

    /// The change of gravity to that on the table.
    ///
    /// # Errors
    /// [`CaseError::Missing`].
    pub(crate) fn load(&self) -> Result<Load, CaseError> {
        Ok(self.load_to(self.table_pose()?.gravity()))
    }
}

fn table_pose(given: Given<'_>) -> Result<Option<TablePose>, CaseError> {
    match (given.number("table.ap"), given.number("table.lat")) {
        (None, None) => Ok(None),
        (Some(ap_deg), Some(lat_deg)) => Ok(Some(TablePose { ap_deg, lat_deg })),
        (None, Some(_)) => Err(missing("table.ap")),
        (Some(_), None) => Err(missing("table.lat")),
    }
}

fn tolerance(given: Given<'_>) -> Result<Tolerance, CaseError> {
    /// Surface of a sphere of 35 mm, mm.
    const AT_MM: f64 = 17.5;
    let (percent, at) = (given.number("dose.tolerance"), given.number("dose.at"));
    if percent.is_none() && at.is_some() {
        return Err(value("dose.at", "only with `dose.tolerance`"));
    }
    let dose = percent.map(|percent| DoseTolerance { percent, at_mm: at.unwrap_or(AT_MM) });
    let asked = dose.is_none() || given.get("tolerance").is_some();
    let place_mm = given.number("tolerance").filter(|_| asked);
    Ok(Tolerance { place_mm, dose })
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
