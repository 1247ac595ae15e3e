//! Pictures as PNG files.

use crate::Error;
use crate::pictures::{Part, Picture, Row};
use crate::tables::Table;
use rayon::prelude::*;
use supine_space::Progress;

/// A row with its pictures as PNG files.
#[derive(Debug)]
pub(crate) struct EncodedRow {
    pub(crate) title: String,
    pub(crate) text: String,
    pub(crate) pair: bool,
    pub(crate) part: Part,
    pub(crate) pictures: Vec<EncodedPicture>,
    pub(crate) table: Option<Table>,
}

/// A picture as a PNG file.
#[derive(Debug)]
pub(crate) struct EncodedPicture {
    pub(crate) name: String,
    pub(crate) caption: String,
    pub(crate) png: Vec<u8>,
    pub(crate) width: usize,
    pub(crate) height: usize,
}

/// The pictures of all rows as PNG files.
pub(crate) fn encoded(rows: Vec<Row>, progress: Progress<'_>) -> Result<Vec<EncodedRow>, Error> {
    let encode = |picture: Picture| {
        let Picture { name, caption, canvas } = picture;
        let png = canvas.png().map_err(|source| Error::Picture { name: name.clone(), source })?;
        Ok(EncodedPicture { name, caption, png, width: canvas.width(), height: canvas.height() })
    };
    let count = rows.len() as f64;
    let row = |(n, row): (usize, Row)| {
        progress.at(n as f64 / count)?;
        let Row { title, text, pair, part, pictures, table } = row;
        let pictures = pictures.into_par_iter().map(encode).collect::<Result<_, Error>>()?;
        Ok(EncodedRow { title, text, pair, part, pictures, table })
    };
    rows.into_par_iter().enumerate().map(row).collect()
}
