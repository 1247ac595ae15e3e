//! Reading numbers from bytes that may end anywhere.

use crate::error::Refusal;

/// What is left of some bytes. Reading beyond them is refused with the rule they break.
#[derive(Debug)]
pub(crate) struct Reader<'a> {
    left: &'a [u8],
    rule: &'static str,
}

impl<'a> Reader<'a> {
    /// All of these bytes; the rule says how they should be laid out.
    pub(crate) fn new(bytes: &'a [u8], rule: &'static str) -> Self {
        Self { left: bytes, rule }
    }

    /// Bytes left.
    pub(crate) fn left(&self) -> usize {
        self.left.len()
    }

    /// That the rule is broken.
    pub(crate) fn refuse<T>(&self) -> Result<T, Refusal> {
        Err(Refusal::Form(self.rule))
    }

    /// Refuses bytes that nobody has asked for.
    pub(crate) fn end(&self) -> Result<(), Refusal> {
        if self.left.is_empty() { Ok(()) } else { self.refuse() }
    }

    /// The next so many bytes.
    pub(crate) fn take(&mut self, bytes: u64) -> Result<&'a [u8], Refusal> {
        let split = usize::try_from(bytes).ok().and_then(|bytes| self.left.split_at_checked(bytes));
        let Some((taken, left)) = split else { return self.refuse() };
        self.left = left;
        Ok(taken)
    }

    /// All bytes left.
    pub(crate) fn rest(&mut self) -> &'a [u8] {
        std::mem::take(&mut self.left)
    }

    /// The next N bytes.
    pub(crate) fn array<const N: usize>(&mut self) -> Result<&'a [u8; N], Refusal> {
        let Some((taken, left)) = self.left.split_first_chunk() else { return self.refuse() };
        self.left = left;
        Ok(taken)
    }

    /// The bytes before the next NUL, which is taken too.
    pub(crate) fn until_nul(&mut self) -> Result<&'a [u8], Refusal> {
        let Some(end) = self.left.iter().position(|&byte| byte == 0) else { return self.refuse() };
        let taken = self.take(end as u64)?;
        self.u8()?;
        Ok(taken)
    }

    pub(crate) fn u8(&mut self) -> Result<u8, Refusal> {
        self.array().map(|[byte]| *byte)
    }

    pub(crate) fn u16(&mut self) -> Result<u16, Refusal> {
        self.array().map(|bytes| u16::from_be_bytes(*bytes))
    }

    pub(crate) fn u32(&mut self) -> Result<u32, Refusal> {
        self.array().map(|bytes| u32::from_be_bytes(*bytes))
    }

    pub(crate) fn u64(&mut self) -> Result<u64, Refusal> {
        self.array().map(|bytes| u64::from_be_bytes(*bytes))
    }

    pub(crate) fn u16s<const N: usize>(&mut self) -> Result<[u16; N], Refusal> {
        let mut values = [0; N];
        for value in &mut values {
            *value = self.u16()?;
        }
        Ok(values)
    }

    pub(crate) fn f32s<const N: usize>(&mut self) -> Result<[f32; N], Refusal> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.array().map(|bytes| f32::from_be_bytes(*bytes))?;
        }
        Ok(values)
    }
}

/// Adds numbers, big-endian.
pub(crate) fn put_f32s(out: &mut Vec<u8>, values: &[f32]) {
    out.reserve(4 * values.len());
    for value in values {
        out.extend_from_slice(&value.to_be_bytes());
    }
}

/// Adds numbers, big-endian.
pub(crate) fn put_u16s(out: &mut Vec<u8>, values: &[u16]) {
    for value in values {
        out.extend_from_slice(&value.to_be_bytes());
    }
}

/// Adds numbers, big-endian.
pub(crate) fn put_u32s(out: &mut Vec<u8>, values: &[u32]) {
    out.reserve(4 * values.len());
    for value in values {
        out.extend_from_slice(&value.to_be_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reading_stops_at_the_end() {
        let mut reader = Reader::new(&[1, 2, 3], "three bytes");
        assert_eq!(reader.u16(), Ok(0x0102));
        assert_eq!(reader.u16(), Err(Refusal::Form("three bytes")));
        assert_eq!(reader.take(u64::MAX), Err(Refusal::Form("three bytes")));
        assert_eq!(reader.end(), Err(Refusal::Form("three bytes")));
        assert_eq!((reader.u8(), reader.left()), (Ok(3), 0));
        assert_eq!(reader.end(), Ok(()));
    }
}
