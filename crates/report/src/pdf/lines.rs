//! Texts cut into lines.

use crate::fonts::Face;
use std::ops::Range;

/// The ranges of a text that fit a width, in points, one per line: broken at spaces, and within a
/// word only where it is wider than a whole line.
pub(super) fn lines(text: &str, face: Face, size: f64, wide: f64) -> Vec<Range<usize>> {
    let letters = face.line(text);
    let count = letters.len();
    let is_space = |at: usize| at < count && &text[letters[at].bytes.clone()] == " ";
    let byte = |at: usize| letters.get(at).map_or(text.len(), |letter| letter.bytes.start);
    let (mut found, mut from) = (Vec::new(), 0);
    while from < count {
        let begin = letters[from].x;
        let sticks_out = |at: &usize| (letters[*at].x + letters[*at].advance - begin) * size > wide;
        let end = (from..count).find(sticks_out).map_or(count, |over| {
            let longest = over.max(from + 1);
            (from + 1..=longest).rev().find(|&at| is_space(at)).unwrap_or(longest)
        });
        found.push(byte(from)..byte(end));
        from = end + usize::from(is_space(end));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_hold_all_words_and_are_no_wider_than_they_may() {
        let text =
            "The tumour moves −11.2 mm (95 %: 6.0 to 17.6 mm) 2.25.123456789012345678901234567890";
        for wide in [20.0, 55.0, 90.0, 1000.0] {
            let found = lines(text, Face::Plain, 9.0, wide);
            assert!(found.iter().all(|l| 9.0 * Face::Plain.width(&text[l.clone()]) <= wide + 1e-9));
            let joined: String = found.iter().map(|l| &text[l.clone()]).collect();
            assert_eq!(joined.replace(' ', ""), text.replace(' ', ""), "{wide}");
        }
        assert_eq!(lines("one two", Face::Plain, 9.0, 20.0), [0..3, 4..7]);
        assert!(lines("", Face::Plain, 9.0, 20.0).is_empty());
    }
}
