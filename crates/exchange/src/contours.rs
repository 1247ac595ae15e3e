//! Planar contours: CSV `structure,contour,x,y,z` (LPS, mm).
//!
//! One row per corner, in order; the contour is closed from its last corner to its first. Rows that
//! follow each other with the same structure and contour number are one contour.

use crate::{Error, Problem, file, table};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use supine_space::{Point, from_cell, to_cell};
use supine_volume::Rule;

const HEADING: [&str; 5] = ["structure", "contour", "x", "y", "z"];

/// A structure drawn as closed planar contours.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedContours {
    /// Its name.
    pub name: String,
    /// Corners of each contour, LPS, mm.
    pub contours: Vec<Vec<Point>>,
    /// How contours of one plane go together; a CSV does not say it.
    pub rule: Rule,
}

/// Whether a file is a CSV of contours, by its first line.
///
/// # Errors
/// When it cannot be read.
pub fn is_contours(path: &Path) -> Result<bool, Error> {
    if !file::has_suffix(path, ".csv") {
        return Ok(false);
    }
    Ok(table::has_head(&file::read(path)?, &HEADING))
}

/// Reads contours from CSV with the heading `structure,contour,x,y,z`; LPS, mm.
///
/// # Errors
/// When the file cannot be read or is malformed, or a coordinate is not a finite number.
pub fn read_contours(path: &Path) -> Result<Vec<NamedContours>, Error> {
    parse(&file::read(path)?).map_err(|p| p.of(path))
}

fn parse(bytes: &[u8]) -> Result<Vec<NamedContours>, Problem> {
    let mut structures: Vec<NamedContours> = Vec::new();
    // Of each name: a file may hold as many names as rows.
    let mut places: BTreeMap<String, usize> = BTreeMap::new();
    let mut last: Option<(usize, String)> = None;
    let mut begun: BTreeSet<(usize, String)> = BTreeSet::new();
    let mut resumed = None;
    for record in table::rows(bytes, &HEADING)?.records() {
        let record = record.map_err(table::malformed)?;
        let line = table::line_of(&record);
        let mut xyz = [0.0; 3];
        for (c, text) in xyz.iter_mut().zip(record.iter().skip(2)) {
            *c = table::coordinate(text, line)?;
        }
        let (name, number) = (from_cell(&record[0]), &record[1]);
        let at = places.get(name).copied().unwrap_or_else(|| {
            places.insert(name.to_owned(), structures.len());
            let (name, rule) = (name.into(), Rule::default());
            structures.push(NamedContours { name, contours: vec![], rule });
            structures.len() - 1
        });
        let contours = &mut structures[at].contours;
        let goes_on = last.as_ref().is_some_and(|(s, n)| *s == at && n == number);
        if !goes_on {
            contours.push(vec![]);
            last = Some((at, number.into()));
            if !begun.insert((at, number.into())) {
                resumed = resumed.or(Some(line));
            }
        }
        if let Some(contour) = contours.last_mut() {
            contour.push(xyz.into());
        }
    }
    let is_cut = |contour: &Vec<Point>| contour.len() < 3;
    match resumed {
        // A number may come again, in another plane: then each of its contours is whole.
        Some(line) if structures.iter().any(|s| s.contours.iter().any(is_cut)) => {
            let reason = "it goes on with a contour that other rows interrupted: rows of one contour have to \
                          follow each other";
            Err(Problem::Line { line, reason: reason.into() })
        }
        _ => Ok(structures),
    }
}

/// Writes contours as CSV with the heading `structure,contour,x,y,z`; contours are counted from 1
/// in each structure; LPS, mm, to 0.0001 mm.
///
/// # Errors
/// When the name does not end in `.csv` or the file cannot be written.
pub fn write_contours(structures: &[NamedContours], path: &Path) -> Result<(), Error> {
    if !file::has_suffix(path, ".csv") {
        let reason = "contours are written as .csv".into();
        return Err(Error::Unwritable { path: path.into(), reason });
    }
    file::write(path, |out| {
        let mut csv = csv::Writer::from_writer(out);
        csv.write_record(HEADING)?;
        for structure in structures {
            for (n, contour) in structure.contours.iter().enumerate() {
                let number = (n + 1).to_string();
                for p in contour {
                    let [x, y, z] = [p.x, p.y, p.z].map(|c| format!("{c:.4}"));
                    csv.write_record([&*to_cell(&structure.name), &number, &x, &y, &z])?;
                }
            }
        }
        csv.flush()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn structures_and_contours_are_told_apart() {
        let text = b"structure,contour,x,y,z\nA,1,0,0,0\nA,1,1,0,0\n=B,1,5,5,5\nA,2,1,2,3\n";
        let read = parse(text).unwrap();
        let sizes: Vec<Vec<usize>> =
            read.iter().map(|s| s.contours.iter().map(Vec::len).collect()).collect();
        assert_eq!(sizes, [vec![2, 1], vec![1]]);
        assert_eq!((read[0].name.as_str(), read[0].contours[1][0]), ("A", [1.0, 2.0, 3.0].into()));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("c.csv");
        write_contours(&read, &path).unwrap();
        assert!(is_contours(&path).unwrap());
        assert!(std::fs::read_to_string(&path).unwrap().contains("\n'=B,1,"));
        assert_eq!(read_contours(&path).unwrap(), read);
    }

    #[test]
    fn as_many_structures_as_rows_are_read_by_name() {
        // Each row was compared with every name before it: minutes for this file.
        let rows = (0..200_000).map(|n| format!("S{},{n},{n},0,0\n", n % 150_000));
        let text = format!("structure,contour,x,y,z\n{}", rows.collect::<String>());
        let read = parse(text.as_bytes()).unwrap();
        assert_eq!(read.len(), 150_000);
        let sizes = [0, 49_999, 50_000].map(|n| read[n].contours.len());
        assert_eq!((sizes, read[7].contours[1][0].x), ([2, 2, 1], 150_007.0));
    }

    #[test]
    fn what_is_no_contour_is_refused_by_line() {
        let line = |text: &[u8]| match parse(text) {
            Err(Problem::Line { line, .. }) => line,
            other => panic!("{other:?}"),
        };
        assert_eq!(line(b"name,x,y,z\na,1,2,3\n"), 1);
        assert_eq!(line(b"structure,contour,x,y,z\nA,1,0,0,0\nA,1,0,nan,0\n"), 3);
        assert_eq!(line(b"structure,contour,x,y,z\nA,1,0,0\n"), 2);
        let turns = b"structure,contour,x,y,z\nA,1,0,0,0\nB,1,5,0,0\nA,1,1,0,0\nB,1,6,0,0\n";
        assert_eq!(line(turns), 4);
    }
}
