//! The letters of pictures and PDF: DejaVu Sans Condensed, embedded, so that they are the same
//! everywhere.

use skrifa::instance::{LocationRef, Size};
use skrifa::raw::TableProvider;
use skrifa::{FontRef, GlyphId, MetadataProvider};

/// One of the two faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Face {
    Plain,
    Bold,
}

/// A letter in its place.
#[derive(Clone, Debug)]
pub(crate) struct Placed {
    pub(crate) glyph: GlyphId,
    /// Where it begins, and how far the next one is, in sizes of the font.
    pub(crate) x: f64,
    pub(crate) advance: f64,
    /// The bytes of the text that it shows.
    pub(crate) bytes: std::ops::Range<usize>,
}

impl Face {
    /// The font file, TrueType.
    pub(crate) fn file(self) -> &'static [u8] {
        match self {
            Self::Plain => include_bytes!("../fonts/DejaVuSansCondensed.ttf"),
            Self::Bold => include_bytes!("../fonts/DejaVuSansCondensed-Bold.ttf"),
        }
    }

    /// The font; a test reads both.
    pub(crate) fn font(self) -> Option<FontRef<'static>> {
        FontRef::new(self.file()).ok()
    }

    /// The letters of a line beside each other, that of what the font lacks as a box.
    pub(crate) fn line(self, text: &str) -> Vec<Placed> {
        let Some(font) = self.font() else { return Vec::new() };
        let (letters, metrics) =
            (font.charmap(), font.glyph_metrics(Size::unscaled(), LocationRef::default()));
        let unit = font.head().map_or(1.0, |head| 1.0 / f64::from(head.units_per_em()));
        let mut x = 0.0;
        let place = |(at, letter): (usize, char)| {
            let glyph = letters.map(letter).unwrap_or_default();
            let advance = f64::from(metrics.advance_width(glyph).unwrap_or_default()) * unit;
            let bytes = at..at + letter.len_utf8();
            let placed = Placed { glyph, x, advance, bytes };
            x += advance;
            placed
        };
        text.char_indices().map(place).collect()
    }

    /// Width of a line in sizes of the font.
    pub(crate) fn width(self, text: &str) -> f64 {
        self.line(text).last().map_or(0.0, |last| last.x + last.advance)
    }

    /// Whether it has a letter.
    pub(crate) fn has(self, letter: char) -> bool {
        self.font().is_some_and(|font| font.charmap().map(letter).is_some())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_faces_have_the_letters_of_european_names_and_of_the_report() {
        for face in [Face::Plain, Face::Bold] {
            let letters = "Müller Łuszczyńska Dvořák Şener Παπαδοπούλου Ивáнова Ђурђевић Ընկեր \
                           ქართული Nguyễn −×±°²≤≥–“”•⟨⟩→€\u{202f}\u{2009}\u{2011}";
            let lacking: String = letters.chars().filter(|c| !face.has(*c)).collect();
            assert!(lacking.is_empty(), "{face:?} {lacking}");
            assert!(!face.has('山'));
        }
    }

    #[test]
    fn letters_stand_beside_each_other() {
        let line = Face::Plain.line("é1");
        assert_eq!(line[1].bytes, 2..3);
        assert!(line[1].x == line[0].advance && line[0].advance > 0.4, "{line:?}");
        assert!(Face::Bold.width("tumour") > Face::Plain.width("tumour"));
        assert_eq!(Face::Plain.width(""), 0.0);
    }
}
