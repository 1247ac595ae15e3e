//! Tables in CSV as spreadsheets write them.

use crate::Problem;
use supine_space::{from_file, separator};

/// The rows of a table with this head, in lower or upper case. Blanks round a cell are no part of
/// it; cells are parted as its head has them ([`separator`]).
///
/// # Errors
/// When it is no UTF-8, or has another head.
pub(crate) fn rows<'a>(bytes: &'a [u8], head: &[&str]) -> Result<csv::Reader<&'a [u8]>, Problem> {
    let text = from_file(bytes).map_err(|reason| Problem::Text { reason })?;
    let first = text.lines().next().unwrap_or_default();
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(separator(first))
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let headers = reader.headers().map_err(malformed)?;
    if !headers.iter().map(str::to_ascii_lowercase).eq(head.iter().copied()) {
        let columns: Vec<&str> = headers.iter().collect();
        let heading: String = columns.join(",").chars().take(60).collect();
        let reason = format!("`{heading}` instead of the heading `{}` (LPS, mm)", head.join(","));
        return Err(Problem::Line { line: 1, reason });
    }
    Ok(reader)
}

/// Whether the first line of a table is this head.
pub(crate) fn has_head(bytes: &[u8], head: &[&str]) -> bool {
    let first = bytes.split(|&b| b == b'\n').next().unwrap_or_default();
    rows(first, head).is_ok()
}

/// What is wrong with a line.
pub(crate) fn malformed(error: csv::Error) -> Problem {
    let line = error.position().map_or(0, csv::Position::line);
    Problem::Line { line, reason: error.to_string() }
}

/// The number of a row's line.
pub(crate) fn line_of(record: &csv::StringRecord) -> u64 {
    record.position().map_or(0, csv::Position::line)
}

/// A coordinate, mm.
///
/// # Errors
/// When it is no finite number.
pub(crate) fn coordinate(text: &str, line: u64) -> Result<f64, Problem> {
    let finite = text.parse().ok().filter(|c: &f64| c.is_finite());
    finite.ok_or_else(|| Problem::Line {
        line,
        reason: format!("`{text}` is not a coordinate in mm"),
    })
}
