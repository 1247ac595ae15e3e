//! The tumour of a case that is begun.

use super::Init;
use crate::Error;
use crate::commands::{input, usage};
use crate::shared::drawn;
use std::path::PathBuf;
use supine_dicom::read_structures;
use supine_exchange::{NamedPoint, is_points_name, read_points};
use supine_space::{Point, Sphere};

/// What is known of the tumour.
#[derive(Debug)]
pub(super) enum Found {
    /// A region of a structure set.
    Region {
        /// Its name.
        name: String,
        /// The structure set.
        file: PathBuf,
        /// The sphere that it stands for.
        sphere: Sphere,
        /// The frame of reference it was drawn in.
        frame: String,
    },
    /// A point, and perhaps a radius.
    Place {
        /// LPS, mm.
        centre: Point,
        /// mm.
        radius: Option<f64>,
    },
    /// Nothing.
    Nothing,
}

impl Found {
    /// Whether nothing is left to fill in.
    pub(super) fn is_whole(&self) -> bool {
        matches!(self, Self::Region { .. } | Self::Place { radius: Some(_), .. })
    }

    /// Where it is, as far as that is known: a point has a radius of 1 mm.
    pub(super) fn sphere(&self) -> Result<Option<Sphere>, Error> {
        match self {
            Self::Region { sphere, .. } => Ok(Some(*sphere)),
            Self::Place { centre, radius } => {
                let sphere = Sphere::new(*centre, radius.unwrap_or(1.0));
                sphere.map(Some).map_err(|e| input(format!("the tumour: {e}")))
            }
            Self::Nothing => Ok(None),
        }
    }

    /// The frame of reference of a region.
    pub(super) fn frame_of_reference(&self) -> Option<&str> {
        match self {
            Self::Region { frame, .. } => Some(frame),
            Self::Place { .. } | Self::Nothing => None,
        }
    }
}

/// What the options say of the tumour.
pub(super) fn find(given: &Init) -> Result<Found, Error> {
    match (&given.structures, given.tumour.as_deref()) {
        (Some(file), name) => region(file, name.unwrap_or_default()),
        (None, Some(file)) if is_points_name(file.as_ref()) => {
            let points = read_points(file.as_ref()).map_err(|e| Error::file("--tumour", e))?;
            Ok(Found::Place { centre: only(&points)?.position, radius: given.radius })
        }
        (None, Some(name)) => Err(usage(format!(
            "--tumour {name:?} is no list of points (.csv, .mrk.json); with a region's name, --structures RS.dcm is needed"
        ))),
        (None, None) => Ok(Found::Nothing),
    }
}

fn region(file: &PathBuf, name: &str) -> Result<Found, Error> {
    if let Err(source) = std::fs::metadata(file) {
        return Err(Error::Missing { key: "--structures", path: file.clone(), source });
    }
    let structures = read_structures(file).map_err(Error::Dicom)?;
    if name.is_empty() {
        let names: Vec<String> =
            structures.rois().iter().map(|r| format!("{:?}", r.name)).collect();
        return Err(usage(format!("name the tumour's region with --tumour: {}", names.join(", "))));
    }
    // What is odd about its contours, `check` tells of the case that is written.
    let (sphere, frame) = drawn(&structures, name)?;
    Ok(Found::Region { name: name.into(), file: file.clone(), sphere, frame })
}

/// The point called tumour, or the only one.
fn only(points: &[NamedPoint]) -> Result<&NamedPoint, Error> {
    let named: Vec<_> =
        points.iter().filter(|point| point.name.eq_ignore_ascii_case("tumour")).collect();
    match (named.as_slice(), points) {
        ([one], _) => Ok(*one),
        ([], [one]) => Ok(one),
        _ => {
            let names: Vec<String> = points.iter().map(|p| format!("{:?}", p.name)).collect();
            Err(input(format!(
                "--tumour: the file holds {} points ({}), of which one alone must be called \"tumour\"",
                points.len(),
                names.join(", ")
            )))
        }
    }
}
