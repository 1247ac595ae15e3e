//! What can go wrong, in words that name the file and never the patient.

use crate::series_summary::SeriesSummary;
use std::fmt::Write as _;
use std::path::PathBuf;
use supine_space::Failure;

/// Why a series cannot be read or written.
///
/// Files are named by their path below the folder that was given.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file or folder cannot be opened or read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Nothing in the folder is a CT image.
    #[error("no CT image series in {}: {found}", path.display())]
    NoCt {
        /// The folder.
        path: PathBuf,
        /// What is there instead.
        found: String,
    },
    /// Several series could be meant.
    #[error("several CT series, choose one by its Series Instance UID:{}", listed(series))]
    SeveralSeries {
        /// The series, in the order of their UIDs.
        series: Vec<SeriesSummary>,
    },
    /// The asked series is not there.
    #[error("no CT series {asked}; there are:{}", listed(series))]
    UnknownSeries {
        /// The asked Series Instance UID.
        asked: String,
        /// The series that are there.
        series: Vec<SeriesSummary>,
    },
    /// Too few slices to make a volume.
    #[error("the CT series {series} has {slices} slice(s); a volume needs 3 or more")]
    TooFewSlices {
        /// Series Instance UID.
        series: String,
        /// Number of slices.
        slices: usize,
    },
    /// The file is cut short, damaged or made to deceive.
    #[error("{file} is not a sound DICOM file: {reason}")]
    Malformed {
        /// The file.
        file: String,
        /// What is wrong and where.
        reason: String,
    },
    /// An attribute is missing or its value cannot be used.
    #[error("{file}: {attribute} {reason}")]
    Attribute {
        /// The file.
        file: String,
        /// Name of the attribute.
        attribute: &'static str,
        /// What is wrong with it.
        reason: String,
    },
    /// The file is sound but of a kind that is not read.
    #[error("{file}: {what}")]
    Unsupported {
        /// The file.
        file: String,
        /// What is not read, and what to do.
        what: String,
    },
    /// The file is no DICOM, or holds nothing but names of others.
    #[error("{file}: not a CT image but: {what}")]
    NotDicom {
        /// The file.
        file: String,
        /// What it is instead.
        what: String,
    },
    /// The pixels cannot be decoded.
    #[error("{file}: the pixels cannot be decoded: {reason}")]
    Pixels {
        /// The file.
        file: String,
        /// Why.
        reason: String,
    },
    /// Slices of one series disagree where they must agree.
    #[error("{attribute} differs within the series: {a} and {b}{values}")]
    Differs {
        /// Name of the attribute.
        attribute: &'static str,
        /// A file.
        a: String,
        /// The first file that disagrees with it.
        b: String,
        /// The two values, unless they could name the patient.
        values: String,
    },
    /// A file that is to be left out is not there.
    #[error(
        "no file {file} is there to be left out (`exclude`): name files by their paths below the folder of the CT"
    )]
    NothingToExclude {
        /// Its path as given.
        file: String,
    },
    /// Two slices lie at the same place.
    #[error("two slices lie at the same position: {a} and {b}{hint}")]
    DuplicatePosition {
        /// A file.
        a: String,
        /// The other file.
        b: String,
        /// What the two differ in, if that explains it.
        hint: String,
    },
    /// Slices of different acquisitions alternate.
    #[error(
        "the series holds several acquisitions (phases, energies) whose slices alternate: \
         {attribute} {values} in {a} and {b}; export the wanted one by itself"
    )]
    SeveralAcquisitions {
        /// Name of the attribute that tells them apart.
        attribute: &'static str,
        /// A file.
        a: String,
        /// The next file along the normal.
        b: String,
        /// Its two values.
        values: String,
    },
    /// Acquisitions that follow each other share a place.
    #[error(
        "two slices lie {apart_mm:.3} mm apart, {a} and {b}, where the series joins several acquisitions ({differ}); \
         leave one out: {exclude}"
    )]
    JoinedAcquisitions {
        /// A file.
        a: String,
        /// The next file along the normal.
        b: String,
        /// The attribute that tells them apart, and its two values.
        differ: String,
        /// Distance along the normal, mm.
        apart_mm: f64,
        /// How to leave out files so that the rest is in order.
        exclude: String,
    },
    /// A slice is missing.
    #[error(
        "gap of {gap_mm:.3} mm between {a} and {b}, the step is {step_mm:.3} mm: a slice is missing{hint}"
    )]
    Gap {
        /// The slice below the gap.
        a: String,
        /// The slice above the gap.
        b: String,
        /// Distance along the normal, mm.
        gap_mm: f64,
        /// Median step, mm.
        step_mm: f64,
        /// What can be done.
        hint: String,
    },
    /// The steps between slices are unequal.
    #[error(
        "the slices are not equally spaced: {found_mm:.3} mm between {a} and {b}, elsewhere \
         {step_mm:.3} mm{hint}"
    )]
    UnequalSteps {
        /// A file.
        a: String,
        /// The next file along the normal.
        b: String,
        /// Their distance along the normal, mm.
        found_mm: f64,
        /// Median step, mm.
        step_mm: f64,
        /// What can be done.
        hint: String,
    },
    /// The slices are not stacked along their normal.
    #[error(
        "the slices are shifted sideways (gantry tilt): the line through them leans {degrees:.2} degrees \
         from their normal, {file} lies {lateral_mm:.3} mm beside the normal through the first slice; \
         resample the series to an untilted grid first"
    )]
    Tilted {
        /// The slice that lies farthest aside.
        file: String,
        /// Angle of the line through the slices with their normal, degrees.
        degrees: f64,
        /// Its distance from the normal through the first slice, mm.
        lateral_mm: f64,
    },
    /// A slice does not lie above the others.
    #[error(
        "{file} lies {lateral_mm:.3} mm beside the line through the slices; is its position right?"
    )]
    Stray {
        /// The slice that lies farthest aside.
        file: String,
        /// Its distance from the line, mm.
        lateral_mm: f64,
    },
    /// The positions and spacings make no grid.
    #[error("the series has no usable grid: {0}")]
    Grid(#[from] supine_space::GridError),
    /// The values cannot be Hounsfield units.
    #[error("its values cannot be Hounsfield units: {reason}")]
    NotHounsfield {
        /// What speaks against it.
        reason: String,
    },
    /// The volume to be written does not lie on the grid of its source.
    #[error("the volume does not lie on the grid of its source series: {reason}")]
    OtherGrid {
        /// What differs.
        reason: String,
    },
    /// Regions that do not lie on the voxels of the CT.
    #[error("{file}: {reason}; resample it to the CT or export it on the CT's own grid")]
    OtherVoxels {
        /// The file.
        file: String,
        /// Which part lies where.
        reason: String,
    },
    /// A region of interest whose contours cannot be made voxels.
    #[error("{file}: the region {name:?}: {source}")]
    Contours {
        /// The file.
        file: String,
        /// Name of the region.
        name: String,
        /// What is wrong with its contours.
        source: supine_volume::ContourError,
    },
    /// A region of interest of which nothing is closed.
    #[error(
        "{file}: the region {name:?} is drawn as {lines} point(s), open line(s) or contours of unknown \
         type alone, which enclose nothing: close its contours (Contour Geometric Type CLOSED_PLANAR)"
    )]
    OpenContours {
        /// The file.
        file: String,
        /// Name of the region.
        name: String,
        /// How many points and lines it has.
        lines: usize,
    },
    /// A text that was to be written does not fit its attribute.
    #[error("{attribute} cannot be written: {reason}")]
    Text {
        /// Name of the attribute.
        attribute: &'static str,
        /// Why.
        reason: String,
    },
    /// The output cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The output folder holds something that an export would overwrite.
    #[error("{} holds other files and is left as it is; choose a new folder", path.display())]
    Occupied {
        /// The folder.
        path: PathBuf,
    },
    /// A written file does not read back as it was meant.
    #[error(
        "the written file {file} does not read back as it was meant: {reason}; nothing is left"
    )]
    ReadBack {
        /// The file.
        file: String,
        /// What differs.
        reason: String,
    },
    /// The user asked to stop.
    #[error(transparent)]
    Stopped(#[from] supine_space::Stopped),
}

impl Error {
    /// What kind of failure it is.
    pub fn kind(&self) -> Failure {
        match self {
            Self::Write { source, .. } => Failure::of_output(source),
            Self::Occupied { .. } | Self::ReadBack { .. } => Failure::Output,
            Self::Stopped(_) => Failure::Stopped,
            _ => Failure::Input,
        }
    }

    /// What is wrong, without the file.
    pub(crate) fn reason(&self) -> String {
        match self {
            Self::Malformed { reason, .. } => reason.clone(),
            Self::Attribute { attribute, reason, .. } => format!("{attribute} {reason}"),
            other => other.to_string(),
        }
    }

    /// An attribute of a file that cannot be used.
    pub(crate) fn attribute(
        file: &str,
        attribute: &'static str,
        reason: impl Into<String>,
    ) -> Self {
        Self::Attribute { file: file.to_owned(), attribute, reason: reason.into() }
    }
}

/// One line per series.
fn listed(series: &[SeriesSummary]) -> String {
    let mut text = String::new();
    for s in series {
        let _ = write!(text, "\n  {}  {} slices  {:?}", s.uid, s.slices, s.description);
    }
    text
}
