//! Writing closed surfaces: binary STL, binary PLY, OBJ; LPS, mm, which a comment says as 3D Slicer
//! does.

use crate::{Error, file};
use std::io::{self, Write};
use std::path::Path;
use supine_mesh::TriSurface;

/// The comment by which 3D Slicer knows the frame.
const FRAME: &str = "supine. SPACE=LPS";

/// Writes a closed surface by the ending of the name: `.stl` (binary, single precision), `.ply`
/// (binary) or `.obj`; LPS, mm, and the file says so.
///
/// # Errors
/// When the name ends otherwise, there are 2^32 triangles or more, or the file cannot be written.
pub fn write_surface(surface: &TriSurface, path: &Path) -> Result<(), Error> {
    let refused = |reason: &str| Error::Unwritable { path: path.into(), reason: reason.into() };
    let Ok(count) = u32::try_from(surface.triangles().len()) else {
        return Err(refused("the surface has too many triangles"));
    };
    if file::has_suffix(path, ".stl") {
        file::write(path, |out| stl(surface, count, out))
    } else if file::has_suffix(path, ".ply") {
        file::write(path, |out| ply(surface, out))
    } else if file::has_suffix(path, ".obj") {
        file::write(path, |out| obj(surface, out))
    } else {
        Err(refused("surfaces are written as .stl, .ply or .obj"))
    }
}

fn stl(surface: &TriSurface, count: u32, out: &mut impl Write) -> io::Result<()> {
    let mut head = FRAME.as_bytes().to_vec();
    head.resize(80, b' ');
    out.write_all(&head)?;
    out.write_all(&count.to_le_bytes())?;
    for triangle in surface.triangles() {
        let [a, b, c] = triangle.map(|p| surface.points()[p as usize]);
        let normal = (b - a).cross(&(c - a));
        let normal = normal.try_normalize(0.0).unwrap_or(normal);
        for vector in [normal, a.coords, b.coords, c.coords] {
            for x in vector.iter() {
                // Adding 0 makes -0 the same as 0.
                out.write_all(&(*x as f32 + 0.0).to_le_bytes())?;
            }
        }
        out.write_all(&[0; 2])?;
    }
    Ok(())
}

fn ply(surface: &TriSurface, out: &mut impl Write) -> io::Result<()> {
    let (points, triangles) = (surface.points().len(), surface.triangles().len());
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment {FRAME}\nelement vertex {points}\n\
         property double x\nproperty double y\nproperty double z\nelement face {triangles}\n\
         property list uchar int vertex_indices\nend_header\n"
    )?;
    for x in surface.points().iter().flat_map(|p| p.iter()) {
        out.write_all(&x.to_le_bytes())?;
    }
    for triangle in surface.triangles() {
        out.write_all(&[3])?;
        for corner in triangle {
            out.write_all(&corner.to_le_bytes())?;
        }
    }
    Ok(())
}

fn obj(surface: &TriSurface, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "# {FRAME}")?;
    for p in surface.points() {
        writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
    }
    for [a, b, c] in surface.triangles().iter().map(|t| t.map(|p| p + 1)) {
        writeln!(out, "f {a} {b} {c}")?;
    }
    Ok(())
}
