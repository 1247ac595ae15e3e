//! Named points: CSV `name,x,y,z` (LPS, mm) and 3D Slicer markups.

use crate::{Error, Problem, file, markups, table};
use std::path::Path;
use supine_space::{Point, from_cell, to_cell};

/// A point with a name.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedPoint {
    /// Its name; need not be unique.
    pub name: String,
    /// Where it is, LPS, mm.
    pub position: Point,
}

/// Reads points from CSV (`.csv`, with the heading `name,x,y,z`; LPS, mm) or 3D Slicer markups
/// (`.mrk.json`; turned to LPS when they are in RAS, all lists one after the other).
///
/// # Errors
/// When the name ends otherwise, the file cannot be read or is malformed, or a coordinate is not
/// a finite number.
pub fn read_points(path: &Path) -> Result<Vec<NamedPoint>, Error> {
    let bytes = file::read(path)?;
    let points = if is_markups(path) {
        markups::parse(&bytes).map(|lists| lists.into_iter().flat_map(|l| l.points).collect())
    } else if file::has_suffix(path, ".csv") {
        parse_csv(&bytes)
    } else {
        Err(Problem::Format("points as .csv or .mrk.json"))
    };
    points.map_err(|p| p.of(path))
}

/// Writes points as CSV (`.csv`) or as 3D Slicer markups (`.mrk.json`); LPS, mm.
///
/// # Errors
/// When the name ends otherwise, a coordinate is not finite or the file cannot be written.
pub fn write_points(points: &[NamedPoint], path: &Path) -> Result<(), Error> {
    let refused = |reason| Error::Unwritable { path: path.into(), reason };
    if let Some(p) = points.iter().find(|p| !p.position.iter().all(|c| c.is_finite())) {
        return Err(refused(format!("the position of point `{}` is not finite", p.name)));
    }
    if is_markups(path) {
        let text = markups::compose(points).map_err(|e| refused(e.to_string()))?;
        file::write(path, |out| std::io::Write::write_all(out, text.as_bytes()))
    } else if file::has_suffix(path, ".csv") {
        file::write(path, |out| {
            let mut csv = csv::Writer::from_writer(out);
            csv.write_record(["name", "x", "y", "z"])?;
            for p in points {
                let [x, y, z] = [p.position.x, p.position.y, p.position.z].map(|c| c.to_string());
                csv.write_record([&*to_cell(&p.name), &x, &y, &z])?;
            }
            csv.flush()
        })
    } else {
        Err(refused("points are written as .csv or .mrk.json".into()))
    }
}

/// Whether a file's name is that of a list of points: `.csv` or `.mrk.json`, whatever the case.
pub fn is_points_name(path: &Path) -> bool {
    [".csv", ".mrk.json"].iter().any(|ending| file::has_suffix(path, ending))
}

pub(crate) fn is_markups(path: &Path) -> bool {
    file::has_suffix(path, ".json")
}

pub(crate) fn parse_csv(bytes: &[u8]) -> Result<Vec<NamedPoint>, Problem> {
    let mut points = Vec::new();
    for record in table::rows(bytes, &["name", "x", "y", "z"])?.records() {
        let record = record.map_err(table::malformed)?;
        let mut xyz = [0.0; 3];
        for (c, text) in xyz.iter_mut().zip(record.iter().skip(1)) {
            *c = table::coordinate(text, table::line_of(&record))?;
        }
        let name = from_cell(record.get(0).unwrap_or_default()).to_string();
        points.push(NamedPoint { name, position: xyz.into() });
    }
    Ok(points)
}

#[cfg(test)]
mod tests;
