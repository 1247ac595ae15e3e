//! Numbers in a table with a header: comma-separated values.

use csv::{ErrorKind, Position, ReaderBuilder, StringRecord, Trim};

/// Why a table could not be read.
#[derive(Debug, thiserror::Error, PartialEq)]
#[non_exhaustive]
pub enum TableError {
    /// A column that is needed is not there, or more than once.
    #[error(
        "the header has the column `{name}` {times} times: it must name it once, with commas between the columns"
    )]
    Column {
        /// Its name.
        name: &'static str,
        /// How often it is there.
        times: usize,
    },
    /// A line is longer or shorter than the header.
    #[error(
        "line {line} has {fields} fields and the header has {header}: give each column a value"
    )]
    Fields {
        /// Counted from 1, the header included.
        line: u64,
        /// Fields of the line.
        fields: u64,
        /// Fields of the header.
        header: u64,
    },
    /// A field is no number.
    #[error(
        "line {line}: `{text}` in the column `{column}` is not a finite number: write it as 12.5, or take the line out"
    )]
    Number {
        /// Counted from 1, the header included.
        line: u64,
        /// The column.
        column: &'static str,
        /// What stands there, as far as it can be shown.
        text: String,
    },
    /// The table is broken otherwise.
    #[error("not a table of comma-separated values: {0}")]
    Broken(String),
}

/// A line of a table.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Line<const N: usize> {
    /// Counted from 1, the header included.
    pub(crate) number: u64,
    /// What stands in the column of the label; empty if none was asked for.
    pub(crate) label: String,
    /// The numbers in the order of the columns that were asked for; finite.
    pub(crate) values: [f64; N],
}

/// The lines of a table: a label, if one is asked for, and the numbers in these columns. Other
/// columns are passed over.
///
/// # Errors
/// When the header lacks a column or has it twice, a line has another number of fields, or a field
/// is no finite number.
pub(crate) fn read<const N: usize>(
    text: &str,
    label: Option<&'static str>,
    columns: [&'static str; N],
) -> Result<Vec<Line<N>>, TableError> {
    let text = text.trim_start_matches('\u{feff}');
    let mut reader = ReaderBuilder::new().trim(Trim::All).from_reader(text.as_bytes());
    let header = reader.headers().map_err(|error| TableError::Broken(error.to_string()))?.clone();
    let label = label.map(|name| place(&header, name)).transpose()?;
    let mut places = [0; N];
    for (found, name) in places.iter_mut().zip(columns) {
        *found = place(&header, name)?;
    }
    let mut lines = Vec::new();
    let mut count = Count { text: text.as_bytes(), byte: 0, line: 1 };
    for record in reader.records() {
        let record = record.map_err(|error| wrong(&error, &mut count))?;
        let number = count.line_of(record.position());
        let field = |place: usize| record.get(place).unwrap_or_default();
        let mut values = [0.0; N];
        for ((value, place), column) in values.iter_mut().zip(places).zip(columns) {
            *value = finite(field(place)).ok_or_else(|| TableError::Number {
                line: number,
                column,
                text: field(place).chars().take(40).collect(),
            })?;
        }
        let label = label.map_or("", field).to_string();
        lines.push(Line { number, label, values });
    }
    Ok(lines)
}

/// Where a column stands.
fn place(header: &StringRecord, name: &'static str) -> Result<usize, TableError> {
    let mut places = header.iter().enumerate().filter(|(_, field)| *field == name);
    match (places.next(), places.count()) {
        (Some((place, _)), 0) => Ok(place),
        (None, _) => Err(TableError::Column { name, times: 0 }),
        (Some(_), more) => Err(TableError::Column { name, times: more + 1 }),
    }
}

fn finite(text: &str) -> Option<f64> {
    text.parse().ok().filter(|value: &f64| value.is_finite())
}

/// Counts lines. The reader's own count lags behind after empty lines and where lines end with CR
/// LF.
struct Count<'a> {
    text: &'a [u8],
    /// Up to here the lines are counted.
    byte: usize,
    line: u64,
}

impl Count<'_> {
    /// The line of a record, which begins after the ends of lines at its position.
    fn line_of(&mut self, position: Option<&Position>) -> u64 {
        let begin = position.and_then(|position| usize::try_from(position.byte()).ok());
        while let Some(byte) = self.text.get(self.byte)
            && (begin.is_some_and(|begin| self.byte < begin) || matches!(byte, b'\r' | b'\n'))
        {
            self.line += u64::from(*byte == b'\n');
            self.byte += 1;
        }
        self.line
    }
}

fn wrong(error: &csv::Error, count: &mut Count<'_>) -> TableError {
    match error.kind() {
        ErrorKind::UnequalLengths { pos, expected_len, len } => TableError::Fields {
            line: count.line_of(pos.as_ref()),
            fields: *len,
            header: *expected_len,
        },
        _ => TableError::Broken(error.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_found_by_name() {
        let text = "\u{feff}z, name,x\r\n3,a , 1\r\n\r\n6e1,b,-4.5\r\n";
        let lines = read(text, Some("name"), ["x", "z"]).unwrap();
        let values: Vec<_> = lines.iter().map(|l| (l.label.as_str(), l.values)).collect();
        assert_eq!(values, [("a", [1.0, 3.0]), ("b", [-4.5, 60.0])]);
        assert_eq!(lines[0].number, 2);
        assert_eq!(lines[1].number, 4, "the line after an empty one");
    }

    #[test]
    fn each_fault_is_named_with_its_line() {
        let refused = |text: &str| read(text, None, ["x", "y"]).unwrap_err().to_string();
        assert!(refused("").contains("`x` 0 times"));
        assert!(refused("x;y\n1;2").contains("`x` 0 times"));
        assert!(refused("x,y,y\n1,2,3").contains("`y` 2 times"));
        let short = refused("x,y\n1,2\n\n3\n");
        assert!(short.contains("line 4 has 1 fields"), "{short}");
        let short = refused("x,y\r\n1,2\r\n\r\n3\r\n");
        assert!(short.contains("line 4 has 1 fields"), "{short}");
        for wrong in ["", "1,", "nan", "inf", "1e999", "0x1", "1.2.3"] {
            let text = refused(&format!("x,y\n1,2\n\"{wrong}\",2"));
            assert!(text.contains("line 3") && text.contains("column `x`"), "{text}");
        }
    }

    #[test]
    fn no_text_makes_it_panic() {
        let pieces = ["x", "y", ",", "\n", "\"", "\r", "1", "-", "\0", "é", " ", "x,y\n"];
        let mut draws = crate::trajectory::SplitMix::new(3);
        for _ in 0..5_000 {
            let count = (draws.even() * 20.0) as usize;
            let piece = |_| pieces[(draws.even() * pieces.len() as f64) as usize];
            let text: String = (0..count).map(piece).collect();
            if let Ok(lines) = read(&text, None, ["x", "y"]) {
                assert!(lines.iter().all(|l| l.values.iter().all(|v| v.is_finite())));
            }
        }
    }
}
