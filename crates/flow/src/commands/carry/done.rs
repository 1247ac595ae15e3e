//! What is told of what was carried.

use crate::commands::messages;
use serde::Serialize;
use std::path::PathBuf;
use supine_report::{CarriedRegion, Warning};

/// What was carried.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum CarryDone {
    /// Points.
    Points {
        /// The file.
        points: PathBuf,
        /// How many were moved.
        carried: usize,
        /// Names of those outside the modelled tissue, which stay.
        outside: Vec<String>,
    },
    /// Label maps.
    Labels {
        /// The file.
        out: PathBuf,
        /// Each label that is there or has a name.
        labels: Vec<LabelVolume>,
    },
    /// A dose.
    Dose(Box<DoseFacts>),
    /// A closed surface.
    Surface(SurfaceFacts),
    /// Contours.
    Contours {
        /// The file.
        out: PathBuf,
        /// Each structure that has contours.
        structures: Vec<ContoursFacts>,
        /// SOP Instance UID of a structure set.
        instance_uid: Option<String>,
        /// What the user must know.
        #[serde(serialize_with = "messages")]
        warnings: Vec<Warning>,
    },
    /// Segments of a DICOM segmentation.
    Segments {
        /// The file.
        out: PathBuf,
        /// Each segment.
        segments: Vec<SegmentVolume>,
        /// SOP Instance UID.
        instance_uid: String,
        /// What the user must know.
        #[serde(serialize_with = "messages")]
        warnings: Vec<Warning>,
    },
}

/// A label before and after.
#[derive(Clone, Debug, Serialize)]
pub struct LabelVolume {
    /// Which of several maps in one file.
    pub layer: usize,
    /// Its number.
    pub number: u16,
    /// The name that the file gives it.
    pub name: Option<String>,
    /// Volume in the CT, ml.
    pub before_ml: f64,
    /// Volume in the operating position, ml.
    pub after_ml: f64,
}

/// A segment before and after.
#[derive(Clone, Debug, Serialize)]
pub struct SegmentVolume {
    /// Its number.
    pub number: u16,
    /// Its name and volumes.
    #[serde(flatten)]
    pub region: CarriedRegion,
}

/// A dose before and after.
#[derive(Clone, Debug, Serialize)]
pub struct DoseFacts {
    /// The file.
    pub out: PathBuf,
    /// Largest dose, Gy.
    pub max_gy: [f64; 2],
    /// Σ dose x volume, Gy ml, without what is written into the air beside the skin.
    pub integral_gy_ml: [f64; 2],
    /// Σ dose x volume of all that is written, Gy ml: beside the skin the dose goes on from the
    /// tissue, so that it can be interpolated up to there.
    pub written_gy_ml: f64,
    /// Σ dose x mass, mJ; none without the CT.
    pub energy_mj: Option<[f64; 2]>,
    /// Mass within the grid of the dose, g; none without the CT.
    pub mass_g: Option<[f64; 2]>,
    /// How the density is found.
    pub density: &'static str,
    /// What was written as DICOM.
    pub dicom: Option<DicomDose>,
    /// What the user must know.
    #[serde(serialize_with = "messages")]
    pub warnings: Vec<Warning>,
}

/// An RT dose that was written.
#[derive(Clone, Debug, Serialize)]
pub struct DicomDose {
    /// Dose Type.
    #[serde(rename = "type")]
    pub dose_type: String,
    /// Dose Summation Type.
    pub summation: String,
    /// SOP Instance UID.
    pub instance_uid: String,
    /// Series Instance UID.
    pub series_uid: String,
    /// Step of the stored values, given and written, Gy.
    pub step_gy: [f64; 2],
    /// Largest difference of a dose that was read back, Gy.
    pub read_back_error_gy: f64,
}

/// A surface before and after.
#[derive(Clone, Debug, Serialize)]
pub struct SurfaceFacts {
    /// The file.
    pub out: PathBuf,
    /// Volume enclosed in the CT, ml.
    pub before_ml: f64,
    /// Volume enclosed in the operating position, ml.
    pub after_ml: f64,
    /// Points of the surface as given.
    pub points: usize,
    /// Those of them that moved.
    pub moved_points: usize,
    /// Points that were added on edges.
    pub added_points: usize,
    /// Largest displacement of a point, mm.
    pub max_displacement_mm: f64,
    /// What the user must know.
    #[serde(serialize_with = "messages")]
    pub warnings: Vec<Warning>,
}

/// The contours of a structure before and after.
#[derive(Clone, Debug, Serialize)]
pub struct ContoursFacts {
    /// Its name.
    pub name: String,
    /// Volume in the CT, ml.
    pub before_ml: f64,
    /// Volume in the operating position, ml.
    pub after_ml: f64,
    /// Whether any point moved; else the contours are as given.
    pub moved: bool,
    /// Largest displacement of a point, mm.
    pub max_displacement_mm: f64,
    /// Number of contours before and after.
    pub contours: [usize; 2],
}
