//! What version 2 puts around the content: the extended header before it, metadata after it.

use crate::content::text;
use crate::error::{BodyError, Refusal};
use crate::name::{cut, readable};
use crate::reader::{Reader, put_u16s};

/// Size of the extended header, bytes. A larger one is read, and what is more is skipped.
const EXTENDED: u16 = 12;

/// Most entries of one message. More would cost more memory than they have bytes.
pub(crate) const ENTRIES: usize = 500;

/// Longest value that is written, bytes: with all entries the sum stays below 2^32.
const VALUE: usize = 8 << 20;

/// A body of version 2, taken apart.
#[derive(Debug)]
pub(crate) struct Parts<'a> {
    pub(crate) id: u32,
    pub(crate) content: &'a [u8],
    pub(crate) metadata: Vec<(String, String)>,
}

/// Takes a body of version 2 apart: extended header (u16 its size, u16 size of the metadata's
/// header, u32 size of the metadata's body, u32 message id), content, metadata.
pub(crate) fn read(body: &[u8]) -> Result<Parts<'_>, BodyError> {
    let size = body.len() as u64;
    let bad = |why| BodyError::ExtendedHeader { size, why };
    let mut reader = Reader::new(body, "");
    let cut = |_| bad("12 bytes are needed");
    let extended = reader.u16().map_err(cut)?;
    let header = reader.u16().map_err(cut)?;
    let values = reader.u32().map_err(cut)?;
    let id = reader.u32().map_err(cut)?;
    if extended < EXTENDED {
        return Err(bad("it gives itself less than 12 bytes"));
    }
    // Each is at most 2^32, so that their sum fits.
    let around = u64::from(extended) + u64::from(header) + u64::from(values);
    let Some(content) = size.checked_sub(around) else {
        return Err(bad("it and the metadata are larger than the body: correct the sizes in it"));
    };
    let long = |_| bad("it is longer than the body");
    reader.take(u64::from(extended - EXTENDED)).map_err(long)?;
    let content = reader.take(content).map_err(long)?;
    let header = reader.take(u64::from(header)).map_err(long)?;
    let metadata = entries(header, reader.rest()).map_err(|refusal| match refusal {
        Refusal::Form(why) => BodyError::Metadata { size, why },
        Refusal::TooMany { what, count, limit } => BodyError::TooMany { what, count, limit },
    })?;
    Ok(Parts { id, content, metadata })
}

/// Reads metadata: header u16 count, for each u16 size of the key, u16 encoding, u32 size of the
/// value; body key, value, key, value. Without a header there are none.
fn entries(header: &[u8], body: &[u8]) -> Result<Vec<(String, String)>, Refusal> {
    let mut header = Reader::new(header, "its header has 2 bytes and 8 for each entry");
    let mut body = Reader::new(body, "keys and values have the sizes that the header gives them");
    let count = if header.left() == 0 { 0 } else { header.u16()? };
    if header.left() as u64 != 8 * u64::from(count) {
        return header.refuse();
    }
    if usize::from(count) > ENTRIES {
        let (count, limit) = (u64::from(count), ENTRIES as u64);
        return Err(Refusal::TooMany { what: "entries of metadata", count, limit });
    }
    let mut entries = Vec::with_capacity(usize::from(count));
    for _ in 0..count {
        let key = header.u16()?;
        // Both encodings that occur, ASCII and UTF-8, are read as UTF-8.
        header.u16()?;
        let value = header.u32()?;
        let key = body.take(u64::from(key))?;
        let value = body.take(u64::from(value))?;
        entries.push((readable(key), readable(value)));
    }
    body.end()?;
    Ok(entries)
}

/// Keys and values as they are written: the first 500, each cut to what its size can say.
fn written(metadata: &[(String, String)]) -> impl Iterator<Item = (&str, &str)> {
    metadata
        .iter()
        .take(ENTRIES)
        .map(|(key, value)| (cut(key, usize::from(u16::MAX)), cut(value, VALUE)))
}

/// Sizes of the metadata: their header and their body, bytes.
fn sizes(metadata: &[(String, String)]) -> (u16, u32) {
    written(metadata).fold((2, 0), |(header, body), (key, value)| {
        (header + 8, body + key.len() as u32 + value.len() as u32)
    })
}

/// Bytes of all that is put around a content.
pub(crate) fn bytes(metadata: &[(String, String)]) -> usize {
    let (header, body) = sizes(metadata);
    usize::from(EXTENDED) + usize::from(header) + body as usize
}

/// Adds the extended header.
pub(crate) fn put_extended(out: &mut Vec<u8>, id: u32, metadata: &[(String, String)]) {
    let (header, body) = sizes(metadata);
    put_u16s(out, &[EXTENDED, header]);
    out.extend_from_slice(&body.to_be_bytes());
    out.extend_from_slice(&id.to_be_bytes());
}

/// Adds the metadata. Without any there is still the count.
pub(crate) fn put(out: &mut Vec<u8>, metadata: &[(String, String)]) {
    put_u16s(out, &[written(metadata).count() as u16]);
    for (key, value) in written(metadata) {
        put_u16s(out, &[key.len() as u16, text::encoding(value)]);
        out.extend_from_slice(&(value.len() as u32).to_be_bytes());
    }
    for (key, value) in written(metadata) {
        out.extend_from_slice(key.as_bytes());
        out.extend_from_slice(value.as_bytes());
    }
}
