//! Letters made of strokes, so that no font file is needed.

use crate::canvas::{Canvas, Pen, Rgb, Spot};

/// Height of a capital, in units of the glyphs' own grid.
const CAPITAL: f64 = 12.0;
/// Height of the baseline above the lowest line of the grid.
const BASELINE: f64 = 4.0;
/// Free space after a glyph, units.
const GAP: f64 = 4.0;
/// Width of a space, units.
const SPACE: f64 = 5.0;

/// The strokes of each character. A pair of base-36 digits is a point: x from the left, y up;
/// descenders end at 0, the baseline lies at 4, small letters reach c (12), capitals g (16).
/// Blanks separate the strokes.
#[rustfmt::skip]
const GLYPHS: [(char, &str); 77] = [
    ('A', "044g84 1868"), ('B', "5a0a 040g5g7e7c5a88865404"), ('C', "8e6g2g0d07246486"),
    ('D', "040g5g8d875404"), ('E', "8g0g0484 0a6a"), ('F', "8g0g04 0a6a"),
    ('G', "8e6g2g0d072464868a5a"), ('H', "040g 848g 0a8a"), ('I', "040g"), ('J', "5g56341406"),
    ('K', "040g 8g08 3b84"), ('L', "0g0474"), ('M', "040g4a8g84"), ('N', "040g848g"),
    ('O', "2g6g8d876424070d2g"), ('P', "040g6g8e8c6a0a"), ('Q', "2g6g8d876424070d2g 5784"),
    ('R', "040g6g8e8c6a0a 4a84"), ('S', "8e6g2g0e0c2a6a8886642406"), ('T', "0g8g 4g44"),
    ('U', "0g072464878g"), ('V', "0g448g"), ('W', "0g244c648g"), ('X', "0g84 8g04"),
    ('Y', "0g4a8g 4a44"), ('Z', "0g8g0484"),
    ('a', "6c64 6a4c2c0a06244466"), ('b', "0g04 0a2c4c6a66442406"), ('c', "6a4c2c0a06244466"),
    ('d', "6g64 6a4c2c0a06244466"), ('e', "08686a4c2c0a06244465"), ('f', "5g3g2e24 0c5c"),
    ('g', "6c62402001 6a4c2c0a06244466"), ('h', "0g04 0a2c4c6a64"), ('i', "0c04 0f0g"),
    ('j', "2c211000 2f2g"), ('k', "0g04 6c07 2864"), ('l', "0g04"),
    ('m', "0c04 0a2c3c5a54 5a7c8caaa4"), ('n', "0c04 0a2c4c6a64"), ('o', "2c4c6a664424060a2c"),
    ('p', "0c00 0a2c4c6a66442406"), ('q', "6c60 6a4c2c0a06244466"), ('r', "0c04 0a2c4c"),
    ('s', "6b4c2c0b0928486765442405"), ('t', "2g263454 0c5c"), ('u', "0c06244466 6c64"),
    ('v', "0c346c"), ('w', "0c244b648c"), ('x', "0c64 6c04"), ('y', "0c34 6c2000"), ('z', "0c6c0464"),
    ('0', "2g5g7d775424070d2g"), ('1', "0d3g34"), ('2', "0e2g5g7e7b0474"),
    ('3', "0f2g5g7e7c5a2a 5a7876542405"), ('4', "646g0888"), ('5', "7g1g0a2b5b7976542405"),
    ('6', "6g3g0c06245476795b2b09"), ('7', "0g7g24"), ('8', "2a0c0e2g5g7e7c5a2a0806245476785a"),
    ('9', "1444787e5g2g0e0b29597b"),
    ('.', "0405"), (',', "1402"), (':', "0506 0b0c"), ('-', "0a5a"), ('+', "0a6a 3d37"),
    ('=', "0c6c 0868"), ('/', "046g"), ('(', "3h1e1633"), (')', "0h2e2603"),
    ('%', "048g 0g2g2e0e0g 6484866664"), ('<', "6d0a67"), ('>', "0d6a07"),
    ('°', "1g2g3f3e2d1d0e0f1g"), ('×', "1b57 5b17"), ('±', "0b6b 3e38 0565"),
];

/// The strokes of a character; a box for one that has none.
fn strokes(c: char) -> &'static str {
    GLYPHS.iter().find(|g| g.0 == c).map_or("040g8g8404", |g| g.1)
}

/// Points of one stroke, units of the grid.
fn points(stroke: &str) -> Vec<Spot> {
    let digit = |b: u8| f64::from((b as char).to_digit(36).unwrap_or(0));
    stroke.as_bytes().chunks_exact(2).map(|p| [digit(p[0]), digit(p[1])]).collect()
}

/// Advance of a character, units.
fn advance(c: char) -> f64 {
    if c == ' ' {
        return SPACE;
    }
    let right = strokes(c).split(' ').flat_map(points).map(|p| p[0]).fold(0.0, f64::max);
    right + GAP
}

/// Width of a text, pixels, when its capitals are `size` pixels high.
pub(crate) fn text_width(text: &str, size: f64) -> f64 {
    (text.chars().map(advance).sum::<f64>() - GAP).max(0.0) * size / CAPITAL
}

/// Where a text stands relative to its spot.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Align {
    /// The spot is the left end of the baseline.
    Left,
    /// The spot is the middle of the baseline.
    Centre,
    /// The spot is the right end of the baseline.
    Right,
}

impl Canvas {
    /// Writes a text with capitals `size` pixels high, on a dark halo.
    pub(crate) fn text(&mut self, text: &str, spot: Spot, align: Align, size: f64, rgb: Rgb) {
        let shift = match align {
            Align::Left => 0.0,
            Align::Centre => 0.5,
            Align::Right => 1.0,
        };
        let unit = size / CAPITAL;
        let mut x = spot[0] - shift * text_width(text, size);
        let mut segments = Vec::new();
        for c in text.chars() {
            if c != ' ' {
                for stroke in strokes(c).split(' ') {
                    let at = |p: &Spot| [x + p[0] * unit, spot[1] - (p[1] - BASELINE) * unit];
                    segments.extend(points(stroke).windows(2).map(|w| [at(&w[0]), at(&w[1])]));
                }
            }
            x += advance(c) * unit;
        }
        self.stroke_on_halo(&segments, Pen::new(0.13 * size, rgb));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_glyph_is_well_formed_and_there_once() {
        for (n, (c, glyph)) in GLYPHS.iter().enumerate() {
            assert!(GLYPHS[..n].iter().all(|g| g.0 != *c), "{c} twice");
            for stroke in glyph.split(' ') {
                assert!(stroke.len() >= 4 && stroke.len() % 2 == 0, "{c}: {stroke}");
                for p in points(stroke) {
                    assert!(p[0] <= 10.0 && p[1] <= 17.0, "{c}: {stroke}");
                }
            }
        }
        let all = ('a'..='z').chain('A'..='Z').chain('0'..='9');
        assert!(all.into_iter().all(|c| GLYPHS.iter().any(|g| g.0 == c)));
    }

    #[test]
    fn text_stands_where_it_is_put() {
        let mut canvas = Canvas::new(100, 40);
        canvas.text("H", [50.0, 30.0], Align::Centre, 20.0, [255; 3]);
        let lit = |x: usize, y: usize| canvas.at(x, y)[0] > 100;
        let xs: Vec<usize> = (0..100).filter(|&x| (0..40).any(|y| lit(x, y))).collect();
        let ys: Vec<usize> = (0..40).filter(|&y| (0..100).any(|x| lit(x, y))).collect();
        assert!(xs[0] >= 41 && xs[xs.len() - 1] <= 59, "{xs:?}");
        assert!(ys[0] >= 8 && ys[ys.len() - 1] <= 32 && ys.len() >= 20, "{ys:?}");
    }
}
