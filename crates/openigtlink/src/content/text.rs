//! STRING: u16 encoding, u16 bytes of text, text.

use crate::error::Refusal;
use crate::name::{cut, readable};
use crate::reader::{Reader, put_u16s};

/// The encoding ASCII, by the numbers of IANA (MIBenum).
pub const ASCII: u16 = 3;
/// The encoding UTF-8, by the numbers of IANA (MIBenum).
pub const UTF_8: u16 = 106;

/// Bytes before the text.
pub(crate) const HEAD: usize = 4;

/// Text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Text {
    /// Encoding that the message names: [`ASCII`], [`UTF_8`], or another.
    pub encoding: u16,
    /// The text. Whatever the encoding it is read as UTF-8; a byte that is not becomes `?`.
    pub text: String,
}

impl Text {
    /// Text in the encoding it needs.
    pub fn new(text: &str) -> Self {
        Self { encoding: encoding(text), text: text.to_owned() }
    }

    /// Reads a STRING.
    pub(crate) fn read(bytes: &[u8]) -> Result<Self, Refusal> {
        let mut reader = Reader::new(
            bytes,
            "a STRING has u16 encoding, u16 length and as many bytes of text as that says",
        );
        let encoding = reader.u16()?;
        let length = reader.u16()?;
        let text = readable(reader.take(u64::from(length))?);
        reader.end()?;
        Ok(Self { encoding, text })
    }

    /// Adds it as it goes over the wire; what is beyond 65535 bytes is cut.
    pub(crate) fn put(&self, out: &mut Vec<u8>) {
        let text = cut(&self.text, usize::from(u16::MAX));
        put_u16s(out, &[self.encoding, text.len() as u16]);
        out.extend_from_slice(text.as_bytes());
    }
}

/// The encoding a text needs.
pub(crate) fn encoding(text: &str) -> u16 {
    if text.is_ascii() { ASCII } else { UTF_8 }
}
