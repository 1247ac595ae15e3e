//! STATUS: u16 code, i64 sub-code, char[20] name, text.

use crate::error::Refusal;
use crate::name::{Name, readable};
use crate::reader::{Reader, put_u16s};

/// Bytes before the text.
pub(crate) const HEAD: usize = 30;

/// How the sender is, or what it thinks of a message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Status {
    /// What kind of state.
    pub code: StatusCode,
    /// More of it, by the sender's own list.
    pub sub_code: i64,
    /// Short name, at most 20 characters.
    pub name: String,
    /// What happened, for a person to read.
    pub text: String,
}

impl Status {
    /// A state without a sub-code.
    pub fn new(code: StatusCode, name: &str, text: &str) -> Self {
        Self { code, sub_code: 0, name: name.to_owned(), text: text.to_owned() }
    }

    /// Reads a STATUS. The text ends at its first NUL or with the body.
    pub(crate) fn read(bytes: &[u8]) -> Result<Self, Refusal> {
        let rule = "a STATUS has 30 bytes and its text: u16 code, i64 sub-code, char[20] name";
        let mut reader = Reader::new(bytes, rule);
        let code = StatusCode::from(reader.u16()?);
        let sub_code = i64::from_be_bytes(*reader.array()?);
        let name = Name::<20>::read(reader.array()?).to_string();
        let text = reader.rest().split(|&byte| byte == 0).next().unwrap_or_default();
        Ok(Self { code, sub_code, name, text: readable(text) })
    }

    /// Adds it as it goes over the wire, the text with one NUL as the C++ library has it.
    pub(crate) fn put(&self, out: &mut Vec<u8>) {
        put_u16s(out, &[self.code.number()]);
        out.extend_from_slice(&self.sub_code.to_be_bytes());
        out.extend_from_slice(Name::<20>::new(&self.name).field());
        out.extend(self.text.bytes().take_while(|&byte| byte != 0));
        out.push(0);
    }
}

/// The codes of STATUS.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StatusCode {
    /// 1
    Ok,
    /// 2
    UnknownError,
    /// 3: stop the patient's procedure.
    Panic,
    /// 4
    NotFound,
    /// 5
    AccessDenied,
    /// 6
    Busy,
    /// 7: a message was not complete in time, or the connection was lost.
    TimedOut,
    /// 8
    Overflow,
    /// 9: the CRC of a body is wrong.
    ChecksumError,
    /// 10: something is not as the protocol or the receiver needs it.
    ConfigurationError,
    /// 11: not enough memory, time or room.
    NotEnoughResources,
    /// 12: the type of a message is not known.
    UnknownInstruction,
    /// 13
    NotReady,
    /// 14
    ManualMode,
    /// 15
    Disabled,
    /// 16
    NotPresent,
    /// 17
    UnknownVersion,
    /// 18
    HardwareFailure,
    /// 19
    ShuttingDown,
    /// Any other; 0 is not valid, from 20 on there are none.
    Other(u16),
}

/// The codes with names: number n stands at place n - 1.
const CODES: [StatusCode; 19] = [
    StatusCode::Ok,
    StatusCode::UnknownError,
    StatusCode::Panic,
    StatusCode::NotFound,
    StatusCode::AccessDenied,
    StatusCode::Busy,
    StatusCode::TimedOut,
    StatusCode::Overflow,
    StatusCode::ChecksumError,
    StatusCode::ConfigurationError,
    StatusCode::NotEnoughResources,
    StatusCode::UnknownInstruction,
    StatusCode::NotReady,
    StatusCode::ManualMode,
    StatusCode::Disabled,
    StatusCode::NotPresent,
    StatusCode::UnknownVersion,
    StatusCode::HardwareFailure,
    StatusCode::ShuttingDown,
];

impl StatusCode {
    /// The number on the wire.
    pub fn number(self) -> u16 {
        let place = CODES.iter().zip(1..).find(|(code, _)| **code == self);
        match (self, place) {
            (Self::Other(number), _) | (_, Some((_, number))) => number,
            // Every code with a name is in the list.
            (_, None) => 0,
        }
    }
}

impl From<u16> for StatusCode {
    fn from(number: u16) -> Self {
        let named = usize::from(number).checked_sub(1).and_then(|place| CODES.get(place));
        named.copied().unwrap_or(Self::Other(number))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_is_a_code_and_back() {
        for number in 0..=u16::MAX {
            assert_eq!(StatusCode::from(number).number(), number);
        }
        assert_eq!(StatusCode::ChecksumError.number(), 9);
        assert_eq!(StatusCode::ConfigurationError.number(), 10);
        assert_eq!(StatusCode::NotEnoughResources.number(), 11);
        assert_eq!(StatusCode::UnknownInstruction.number(), 12);
        assert_eq!(StatusCode::ShuttingDown.number(), 19);
        assert_eq!(StatusCode::from(0), StatusCode::Other(0));
    }

    #[test]
    fn text_is_read_with_its_nul_and_without() {
        let mut bytes = vec![0; HEAD];
        bytes[1] = 1;
        bytes.extend(b"well");
        let without = Status::read(&bytes);
        bytes.push(0);
        assert_eq!(Status::read(&bytes), without);
        assert_eq!(without.map(|status| status.text), Ok("well".to_owned()));
        assert!(Status::read(&bytes[..HEAD]).is_ok_and(|status| status.text.is_empty()));
        assert!(Status::read(&bytes[..HEAD - 1]).is_err());
    }
}
