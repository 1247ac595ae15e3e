//! What scripts are told of a failure.

use crate::Error;
use crate::spec::CaseError;
use supine_report::RunPlace;

fn in_file(path: &std::path::Path) -> RunPlace {
    RunPlace { file: Some(path.into()), ..RunPlace::default() }
}

fn at_key(key: &str) -> RunPlace {
    RunPlace { key: Some(key.into()), ..RunPlace::default() }
}

fn in_stage(stage: &str) -> RunPlace {
    RunPlace { stage: Some(stage.into()), ..RunPlace::default() }
}

fn of_key(key: &str, place: RunPlace) -> RunPlace {
    RunPlace { key: Some(key.into()), ..place }
}

impl Error {
    /// A word for this failure that stays the same from version to version.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Case(error) => error.code(),
            Self::Ct(_) => "ct-unusable",
            Self::Deformed { .. } => "ct-already-deformed",
            Self::LayOtherwise { .. } => "ct-position",
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
            Self::TumourPlace(supine_segment::TumourPlaceError::NoTissue { .. }) => "ct-not-hu",
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
    pub fn place(&self) -> RunPlace {
        match self {
            Self::Case(error) => error.place(),
            Self::Ct(_) => of_key("ct", in_stage("import")),
            Self::Deformed { path } | Self::LayOtherwise { path, .. } => {
                of_key("ct", in_file(path))
            }
            Self::CaseChanged { path } | Self::CaseThere { path } => in_file(path),
            Self::File { key, source } => of_key(key, place_of_exchange(source)),
            Self::Product(source) => place_of_exchange(source),
            Self::Missing { key, path, .. }
            | Self::Changed { key, path }
            | Self::InputsChanged { key, path }
            | Self::Overlap { key, path } => of_key(key, in_file(path)),
            Self::LabelsObject(_) | Self::Regions(_) | Self::Labels(_) => at_key("labels.file"),
            Self::Region(_) => of_key("region.centre", in_stage("region")),
            Self::TumourFile(_) => at_key("tumour.file"),
            Self::TumourName(_) => at_key("tumour.structure"),
            Self::TumourPlace(_) => of_key("tumour.centre", in_stage("tumour")),
            Self::Tumour(_) => of_key("tumour.centre", in_stage("region")),
            Self::Segment(_) => in_stage("segment"),
            Self::Mesh(_) | Self::NotBuilt { .. } | Self::NotRefined { .. } => in_stage("mesh"),
            Self::Solve(_) => in_stage("solve"),
            Self::Interval(_) => in_stage("interval"),
            Self::Fit(_) => in_stage("fit"),
            Self::Evaluation(_) => in_stage("evaluation"),
            Self::Landmarks { .. } => at_key("scans.landmarks"),
            Self::Mirrored => at_key("scans.supine"),
            Self::Warp(_) => in_stage("warp"),
            Self::Export(_) => in_stage("export"),
            Self::Report(_) => in_stage("report"),
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
            | Self::Busy { path } => in_file(path),
            _ => RunPlace::default(),
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

fn place_of_exchange(error: &supine_exchange::Error) -> RunPlace {
    use supine_exchange::Error as File;
    match error {
        File::Read { path, .. }
        | File::Input { path, .. }
        | File::Write { path, .. }
        | File::Unwritable { path, .. } => in_file(path),
        _ => RunPlace::default(),
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

    fn place(&self) -> RunPlace {
        match self {
            Self::Unreadable { path, .. }
            | Self::Invalid { path, .. }
            | Self::Withheld { path } => in_file(path),
            Self::Value { key, .. } | Self::Missing { key, .. } => at_key(key),
            Self::Incomplete { keys, .. } => {
                RunPlace { key: keys.first().map(|key| (*key).into()), ..RunPlace::default() }
            }
            Self::Key(_) => RunPlace::default(),
        }
    }
}
