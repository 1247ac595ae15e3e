//! Why a run ended without its result.

use crate::{CaseError, RoleError};
use std::path::PathBuf;

/// Why a run ended; [`RunError::exit_code`] is what the command answers.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// The case file.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// The CT.
    #[error("the CT cannot be used: {0}")]
    Ct(supine_dicom::Error),
    /// Another file that the case names.
    #[error("{role}: {source}")]
    File {
        /// Which key of the case names it.
        role: &'static str,
        /// Why.
        source: supine_exchange::Error,
    },
    /// A file that is not there or cannot be opened.
    #[error("{role} {path} cannot be read: {source}")]
    Missing {
        /// Which key of the case names it.
        role: &'static str,
        /// The path.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The system gives no random numbers for the key of a de-identification.
    #[error("no random numbers for the de-identification: {0}")]
    Random(String),
    /// A DICOM object that was brought along as labels.
    #[error("`labels`: {0}")]
    Regions(supine_dicom::Error),
    /// Its regions cannot be told apart.
    #[error("`labels`: {0}")]
    Roles(#[from] RoleError),
    /// Labels that cannot be of the CT.
    #[error("`labels`: {0}")]
    Labels(#[from] supine_segment::LabelsError),
    /// The region.
    #[error("`region`: {0}")]
    Region(#[from] supine_volume::RegionError),
    /// The tumour and the anatomy disagree.
    #[error("`tumour`: {0}")]
    Tumour(String),
    /// Segmentation.
    #[error("segmentation: {0}")]
    Segment(supine_segment::Error),
    /// Meshing.
    #[error("meshing: {0}")]
    Mesh(supine_tetrahedralise::Error),
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
    /// Meshing by CGAL.
    #[cfg(feature = "cgal")]
    #[error("meshing: {0}")]
    Cgal(supine_tetrahedralise_cgal::Error),
    /// Meshing by TetGen.
    #[cfg(feature = "tetgen")]
    #[error("meshing: {0}")]
    Tetgen(supine_tetrahedralise_tetgen::Error),
    /// Mechanics.
    #[error("mechanics: {0}")]
    Solve(supine_fem::Error),
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
    #[error("{path} was drawn in another frame of reference than that of the CT")]
    OtherFrame {
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
    /// A product that cannot be written.
    #[error("{0}")]
    Product(supine_exchange::Error),
    /// A stored solution that lost its displacement.
    #[error("{path} holds no displacement; run again with --force solve")]
    NoDisplacement {
        /// The file.
        path: PathBuf,
    },
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
    /// An input lies where the run writes.
    #[error(
        "{role}: {path} lies where the run writes its results and would be lost; copy it elsewhere or name another --out"
    )]
    Overlap {
        /// Which key of the case names it.
        role: &'static str,
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
    /// A record that cannot be written as JSON (a number that is not finite).
    #[error("the record of a stage cannot be written: {0}")]
    Record(#[from] serde_json::Error),
    /// The user stopped it.
    #[error("interrupted; what was finished is kept and a second run continues from there")]
    Stopped,
}

impl From<supine_space::Stopped> for RunError {
    fn from(_: supine_space::Stopped) -> Self {
        Self::Stopped
    }
}

impl RunError {
    /// An input or stored product that cannot be read, by the key of the case that names it.
    pub(crate) fn file(role: &'static str, source: supine_exchange::Error) -> Self {
        match source {
            supine_exchange::Error::Stopped(_) => Self::Stopped,
            source => Self::File { role, source },
        }
    }

    /// A product that cannot be written or read back.
    pub(crate) fn product(error: supine_exchange::Error) -> Self {
        match error {
            supine_exchange::Error::Stopped(_) => Self::Stopped,
            error => Self::Product(error),
        }
    }

    /// The exit code: 1 input, 2 usage, 3 method, 5 output, 75 worth a retry, 130 interrupted.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Case(_)
            | Self::Ct(_)
            | Self::File { .. }
            | Self::Missing { .. }
            | Self::Overlap { .. }
            | Self::Unfinished { .. }
            | Self::Regions(_)
            | Self::OtherFrame { .. }
            | Self::OtherRegistration { .. }
            | Self::NoSeries
            | Self::Roles(_)
            | Self::Labels(_)
            | Self::Region(_)
            | Self::Tumour(_) => 1,
            Self::NotBuilt { .. } | Self::NotRefined { .. } => 2,
            #[cfg(feature = "cgal")]
            Self::Cgal(_) => 3,
            #[cfg(feature = "tetgen")]
            Self::Tetgen(_) => 3,
            Self::Mesh(supine_tetrahedralise::Error::Solid(_)) => 1,
            Self::Structure { .. } => 3,
            Self::Segment(_) | Self::Mesh(_) | Self::Solve(_) | Self::Warp(_) => 3,
            Self::Carried(error) => match error.kind() {
                supine_dicom::ErrorKind::Input => 1,
                supine_dicom::ErrorKind::Output => output_code(error),
                supine_dicom::ErrorKind::Stopped => 130,
            },
            Self::Export(error) | Self::DicomLabels(error) => output_code(error),
            Self::Product(error) => output_code(error),
            Self::Report(error) => output_code(error),
            Self::Output { source, .. } => output_code(source),
            Self::NoDisplacement { .. } | Self::Foreign { .. } | Self::Record(_) => 5,
            Self::Busy { .. } | Self::Random(_) => 75,
            Self::Stopped => 130,
        }
    }
}

/// A full disk is worth a retry; a folder that cannot be written is not.
fn output_code(error: &(dyn std::error::Error + 'static)) -> u8 {
    use std::io::ErrorKind as Kind;
    let chain = std::iter::successors(Some(error), |e| e.source());
    let full = chain
        .filter_map(|e| e.downcast_ref::<std::io::Error>())
        .any(|e| matches!(e.kind(), Kind::StorageFull | Kind::QuotaExceeded));
    if full { 75 } else { 5 }
}

/// Turns the errors of the stages into [`RunError`], keeping an interruption an interruption.
macro_rules! from_stage {
    ($($crate_name:ident => $variant:ident),* $(,)?) => {$(
        impl From<$crate_name::Error> for RunError {
            fn from(error: $crate_name::Error) -> Self {
                match error {
                    $crate_name::Error::Stopped(_) => Self::Stopped,
                    other => Self::$variant(other),
                }
            }
        }
    )*};
}

#[cfg(feature = "cgal")]
from_stage! { supine_tetrahedralise_cgal => Cgal }
#[cfg(feature = "tetgen")]
from_stage! { supine_tetrahedralise_tetgen => Tetgen }
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
        assert_eq!(RunError::Product(product).exit_code(), 75);
        assert_eq!(RunError::Output { path: path.clone(), source: full() }.exit_code(), 75);
        assert_eq!(RunError::Output { path, source: denied }.exit_code(), 5);
    }

    #[test]
    fn an_interruption_stays_one() {
        let error = RunError::from(supine_fem::Error::Stopped(supine_space::Stopped));
        assert_eq!(error.exit_code(), 130);
    }
}
