//! Texts in WinAnsiEncoding, the letters of the standard fonts (ISO 32000-1, annex D).

/// Letters of the codes 0x80 to 0x9F, of which five are none; those of 0xA0 to 0xFF are their own
/// numbers.
const UPPER: [char; 32] = [
    '€', '\0', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\0', 'Ž', '\0', '\0', '‘',
    '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\0', 'ž', 'Ÿ',
];

/// Base letters of U+0100 to U+017F (Latin Extended-A), in their order.
const BASE: &[u8; 128] = b"AaAaAaCcCcCcCcDdDdEeEeEeEeEeGgGgGgGgHhHhIiIiIiIiIiIiJjKkkLlLlLlLlLlNnNnNnnNnOoOoOoOoRrRrRrSsSsSsSsTtTtTtUuUuUuUuUuUuWwYyYZzZzZzs";

/// The text in WinAnsiEncoding, and whether every letter of it kept its shape. Latin letters that
/// the encoding lacks become their base letters, all others question marks; signs for which it has
/// an equal become that.
pub(super) fn ansi(text: &str) -> (Vec<u8>, bool) {
    let (mut bytes, mut whole) = (Vec::with_capacity(text.len()), true);
    for letter in text.chars() {
        let code = u32::from(letter);
        match letter {
            ' '..='~' => bytes.push(letter as u8),
            '\u{a0}'..='\u{ff}' => bytes.push(code as u8),
            // Minus signs and hyphens.
            '\u{2212}' | '\u{2010}' | '\u{2011}' => bytes.push(b'-'),
            // Narrow and thin spaces, which hold figures together.
            '\u{202f}' | '\u{2009}' => bytes.push(0xA0),
            '≤' => bytes.extend(b"<="),
            '≥' => bytes.extend(b">="),
            '′' => bytes.push(b'\''),
            '″' => bytes.push(b'"'),
            _ => {
                let upper = UPPER.iter().position(|&known| known == letter && known != '\0');
                bytes.push(match (upper, letter) {
                    (Some(at), _) => 0x80 + at as u8,
                    (None, '\u{100}'..='\u{17f}') => {
                        whole = false;
                        BASE[code as usize - 0x100]
                    }
                    (None, _) => {
                        whole = false;
                        b'?'
                    }
                });
            }
        }
    }
    (bytes, whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_of_the_report_keep_their_meaning() {
        assert_eq!(ansi("−2.3°, 4 cm²"), (b"-2.3\xB0, 4 cm\xB2".to_vec(), true));
        assert_eq!(ansi("“net” – 1\u{202f}234"), (b"\x93net\x94 \x96 1\xA0234".to_vec(), true));
        assert_eq!(ansi("≤ 5′"), (b"<= 5'".to_vec(), true));
        assert_eq!(ansi("Müller, Zoë €"), (b"M\xFCller, Zo\xEB \x80".to_vec(), true));
    }

    #[test]
    fn letters_that_are_lacking_are_said() {
        assert_eq!(ansi("Łuszczyńska"), (b"Luszczynska".to_vec(), false));
        assert_eq!(ansi("Dvořák, Şener, ı"), (b"Dvor\xE1k, Sener, i".to_vec(), false));
        assert_eq!(ansi("Иванова"), (b"???????".to_vec(), false));
        assert_eq!(ansi("山田"), (b"??".to_vec(), false));
    }

    #[test]
    fn no_control_letter_is_written() {
        let (bytes, whole) = ansi("a\nb\u{81}");
        assert_eq!((bytes, whole), (b"a?b?".to_vec(), false));
    }
}
