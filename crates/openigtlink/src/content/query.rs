//! GET_, STT_, STP_ and RTS_: asking for a type, once or again and again, and the answer.

use crate::content::{KINDS, POSITION_TOO};
use crate::error::Refusal;
use crate::name::Name;
use crate::reader::Reader;

/// A query for a type, or the answer to one. The header's device name says whose; empty means any.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Query {
    /// What is asked.
    pub verb: Verb,
    /// Of which type: its whole name, such as TRANSFORM.
    pub of: String,
}

/// What a query asks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verb {
    /// GET_: one message of the type.
    Get,
    /// STT_: messages of the type from now on.
    Start(Start),
    /// STP_: no more of them.
    Stop,
    /// RTS_: whether a start or stop, or a get without another answer, was followed. Send it only
    /// to a peer that has sent one: some cannot take it.
    Reply(Outcome),
}

/// How often messages are wanted. Which form is sent depends on the type.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Start {
    /// Whenever there is something new: no body.
    Plain,
    /// For TDATA and QTDATA: 36 bytes.
    Tracking {
        /// Shortest time between two, ms; 0 for the fastest.
        interval_ms: i32,
        /// Name of the coordinates that are wanted, at most 32 characters.
        coordinates: Name<32>,
    },
    /// For POLYDATA: 8 bytes.
    Interval {
        /// Shortest time between two. The specification calls it nanoseconds in one place and 32.32
        /// seconds in another.
        interval: u64,
    },
}

/// How a query went.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Outcome {
    /// 0: it is followed.
    Done,
    /// 1, and any other number: it is not.
    Failed,
}

/// Names after the prefix that are not the whole type name: what is written comes first of its
/// type. Twelve letters are all that the header has for both, and libraries and specification cut
/// differently.
const SHORT: [(&str, &str); 5] = [
    ("TRANS", "TRANSFORM"),
    ("TRANSFOR", "TRANSFORM"),
    ("CAPABIL", "CAPABILITY"),
    ("CAPABILI", "CAPABILITY"),
    (POSITION_TOO, "POSITION"),
];

/// The prefix of a query's type name and the type it is about; `None` if it is no query for a known
/// type.
pub(crate) fn parts(kind: &str) -> Option<(&'static str, &'static str)> {
    let prefix = ["GET_", "STT_", "STP_", "RTS_"].into_iter().find(|p| kind.starts_with(p))?;
    let name = kind.strip_prefix(prefix)?;
    let short = SHORT.iter().find(|(short, _)| *short == name).map(|(_, whole)| *whole);
    short.or_else(|| KINDS.into_iter().find(|whole| *whole == name)).map(|of| (prefix, of))
}

/// Whether a type is started with interval and coordinates.
fn is_tracking(of: &str) -> bool {
    matches!(of, "TDATA" | "QTDATA")
}

impl Query {
    /// A query for a type by its whole name.
    pub fn new(verb: Verb, of: &str) -> Self {
        Self { verb, of: of.to_owned() }
    }

    /// Reads the body of a query. That of GET_ and STP_ is empty in all libraries; the
    /// specification leaves it to the type, so what is there is passed over.
    pub(crate) fn read(prefix: &str, of: &str, bytes: &[u8]) -> Result<Self, Refusal> {
        let verb = match prefix {
            "GET_" => Verb::Get,
            "STP_" => Verb::Stop,
            "STT_" => Verb::Start(Start::read(of, bytes)?),
            _ => {
                let mut reader =
                    Reader::new(bytes, "RTS_ has one byte: 0 for success, 1 for failure");
                let outcome = if reader.u8()? == 0 { Outcome::Done } else { Outcome::Failed };
                reader.end()?;
                Verb::Reply(outcome)
            }
        };
        Ok(Self { verb, of: of.to_owned() })
    }

    /// The type name on the wire.
    pub(crate) fn kind(&self) -> Name<12> {
        let prefix = match self.verb {
            Verb::Get => "GET_",
            Verb::Start(_) => "STT_",
            Verb::Stop => "STP_",
            Verb::Reply(_) => "RTS_",
        };
        let short = SHORT.iter().find(|(_, whole)| *whole == self.of && *whole != "POSITION");
        let name = short.map_or(self.of.as_str(), |(short, _)| *short);
        Name::new(&format!("{prefix}{name}"))
    }

    /// Adds the body as it goes over the wire.
    pub(crate) fn put(&self, out: &mut Vec<u8>) {
        match &self.verb {
            Verb::Get | Verb::Stop => {}
            Verb::Reply(Outcome::Done) => out.push(0),
            Verb::Reply(Outcome::Failed) => out.push(1),
            Verb::Start(start) => start.put(&self.of, out),
        }
    }
}

impl Start {
    /// Reads the body of STT_ for a type.
    fn read(of: &str, bytes: &[u8]) -> Result<Self, Refusal> {
        let tracking = is_tracking(of);
        let rule = if tracking {
            "STT_TDATA and STT_QTDATA have 36 bytes: i32 interval in ms, char[32] coordinates"
        } else {
            "STT_ of this type has no body, or 8 bytes: u64 interval"
        };
        let mut reader = Reader::new(bytes, rule);
        match (tracking, bytes.len()) {
            (true, 36) => Ok(Self::Tracking {
                interval_ms: i32::from_be_bytes(*reader.array()?),
                coordinates: Name::read(reader.array()?),
            }),
            (false, 0) => Ok(Self::Plain),
            (false, 8) => Ok(Self::Interval { interval: reader.u64()? }),
            _ => reader.refuse(),
        }
    }

    /// Adds the body for a type; where that has another form, with what both have in common.
    fn put(&self, of: &str, out: &mut Vec<u8>) {
        match (is_tracking(of), self) {
            (true, Self::Tracking { interval_ms, coordinates }) => {
                out.extend_from_slice(&interval_ms.to_be_bytes());
                out.extend_from_slice(coordinates.field());
            }
            (true, Self::Plain | Self::Interval { .. }) => out.extend_from_slice(&[0; 36]),
            (false, Self::Interval { interval }) => out.extend_from_slice(&interval.to_be_bytes()),
            (false, Self::Plain | Self::Tracking { .. }) => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_and_long_names_ask_for_the_same() {
        for name in ["GET_TRANS", "GET_TRANSFOR"] {
            assert_eq!(parts(name), Some(("GET_", "TRANSFORM")), "{name}");
        }
        assert_eq!(parts("STT_TRANSFOR"), Some(("STT_", "TRANSFORM")));
        assert_eq!(parts("GET_CAPABIL"), Some(("GET_", "CAPABILITY")));
        assert_eq!(parts("GET_QTRANS"), Some(("GET_", "POSITION")));
        assert_eq!(parts("GET_NOSUCH"), None);
        assert_eq!(parts("TRANS"), None);
        assert_eq!(parts("get_TRANS"), None);
    }

    #[test]
    fn every_query_fits_into_the_header_and_comes_back() {
        let tracking = Start::Tracking { interval_ms: -3, coordinates: "Patient".into() };
        let starts = [Start::Plain, tracking, Start::Interval { interval: 7 }];
        let mut verbs = vec![Verb::Get, Verb::Stop];
        verbs.extend(starts.map(Verb::Start));
        verbs.extend([Outcome::Done, Outcome::Failed].map(Verb::Reply));
        for of in KINDS {
            for verb in &verbs {
                let query = Query::new(verb.clone(), of);
                let kind = query.kind().to_string();
                let mut body = Vec::new();
                query.put(&mut body);
                let (prefix, whole) = parts(&kind).expect("a known query");
                assert_eq!(whole, of);
                let back = Query::read(prefix, whole, &body).expect("what we write is read");
                let same_form = match verb {
                    Verb::Start(Start::Tracking { .. }) => is_tracking(of),
                    Verb::Start(_) => !is_tracking(of),
                    _ => true,
                };
                assert_eq!(back == query, same_form, "{kind} {verb:?}");
            }
        }
    }
}
