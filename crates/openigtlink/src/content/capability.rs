//! CAPABILITY: type names, 12 bytes each.

use crate::error::Refusal;
use crate::name::Name;
use crate::reader::Reader;

/// Bytes of a name.
pub(crate) const BYTES: usize = 12;

/// Most names of one message. More would cost more memory than they have bytes.
pub(crate) const NAMES: usize = 1000;

/// Reads a CAPABILITY.
pub(crate) fn read(bytes: &[u8]) -> Result<Vec<String>, Refusal> {
    let mut reader = Reader::new(bytes, "a CAPABILITY has 12 bytes for each of its type names");
    let count = bytes.len() / BYTES;
    if count > NAMES {
        return Err(Refusal::TooMany {
            what: "type names",
            count: count as u64,
            limit: NAMES as u64,
        });
    }
    let mut names = Vec::with_capacity(count);
    while reader.left() > 0 {
        names.push(Name::<BYTES>::read(reader.array()?).to_string());
    }
    Ok(names)
}

/// Adds names as they go over the wire.
pub(crate) fn put(out: &mut Vec<u8>, names: &[String]) {
    for name in names {
        out.extend_from_slice(Name::<BYTES>::new(name).field());
    }
}
