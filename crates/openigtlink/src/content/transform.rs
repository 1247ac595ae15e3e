//! TRANSFORM: f32 x 12, the columns of a 3 x 4 matrix one after the other.

use crate::error::Refusal;
use crate::reader::{Reader, put_f32s};

/// A 3 x 4 matrix by rows: rotation in the first three columns, translation (mm) in the last.
/// On the wire it goes column by column.
pub type Rows = [[f32; 4]; 3];

/// Reads a TRANSFORM: 48 bytes.
pub(crate) fn read(bytes: &[u8]) -> Result<Rows, Refusal> {
    let mut reader =
        Reader::new(bytes, "a TRANSFORM has 48 bytes: the 12 f32 of a 3 x 4 matrix, by columns");
    let rows = read_rows(&mut reader)?;
    reader.end()?;
    Ok(rows)
}

/// Reads 12 f32, column by column.
pub(crate) fn read_rows(reader: &mut Reader<'_>) -> Result<Rows, Refusal> {
    let mut rows = Rows::default();
    for column in 0..4 {
        let values = reader.f32s::<3>()?;
        for (row, value) in rows.iter_mut().zip(values) {
            row[column] = value;
        }
    }
    Ok(rows)
}

/// Adds 12 f32, column by column.
pub(crate) fn put(out: &mut Vec<u8>, rows: &Rows) {
    for column in 0..4 {
        put_f32s(out, &rows.map(|row| row[column]));
    }
}
