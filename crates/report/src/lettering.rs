//! Lettering on pictures.

use crate::canvas::{Canvas, Rgb, Spot};
use crate::fonts::Face;
use skrifa::MetadataProvider;
use skrifa::instance::{LocationRef, Size};
use skrifa::outline::{DrawSettings, OutlinePen};
use tiny_skia::PathBuilder;

/// Height of a capital in sizes of the font.
const CAPITAL: f64 = 0.729;

/// Width of a text, pixels, when its capitals are `size` pixels high, to the nearest.
pub(crate) fn text_width(text: &str, size: f64) -> f64 {
    Face::Plain.width(text) * size.round() / CAPITAL
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

/// Outlines of letters at a place of a picture, whose y runs down.
struct Outlines {
    path: PathBuilder,
    /// Where the letter stands, pixels.
    at: [f32; 2],
}

impl Outlines {
    fn spot(&self, x: f32, y: f32) -> (f32, f32) {
        (self.at[0] + x, self.at[1] - y)
    }
}

impl OutlinePen for Outlines {
    fn move_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.spot(x, y);
        self.path.move_to(x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.spot(x, y);
        self.path.line_to(x, y);
    }

    fn quad_to(&mut self, cx: f32, cy: f32, x: f32, y: f32) {
        let ((cx, cy), (x, y)) = (self.spot(cx, cy), self.spot(x, y));
        self.path.quad_to(cx, cy, x, y);
    }

    fn curve_to(&mut self, ax: f32, ay: f32, bx: f32, by: f32, x: f32, y: f32) {
        let ((ax, ay), (bx, by), (x, y)) = (self.spot(ax, ay), self.spot(bx, by), self.spot(x, y));
        self.path.cubic_to(ax, ay, bx, by, x, y);
    }

    fn close(&mut self) {
        self.path.close();
    }
}

impl Canvas {
    /// Writes a text with capitals `size` pixels high, on a dark halo.
    pub(crate) fn text(&mut self, text: &str, spot: Spot, align: Align, size: f64, rgb: Rgb) {
        let shift = match align {
            Align::Left => 0.0,
            Align::Centre => 0.5,
            Align::Right => 1.0,
        };
        let Some(font) = Face::Plain.font() else { return };
        let (outlines, em) = (font.outline_glyphs(), size.round() / CAPITAL);
        let left = spot[0] - shift * text_width(text, size);
        // On the lower edge of a row of pixels, and whole pixels high: letters are sharp there.
        let base = spot[1].floor() + 0.5;
        let mut pen = Outlines { path: PathBuilder::new(), at: [0.0; 2] };
        for letter in Face::Plain.line(text) {
            pen.at = [(left + letter.x * em) as f32, base as f32];
            let settings = DrawSettings::unhinted(Size::new(em as f32), LocationRef::default());
            let Some(outline) = outlines.get(letter.glyph) else { continue };
            // The project's own font has no outline that cannot be drawn.
            let _drawn = outline.draw(settings, &mut pen);
        }
        self.letters(pen.path, rgb);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_stands_where_it_is_put() {
        let mut canvas = Canvas::new(100, 40);
        canvas.text("H", [50.0, 30.0], Align::Centre, 20.0, [255; 3]);
        let lit = |x: usize, y: usize| canvas.at(x, y)[0] > 100;
        let xs: Vec<usize> = (0..100).filter(|&x| (0..40).any(|y| lit(x, y))).collect();
        let ys: Vec<usize> = (0..40).filter(|&y| (0..100).any(|x| lit(x, y))).collect();
        assert!(xs[0] >= 41 && xs[xs.len() - 1] <= 59, "{xs:?}");
        assert!(ys[0] >= 10 && ys[ys.len() - 1] <= 30 && ys.len() >= 20, "{ys:?}");
    }
}
