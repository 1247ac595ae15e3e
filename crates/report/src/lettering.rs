//! Lettering on pictures.

use crate::canvas::{Canvas, Rgb, Spot};
use crate::fonts::Face;
use skrifa::MetadataProvider;
use skrifa::instance::{LocationRef, Size};
use skrifa::outline::DrawSettings;
use skrifa::outline::pen::PathElement;
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
        let base = (spot[1].floor() + 0.5) as f32;
        let mut path = PathBuilder::new();
        for letter in Face::Plain.line(text) {
            let at = (left + letter.x * em) as f32;
            let settings = DrawSettings::unhinted(Size::new(em as f32), LocationRef::default());
            let mut drawn = Vec::new();
            let Some(outline) = outlines.get(letter.glyph) else { continue };
            // The project's own font has no outline that cannot be drawn.
            let _metrics = outline.draw(settings, &mut drawn);
            for element in drawn {
                match element {
                    PathElement::MoveTo { x, y } => path.move_to(at + x, base - y),
                    PathElement::LineTo { x, y } => path.line_to(at + x, base - y),
                    PathElement::QuadTo { cx0, cy0, x, y } => {
                        path.quad_to(at + cx0, base - cy0, at + x, base - y);
                    }
                    // Outlines of TrueType have none.
                    PathElement::CurveTo { .. } => {}
                    PathElement::Close => path.close(),
                }
            }
        }
        self.letters(path, rgb);
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
