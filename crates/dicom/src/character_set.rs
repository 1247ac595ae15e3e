//! Texts in their Specific Character Set (PS3.3 C.12.1.1.2), with code extensions (PS3.5 6.1.2.5).

use crate::data_set::{DataSet, text_of};
use dicom_core::Tag;
use dicom_dictionary_std::tags;
use dicom_encoding::text::{SpecificCharacterSet, TextCodec};

/// Begins an escape sequence.
pub(crate) const ESCAPE: u8 = 0x1B;

/// What stands for a set of letters in the upper or lower half of the codes: the name by which it
/// is decoded, and the sequence that the decoder wants to see before and after.
#[derive(Clone, Copy, Debug)]
enum Letters {
    /// One byte a letter, or two with the highest bit set.
    Named(&'static str),
    /// Two bytes of seven bits a letter, after this sequence.
    Kanji(&'static [u8]),
    /// ISO 8859-9, which is no set of the decoder's: Latin-1 but for six letters.
    Turkish,
}

/// Escape sequences, whether they are of the upper half, and what they begin (PS3.3 tables C.12-3
/// and C.12-4).
const SEQUENCES: [(&[u8], bool, Letters); 17] = [
    (b"(B", false, Letters::Named("ISO_IR 6")),
    (b"(J", false, Letters::Named("ISO_IR 6")),
    (b"$B", false, Letters::Kanji(b"\x1b$B")),
    (b"$(D", false, Letters::Kanji(b"\x1b$(D")),
    (b")I", true, Letters::Named("ISO_IR 13")),
    (b"-A", true, Letters::Named("ISO_IR 100")),
    (b"-B", true, Letters::Named("ISO_IR 101")),
    (b"-C", true, Letters::Named("ISO_IR 109")),
    (b"-D", true, Letters::Named("ISO_IR 110")),
    (b"-F", true, Letters::Named("ISO_IR 126")),
    (b"-G", true, Letters::Named("ISO_IR 127")),
    (b"-H", true, Letters::Named("ISO_IR 138")),
    (b"-L", true, Letters::Named("ISO_IR 144")),
    (b"-M", true, Letters::Turkish),
    (b"-T", true, Letters::Named("ISO_IR 166")),
    (b"$)C", true, Letters::Named("ISO_IR 149")),
    (b"$)A", true, Letters::Named("ISO 2022 IR 58")),
];

/// A text of an object without padding, in the character set that the object names.
pub(crate) fn readable(header: &DataSet, tag: Tag) -> String {
    readable_in(&header.text(tags::SPECIFIC_CHARACTER_SET), header, tag)
}

/// A text of an item without padding; `sets` as its object names them, the item may name others.
pub(crate) fn readable_in(sets: &str, item: &DataSet, tag: Tag) -> String {
    let own = item.text(tags::SPECIFIC_CHARACTER_SET);
    let sets = if own.is_empty() { sets } else { &own };
    let text = decode(sets, item.bytes(tag).unwrap_or_default());
    text.trim_matches([' ', '\0']).into()
}

/// The text that bytes are in the sets of a Specific Character Set; what is no text there is read
/// as UTF-8 or Latin-1.
pub(crate) fn decode(sets: &str, bytes: &[u8]) -> String {
    if bytes.contains(&ESCAPE) {
        return extended(sets, bytes).unwrap_or_else(|| text_of(bytes));
    }
    let first = sets.split('\\').map(str::trim).find(|name| !name.is_empty());
    first.and_then(|name| letters(name).text(bytes)).unwrap_or_else(|| text_of(bytes))
}

/// Whether every set that a Specific Character Set names is known.
pub(crate) fn is_known(sets: &str) -> bool {
    let known = |name: &str| match letters(name) {
        Letters::Named(known) => !known.is_empty() || name.is_empty() || name.ends_with(" 159"),
        Letters::Kanji(_) | Letters::Turkish => true,
    };
    sets.split('\\').map(str::trim).all(known)
}

/// Whether bytes are a text in known sets.
pub(crate) fn holds(sets: &str, bytes: &[u8]) -> bool {
    let text = match sets {
        "" | "ISO_IR 6" => return bytes.is_ascii(),
        // The decoder puts question marks.
        "ISO_IR 192" => return std::str::from_utf8(bytes).is_ok(),
        // What Latin-1 has no letters for is read all the same.
        "ISO_IR 100" => return !bytes.iter().any(|b| (0x80..0xA0).contains(b)),
        _ if bytes.contains(&ESCAPE) => extended(sets, bytes),
        _ => {
            let first = sets.split('\\').map(str::trim).find(|name| !name.is_empty());
            first.and_then(|name| letters(name).text(bytes))
        }
    };
    text.is_some_and(|text| !text.contains(char::REPLACEMENT_CHARACTER))
}

/// The letters of a defined term.
fn letters(name: &str) -> Letters {
    let names = SEQUENCES.iter().filter_map(|(.., letters)| match letters {
        Letters::Named(known) => Some(*known),
        _ => None,
    });
    let alone = ["ISO_IR 192", "ISO_IR 87", "GB18030", "GBK"];
    let number = name.rsplit(' ').next().unwrap_or_default();
    let same = |known: &&str| *known == name || known.rsplit(' ').next() == Some(number);
    match number {
        "148" => Letters::Turkish,
        _ => names.chain(alone).find(same).map_or(Letters::Named(""), Letters::Named),
    }
}

impl Letters {
    fn text(self, bytes: &[u8]) -> Option<String> {
        let by =
            |name: &str, bytes: &[u8]| SpecificCharacterSet::from_code(name)?.decode(bytes).ok();
        match self {
            Self::Named(name) => by(name, bytes),
            Self::Kanji(before) => by("ISO_IR 87", &[before, bytes, b"\x1b(B"].concat()),
            Self::Turkish => Some(bytes.iter().map(|byte| turkish(*byte)).collect()),
        }
    }
}

fn turkish(byte: u8) -> char {
    match byte {
        0xD0 => 'Ğ',
        0xDD => 'İ',
        0xDE => 'Ş',
        0xF0 => 'ğ',
        0xFD => 'ı',
        0xFE => 'ş',
        other => char::from(other),
    }
}

/// A text with question marks for letters beyond ASCII.
pub(crate) fn question_marks(bytes: &[u8]) -> Vec<u8> {
    let ascii = |c: char| u8::try_from(c).ok().filter(u8::is_ascii).unwrap_or(b'?');
    match extended("", bytes).filter(|_| bytes.contains(&ESCAPE)) {
        Some(text) => text.chars().map(ascii).collect(),
        None => {
            let plain = |&b: &u8| if b.is_ascii() && b != ESCAPE { b } else { b'?' };
            bytes.iter().map(plain).collect()
        }
    }
}

/// A text with escape sequences.
fn extended(sets: &str, bytes: &[u8]) -> Option<String> {
    let first = sets.split('\\').next().map(str::trim).filter(|name| !name.is_empty());
    let begin = [Letters::Named("ISO_IR 6"), first.map_or(Letters::Named("ISO_IR 6"), letters)];
    let (mut now, mut text, mut rest) = (begin, String::new(), bytes);
    while let Some((&byte, after)) = rest.split_first() {
        if byte == ESCAPE {
            let (sequence, upper, letters) =
                SEQUENCES.iter().find(|(sequence, ..)| after.starts_with(sequence))?;
            now[usize::from(*upper)] = *letters;
            rest = &after[sequence.len()..];
            continue;
        }
        let is_kanji = matches!(now[0], Letters::Kanji(_));
        // Between the parts of a name and between values the first sets are those of the beginning.
        if !is_kanji && matches!(byte, b'^' | b'=' | b'\\' | b'\r' | b'\n' | b'\t' | 0x0C) {
            text.push(char::from(byte));
            (now, rest) = (begin, after);
            continue;
        }
        let half = usize::from(byte >= 0x80);
        let ends = |b: &u8| {
            *b == ESCAPE
                || usize::from(*b >= 0x80) != half
                || (!is_kanji && b"^=\\\r\n\t\x0c".contains(b))
        };
        let length = rest.iter().position(ends).unwrap_or(rest.len());
        text += &now[half].text(&rest[..length])?;
        rest = &rest[length..];
    }
    Some(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names of PS3.5 annexes H, I, J and K, and single sets.
    #[test]
    fn names_are_those_of_the_standard() {
        let cases: [(&str, &[u8], &str); 11] = [
            (
                "\\ISO 2022 IR 87",
                b"Yamada^Tarou=\x1b$B;3ED\x1b(B^\x1b$BB@O:\x1b(B=\x1b$B$d$^$@\x1b(B^\x1b$B$?$m$&\x1b(B",
                "Yamada^Tarou=山田^太郎=やまだ^たろう",
            ),
            (
                "ISO 2022 IR 13\\ISO 2022 IR 87",
                b"\xd4\xcf\xc0\xde^\xc0\xdb\xb3=\x1b$B;3ED\x1b(J^\x1b$BB@O:\x1b(J=\x1b$B$d$^$@\x1b(J^\x1b$B$?$m$&\x1b(J",
                "ﾔﾏﾀﾞ^ﾀﾛｳ=山田^太郎=やまだ^たろう",
            ),
            (
                "\\ISO 2022 IR 149",
                b"Hong^Gildong=\x1b$)C\xfb\xf3^\x1b$)C\xd1\xce\xd4\xd7=\x1b$)C\xc8\xab^\x1b$)C\xb1\xe6\xb5\xbf",
                "Hong^Gildong=洪^吉洞=홍^길동",
            ),
            (
                "\\ISO 2022 IR 58",
                b"Zhang^XiaoDong=\x1b$)A\xd5\xc5^\x1b$)A\xd0\xa1\xb6\xab=",
                "Zhang^XiaoDong=张^小东=",
            ),
            ("\\ISO 2022 IR 159", b"\x1b$(D0!\x1b(B", "丂"),
            ("ISO_IR 192", "Wang^XiaoDong=王^小东=".as_bytes(), "Wang^XiaoDong=王^小东="),
            ("GB18030", b"Wang^XiaoDong=\xcd\xf5^\xd0\xa1\xb6\xab=", "Wang^XiaoDong=王^小东="),
            ("ISO_IR 144", b"\xbb\xee\xda\xe1\xd5\xdc\xd1\xe3\xe0\xd3", "Люксембург"),
            ("ISO_IR 100", b"\xc4neas^R\xfcdiger", "Äneas^Rüdiger"),
            ("ISO_IR 148", b"\xc7avu\xfeo\xf0lu", "Çavuşoğlu"),
            ("ISO 2022 IR 100\\ISO 2022 IR 144", b"Buc^J\xe9r\xf4me=\x1b-L\xbb\xee", "Buc^Jérôme=Лю"),
        ];
        for (sets, bytes, want) in cases {
            assert_eq!(decode(sets, bytes), want, "{sets}");
            assert!(is_known(sets) && holds(sets, bytes), "{sets}");
        }
    }

    #[test]
    fn what_is_in_no_set_is_still_read() {
        assert!(!is_known("NONSENSE"));
        assert!(!holds("ISO_IR 192", b"J\xe9r"));
        assert_eq!(decode("NONSENSE", b"J\xe9r\xf4me"), "Jérôme");
        assert_eq!(decode("", "Jérôme".as_bytes()), "Jérôme");
        // An escape sequence that nobody knows, and one that is cut off.
        for bytes in [&b"\x1b%Z"[..], b"Y\x1b$"] {
            assert_eq!(decode("\\ISO 2022 IR 87", bytes), text_of(bytes));
            assert!(!holds("\\ISO 2022 IR 87", bytes));
        }
    }
}
