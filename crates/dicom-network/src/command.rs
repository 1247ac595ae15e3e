//! Command sets: what a message asks or answers (PS3.7 6.3 and Annex E).
//!
//! A command set is flat, always in Implicit VR Little Endian; elements outside group 0000 do not
//! belong there and are passed over.

use std::collections::BTreeMap;

/// Longest command set that is read, bytes; real ones have some hundred.
pub(crate) const MAX_COMMAND_BYTES: usize = 1 << 16;

/// Elements of group 0000 (PS3.7 E.1).
pub(crate) mod element {
    pub(crate) const AFFECTED_SOP_CLASS: u16 = 0x0002;
    pub(crate) const COMMAND_FIELD: u16 = 0x0100;
    pub(crate) const MESSAGE_ID: u16 = 0x0110;
    pub(crate) const MESSAGE_ID_RESPONDED_TO: u16 = 0x0120;
    pub(crate) const MOVE_DESTINATION: u16 = 0x0600;
    pub(crate) const PRIORITY: u16 = 0x0700;
    pub(crate) const DATA_SET_TYPE: u16 = 0x0800;
    pub(crate) const STATUS: u16 = 0x0900;
    pub(crate) const AFFECTED_SOP_INSTANCE: u16 = 0x1000;
    pub(crate) const COMPLETED: u16 = 0x1021;
    pub(crate) const FAILED: u16 = 0x1022;
}

/// Command fields (PS3.7 E.1); answers have the highest bit set.
pub(crate) mod field {
    pub(crate) const STORE: u16 = 0x0001;
    pub(crate) const GET: u16 = 0x0010;
    pub(crate) const FIND: u16 = 0x0020;
    pub(crate) const MOVE: u16 = 0x0021;
    pub(crate) const ECHO: u16 = 0x0030;
    pub(crate) const ANSWER: u16 = 0x8000;
}

/// Data Set Type of a message without data set.
const NO_DATA_SET: u16 = 0x0101;
/// Data Set Type of one with; any other value would do.
const DATA_SET: u16 = 0x0001;

/// A command set: the values of its elements, by element number.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Command {
    elements: BTreeMap<u16, Vec<u8>>,
}

impl Command {
    /// A request with this command field.
    pub(crate) fn request(field: u16, message: u16, class: &str, data_set: bool) -> Self {
        Self::default()
            .text(element::AFFECTED_SOP_CLASS, class)
            .number(element::COMMAND_FIELD, field)
            .number(element::MESSAGE_ID, message)
            .number(element::DATA_SET_TYPE, if data_set { DATA_SET } else { NO_DATA_SET })
    }

    /// The answer to a request, without data set.
    pub(crate) fn answer(request: &Self, status: u16) -> Self {
        let field = request.get_number(element::COMMAND_FIELD).unwrap_or_default();
        let mut answer = Self::default()
            .number(element::COMMAND_FIELD, field | field::ANSWER)
            .number(
                element::MESSAGE_ID_RESPONDED_TO,
                request.get_number(element::MESSAGE_ID).unwrap_or_default(),
            )
            .number(element::DATA_SET_TYPE, NO_DATA_SET)
            .number(element::STATUS, status);
        for number in [element::AFFECTED_SOP_CLASS, element::AFFECTED_SOP_INSTANCE] {
            if let Some(value) = request.elements.get(&number) {
                answer.elements.insert(number, value.clone());
            }
        }
        answer
    }

    #[must_use]
    pub(crate) fn number(mut self, number: u16, value: u16) -> Self {
        self.elements.insert(number, value.to_le_bytes().to_vec());
        self
    }

    /// With a UID or an application entity title.
    #[must_use]
    pub(crate) fn text(mut self, number: u16, value: &str) -> Self {
        let mut bytes = value.as_bytes().to_vec();
        if bytes.len() % 2 == 1 {
            bytes.push(if number == element::MOVE_DESTINATION { b' ' } else { 0 });
        }
        self.elements.insert(number, bytes);
        self
    }

    pub(crate) fn get_number(&self, number: u16) -> Option<u16> {
        let bytes = self.elements.get(&number)?;
        Some(u16::from_le_bytes([*bytes.first()?, *bytes.get(1)?]))
    }

    /// A text without padding; empty when missing or not ASCII.
    pub(crate) fn get_text(&self, number: u16) -> &str {
        let bytes = self.elements.get(&number).map_or(&[][..], Vec::as_slice);
        std::str::from_utf8(bytes).unwrap_or_default().trim_matches([' ', '\0'])
    }

    pub(crate) fn field(&self) -> u16 {
        self.get_number(element::COMMAND_FIELD).unwrap_or_default()
    }

    /// Whether a data set follows.
    pub(crate) fn has_data_set(&self) -> bool {
        self.get_number(element::DATA_SET_TYPE).is_some_and(|t| t != NO_DATA_SET)
    }

    /// As it travels, with its group length first.
    pub(crate) fn to_bytes(&self) -> Vec<u8> {
        let mut body = Vec::new();
        for (number, value) in &self.elements {
            put(&mut body, *number, value);
        }
        let mut bytes = Vec::new();
        put(&mut bytes, 0, &(body.len() as u32).to_le_bytes());
        bytes.extend(body);
        bytes
    }

    /// From what a peer sent.
    ///
    /// # Errors
    /// In words, when the bytes are no command set. The group length is not believed.
    pub(crate) fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        let mut command = Self::default();
        let mut rest = bytes;
        while !rest.is_empty() {
            let Some((header, after)) = rest.split_first_chunk::<8>() else {
                return Err("a command set ends inside an element".into());
            };
            let [g0, g1, e0, e1, l0, l1, l2, l3] = *header;
            let (group, number) = (u16::from_le_bytes([g0, g1]), u16::from_le_bytes([e0, e1]));
            let length = u32::from_le_bytes([l0, l1, l2, l3]);
            let Some((value, after)) = after.split_at_checked(length as usize) else {
                return Err(format!("a command element declares {length} bytes, it has fewer"));
            };
            // Programs on dcmtk add what failed (0008,0058) here and not as a data set: it is told
            // by its number too.
            if group != 0 {
                rest = after;
                continue;
            }
            if number != 0 && command.elements.insert(number, value.to_vec()).is_some() {
                return Err(format!("a command set has element {number:04X} twice"));
            }
            rest = after;
        }
        if command.get_number(element::COMMAND_FIELD).is_none() {
            return Err("a command set without command field".into());
        }
        Ok(command)
    }
}

fn put(bytes: &mut Vec<u8>, number: u16, value: &[u8]) {
    bytes.extend([0, 0]);
    bytes.extend(number.to_le_bytes());
    bytes.extend((value.len() as u32).to_le_bytes());
    bytes.extend(value);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_request_comes_back_and_is_answered() {
        let request = Command::request(field::STORE, 7, "1.2.840.10008.5.1.4.1.1.2", true)
            .text(element::AFFECTED_SOP_INSTANCE, "1.2.3");
        let bytes = request.to_bytes();
        assert_eq!(&bytes[..12], &[0, 0, 0, 0, 4, 0, 0, 0, bytes.len() as u8 - 12, 0, 0, 0]);
        assert_eq!(Command::from_bytes(&bytes).unwrap(), request);
        assert!(request.has_data_set());
        let answer = Command::answer(&request, 0xB000);
        assert_eq!(answer.field(), 0x8001);
        assert_eq!(answer.get_number(element::MESSAGE_ID_RESPONDED_TO), Some(7));
        assert_eq!(answer.get_text(element::AFFECTED_SOP_INSTANCE), "1.2.3");
        assert!(!answer.has_data_set());
    }

    #[test]
    fn elements_of_other_groups_are_passed_over() {
        let answer = Command::default().number(element::COMMAND_FIELD, 0x8010);
        let mut bytes = answer.to_bytes();
        bytes.extend([8, 0, 0x58, 0, 4, 0, 0, 0]);
        bytes.extend(b"1.2\0");
        assert_eq!(Command::from_bytes(&bytes).unwrap(), answer);
        bytes.truncate(bytes.len() - 1);
        assert!(Command::from_bytes(&bytes).is_err());
    }

    #[test]
    fn a_length_that_lies_is_an_error() {
        let mut bytes = Command::request(field::ECHO, 1, "1.2.840.10008.1.1", false).to_bytes();
        // The length of the second element: 4 GB.
        bytes[16..20].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(Command::from_bytes(&bytes).unwrap_err().contains("4294967295"));
    }

    proptest! {
        #[test]
        fn any_bytes_give_a_command_or_an_error(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            if let Ok(command) = Command::from_bytes(&bytes) {
                prop_assert_eq!(Command::from_bytes(&command.to_bytes()), Ok(command));
            }
        }

        #[test]
        fn a_spoilt_command_gives_a_command_or_an_error(at in 0usize..80, byte: u8) {
            let request = Command::request(field::STORE, 7, "1.2.840.10008.5.1.4.1.1.2", true);
            let mut bytes = request.to_bytes();
            let at = at % bytes.len();
            bytes[at] = byte;
            let _either = Command::from_bytes(&bytes);
        }
    }
}
