//! Files that are not part of the series that was read.

use std::fmt;

/// A file that is not part of the series that was read.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct LeftOut {
    /// Path below the folder that was given.
    pub file: String,
    /// Why it was left out.
    pub reason: LeftOutReason,
}

/// Why a file was left out.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LeftOutReason {
    /// A DICOM object of another kind: the name of its SOP class.
    OtherObject(String),
    /// Not a DICOM file: what it is instead.
    NotDicom(&'static str),
    /// A DICOM file that is damaged or does not say what it is: what is wrong.
    Damaged(String),
    /// A DICOM file whose header names another object than its data set.
    TwoNames,
    /// A localizer (scout image) of the series.
    Localizer,
    /// A localizer of another series.
    LocalizerOfAnotherSeries,
    /// A CT image of another series.
    ImageOfAnotherSeries,
    /// The user asked for it.
    Asked,
}

impl fmt::Display for LeftOutReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::OtherObject(text) | Self::Damaged(text) => text,
            Self::NotDicom(text) => text,
            Self::TwoNames => "its file header names another object than its data set",
            Self::Localizer => "localizer",
            Self::LocalizerOfAnotherSeries => "localizer of another series",
            Self::ImageOfAnotherSeries => "CT image of another series",
            Self::Asked => "left out as asked",
        })
    }
}

/// As its text.
impl serde::Serialize for LeftOutReason {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}
