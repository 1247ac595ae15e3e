//! The text header of a NRRD file.

use crate::{Problem, scalar::Scalar};
use std::collections::BTreeMap;

/// Fields and key/value pairs, as text.
#[derive(Debug)]
pub(super) struct Header {
    fields: BTreeMap<String, String>,
    pub(super) keys: BTreeMap<String, String>,
}

impl Header {
    /// The header, and the bytes that follow its blank line.
    pub(super) fn parse(bytes: &[u8]) -> Result<(Self, &[u8]), Problem> {
        let mut header = Self { fields: BTreeMap::new(), keys: BTreeMap::new() };
        let (magic, mut rest) = line(bytes).unwrap_or((String::new(), &[]));
        if !matches!(magic.as_str(), "NRRD0001" | "NRRD0002" | "NRRD0003" | "NRRD0004" | "NRRD0005")
        {
            return Err(Problem::Format("NRRD0001 to NRRD0005 in the first line"));
        }
        for number in 2.. {
            let Some((text, after)) = line(rest) else {
                let reason = "the header does not end in a blank line: the file is cut short";
                return Err(Problem::Line { line: number, reason: reason.into() });
            };
            rest = after;
            if text.is_empty() {
                break;
            }
            header.take(&text, number)?;
        }
        Ok((header, rest))
    }

    /// Takes one line of the header.
    fn take(&mut self, text: &str, line: u64) -> Result<(), Problem> {
        if text.starts_with('#') {
            return Ok(());
        }
        // "key:=value" or "field: value", whichever colon comes first.
        let Some((name, value)) = text.split_once(':') else {
            let reason = format!("`{}` is neither a field nor a key", shortened(text));
            return Err(Problem::Line { line, reason });
        };
        let fresh = if let Some(value) = value.strip_prefix('=') {
            self.keys.insert(name.into(), unescape(value)).is_none()
        } else {
            let name = name.trim().to_ascii_lowercase();
            self.fields.insert(name, value.trim().into()).is_none()
        };
        if fresh {
            return Ok(());
        }
        Err(Problem::Line { line, reason: format!("`{}` is given twice", shortened(name)) })
    }

    /// The text of a field.
    pub(super) fn field(&self, name: &str) -> Option<&str> {
        self.fields.get(name).map(String::as_str)
    }

    /// The text of a field that must be there.
    pub(super) fn required(&self, name: &str) -> Result<&str, Problem> {
        self.field(name).ok_or_else(|| Problem::field(name, "is missing in the header"))
    }

    /// A whole number, 0 when the field is missing.
    pub(super) fn skip(&self, names: [&str; 2]) -> Result<i64, Problem> {
        match names.iter().find_map(|n| self.field(n)) {
            None => Ok(0),
            Some(text) => {
                let wrong = |_| Problem::field(names[0], format!("`{text}` is not a number"));
                text.parse().map_err(wrong)
            }
        }
    }

    /// The type of a sample.
    pub(super) fn scalar(&self) -> Result<Scalar, Problem> {
        let text = self.required("type")?;
        Ok(match text {
            "signed char" | "int8" | "int8_t" => Scalar::I8,
            "uchar" | "unsigned char" | "uint8" | "uint8_t" => Scalar::U8,
            "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => {
                Scalar::I16
            }
            "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => {
                Scalar::U16
            }
            "int" | "signed int" | "int32" | "int32_t" => Scalar::I32,
            "uint" | "unsigned int" | "uint32" | "uint32_t" => Scalar::U32,
            "longlong"
            | "long long"
            | "long long int"
            | "signed long long"
            | "signed long long int"
            | "int64"
            | "int64_t" => Scalar::I64,
            "ulonglong"
            | "unsigned long long"
            | "unsigned long long int"
            | "uint64"
            | "uint64_t" => Scalar::U64,
            "float" => Scalar::F32,
            "double" => Scalar::F64,
            other => {
                return Err(Problem::field("type", format!("`{other}` is not a type of numbers")));
            }
        })
    }
}

/// The next line without its end (\n, \r\n or \r before \n), and what follows it.
fn line(bytes: &[u8]) -> Option<(String, &[u8])> {
    let end = bytes.iter().position(|&b| b == b'\n')?;
    let text = String::from_utf8_lossy(&bytes[..end]);
    Some((text.trim_end_matches('\r').to_string(), &bytes[end + 1..]))
}

fn shortened(text: &str) -> String {
    text.chars().take(40).collect()
}

/// Values of keys write a line end as \n and a backslash as \\.
fn unescape(value: &str) -> String {
    let mut out = String::with_capacity(value.len());
    let mut rest = value.chars();
    while let Some(c) = rest.next() {
        match (c, rest.as_str().chars().next()) {
            ('\\', Some('n')) => {
                out.push('\n');
                rest.next();
            }
            ('\\', Some('\\')) => {
                out.push('\\');
                rest.next();
            }
            _ => out.push(c),
        }
    }
    out
}
