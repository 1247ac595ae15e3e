//! What is told of a scan.

use supine_space::{Failure, Warning};

/// Where the normals of a scan come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NormalSource {
    /// The file has them.
    Given,
    /// From the triangles around each point, by their area.
    Triangles,
    /// From planes through the points near by.
    Neighbours,
}

/// What became of the points of a scan.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ScanInfo {
    /// Points that were given.
    pub points: usize,
    /// Points left out since they are not finite: holes, for most scanners.
    pub not_finite: usize,
    /// Points left out since another lies at the same place.
    pub duplicates: usize,
    /// Points left out since they lie in small pieces by themselves.
    pub islands: usize,
    /// Number of such pieces.
    pub pieces: usize,
    /// Where the normals come from.
    pub normals: NormalSource,
    /// Points whose normal is made from those around, since their own is missing.
    pub mended: usize,
    /// Share of the normals, as they came, that point away from the middle of the points.
    pub outwards: f64,
    /// Whether all normals are turned.
    pub turned: bool,
    /// What the user should know.
    pub warnings: Vec<Warning>,
}

impl ScanInfo {
    pub(super) fn of(points: usize) -> Self {
        Self {
            points,
            not_finite: 0,
            duplicates: 0,
            islands: 0,
            pieces: 0,
            normals: NormalSource::Given,
            mended: 0,
            outwards: 1.0,
            turned: false,
            warnings: vec![],
        }
    }

    pub(super) fn warn(
        &mut self,
        code: &'static str,
        text: impl Into<String>,
        value: (&'static str, f64),
    ) {
        self.warnings.push(Warning::new(code, text).value(value.0, value.1));
    }
}

/// Why a scan cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ScanError {
    /// Too few points to tell anything of a body.
    #[error("the scan has too few points: {found} of {given} can be used, 500 are needed")]
    TooFew {
        /// Points that can be used.
        found: usize,
        /// Points that were given.
        given: usize,
    },
    /// More points than indices.
    #[error("the scan has too many points: {0}; let it be thinned")]
    TooMany(usize),
    /// A normal is not of a point.
    #[error("the scan has {normals} normals for {points} points")]
    Normals {
        /// Number of normals.
        normals: usize,
        /// Number of points.
        points: usize,
    },
    /// An index leads nowhere.
    #[error("triangle {triangle} of the scan names point {point}, but there are only {points}")]
    Index {
        /// Which one.
        triangle: usize,
        /// The index.
        point: u32,
        /// Number of points.
        points: usize,
    },
    /// Points far from any body.
    #[error(
        "the points of the scan reach over {mm:.0} mm: some are not where the body is; remove them"
    )]
    TooLarge {
        /// Extent along an axis, mm.
        mm: f64,
    },
    /// No plane goes through points near each other.
    #[error("the points of the scan lie on a line: there is no surface")]
    Line,
}

impl ScanError {
    /// What kind of failure this is.
    pub fn kind(&self) -> Failure {
        Failure::Input
    }
}
