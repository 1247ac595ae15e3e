//! The samples that follow a NRRD header.

use super::header::Header;
use crate::{Problem, file, scalar::Scalar};
use supine_space::Progress;

/// Samples as bytes of one type.
#[derive(Debug)]
pub(super) struct Stored {
    pub(super) scalar: Scalar,
    pub(super) big_endian: bool,
    pub(super) bytes: Vec<u8>,
}

/// The samples, exactly `wanted` bytes of type `scalar` (or doubles, when they are text).
pub(super) fn decode(
    header: &Header,
    scalar: Scalar,
    data: &[u8],
    wanted: usize,
    progress: Progress<'_>,
) -> Result<Stored, Problem> {
    for name in ["data file", "datafile"] {
        if let Some(file) = header.field(name) {
            let what = format!("a NRRD header whose data are in another file (`{file}`)");
            let advice = "save it with attached data (.nrrd instead of .nhdr)";
            return Err(Problem::Unsupported { what, advice });
        }
    }
    let encoding = header.required("encoding")?.to_ascii_lowercase();
    let data = skip_lines(data, header.skip(["line skip", "lineskip"])?)?;
    let skip = header.skip(["byte skip", "byteskip"])?;
    let text = matches!(encoding.as_str(), "txt" | "text" | "ascii");
    let big_endian = !text && big_endian(header, scalar)?;
    let bytes = match encoding.as_str() {
        "raw" => exact(skip_bytes(data.to_vec(), skip, wanted)?, wanted)?,
        "gz" | "gzip" if skip >= 0 => {
            let ahead = usize::try_from(skip).unwrap_or(usize::MAX);
            let (bytes, more) = file::gunzip(data, wanted.saturating_add(ahead), progress)?;
            if more > 0 {
                return Err(Problem::Excess { wanted });
            }
            exact(skip_bytes(bytes, skip, wanted)?, wanted)?
        }
        "gz" | "gzip" => {
            return Err(Problem::field("byte skip", "is below 0, which only raw data allow"));
        }
        _ if text => {
            let bytes = numbers(data, wanted / scalar.size())?;
            return Ok(Stored { scalar: Scalar::F64, big_endian, bytes });
        }
        other => {
            let what = format!("the NRRD encoding `{other}`");
            let advice = "save the file with encoding raw, gzip or ascii";
            return Err(Problem::Unsupported { what, advice });
        }
    };
    Ok(Stored { scalar, big_endian, bytes })
}

fn big_endian(header: &Header, scalar: Scalar) -> Result<bool, Problem> {
    match header.field("endian").map(str::to_ascii_lowercase).as_deref() {
        Some("little") => Ok(false),
        Some("big") => Ok(true),
        None if scalar.size() == 1 => Ok(false),
        None => Err(Problem::field("endian", "is missing for samples of several bytes")),
        Some(other) => {
            Err(Problem::field("endian", format!("`{other}` is neither little nor big")))
        }
    }
}

fn skip_lines(mut data: &[u8], lines: i64) -> Result<&[u8], Problem> {
    for _ in 0..lines {
        match data.iter().position(|&b| b == b'\n') {
            Some(end) => data = &data[end + 1..],
            None => return Err(Problem::field("line skip", "leads beyond the end of the file")),
        }
    }
    Ok(data)
}

/// Leaves out `skip` bytes at the start; -1: all but the last `wanted`.
fn skip_bytes(mut bytes: Vec<u8>, skip: i64, wanted: usize) -> Result<Vec<u8>, Problem> {
    let ahead = match skip {
        -1 => bytes.len().saturating_sub(wanted),
        _ => usize::try_from(skip)
            .ok()
            .filter(|&s| s <= bytes.len())
            .ok_or_else(|| Problem::field("byte skip", "leads beyond the end of the data"))?,
    };
    if ahead > 0 {
        bytes.drain(..ahead);
    }
    Ok(bytes)
}

fn exact(bytes: Vec<u8>, wanted: usize) -> Result<Vec<u8>, Problem> {
    match bytes.len().cmp(&wanted) {
        std::cmp::Ordering::Less => {
            Err(Problem::Truncated { wanted: wanted as u128, found: bytes.len() as u128 })
        }
        std::cmp::Ordering::Equal => Ok(bytes),
        std::cmp::Ordering::Greater => Err(Problem::Excess { wanted }),
    }
}

/// Numbers written as text, as the bytes of doubles, little endian.
fn numbers(data: &[u8], wanted: usize) -> Result<Vec<u8>, Problem> {
    let mut bytes = Vec::new();
    let words = data.split(|b| b.is_ascii_whitespace() || *b == b',').filter(|w| !w.is_empty());
    for word in words {
        let text = String::from_utf8_lossy(word);
        let wrong = |_| {
            let shown: String = text.chars().take(20).collect();
            Problem::field("encoding", format!("`{shown}` among the samples is not a number"))
        };
        let value: f64 = text.parse().map_err(wrong)?;
        bytes.extend_from_slice(&value.to_le_bytes());
    }
    exact(bytes, wanted.saturating_mul(8))
}
