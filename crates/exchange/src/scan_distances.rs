//! Distances of a scan's points from surfaces: CSV `x,y,z,nx,ny,nz,breast,…` (LPS, mm).

use crate::{Error, Problem, file};
use std::path::Path;
use supine_mesh::{ScanDistances, SurfaceDistances};
use supine_space::{Point, Vector};

/// Columns before those of the surfaces.
const HEADING: [&str; 7] = ["x", "y", "z", "nx", "ny", "nz", "breast"];
/// How the columns of the surfaces end.
const UNIT: &str = "_mm";

/// Writes them (`.csv`), lengths and normals to three decimals, with a column `NAME_mm` for each
/// surface, empty where a point has no distance.
///
/// # Errors
/// When the file cannot be written.
pub fn write_scan_distances(all: &ScanDistances, path: &Path) -> Result<(), Error> {
    file::write(path, |out| {
        let mut csv = csv::Writer::from_writer(out);
        let names = all.surfaces.iter().map(|surface| format!("{}{UNIT}", surface.name));
        csv.write_record(HEADING.into_iter().map(String::from).chain(names))?;
        for (n, (p, normal)) in all.places.iter().zip(&all.normals).enumerate() {
            let lengths = p.coords.iter().chain(normal.iter()).map(|x| format!("{x:.3}"));
            let breast = u8::from(all.breast[n]).to_string();
            let of = |s: &SurfaceDistances| s.mm[n].map_or(String::new(), |mm| format!("{mm:.3}"));
            csv.write_record(lengths.chain([breast]).chain(all.surfaces.iter().map(of)))?;
        }
        csv.flush()
    })
}

/// Reads what [`write_scan_distances`] wrote.
///
/// # Errors
/// When the file cannot be read or is malformed.
pub fn read_scan_distances(path: &Path) -> Result<ScanDistances, Error> {
    let bytes = file::read(path)?;
    parse(&bytes).map_err(|p| p.of(path))
}

fn parse(bytes: &[u8]) -> Result<ScanDistances, Problem> {
    let mut reader = csv::Reader::from_reader(bytes);
    let line = |e: csv::Error| {
        let line = e.position().map_or(0, csv::Position::line);
        Problem::Line { line, reason: e.to_string() }
    };
    let heading = reader.headers().map_err(line)?.clone();
    if !heading.iter().take(HEADING.len()).eq(HEADING) {
        let reason = format!("the heading does not begin with `{}`", HEADING.join(","));
        return Err(Problem::Line { line: 1, reason });
    }
    let names = heading.iter().skip(HEADING.len());
    let surface = |name: &str| SurfaceDistances {
        name: name.strip_suffix(UNIT).unwrap_or(name).into(),
        mm: Vec::new(),
    };
    let mut all = ScanDistances { surfaces: names.map(surface).collect(), ..Default::default() };
    for record in reader.records() {
        let record = record.map_err(line)?;
        add(&mut all, &record).ok_or_else(|| {
            let line = record.position().map_or(0, csv::Position::line);
            Problem::Line { line, reason: "a field is not a number".into() }
        })?;
    }
    Ok(all)
}

/// Adds the point of a row; none where a field is not a number.
fn add(all: &mut ScanDistances, record: &csv::StringRecord) -> Option<()> {
    let number = |text: &str| text.parse().ok().filter(|x: &f64| x.is_finite());
    let mut six = [0.0; 6];
    for (value, text) in six.iter_mut().zip(record.iter()) {
        *value = number(text)?;
    }
    let [x, y, z, nx, ny, nz] = six;
    all.places.push(Point::new(x, y, z));
    all.normals.push(Vector::new(nx, ny, nz));
    all.breast.push(record.get(6)? == "1");
    for (surface, text) in all.surfaces.iter_mut().zip(record.iter().skip(HEADING.len())) {
        let mm = if text.is_empty() { None } else { Some(number(text)?) };
        surface.mm.push(mm);
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_comes_back() {
        let surface = |name: &str, mm| SurfaceDistances { name: name.into(), mm };
        let all = ScanDistances {
            places: vec![Point::new(1.23456, -2.0, 1e3), Point::new(0.1 + 0.2, 0.0, -0.0004)],
            normals: vec![Vector::x(), Vector::new(0.6, 0.8, 0.0)],
            breast: vec![true, false],
            surfaces: vec![
                surface("ct", vec![Some(-1.0 / 3.0), None]),
                surface("fitted", vec![None, Some(2.0)]),
            ],
        }
        .rounded();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scan.csv");
        write_scan_distances(&all, &path).unwrap();
        assert_eq!(read_scan_distances(&path).unwrap(), all);
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.starts_with("x,y,z,nx,ny,nz,breast,ct_mm,fitted_mm\n1.235,"), "{text}");
        for wrong in ["x,y\n1,2\n", "x,y,z,nx,ny,nz,breast\n1,2,3,4,5,inf,1\n"] {
            std::fs::write(&path, wrong).unwrap();
            assert!(read_scan_distances(&path).is_err(), "{wrong}");
        }
    }
}
