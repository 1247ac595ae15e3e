//! Names in fields of fixed width, and text that may hold bytes of any kind.

use std::fmt;

/// A name in a field of N bytes: it ends at the first NUL, or fills the field without one.
///
/// The protocol wants ASCII. Other bytes are kept as they came and shown as one character each
/// (U+0080 to U+00FF), so that a peer gets its own name back to the byte. A name may hold control
/// characters: show it to a person with `{:?}`, which escapes them.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Name<const N: usize>([u8; N]);

impl<const N: usize> Name<N> {
    /// The name in a field as received; what follows the first NUL is ignored.
    pub fn read(field: &[u8; N]) -> Self {
        Self::of(field.iter().copied())
    }

    /// The field that carries a name: cut after N characters or before a NUL, filled up with NULs.
    /// Characters above U+00FF become `?`.
    pub fn new(name: &str) -> Self {
        Self::of(name.chars().map(|c| u8::try_from(u32::from(c)).unwrap_or(b'?')))
    }

    fn of(bytes: impl Iterator<Item = u8>) -> Self {
        let mut field = [0; N];
        for (place, byte) in field.iter_mut().zip(bytes.take_while(|&byte| byte != 0)) {
            *place = byte;
        }
        Self(field)
    }

    /// The whole field, with its NULs.
    pub fn field(&self) -> &[u8; N] {
        &self.0
    }

    /// The bytes before the first NUL.
    pub fn bytes(&self) -> &[u8] {
        let end = self.0.iter().position(|&byte| byte == 0).unwrap_or(N);
        self.0.get(..end).unwrap_or_default()
    }

    /// Whether there is no name.
    pub fn is_empty(&self) -> bool {
        self.bytes().is_empty()
    }
}

impl<const N: usize> Default for Name<N> {
    fn default() -> Self {
        Self([0; N])
    }
}

impl<const N: usize> From<&str> for Name<N> {
    fn from(name: &str) -> Self {
        Self::new(name)
    }
}

impl<const N: usize> fmt::Display for Name<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.bytes().iter().try_for_each(|&byte| fmt::Write::write_char(f, char::from(byte)))
    }
}

impl<const N: usize> fmt::Debug for Name<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "\"{}\"", self.bytes().escape_ascii())
    }
}

/// Text as received: UTF-8, each byte that is not becomes a `?`. Never longer than the bytes.
pub(crate) fn readable(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(bytes.len());
    for chunk in bytes.utf8_chunks() {
        text.push_str(chunk.valid());
        text.extend(chunk.invalid().iter().map(|_| '?'));
    }
    text
}

/// The longest beginning of a text that has at most so many bytes and cuts no character in two.
pub(crate) fn cut(text: &str, bytes: usize) -> &str {
    text.get(..text.floor_char_boundary(bytes)).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_cut_to_its_field_and_may_fill_it() {
        assert_eq!(Name::<4>::new("abcdef").field(), b"abcd");
        assert_eq!(Name::<4>::new("abcdef").to_string(), "abcd");
        assert_eq!(Name::<4>::new("a\0b").field(), b"a\0\0\0");
        assert!(Name::<4>::new("").is_empty() && Name::<4>::default().is_empty());
    }

    #[test]
    fn a_name_ends_at_the_first_nul() {
        let name = Name::<6>::read(b"ab\0xyz");
        assert_eq!(name.to_string(), "ab");
        assert_eq!(name, Name::new("ab"));
    }

    #[test]
    fn every_byte_of_a_name_survives_its_text() {
        for byte in 1..=u8::MAX {
            let name = Name::<2>::read(&[byte, b'x']);
            assert_eq!(Name::new(&name.to_string()), name, "{byte:#x}");
        }
        assert_eq!(Name::<4>::new("a\u{3bc}b").field(), b"a?b\0");
        assert_eq!(format!("{:?}", Name::<4>::read(b"a\n\xff\0")), r#""a\n\xff""#);
    }

    #[test]
    fn text_never_grows_and_is_stable() {
        for bytes in [&b"plain"[..], "\u{e9} \u{b5}m".as_bytes(), b"a\xff\xfe\xc3", b"\xe2\x82"] {
            let text = readable(bytes);
            assert!(text.len() <= bytes.len() && text.capacity() == bytes.len());
            assert_eq!(readable(text.as_bytes()), text);
        }
        assert_eq!(readable(b"a\xff\xfe\xc3"), "a???");
    }

    #[test]
    fn a_cut_keeps_characters_whole() {
        assert_eq!(cut("a\u{e9}b", 2), "a");
        assert_eq!(cut("a\u{e9}b", 3), "a\u{e9}");
        assert_eq!(cut("ab", 9), "ab");
    }
}
