//! Writing MetaImage: one file, zlib, little endian, LPS, mm.

use super::geometry;
use crate::{
    Error,
    file::{self, COMPRESSION},
    scalar::{Sample, Scalar, write_samples},
};
use flate2::write::ZlibEncoder;
use std::{io::Write, path::Path};
use supine_space::{Grid, Progress};

/// Writes a volume of `channels` values per voxel, neighbours in memory; `note` goes to `Comment`.
///
/// The compressed samples are held in memory: their length stands ahead of them.
pub(crate) fn write<T: Sample>(
    path: &Path,
    (grid, channels): (&Grid, usize),
    note: &str,
    samples: impl Iterator<Item = T>,
    progress: Progress<'_>,
) -> Result<(), Error> {
    file::write(path, |out| {
        let mut zlib = ZlibEncoder::new(Vec::new(), COMPRESSION);
        write_samples(&mut zlib, samples, grid.len() * channels, progress)?;
        let stored = zlib.finish()?;
        out.write_all(header((grid, channels), T::SCALAR, note, stored.len()).as_bytes())?;
        out.write_all(&stored)
    })
}

fn header((grid, channels): (&Grid, usize), scalar: Scalar, note: &str, stored: usize) -> String {
    let mut text = String::from("ObjectType = Image\nNDims = 3\n");
    if !note.is_empty() {
        // A value ends with its line.
        text += &format!("Comment = {}\n", note.replace(['\n', '\r'], " "));
    }
    text += &format!(
        "BinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = True\nCompressedDataSize = {stored}\n"
    );
    text += &geometry::lines(grid);
    if channels > 1 {
        text += &format!("ElementNumberOfChannels = {channels}\n");
    }
    text + &format!("ElementType = {}\nElementDataFile = LOCAL\n", type_name(scalar))
}

fn type_name(scalar: Scalar) -> &'static str {
    match scalar {
        Scalar::I8 => "MET_CHAR",
        Scalar::U8 => "MET_UCHAR",
        Scalar::I16 => "MET_SHORT",
        Scalar::U16 => "MET_USHORT",
        Scalar::I32 => "MET_INT",
        Scalar::U32 => "MET_UINT",
        Scalar::I64 => "MET_LONG_LONG",
        Scalar::U64 => "MET_ULONG_LONG",
        Scalar::F32 => "MET_FLOAT",
        Scalar::F64 => "MET_DOUBLE",
    }
}
