//! Texts that people write: case files and tables.

use std::io::{Error, ErrorKind};
use std::path::Path;

/// The text of a file.
///
/// # Errors
/// When it cannot be read, or is no UTF-8: with what it seems to be.
pub(crate) fn read_text(path: &Path) -> Result<String, Error> {
    let bytes = std::fs::read(path)?;
    let text = supine_space::from_file(&bytes);
    text.map(str::to_owned).map_err(|told| Error::new(ErrorKind::InvalidData, told))
}
