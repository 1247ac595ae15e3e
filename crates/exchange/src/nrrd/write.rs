//! Writing NRRD: attached, gzip, little endian, LPS, mm.

use crate::{
    Error,
    file::{self, COMPRESSION},
    scalar::{Sample, Scalar, write_samples},
};
use flate2::write::GzEncoder;
use std::{fmt::Write as _, path::Path};
use supine_space::{Grid, Progress};

/// What a voxel holds.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Axis {
    /// One value.
    Scalar,
    /// Three components, neighbours in memory.
    Vector,
    /// So many independent values, neighbours in memory: overlapping segments of 3D Slicer.
    List(usize),
}

/// Writes a volume; `samples` in the order of memory.
pub(crate) fn write<T: Sample>(
    path: &Path,
    grid: &Grid,
    axis: &Axis,
    keys: &[(String, String)],
    samples: impl Iterator<Item = T>,
    progress: Progress<'_>,
) -> Result<(), Error> {
    let header = header(grid, axis, keys, T::SCALAR);
    let count = grid.len()
        * match axis {
            Axis::Scalar => 1,
            Axis::Vector => 3,
            Axis::List(values) => *values,
        };
    file::write(path, |out| {
        std::io::Write::write_all(out, header.as_bytes())?;
        let mut gzip = GzEncoder::new(out, COMPRESSION);
        write_samples(&mut gzip, samples, count, progress)?;
        gzip.finish()?;
        Ok(())
    })
}

fn header(grid: &Grid, axis: &Axis, keys: &[(String, String)], scalar: Scalar) -> String {
    let [ni, nj, nk] = grid.size();
    let column = |a: usize| {
        let v = grid.direction().column(a) * grid.spacing()[a];
        format!("({},{},{})", plain(v[0]), plain(v[1]), plain(v[2]))
    };
    let (columns, origin) = ([0, 1, 2].map(column).join(" "), grid.origin());
    let (dimension, before, none, kind) = match axis {
        Axis::Scalar => (3, String::new(), "", ""),
        Axis::Vector => (4, "3 ".into(), "none ", "vector "),
        Axis::List(values) => (4, format!("{values} "), "none ", "list "),
    };
    let (x, y, z) = (plain(origin.x), plain(origin.y), plain(origin.z));
    let mut text = format!(
        "NRRD0004\n\
         # Complete NRRD file format specification at:\n\
         # http://teem.sourceforge.net/nrrd/format.html\n\
         type: {}\n\
         dimension: {dimension}\n\
         space: left-posterior-superior\n\
         sizes: {before}{ni} {nj} {nk}\n\
         space directions: {none}{columns}\n\
         kinds: {kind}domain domain domain\n",
        type_name(scalar)
    );
    if scalar.size() > 1 {
        text.push_str("endian: little\n");
    }
    text.push_str("encoding: gzip\n");
    // Writing to a String does not fail.
    let _ = writeln!(text, "space origin: ({x},{y},{z})");
    for (key, value) in keys {
        let value = value.replace('\\', "\\\\").replace('\n', "\\n").replace('\r', "");
        let _ = writeln!(text, "{key}:={value}");
    }
    text.push('\n');
    text
}

/// Negative zero is written as zero.
fn plain(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x }
}

fn type_name(scalar: Scalar) -> &'static str {
    match scalar {
        Scalar::I8 => "int8",
        Scalar::U8 => "uint8",
        Scalar::I16 => "int16",
        Scalar::U16 => "uint16",
        Scalar::I32 => "int32",
        Scalar::U32 => "uint32",
        Scalar::I64 => "int64",
        Scalar::U64 => "uint64",
        Scalar::F32 => "float",
        Scalar::F64 => "double",
    }
}
