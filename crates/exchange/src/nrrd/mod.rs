//! NRRD, "nearly raw raster data": a text header, a blank line, samples.
//!
//! Format: Kindlmann, "Definition of NRRD File Format",
//! <https://teem.sourceforge.net/nrrd/format.html>.

mod data;
mod geometry;
mod header;
mod write;

pub(crate) use write::{Axis, write};

use crate::{
    Problem,
    labels::segments,
    raster::{NOTES, Raster},
};
use header::Header;
use supine_space::Progress;

/// The volume of a NRRD file with attached data.
pub(crate) fn parse(bytes: &[u8], progress: Progress<'_>) -> Result<Raster, Problem> {
    let (header, data) = Header::parse(bytes)?;
    let scalar = header.scalar()?;
    let layout = geometry::layout(&header)?;
    let samples = layout.grid.len().checked_mul(layout.layers);
    let wanted = samples.and_then(|n| n.checked_mul(scalar.size()));
    let wanted = wanted.ok_or_else(|| Problem::field("sizes", "more samples than can be"))?;
    let stored = data::decode(&header, scalar, data, wanted, progress)?;
    Ok(Raster {
        grid: layout.grid,
        layers: layout.layers,
        layers_first: layout.layers_first,
        scalar: stored.scalar,
        big_endian: stored.big_endian,
        bytes: stored.bytes,
        slope: 1.0,
        intercept: 0.0,
        segments: segments::parse(&header.keys, layout.layers)?,
        note: note(&header),
        keys: header.keys,
    })
}

/// The words of the header, as a field or as a key.
fn note(header: &Header) -> String {
    let keys = NOTES.iter().filter_map(|name| header.keys.get(*name).map(String::as_str));
    keys.chain(header.field("content")).collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests;
