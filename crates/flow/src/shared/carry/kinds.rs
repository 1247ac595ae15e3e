//! What a case may want carried.

use std::path::PathBuf;

/// The kinds of the objects that a case can name, in the order in which they are carried.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub enum CarriedKind {
    /// RT doses.
    Dose,
    /// RT structure sets.
    Structures,
    /// Segmentations.
    Segmentation,
}

impl CarriedKind {
    /// All, in the order in which they are carried.
    pub const ALL: [Self; 3] = [Self::Dose, Self::Structures, Self::Segmentation];

    /// Name in the summary and in names of files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Dose => "dose",
            Self::Structures => "structures",
            Self::Segmentation => "segmentation",
        }
    }

    /// The key of the case file.
    pub fn key(self) -> &'static str {
        match self {
            Self::Dose => "carry.dose",
            Self::Structures => "carry.structures",
            Self::Segmentation => "carry.segmentation",
        }
    }
}

/// An object that a case names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CarriedFile {
    /// What it is.
    pub kind: CarriedKind,
    /// Where it is.
    pub path: PathBuf,
}
