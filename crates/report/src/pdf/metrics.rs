//! Widths of Helvetica and Helvetica-Bold, and texts cut into lines by them.

use std::ops::Range;

/// One of the two fonts, which every reader of PDF has (ISO 32000-1, 9.6.2.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Font {
    Plain,
    Bold,
}

/// Widths of Helvetica for the codes 32 to 255 of WinAnsiEncoding, 1/1000 of the size (Adobe's font
/// metrics, AFM 4.1).
#[rustfmt::skip]
const PLAIN: [u16; 224] = [
    278, 278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333, 278, 278,
    556, 556, 556, 556, 556, 556, 556, 556, 556, 556, 278, 278, 584, 584, 584, 556,
    1015, 667, 667, 722, 722, 667, 611, 778, 722, 278, 500, 667, 556, 833, 722, 778,
    667, 778, 722, 667, 611, 722, 667, 944, 667, 667, 611, 278, 278, 278, 469, 556,
    333, 556, 556, 500, 556, 556, 278, 556, 556, 222, 222, 500, 222, 833, 556, 556,
    556, 556, 333, 500, 278, 556, 500, 722, 500, 500, 500, 334, 260, 334, 584, 350,
    556, 350, 222, 556, 333, 1000, 556, 556, 333, 1000, 667, 333, 1000, 350, 611, 350,
    350, 222, 222, 333, 333, 350, 556, 1000, 333, 1000, 500, 333, 944, 350, 500, 667,
    278, 333, 556, 556, 556, 556, 260, 556, 333, 737, 370, 556, 584, 333, 737, 333,
    400, 584, 333, 333, 333, 556, 537, 278, 333, 333, 365, 556, 834, 834, 834, 611,
    667, 667, 667, 667, 667, 667, 1000, 722, 667, 667, 667, 667, 278, 278, 278, 278,
    722, 722, 778, 778, 778, 778, 778, 584, 778, 722, 722, 722, 722, 667, 667, 611,
    556, 556, 556, 556, 556, 556, 889, 500, 556, 556, 556, 556, 278, 278, 278, 278,
    556, 556, 556, 556, 556, 556, 556, 584, 611, 556, 556, 556, 556, 500, 556, 500,
];
/// Widths of Helvetica-Bold for the codes 32 to 255 of WinAnsiEncoding, 1/1000 of the size (Adobe's
/// font metrics, AFM 4.1).
#[rustfmt::skip]
const BOLD: [u16; 224] = [
    278, 333, 474, 556, 556, 889, 722, 238, 333, 333, 389, 584, 278, 333, 278, 278,
    556, 556, 556, 556, 556, 556, 556, 556, 556, 556, 333, 333, 584, 584, 584, 611,
    975, 722, 722, 722, 722, 667, 611, 778, 722, 278, 556, 722, 611, 833, 722, 778,
    667, 778, 722, 667, 611, 722, 667, 944, 667, 667, 611, 333, 278, 333, 584, 556,
    333, 556, 611, 556, 611, 556, 333, 611, 611, 278, 278, 556, 278, 889, 611, 611,
    611, 611, 389, 556, 333, 611, 556, 778, 556, 556, 500, 389, 280, 389, 584, 350,
    556, 350, 278, 556, 500, 1000, 556, 556, 333, 1000, 667, 333, 1000, 350, 611, 350,
    350, 278, 278, 500, 500, 350, 556, 1000, 333, 1000, 556, 333, 944, 350, 500, 667,
    278, 333, 556, 556, 556, 556, 280, 556, 333, 737, 370, 556, 584, 333, 737, 333,
    400, 584, 333, 333, 333, 611, 556, 278, 333, 333, 365, 556, 834, 834, 834, 611,
    722, 722, 722, 722, 722, 722, 1000, 722, 667, 667, 667, 667, 278, 278, 278, 278,
    722, 722, 778, 778, 778, 778, 778, 584, 778, 722, 722, 722, 722, 667, 667, 611,
    556, 556, 556, 556, 556, 556, 889, 556, 556, 556, 556, 556, 278, 278, 278, 278,
    611, 611, 611, 611, 611, 611, 611, 584, 611, 611, 611, 611, 611, 556, 611, 556,
];

/// Width of a text, points.
pub(super) fn width(text: &[u8], font: Font, size: f64) -> f64 {
    let table = if font == Font::Bold { &BOLD } else { &PLAIN };
    let of = |code: &u8| table.get(usize::from(*code).wrapping_sub(32)).copied().unwrap_or(0);
    let thousandths: u32 = text.iter().map(|code| u32::from(of(code))).sum();
    f64::from(thousandths) * size / 1000.0
}

/// The ranges of a text that fit a width, in points, one per line: broken at spaces, and within a
/// word only where it is wider than a whole line.
pub(super) fn lines(text: &[u8], font: Font, size: f64, wide: f64) -> Vec<Range<usize>> {
    let fits = |from: usize, to: usize| width(&text[from..to], font, size) <= wide;
    let mut found = Vec::new();
    let mut from = 0;
    while from < text.len() {
        let mut end = text.len();
        if !fits(from, end) {
            let longest = (from + 1..text.len()).take_while(|&to| fits(from, to)).last();
            let longest = longest.unwrap_or(from + 1);
            let space = (from + 1..=longest).rev().find(|&at| text[at] == b' ');
            end = space.unwrap_or(longest);
        }
        found.push(from..end);
        from = end + usize::from(text.get(end) == Some(&b' '));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_are_those_of_the_fonts() {
        // Figures of the font metrics: space 278, A 667 and 722, a 556.
        assert_eq!(width(b"A a", Font::Plain, 10.0), 15.01);
        assert_eq!(width(b"A a", Font::Bold, 10.0), 15.56);
        // The minus of the text is the hyphen, the degree sign 400.
        assert_eq!(width(&[0xB0], Font::Plain, 10.0), 4.0);
    }

    #[test]
    fn lines_hold_all_words_and_are_no_wider_than_they_may() {
        let text =
            b"The tumour moves 11.2 mm (95 %: 6.0 to 17.6 mm) 2.25.123456789012345678901234567890";
        for wide in [20.0, 55.0, 90.0, 1000.0] {
            let found = lines(text, Font::Plain, 9.0, wide);
            assert!(found.iter().all(|l| width(&text[l.clone()], Font::Plain, 9.0) <= wide));
            let joined: Vec<u8> = found.iter().flat_map(|l| text[l.clone()].to_vec()).collect();
            let plain =
                |text: &[u8]| text.iter().copied().filter(|c| *c != b' ').collect::<Vec<u8>>();
            assert_eq!(plain(&joined), plain(text), "{wide}");
        }
        assert_eq!(lines(b"one two", Font::Plain, 9.0, 20.0), [0..3, 4..7]);
        assert!(lines(b"", Font::Plain, 9.0, 20.0).is_empty());
    }
}
