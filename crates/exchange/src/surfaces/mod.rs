//! Closed surfaces and surface scans: STL, PLY, OBJ.
//!
//! None of the three formats says its frame. 3D Slicer writes `SPACE=LPS` or `SPACE=RAS` into a
//! comment, which counts; without it whoever reads the file has to say. Polygons are cut into
//! triangles. Lengths of a closed surface must be mm. A scan has a frame and a unit of its own.

mod obj;
mod ply;
mod scan;
mod stl;
mod write;

pub use scan::{LengthUnit, ScanFile, read_scan};
pub use write::write_surface;

use crate::{Error, Problem, file};
use std::path::Path;
use supine_mesh::TriSurface;
use supine_space::{Point, Vector};

/// Which way the axes of a surface's coordinates point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfaceFrame {
    /// Left, posterior, superior.
    Lps,
    /// Right, anterior, superior.
    Ras,
}

impl SurfaceFrame {
    /// Its three letters.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lps => "LPS",
            Self::Ras => "RAS",
        }
    }
}

/// What a file holds, in its own frame and unit.
#[derive(Debug, Default)]
struct Parts {
    points: Vec<Point>,
    /// One for each point, of any length, zero where there is none; or none at all.
    normals: Vec<Vector>,
    triangles: Vec<[u32; 3]>,
}

/// So much of a file is searched for its frame: any header, little else.
const HEADER: usize = 4096;

/// Reads a closed surface (`.stl`, `.ply`, `.obj`), and the frame that the file says it is in; it
/// is handed out in LPS, mm, taken to be in `frame` where the file does not say.
///
/// # Errors
/// When the name ends otherwise, the file cannot be read or is malformed, or the surface breaks an
/// invariant of [`TriSurface`].
pub fn read_surface(
    path: &Path,
    frame: SurfaceFrame,
) -> Result<(TriSurface, Option<SurfaceFrame>), Error> {
    let bytes = file::read(path)?;
    let surface = said(&bytes).and_then(|said| {
        let Parts { mut points, triangles, .. } = parse(path, &bytes)?;
        if said.unwrap_or(frame) == SurfaceFrame::Ras {
            points.iter_mut().for_each(|p| (p.x, p.y) = (-p.x, -p.y));
        }
        Ok((TriSurface::new(points, triangles)?, said))
    });
    surface.map_err(|p| p.of(path))
}

/// What a file holds, by the ending of its name.
fn parse(path: &Path, bytes: &[u8]) -> Result<Parts, Problem> {
    if file::has_suffix(path, ".stl") {
        stl::parse(bytes)
    } else if file::has_suffix(path, ".ply") {
        ply::parse(bytes)
    } else if file::has_suffix(path, ".obj") {
        obj::parse(bytes)
    } else {
        Err(Problem::Format("a surface as .stl, .ply or .obj"))
    }
}

/// The frame that the file says it is in.
fn said(bytes: &[u8]) -> Result<Option<SurfaceFrame>, Problem> {
    let head = &bytes[..bytes.len().min(HEADER)];
    let says = |word: &[u8]| head.windows(word.len()).any(|w| w == word);
    match (says(b"SPACE=LPS"), says(b"SPACE=RAS")) {
        (true, true) => Err(Problem::field("SPACE", "is both LPS and RAS")),
        (true, false) => Ok(Some(SurfaceFrame::Lps)),
        (false, true) => Ok(Some(SurfaceFrame::Ras)),
        (false, false) => Ok(None),
    }
}

/// Cuts a polygon into triangles from its first corner on.
fn fan(corners: &[u32], triangles: &mut Vec<[u32; 3]>) {
    triangles.extend((2..corners.len()).map(|n| [corners[0], corners[n - 1], corners[n]]));
}

/// A coordinate of a text, by the line it stands in.
fn coordinate(word: Option<&str>, line: usize) -> Result<f64, Problem> {
    let word = word.unwrap_or_default();
    word.parse().map_err(|_| {
        let shown: String = word.chars().take(20).collect();
        Problem::Line { line: line as u64, reason: format!("`{shown}` is not a coordinate") }
    })
}

#[cfg(test)]
mod tests;
