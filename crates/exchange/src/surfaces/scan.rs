//! Surface scans: any points with or without normals and triangles, in a unit that no format tells.

use super::parse;
use crate::{Error, Problem, file};
use std::path::Path;
use supine_mesh::{Scan, ScanInfo};
use supine_space::{Point, Warning};

/// Unit of the lengths in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LengthUnit {
    /// mm.
    Millimetre,
    /// cm.
    Centimetre,
    /// m.
    Metre,
    /// 25.4 mm.
    Inch,
}

impl LengthUnit {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Millimetre, Self::Centimetre, Self::Metre, Self::Inch];

    /// How it is written: `mm`, `cm`, `m`, `inch`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Millimetre => "mm",
            Self::Centimetre => "cm",
            Self::Metre => "m",
            Self::Inch => "inch",
        }
    }

    /// Its length in mm.
    pub fn mm(self) -> f64 {
        match self {
            Self::Millimetre => 1.0,
            Self::Centimetre => 10.0,
            Self::Metre => 1000.0,
            Self::Inch => 25.4,
        }
    }
}

/// What was found in the file of a scan.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ScanFile {
    /// The unit of its lengths.
    pub unit: LengthUnit,
    /// Whether the unit was told from the size, since nobody said it.
    pub detected: bool,
    /// Diagonal of the box around its points without the outermost, mm.
    pub size_mm: f64,
    /// What became of its points, with all warnings.
    pub info: ScanInfo,
}

/// From corner to corner a scan of a torso measures so much, mm.
const TORSO_MM: std::ops::RangeInclusive<f64> = 150.0..=1500.0;
/// The share of the points beyond either end of the box that tells the size.
const OUTERMOST: f64 = 0.01;
/// So many points tell the size.
const SAMPLE: usize = 100_000;

/// Reads a surface scan (`.stl`, `.ply`, `.obj`): points in mm, in the frame of the file whatever
/// its comments say. Its lengths are in `unit`; without one they are mm or metres, by which of the
/// two makes it as large as a torso. Faces are not needed; normals are taken where the file has
/// them.
///
/// # Errors
/// When the name ends otherwise, the file cannot be read or is malformed, its size does not tell
/// the unit, or the points make no [`Scan`].
pub fn read_scan(path: &Path, unit: Option<LengthUnit>) -> Result<(Scan, ScanFile), Error> {
    let bytes = file::read(path)?;
    let parts = parse(path, &bytes).map_err(|p| p.of(path))?;
    // A scan may be large: what was read is not needed beside what is made of it.
    drop(bytes);
    scan(parts, unit).map_err(|p| p.of(path))
}

fn scan(parts: super::Parts, stated: Option<LengthUnit>) -> Result<(Scan, ScanFile), Problem> {
    let super::Parts { mut points, normals, triangles } = parts;
    let size = size(&points);
    let unit = match stated.or_else(|| detect(size)) {
        Some(unit) => unit,
        // Without points there is no size: the scan itself says so.
        None if size == 0.0 => LengthUnit::Millimetre,
        None => return Err(Problem::Unit { size }),
    };
    if unit != LengthUnit::Millimetre {
        points.iter_mut().for_each(|p| *p *= unit.mm());
    }
    let normals = (!normals.is_empty()).then_some(normals);
    let (scan, mut info) = Scan::new(points, normals, triangles)?;
    let size_mm = size * unit.mm();
    if !TORSO_MM.contains(&size_mm) {
        let text = format!(
            "the scan measures {size_mm:.0} mm from corner to corner in the stated unit ({}), where a torso has 150 to \
             1500 mm: is the unit right?",
            unit.name()
        );
        info.warnings.push(Warning::new("scan-size", text).value("mm", size_mm));
    }
    Ok((scan, ScanFile { unit, detected: stated.is_none(), size_mm, info }))
}

/// mm or metres, by the size in the unit of the file. Centimetres and inches are not guessed: a
/// torso of 40 cm is one of 15.7 inches, and either may be a small piece in mm.
fn detect(size: f64) -> Option<LengthUnit> {
    let fits = |unit: &LengthUnit| TORSO_MM.contains(&(size * unit.mm()));
    [LengthUnit::Millimetre, LengthUnit::Metre].into_iter().find(fits)
}

/// Diagonal of the box around the points without the outermost, nor those that are no places: not
/// finite, or the origin, which scanners write for holes.
fn size(points: &[Point]) -> f64 {
    let step = points.len().div_ceil(SAMPLE).max(1);
    let place = |p: &&Point| p.iter().all(|c| c.is_finite()) && **p != Point::origin();
    let places: Vec<&Point> = points.iter().step_by(step).filter(place).collect();
    let extent = |axis: usize| {
        let mut values: Vec<f64> = places.iter().map(|p| p[axis]).collect();
        values.sort_unstable_by(f64::total_cmp);
        let beyond = (OUTERMOST * values.len() as f64) as usize;
        match (values.get(beyond), values.iter().nth_back(beyond)) {
            (Some(low), Some(high)) => high - low,
            _ => 0.0,
        }
    };
    [0, 1, 2].map(extent).iter().map(|e| e * e).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests;
