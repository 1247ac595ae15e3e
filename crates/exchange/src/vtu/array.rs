//! The data of one array.

use crate::{Problem, file, scalar::Scalar};
use base64::{Engine, engine::general_purpose::STANDARD};
use supine_space::Progress;

/// How a file encodes its binary arrays.
#[derive(Clone, Copy, Debug)]
pub(super) struct Encoding {
    pub(super) big_endian: bool,
    /// Bytes of a number in front of the data.
    pub(super) word: usize,
    /// Blocks of zlib.
    pub(super) compressed: bool,
}

/// Bytes to take binary data from.
#[derive(Clone, Copy, Debug)]
pub(super) enum Storage<'a> {
    None,
    Raw(&'a [u8]),
    Base64(&'a [u8]),
}

/// An array as its tag describes it.
#[derive(Debug)]
pub(super) struct Array {
    pub(super) name: String,
    /// `None` for types that are not numbers.
    pub(super) scalar: Option<Scalar>,
    pub(super) components: usize,
    pub(super) format: String,
    pub(super) offset: usize,
    /// Inline data.
    pub(super) text: String,
}

impl Array {
    fn wrong(&self, reason: impl Into<String>) -> Problem {
        Problem::field(self.name.clone(), reason)
    }

    fn scalar(&self) -> Result<Scalar, Problem> {
        self.scalar.ok_or_else(|| self.wrong("is not an array of numbers"))
    }

    /// All values.
    pub(super) fn floats(
        &self,
        encoding: Encoding,
        appended: Storage<'_>,
    ) -> Result<Vec<f64>, Problem> {
        if self.format == "ascii" {
            return self.words();
        }
        let bytes = self.bytes(encoding, appended)?;
        let mut values = Vec::with_capacity(bytes.len() / self.scalar()?.size());
        self.scalar()?.try_each(&bytes, encoding.big_endian, |_, v| {
            values.push(v);
            Ok::<_, Problem>(())
        })?;
        Ok(values)
    }

    /// All values, which are whole numbers by type.
    pub(super) fn integers(
        &self,
        encoding: Encoding,
        appended: Storage<'_>,
    ) -> Result<Vec<i64>, Problem> {
        if !self.scalar()?.is_integer() {
            return Err(self.wrong("holds floating-point numbers instead of whole ones"));
        }
        if self.format == "ascii" {
            return self.words();
        }
        // Exact: indices and tags lie below 2^53.
        Ok(self.floats(encoding, appended)?.into_iter().map(|v| v as i64).collect())
    }

    fn words<T: std::str::FromStr>(&self) -> Result<Vec<T>, Problem> {
        let parse = |word: &str| {
            let shown: String = word.chars().take(20).collect();
            word.parse().map_err(|_| self.wrong(format!("`{shown}` is not a number of its type")))
        };
        self.text.split_ascii_whitespace().map(parse).collect()
    }

    /// The decoded bytes of a binary array.
    fn bytes(&self, encoding: Encoding, appended: Storage<'_>) -> Result<Vec<u8>, Problem> {
        let inline: Vec<u8>;
        let mut source = match (self.format.as_str(), appended) {
            ("binary", _) => {
                inline = self.text.bytes().filter(|b| !b.is_ascii_whitespace()).collect();
                Source::new(Storage::Base64(&inline), 0)
            }
            ("appended", Storage::None) => {
                return Err(self.wrong("points to appended data, which are missing"));
            }
            ("appended", storage) => Source::new(storage, self.offset),
            (other, _) => return Err(self.wrong(format!("the format `{other}` is unknown"))),
        };
        let bytes = if encoding.compressed {
            blocks(&mut source, encoding)?
        } else {
            let n = source.word(encoding)?;
            source.take(n)?
        };
        if bytes.len().is_multiple_of(self.scalar()?.size()) {
            Ok(bytes)
        } else {
            Err(self.wrong("ends within a number"))
        }
    }
}

/// Count of blocks, their size, size of the last one if it is shorter, compressed sizes, blocks.
fn blocks(source: &mut Source<'_>, encoding: Encoding) -> Result<Vec<u8>, Problem> {
    let n = source.word(encoding)?;
    if n == 0 {
        return Ok(vec![]);
    }
    let (size, last) = (source.word(encoding)?, source.word(encoding)?);
    if n > source.left() / encoding.word {
        let wanted = n as u128 * encoding.word as u128;
        return Err(Problem::Truncated { wanted, found: source.left() as u128 });
    }
    let compressed: Vec<usize> = (0..n).map(|_| source.word(encoding)).collect::<Result<_, _>>()?;
    // All blocks are one stretch of base64 (the words before them may be another).
    let total = compressed.iter().fold(0usize, |sum, &c| sum.saturating_add(c));
    let stretch = source.take(total)?;
    let (mut bytes, mut at) = (Vec::new(), 0);
    for (block, &length) in compressed.iter().enumerate() {
        let wanted = if block + 1 == n && last > 0 { last } else { size };
        let part =
            file::zlib(&stretch[at..at + length], wanted.saturating_add(1), Progress::none())?;
        if part.len() != wanted {
            return Err(Problem::Truncated { wanted: wanted as u128, found: part.len() as u128 });
        }
        bytes.extend_from_slice(&part);
        at += length;
    }
    Ok(bytes)
}

/// Binary data, taken from the front piece by piece.
struct Source<'a> {
    storage: Storage<'a>,
    /// Decoded from base64 but not yet taken: at most two bytes.
    spare: Vec<u8>,
}

impl<'a> Source<'a> {
    fn new(storage: Storage<'a>, offset: usize) -> Self {
        let storage = match storage {
            Storage::Raw(data) => Storage::Raw(data.get(offset..).unwrap_or_default()),
            Storage::Base64(text) => Storage::Base64(text.get(offset..).unwrap_or_default()),
            Storage::None => Storage::None,
        };
        Self { storage, spare: vec![] }
    }

    /// Bytes that can be taken at most.
    fn left(&self) -> usize {
        let stored = match self.storage {
            Storage::Raw(data) => data.len(),
            Storage::Base64(text) => text.len() / 4 * 3,
            Storage::None => 0,
        };
        self.spare.len() + stored
    }

    fn take(&mut self, n: usize) -> Result<Vec<u8>, Problem> {
        let short = Problem::Truncated { wanted: n as u128, found: self.left() as u128 };
        if n > self.left() {
            return Err(short);
        }
        match self.storage {
            Storage::None => Err(short),
            Storage::Raw(data) => {
                let (taken, rest) = data.split_at(n);
                self.storage = Storage::Raw(rest);
                Ok(taken.to_vec())
            }
            Storage::Base64(text) => {
                let mut bytes = std::mem::take(&mut self.spare);
                let groups = n.saturating_sub(bytes.len()).div_ceil(3);
                let (coded, rest) = text.split_at_checked(4 * groups).ok_or(short)?;
                self.storage = Storage::Base64(rest);
                STANDARD
                    .decode_vec(coded, &mut bytes)
                    .map_err(|e| Problem::field("base64", e.to_string()))?;
                if bytes.len() < n {
                    let length = bytes.len() as u128;
                    return Err(Problem::Truncated { wanted: n as u128, found: length });
                }
                self.spare = bytes.split_off(n);
                Ok(bytes)
            }
        }
    }

    /// A number in front of the data.
    fn word(&mut self, encoding: Encoding) -> Result<usize, Problem> {
        let bytes = self.take(encoding.word)?;
        let fold = |n: u64, b: &u8| n << 8 | u64::from(*b);
        let value = if encoding.big_endian {
            bytes.iter().fold(0, fold)
        } else {
            bytes.iter().rev().fold(0, fold)
        };
        Ok(usize::try_from(value).unwrap_or(usize::MAX))
    }
}
