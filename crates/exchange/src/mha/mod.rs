//! MetaImage (`.mha`; `.mhd` with the samples in another file).
//!
//! A text header of lines `Key = Value` that ends with `ElementDataFile`, then samples, plain or as
//! a zlib stream. Positions are LPS, mm, as ITK takes them: `AnatomicalOrientation` is what
//! somebody calls the axes and decides nothing. Format: MetaIO documentation,
//! <https://itk.org/Wiki/MetaIO/Documentation>, and `metaImage.cxx` of ITK.

mod geometry;
mod header;
mod read;
mod write;

pub(crate) use header::is_meta_image;
pub(crate) use read::{data_file, parse};
pub(crate) use write::write;

#[cfg(test)]
mod tests;
