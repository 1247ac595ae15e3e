//! What scripts are told of a failure.

use crate::Error;
use crate::spec::CaseError;
use serde::Serialize;
use std::path::PathBuf;
use supine_report::RunPlace;

/// Where the failure lies, as far as that is known.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Place {
    /// The file or folder.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// The key of the case; of several, the first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub key: Option<&'static str>,
    /// The stage of the flow.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stage: Option<&'static str>,
}

impl From<Place> for RunPlace {
    fn from(Place { file, key, stage }: Place) -> Self {
        let text = |word: Option<&str>| word.map(str::to_owned);
        Self { file, key: text(key), stage: text(stage) }
    }
}

impl Place {
    fn file(path: &std::path::Path) -> Self {
        Self { file: Some(path.into()), ..Self::default() }
    }

    fn key(key: &'static str) -> Self {
        Self { key: Some(key), ..Self::default() }
    }

    fn stage(stage: &'static str) -> Self {
        Self { stage: Some(stage), ..Self::default() }
    }

    fn of_file(key: &'static str, path: &std::path::Path) -> Self {
        Self { key: Some(key), ..Self::file(path) }
    }
}

impl Error {
    /// A word for this failure that stays the same from version to version.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Case(error) => error.code(),
            Self::Ct(_) => "ct-unusable",
            Self::Deformed { .. } => "ct-already-deformed",
            Self::NotSupine { .. } => "ct-not-supine",
            Self::CaseChanged { .. } => "case-changed",
            Self::CaseThere { .. } => "case-there-already",
            Self::File { source, .. } | Self::Product(source) => of_exchange(source),
            Self::Missing { .. } | Self::Unread { .. } => "input-missing",
            Self::Random(_) => "no-random-numbers",
            Self::LabelsObject(_) | Self::Regions(_) | Self::Labels(_) => "labels-unusable",
            Self::Region(_) => "region-unusable",
            Self::TumourFile(_) => "tumour-file-unusable",
            Self::TumourName(_) => "tumour-region-unusable",
            Self::TumourPlace(supine_segment::TumourPlaceError::OutsideCt { .. }) => {
                "tumour-outside-ct"
            }
            Self::TumourPlace(supine_segment::TumourPlaceError::InAir { .. }) => "tumour-in-air",
            Self::TumourPlace(_) => "tumour-on-other-side",
            Self::Tumour(_) => "tumour-outside-region",
            Self::Segment(_) => "segmentation-failed",
            Self::Given { .. } => "result-given",
            Self::Mesh(_) | Self::Fill { .. } => "meshing-failed",
            Self::NotBuilt { .. } => "mesher-not-built",
            Self::NotRefined { .. } => "mesher-cannot-refine",
            Self::Solve(_) => "mechanics-failed",
            Self::Interval(_) => "interval-failed",
            Self::Fit(_) => "fit-failed",
            Self::Evaluation(_) => "evaluation-failed",
            Self::Landmarks { .. } => "landmarks-apart",
            Self::Mirrored => "scan-mirrored",
            Self::Warp(_) | Self::Structure { .. } => "warping-failed",
            Self::Export(_) | Self::DicomLabels(_) => "export-failed",
            Self::Carried(_)
            | Self::OtherFrame { .. }
            | Self::OtherPatient { .. }
            | Self::Unattributed { .. }
            | Self::OtherCt
            | Self::OtherRegistration { .. } => "carried-object-unusable",
            Self::NoSeries => "no-dicom-series",
            Self::Output { .. } | Self::Report(_) | Self::Record(_) => "output-not-written",
            Self::NoDisplacement { .. } | Self::OtherMesh(_) | Self::Eighths(_) => "mesh-unusable",
            Self::Dicom(_) => "dicom-unusable",
            Self::Refused { .. } => "refused",
            Self::NotKept { .. } | Self::NoFolder => "result-not-kept",
            Self::Changed { .. } => "input-changed",
            Self::Threads(_) => "no-threads",
            Self::Foreign { .. } => "output-foreign",
            Self::Overlap { .. } => "output-over-input",
            Self::OtherResult { .. } => "output-of-another-case",
            Self::InputsChanged { .. } => "inputs-changed",
            Self::Unfinished { .. } => "run-unfinished",
            Self::Busy { .. } => "output-busy",
            Self::Stopped => "interrupted",
        }
    }

    /// Where it lies.
    pub fn place(&self) -> Place {
        match self {
            Self::Case(error) => error.place(),
            Self::Ct(_) => Place { key: Some("ct"), ..Place::stage("import") },
            Self::Deformed { path } | Self::NotSupine { path, .. } => Place::of_file("ct", path),
            Self::CaseChanged { path } | Self::CaseThere { path } => Place::file(path),
            Self::File { key, source } => Place { key: Some(key), ..place_of_exchange(source) },
            Self::Product(source) => place_of_exchange(source),
            Self::Missing { key, path, .. }
            | Self::Changed { key, path }
            | Self::InputsChanged { key, path }
            | Self::Overlap { key, path } => Place::of_file(key, path),
            Self::LabelsObject(_) | Self::Regions(_) | Self::Labels(_) => Place::key("labels.file"),
            Self::Region(_) => Place { key: Some("region.centre"), ..Place::stage("region") },
            Self::TumourFile(_) => Place::key("tumour.file"),
            Self::TumourName(_) => Place::key("tumour.structure"),
            Self::TumourPlace(_) => Place { key: Some("tumour.centre"), ..Place::stage("tumour") },
            Self::Tumour(_) => Place { key: Some("tumour.centre"), ..Place::stage("region") },
            Self::Segment(_) => Place::stage("segment"),
            Self::Mesh(_) | Self::NotBuilt { .. } | Self::NotRefined { .. } => Place::stage("mesh"),
            Self::Solve(_) => Place::stage("solve"),
            Self::Interval(_) => Place::stage("interval"),
            Self::Fit(_) => Place::stage("fit"),
            Self::Evaluation(_) => Place::stage("evaluation"),
            Self::Landmarks { .. } => Place::key("scans.landmarks"),
            Self::Mirrored => Place::key("scans.supine"),
            Self::Warp(_) => Place::stage("warp"),
            Self::Export(_) => Place::stage("export"),
            Self::Report(_) => Place::stage("report"),
            Self::OtherFrame { path, .. }
            | Self::OtherPatient { path }
            | Self::Unattributed { path }
            | Self::OtherRegistration { path, .. }
            | Self::NoDisplacement { path }
            | Self::Unread { path, .. }
            | Self::Output { path, .. }
            | Self::Foreign { path }
            | Self::OtherResult { path, .. }
            | Self::Unfinished { path }
            | Self::Busy { path } => Place::file(path),
            _ => Place::default(),
        }
    }
}

/// What is read and what is written fail by the same type.
fn of_exchange(error: &supine_exchange::Error) -> &'static str {
    match error {
        supine_exchange::Error::Read { .. } => "input-missing",
        supine_exchange::Error::Input { .. } => "input-unusable",
        _ => "output-not-written",
    }
}

fn place_of_exchange(error: &supine_exchange::Error) -> Place {
    use supine_exchange::Error as File;
    match error {
        File::Read { path, .. }
        | File::Input { path, .. }
        | File::Write { path, .. }
        | File::Unwritable { path, .. } => Place::file(path),
        _ => Place::default(),
    }
}

impl CaseError {
    fn code(&self) -> &'static str {
        match self {
            Self::Unreadable { .. } => "case-unreadable",
            Self::Invalid { .. } => "case-invalid",
            Self::Key(_) => "case-key-unknown",
            Self::Value { .. } => "case-value",
            Self::Missing { .. } | Self::Incomplete { .. } => "case-key-missing",
            Self::Withheld { .. } => "case-withheld",
        }
    }

    fn place(&self) -> Place {
        match self {
            Self::Unreadable { path, .. }
            | Self::Invalid { path, .. }
            | Self::Withheld { path } => Place::file(path),
            Self::Value { key, .. } | Self::Missing { key, .. } => Place::key(key),
            Self::Incomplete { keys, .. } => {
                Place { key: keys.first().copied(), ..Place::default() }
            }
            Self::Key(_) => Place::default(),
        }
    }
}
