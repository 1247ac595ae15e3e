//! Why there is no result.

use crate::NodeId;
use crate::shared::RegionNameError;
use crate::spec::{CaseError, readable};
use std::path::PathBuf;
use supine_space::Failure;

/// Added where an object of the patient cannot be told from one of another scan.
const WITHOUT_KEY: &str = "; the run is de-identified and the key to its identifiers is not here: which objects were made on its CT \
     cannot be told without it";

/// Why there is no result; [`Error::kind`] says what kind of failure it is.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The case file.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// The CT.
    #[error("the CT cannot be used: {0}")]
    Ct(supine_dicom::Error),
    /// Somebody else changed the case file while it was edited.
    #[error("{path} was changed by another program: nothing was written; open it anew")]
    CaseChanged {
        /// The path.
        path: PathBuf,
    },
    /// A new case would take the place of a file.
    #[error("{path} is there already; name another file")]
    CaseThere {
        /// The path.
        path: PathBuf,
    },
    /// A CT that is a result of this program.
    #[error("`ct` {path} is {}", supine_dicom::DEFORMED_ALREADY)]
    Deformed {
        /// The path.
        path: PathBuf,
    },
    /// A CT of a patient who lay otherwise than the case says.
    #[error("`ct` {path} cannot be used: {why}")]
    LayOtherwise {
        /// The path.
        path: PathBuf,
        /// How she lay, and what to do.
        why: String,
    },
    /// Another file that the case names.
    #[error("`{key}`: {source}")]
    File {
        /// Which key of the case names it.
        key: &'static str,
        /// Why.
        source: supine_exchange::Error,
    },
    /// A file that is not there or cannot be opened.
    #[error("`{key}` {path} cannot be read: {source}; {}", readable(source))]
    Missing {
        /// Which key of the case names it.
        key: &'static str,
        /// The path.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The same of a file that no key of a case names.
    #[error("{path} cannot be read: {source}; {}", readable(source))]
    Unread {
        /// The path.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The system gives no random numbers for the key of a de-identification.
    #[error("no random numbers for the de-identification: {0}")]
    Random(String),
    /// A DICOM object that was supplied as labels.
    #[error("`labels`: {0}")]
    LabelsObject(supine_dicom::Error),
    /// Its regions cannot be told apart.
    #[error("`labels`: {0}")]
    Regions(#[from] RegionNameError),
    /// Labels that cannot be of the CT.
    #[error("`labels`: {0}")]
    Labels(#[from] supine_segment::LabelsError),
    /// The region.
    #[error("`region`: {0}")]
    Region(#[from] supine_volume::RegionError),
    /// A structure set that is to hold the tumour.
    #[error("`tumour.file`: {0}")]
    TumourFile(supine_dicom::Error),
    /// No region of a structure set has the tumour's name, or several have.
    #[error("`tumour.structure`: {0}")]
    TumourName(String),
    /// The tumour cannot be there.
    #[error("`tumour`: {0}")]
    TumourPlace(#[from] supine_segment::TumourPlaceError),
    /// The tumour and the anatomy disagree.
    #[error("`tumour`: {0}")]
    Tumour(String),
    /// Segmentation.
    #[error("segmentation: {0}")]
    Segment(supine_segment::Error),
    /// Meshing.
    #[error("meshing: {0}")]
    Mesh(supine_tetrahedralise::Error),
    /// A whole run of a session that holds what its case does not tell.
    #[error(
        "the {node} was given in memory: a run folder tells all that it rests on by its case; save what was given to a file and \
         name that, or take the results from the session"
    )]
    Given {
        /// The node whose result was given.
        node: NodeId,
    },
    /// A mesher that this program was built without.
    #[error(
        "this program was built without the mesher {mesher}; use native, or build it with `cargo \
         build --release --features {mesher}` (README, \"Other meshers\")"
    )]
    NotBuilt {
        /// Its name.
        mesher: &'static str,
    },
    /// The mesher cannot make a mesh finer in some places.
    #[error(
        "the mesher {mesher} cannot make the mesh finer near a place: use the mesher native, or leave the refinement out"
    )]
    NotRefined {
        /// Its name.
        mesher: &'static str,
    },
    /// Meshing by another mesher than our own.
    #[error("meshing: {source}")]
    Fill {
        /// What it failed with.
        source: Box<dyn std::error::Error + Send + Sync>,
        /// The kind of failure.
        kind: Failure,
    },
    /// Mechanics.
    #[error("mechanics: {0}")]
    Solve(supine_fem::Error),
    /// How sure the tumour's place is.
    #[error("interval of the tumour's displacement: {0}")]
    Interval(#[from] supine_personalise::Error),
    /// The modulus could not be fitted to the scans.
    #[error("fit of the modulus to the scans: {0}")]
    Fit(supine_personalise::Error),
    /// The scan on the operating table could not be held against the result.
    #[error("the scan on the operating table: {0}")]
    Evaluation(supine_personalise::Error),
    /// Landmarks of a scan that are not those of the CT.
    #[error(
        "the landmarks of the scan {frame:?} cannot be brought onto those of the CT: {rms_mm:.0} mm rms are left; one of them is \
         of another point, left and right are exchanged, or their unit is another"
    )]
    Landmarks {
        /// The scan.
        frame: String,
        /// What is left, mm rms.
        rms_mm: f64,
    },
    /// A scan that is a mirror image.
    #[error(
        "the scan of the lying patient is mirrored: its mirror image lies far nearer to the skin of the CT; have left and right \
         of the scans exchanged"
    )]
    Mirrored,
    /// Warping.
    #[error("warping: {0}")]
    Warp(supine_warp::Error),
    /// The exported series.
    #[error("the series cannot be exported: {0}")]
    Export(supine_dicom::Error),
    /// A dose, a structure set or a segmentation that is carried along.
    #[error("{0}")]
    Carried(supine_dicom::Error),
    /// A structure that cannot be carried.
    #[error("warping: {name}: {source}")]
    Structure {
        /// Its name.
        name: String,
        /// Why.
        source: supine_warp::Error,
    },
    /// What is carried belongs to another scan.
    #[error(
        "{path} was drawn in another frame of reference than that of the CT{}{}",
        .region.as_ref().map_or(String::new(), |name| format!(" (its region {name:?})")),
        if *.without_key { WITHOUT_KEY } else { "" }
    )]
    OtherFrame {
        /// The object.
        path: PathBuf,
        /// The first region that was, of a structure set.
        region: Option<String>,
        /// The CT is de-identified, and what its identifiers were is not known.
        without_key: bool,
    },
    /// A CT that is given beside a run is not the one that the run was made from.
    #[error(
        "--ct is not the CT that the run was made from: its Patient ID or its Frame of Reference UID differs"
    )]
    OtherCt,
    /// What is carried says neither on which scan nor of whom it was made.
    #[error(
        "{path}: nothing says that it belongs to this CT: it names no frame of reference, and it or the CT no \
         patient (Patient ID); export it again with both"
    )]
    Unattributed {
        /// The object.
        path: PathBuf,
    },
    /// What is carried belongs to another patient.
    #[error("{path} is of another patient than the CT: its Patient ID differs")]
    OtherPatient {
        /// The object.
        path: PathBuf,
    },
    /// A registration beside a series that it does not register.
    #[error("{path} is not the registration of {series}")]
    OtherRegistration {
        /// The registration.
        path: PathBuf,
        /// The series.
        series: PathBuf,
    },
    /// Objects of a CT that did not come as DICOM.
    #[error(
        "the CT did not come as DICOM: there is no exported series to which a dose, a structure set or a segmentation \
         could belong"
    )]
    NoSeries,
    /// The labels as a DICOM segmentation.
    #[error("the labels cannot be exported as DICOM: {0}")]
    DicomLabels(supine_dicom::Error),
    /// An output that cannot be written.
    #[error("{0}")]
    Product(supine_exchange::Error),
    /// A mesh file without a displacement.
    #[error("{path} holds no point data `displacement` (mm): make it with `supine solve`")]
    NoDisplacement {
        /// The file.
        path: PathBuf,
    },
    /// A DICOM file that a command reads for itself.
    #[error("{0}")]
    Dicom(supine_dicom::Error),
    /// What a command cannot do with what it was given.
    #[error("{message}")]
    Refused {
        /// What kind of failure it is.
        kind: Failure,
        /// Why, and what to do.
        message: String,
    },
    /// Tetrahedra too flat to be split for a picture.
    #[error("the preview cannot be drawn: {0}")]
    Eighths(supine_mesh::MeshError),
    /// A displacement of another mesh.
    #[error(transparent)]
    OtherMesh(#[from] supine_mesh::DisplacementError),
    /// A result that lies in no folder was wanted from one.
    #[error("the result of {node} is not kept")]
    NotKept {
        /// Whose.
        node: NodeId,
    },
    /// A node that writes files, in a session without a folder.
    #[error("this result is written to a folder, and the session has none")]
    NoFolder,
    /// An input that was changed while it was read.
    #[error("`{key}` {path} was changed while it was read; run again")]
    Changed {
        /// Which key of the case names it.
        key: &'static str,
        /// The path.
        path: PathBuf,
    },
    /// Threads that cannot be had.
    #[error("could not start worker threads: {0}")]
    Threads(String),
    /// The report.
    #[error("the report cannot be written: {0}")]
    Report(supine_report::Error),
    /// The output folder.
    #[error("the output {path} cannot be written: {source}")]
    Output {
        /// The path.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The output folder holds something of that name that no run made.
    #[error("{path} is there already and was not made by a run; name another --out")]
    Foreign {
        /// What is there.
        path: PathBuf,
    },
    /// The output folder holds the finished result of another case.
    #[error(
        "{path} holds {held}; this case is of another one{}: name another --out, or give --overwrite to have it replaced",
        ct.as_ref().map_or(String::new(), |ct| format!(" ({})", ct.display()))
    )]
    OtherResult {
        /// The folder.
        path: PathBuf,
        /// What it holds, in words.
        held: String,
        /// The CT of the case.
        ct: Option<PathBuf>,
    },
    /// A file of a summary that is repeated is not the one that its run read.
    #[error(
        "`{key}` {path} is not what the run of this summary read: its content differs; run the case file, or give \
         --inputs-changed if this is what you want"
    )]
    InputsChanged {
        /// Which key of the case names it.
        key: &'static str,
        /// The path.
        path: PathBuf,
    },
    /// An input lies where the run writes.
    #[error(
        "`{key}`: {path} lies where the run writes its results and would be lost; copy it elsewhere or name another --out"
    )]
    Overlap {
        /// Which key of the case names it.
        key: &'static str,
        /// The input.
        path: PathBuf,
    },
    /// A folder that is not that of a finished run.
    #[error("{path} is not the folder of a finished run")]
    Unfinished {
        /// The folder.
        path: PathBuf,
    },
    /// Another run works in the folder.
    #[error("another run is at work in {path}; wait for it or name another --out")]
    Busy {
        /// The folder.
        path: PathBuf,
    },
    /// A record that cannot be written as JSON (a number that is not finite), or not read (somebody
    /// changed it).
    #[error("the record of a stage cannot be written or read: {0}; run into a new folder")]
    Record(#[from] serde_json::Error),
    /// The user stopped it.
    #[error("interrupted; what was finished is kept and a second run continues from there")]
    Stopped,
}

impl From<supine_space::Stopped> for Error {
    fn from(_: supine_space::Stopped) -> Self {
        Self::Stopped
    }
}

impl From<supine_space::SphereError> for Error {
    fn from(error: supine_space::SphereError) -> Self {
        Self::Tumour(error.to_string())
    }
}

impl Error {
    /// An input that cannot be read, by the key of the case that names it.
    pub(crate) fn file(key: &'static str, source: supine_exchange::Error) -> Self {
        match source {
            supine_exchange::Error::Stopped(_) => Self::Stopped,
            source => Self::File { key, source },
        }
    }

    /// An output that cannot be written or read back.
    pub(crate) fn product(error: supine_exchange::Error) -> Self {
        match error {
            supine_exchange::Error::Stopped(_) => Self::Stopped,
            error => Self::Product(error),
        }
    }

    /// Whether a place cannot be written at all, however often it is tried.
    pub(crate) fn is_unwritable(&self) -> bool {
        use std::io::ErrorKind::{PermissionDenied, ReadOnlyFilesystem};
        matches!(self, Self::Output { source, .. } if [PermissionDenied, ReadOnlyFilesystem].contains(&source.kind()))
    }

    /// What kind of failure it is.
    pub fn kind(&self) -> Failure {
        match self {
            Self::Case(_)
            | Self::Ct(_)
            | Self::File { .. }
            | Self::Missing { .. }
            | Self::Unread { .. }
            | Self::Deformed { .. }
            | Self::LayOtherwise { .. }
            | Self::CaseChanged { .. }
            | Self::CaseThere { .. }
            | Self::Overlap { .. }
            | Self::InputsChanged { .. }
            | Self::Unfinished { .. }
            | Self::LabelsObject(_)
            | Self::OtherFrame { .. }
            | Self::OtherPatient { .. }
            | Self::Unattributed { .. }
            | Self::OtherCt
            | Self::OtherRegistration { .. }
            | Self::NoSeries
            | Self::NoDisplacement { .. }
            | Self::OtherMesh(_)
            | Self::Eighths(_)
            | Self::Regions(_)
            | Self::Labels(_)
            | Self::Region(_)
            | Self::TumourFile(_)
            | Self::TumourName(_)
            | Self::TumourPlace(_)
            | Self::Tumour(_) => Failure::Input,
            Self::NotBuilt { .. }
            | Self::OtherResult { .. }
            | Self::NotRefined { .. }
            | Self::NoFolder
            | Self::Given { .. } => Failure::Usage,
            Self::Structure { source, .. } | Self::Warp(source) => source.kind(),
            Self::Segment(error) => error.kind(),
            Self::Mesh(error) => error.kind(),
            Self::Solve(error) => error.kind(),
            Self::Interval(error) | Self::Fit(error) | Self::Evaluation(error) => error.kind(),
            Self::Landmarks { .. } | Self::Mirrored => Failure::Input,
            Self::Carried(error) | Self::Dicom(error) => error.kind(),
            Self::Refused { kind, .. } | Self::Fill { kind, .. } => *kind,
            Self::Export(error) | Self::DicomLabels(error) => error.kind(),
            Self::Product(error) => error.kind(),
            Self::Report(error) => error.kind(),
            Self::Output { source, .. } => Failure::of_output(source),
            Self::NotKept { .. } | Self::Foreign { .. } | Self::Record(_) => Failure::Output,
            Self::Busy { .. } | Self::Random(_) | Self::Changed { .. } | Self::Threads(_) => {
                Failure::Retry
            }
            Self::Stopped => Failure::Stopped,
        }
    }
}

/// Turns the errors of the stages into [`Error`], keeping an interruption an interruption.
macro_rules! from_stage {
    ($($crate_name:ident => $variant:ident),* $(,)?) => {$(
        impl From<$crate_name::Error> for Error {
            fn from(error: $crate_name::Error) -> Self {
                match error {
                    $crate_name::Error::Stopped(_) => Self::Stopped,
                    other => Self::$variant(other),
                }
            }
        }
    )*};
}

from_stage! {
    supine_segment => Segment,
    supine_tetrahedralise => Mesh,
    supine_fem => Solve,
    supine_warp => Warp,
    supine_report => Report,
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io;

    #[test]
    fn a_full_disk_is_worth_a_retry_wherever_it_shows() {
        let full = || io::Error::from(io::ErrorKind::StorageFull);
        let denied = io::Error::from(io::ErrorKind::PermissionDenied);
        let path = PathBuf::from("x");
        let product = supine_exchange::Error::Write { path: path.clone(), cause: full() };
        assert_eq!(Error::Product(product).kind(), Failure::Retry);
        assert_eq!(Error::Output { path: path.clone(), source: full() }.kind(), Failure::Retry);
        assert_eq!(Error::Output { path, source: denied }.kind(), Failure::Output);
    }

    #[test]
    fn an_interruption_stays_one() {
        let error = Error::from(supine_fem::Error::Stopped(supine_space::Stopped));
        assert_eq!(error.kind(), Failure::Stopped);
    }
}
