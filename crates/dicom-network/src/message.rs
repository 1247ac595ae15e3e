//! Messages over an association: a command set, and a data set where one follows (PS3.7 section
//! 6.3, PS3.8 Annex E).

use crate::command::{Command, MAX_COMMAND_BYTES};
use crate::error::Error;
use crate::link::Link;
use dicom_ul::pdu::{PDataValue, PDataValueType};
use std::collections::VecDeque;
use std::io::Read;

/// Bytes before the data in a P-DATA unit with one value: header of the unit, of the value.
const HEADERS: usize = 6 + 6;
/// How much is gathered before it is written to the connection, bytes.
const GATHERED: usize = 256 << 10;

/// A request or an answer.
#[derive(Debug)]
pub(crate) struct Message {
    /// The number of its presentation context.
    pub(crate) context: u8,
    pub(crate) command: Command,
}

/// A data set that is sent.
pub(crate) struct Payload<'a> {
    pub(crate) reader: &'a mut dyn Read,
    /// How many bytes of it.
    pub(crate) length: u64,
}

impl<'a> Payload<'a> {
    /// All of these bytes.
    pub(crate) fn of(bytes: &'a mut &[u8]) -> Self {
        let length = bytes.len() as u64;
        Self { reader: bytes, length }
    }
}

/// An association on which messages go back and forth.
pub(crate) struct Talk<'a> {
    pub(crate) link: Link<'a>,
    values: VecDeque<PDataValue>,
    last_id: u16,
}

impl<'a> Talk<'a> {
    pub(crate) fn new(link: Link<'a>) -> Self {
        Self { link, values: VecDeque::new(), last_id: 0 }
    }

    /// A number for the next request.
    pub(crate) fn next_id(&mut self) -> u16 {
        self.last_id = self.last_id.wrapping_add(1);
        self.last_id
    }

    /// Sends a command, and the data set that follows it.
    pub(crate) fn send(
        &mut self,
        context: u8,
        command: &Command,
        data: Option<Payload<'_>>,
    ) -> Result<(), Error> {
        let most = self.link.peer_max as usize - 6;
        let mut out = Vec::new();
        let command = command.to_bytes();
        let parts = command.chunks(most).count();
        for (n, part) in command.chunks(most).enumerate() {
            put_header(&mut out, context, part.len(), true, n + 1 == parts);
            out.extend_from_slice(part);
        }
        if let Some(Payload { reader, length }) = data {
            let mut left = length;
            while left > 0 {
                let size = (left).min(most as u64) as usize;
                left -= size as u64;
                put_header(&mut out, context, size, false, left == 0);
                let start = out.len();
                out.resize(start + size, 0);
                reader.read_exact(&mut out[start..]).map_err(|e| {
                    // The unit that was begun cannot be ended: the association is lost.
                    self.link.broken(format!("a file changed while it was sent: {e}"))
                })?;
                if out.len() + size + HEADERS > GATHERED {
                    self.link.send_bytes(&out)?;
                    out.clear();
                }
            }
        }
        self.link.send_bytes(&out)
    }

    /// The next command; `None` when the peer has released the association.
    pub(crate) fn receive(&mut self) -> Result<Option<Message>, Error> {
        let mut bytes = Vec::new();
        let mut context = None;
        self.link.begin();
        loop {
            let Some(value) = self.next_value()? else {
                return match context {
                    None => Ok(None),
                    Some(_) => Err(self.link.broken("released within a command")),
                };
            };
            let of = *context.get_or_insert(value.presentation_context_id);
            if value.value_type != PDataValueType::Command || of != value.presentation_context_id {
                return Err(self.link.protocol("a data set where a command belongs"));
            }
            if bytes.len() + value.data.len() > MAX_COMMAND_BYTES {
                let what = format!("a command set of more than {MAX_COMMAND_BYTES} bytes");
                return Err(self.link.protocol(what));
            }
            bytes.extend_from_slice(&value.data);
            if value.is_last {
                if !self.link.contexts.contains_key(&of) {
                    return Err(self.link.protocol("a command in a context nobody agreed on"));
                }
                let command =
                    Command::from_bytes(&bytes).map_err(|what| self.link.protocol(what))?;
                return Ok(Some(Message { context: of, command }));
            }
        }
    }

    /// The answer to a request.
    pub(crate) fn answer(&mut self) -> Result<Message, Error> {
        self.receive()?.ok_or_else(|| self.link.broken("the peer released it early"))
    }

    /// Hands the data set of a message to `sink`, piece by piece; `most` bytes at most.
    pub(crate) fn data(
        &mut self,
        message: &Message,
        most: u64,
        sink: &mut dyn FnMut(&[u8]),
    ) -> Result<u64, Error> {
        let mut total = 0;
        self.link.begin();
        loop {
            let Some(value) = self.next_value()? else {
                return Err(self.link.broken("released within a data set"));
            };
            let context = value.presentation_context_id == message.context;
            if value.value_type != PDataValueType::Data || !context {
                return Err(self.link.protocol("a command where a data set belongs"));
            }
            total += value.data.len() as u64;
            if total > most {
                return Err(self.link.protocol(format!("a data set of more than {most} bytes")));
            }
            sink(&value.data);
            if value.is_last {
                return Ok(total);
            }
        }
    }

    fn next_value(&mut self) -> Result<Option<PDataValue>, Error> {
        loop {
            if let Some(value) = self.values.pop_front() {
                if value.data.is_empty() && !value.is_last {
                    // Such a message would never end, and never be too long.
                    return Err(self.link.protocol("a piece of a message without a byte"));
                }
                return Ok(Some(value));
            }
            match self.link.receive_values()? {
                Some(values) => self.values.extend(values),
                None => return Ok(None),
            }
        }
    }
}

/// The headers of a P-DATA-TF unit with one value of `size` bytes (PS3.8 9.3.5).
fn put_header(out: &mut Vec<u8>, context: u8, size: usize, command: bool, last: bool) {
    out.extend([4, 0]);
    out.extend((size as u32 + 6).to_be_bytes());
    out.extend((size as u32 + 2).to_be_bytes());
    out.extend([context, u8::from(command) | u8::from(last) << 1]);
}
