//! Messages from a socket, within time and memory.

use std::io::{ErrorKind, Read};
use std::net::TcpStream;
use std::time::{Duration, Instant};
use supine_openigtlink::{BodyError, HEADER_BYTES, Header, HeaderError, Message};

/// From its first byte on a message has this long to arrive.
const IN_TIME: Duration = Duration::from_secs(2);
/// A read waits so long before it looks whether the session is over.
const TICK: Duration = Duration::from_millis(50);
/// Memory for a body grows by this, so that it follows what has arrived.
const PIECE: usize = 64 << 10;

/// What came.
#[derive(Debug)]
pub(crate) enum Came {
    Message(Box<Message>),
    /// A type that is not known; its body was skipped.
    Unknown(Header),
    Header(HeaderError),
    Body(BodyError),
    /// A message was not complete in time.
    Late,
    /// The peer is gone, or the session over.
    Gone,
}

/// Why bytes are not there.
enum Lack {
    Late,
    Gone,
}

/// Reads messages from a socket.
#[derive(Debug)]
pub(crate) struct Wire<'a> {
    stream: &'a TcpStream,
    /// When the message that is being read began.
    began: Option<Instant>,
}

impl<'a> Wire<'a> {
    pub(crate) fn new(stream: &'a TcpStream) -> std::io::Result<Self> {
        stream.set_read_timeout(Some(TICK))?;
        Ok(Self { stream, began: None })
    }

    /// The next message; `over` says whether the session is.
    pub(crate) fn next(&mut self, over: &dyn Fn() -> bool) -> Came {
        self.began = None;
        let mut head = [0; HEADER_BYTES];
        if let Err(lack) = self.fill(&mut head, over) {
            return lack.into();
        }
        let header = match Header::read(&head) {
            Ok(header) => header,
            Err(error) => return Came::Header(error),
        };
        if !header.is_known() {
            return match self.skip(header.body, over) {
                Ok(()) => Came::Unknown(header),
                Err(lack) => lack.into(),
            };
        }
        let body = match self.body(header.body, over) {
            Ok(body) => body,
            Err(lack) => return lack.into(),
        };
        match Message::read(&header, &body) {
            Ok(message) => Came::Message(Box::new(message)),
            Err(error) => Came::Body(error),
        }
    }

    fn body(&mut self, size: u64, over: &dyn Fn() -> bool) -> Result<Vec<u8>, Lack> {
        // The header's limit is far below the address space.
        let size = usize::try_from(size).unwrap_or(usize::MAX);
        let mut body = Vec::new();
        while body.len() < size {
            let from = body.len();
            body.resize(size.min(from + PIECE), 0);
            self.fill(&mut body[from..], over)?;
        }
        Ok(body)
    }

    fn skip(&mut self, size: u64, over: &dyn Fn() -> bool) -> Result<(), Lack> {
        let mut left = usize::try_from(size).unwrap_or(usize::MAX);
        let mut piece = vec![0; PIECE.min(left)];
        while left > 0 {
            let part = left.min(piece.len());
            self.fill(&mut piece[..part], over)?;
            left -= part;
        }
        Ok(())
    }

    /// Fills a piece. Idle is allowed; once a message has begun it has to come.
    fn fill(&mut self, piece: &mut [u8], over: &dyn Fn() -> bool) -> Result<(), Lack> {
        let mut filled = 0;
        while filled < piece.len() {
            if over() {
                return Err(Lack::Gone);
            }
            if self.began.is_some_and(|began| began.elapsed() > IN_TIME) {
                return Err(Lack::Late);
            }
            match (&mut &*self.stream).read(&mut piece[filled..]) {
                Ok(0) => return Err(Lack::Gone),
                Ok(read) => {
                    filled += read;
                    self.began.get_or_insert_with(Instant::now);
                }
                Err(error) => match error.kind() {
                    ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted => {}
                    _ => return Err(Lack::Gone),
                },
            }
        }
        Ok(())
    }
}

impl From<Lack> for Came {
    fn from(lack: Lack) -> Self {
        match lack {
            Lack::Late => Self::Late,
            Lack::Gone => Self::Gone,
        }
    }
}
