//! The text header of a MetaImage.

use crate::{Problem, scalar::Scalar};
use std::collections::BTreeMap;

/// Longest header that is looked at, bytes: one without an end is not searched through a whole
/// volume.
const LONGEST: usize = 1 << 16;
/// The key that ends the header.
const LAST: &str = "ElementDataFile";

/// Keys and their values, as text.
#[derive(Debug)]
pub(super) struct Header(BTreeMap<String, String>);

/// Whether the bytes begin like a MetaImage: with one of the keys that stand first in such files.
pub(crate) fn is_meta_image(bytes: &[u8]) -> bool {
    let start = String::from_utf8_lossy(&bytes[..bytes.len().min(64)]);
    let key = start.split_once('=').map(|(key, _)| key.trim());
    key.is_some_and(|key| ["ObjectType", "ObjectSubType", "NDims", "Comment"].contains(&key))
}

impl Header {
    /// The header, and the bytes that follow its last line.
    pub(super) fn parse(bytes: &[u8]) -> Result<(Self, &[u8]), Problem> {
        let mut header = Self(BTreeMap::new());
        let mut rest = bytes;
        for number in 1.. {
            let window = &rest[..rest.len().min(LONGEST)];
            let end = window.iter().position(|&b| b == b'\n');
            // The last line of a `.mhd` may have no end.
            let text = String::from_utf8_lossy(&window[..end.unwrap_or(window.len())]);
            rest = &rest[end.map_or(window.len(), |end| end + 1)..];
            let done = header.take(text.trim_end_matches('\r'), number)?;
            if done {
                break;
            }
            if end.is_none() || bytes.len() - rest.len() > LONGEST {
                let reason = format!("the header does not end in a line `{LAST} = ...`");
                return Err(Problem::Line { line: number, reason });
            }
        }
        Ok((header, rest))
    }

    /// Takes one line; whether it is the last one.
    fn take(&mut self, text: &str, line: u64) -> Result<bool, Problem> {
        let shown = |text: &str| text.chars().take(40).collect::<String>();
        let Some((key, value)) = text.split_once('=') else {
            if text.trim().is_empty() {
                return Ok(false);
            }
            let reason = format!("`{}` is not `Key = Value`", shown(text));
            return Err(Problem::Line { line, reason });
        };
        let (key, value) = (key.trim(), value.trim());
        if self.0.insert(key.into(), value.into()).is_some() {
            return Err(Problem::Line { line, reason: format!("`{}` is given twice", shown(key)) });
        }
        Ok(key == LAST)
    }

    /// The text of the one of these keys that is given; they are names for the same.
    pub(super) fn text(&self, names: &[&'static str]) -> Result<Option<&str>, Problem> {
        let mut given = names.iter().filter_map(|n| self.0.get(*n));
        let first = given.next().map(String::as_str);
        if given.next().is_some() {
            return Err(Problem::field(names[0], format!("is given twice, {}", names.join(", "))));
        }
        Ok(first)
    }

    /// The text of a key that must be there.
    pub(super) fn required(&self, names: &[&'static str]) -> Result<&str, Problem> {
        self.text(names)?.ok_or_else(|| Problem::field(names[0], "is missing in the header"))
    }

    /// `True` or `False`; false where nothing is said.
    pub(super) fn flag(&self, names: &[&'static str]) -> Result<bool, Problem> {
        match self.text(names)?.map(str::to_ascii_lowercase).as_deref() {
            None | Some("false" | "f" | "0") => Ok(false),
            Some("true" | "t" | "1") => Ok(true),
            Some(_) => Err(Problem::field(names[0], "is neither True nor False")),
        }
    }

    /// So many numbers; `None` where nothing is said.
    pub(super) fn numbers<T: std::str::FromStr, const N: usize>(
        &self,
        names: &[&'static str],
    ) -> Result<Option<[T; N]>, Problem> {
        let Some(text) = self.text(names)? else { return Ok(None) };
        let numbers: Option<Vec<T>> = text.split_whitespace().map(|n| n.parse().ok()).collect();
        let exactly = numbers.and_then(|n| n.try_into().ok());
        exactly.map(Some).ok_or_else(|| {
            let shown: String = text.chars().take(40).collect();
            Problem::field(names[0], format!("`{shown}` instead of {N} numbers"))
        })
    }

    /// So many numbers that must be there.
    pub(super) fn needed<T: std::str::FromStr, const N: usize>(
        &self,
        names: &[&'static str],
    ) -> Result<[T; N], Problem> {
        let missing = || Problem::field(names[0], "is missing in the header");
        self.numbers(names)?.ok_or_else(missing)
    }

    /// The type of a sample.
    pub(super) fn scalar(&self) -> Result<Scalar, Problem> {
        Ok(match self.required(&["ElementType"])? {
            "MET_CHAR" => Scalar::I8,
            "MET_UCHAR" => Scalar::U8,
            "MET_SHORT" => Scalar::I16,
            "MET_USHORT" => Scalar::U16,
            "MET_INT" => Scalar::I32,
            "MET_UINT" => Scalar::U32,
            "MET_LONG_LONG" => Scalar::I64,
            "MET_ULONG_LONG" => Scalar::U64,
            "MET_FLOAT" => Scalar::F32,
            "MET_DOUBLE" => Scalar::F64,
            other => {
                let shown: String = other.chars().take(40).collect();
                let reason = format!(
                    "`{shown}` is not MET_UCHAR, MET_SHORT, MET_USHORT, MET_INT, MET_FLOAT, MET_DOUBLE or \
                     another type of numbers of one size everywhere"
                );
                return Err(Problem::field("ElementType", reason));
            }
        })
    }
}
