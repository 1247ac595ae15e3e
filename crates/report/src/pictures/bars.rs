//! Histograms.

use super::LETTER;
use crate::canvas::{Canvas, Pen, Rgb};
use crate::lettering::Align;
use crate::palette;

/// A histogram.
pub(super) struct Bars<'a> {
    /// What there is in each class; drawn as shares of their sum.
    pub(super) amounts: Vec<f64>,
    /// A tick below every so many classes, ...
    pub(super) every: usize,
    /// ... which says this at the lower end of class n.
    pub(super) tick: &'a dyn Fn(usize) -> String,
    /// Colour of class n.
    pub(super) colour: &'a dyn Fn(usize) -> Rgb,
}

impl Bars<'_> {
    /// Draws across the canvas, `height` pixels from row `top`.
    pub(super) fn draw(&self, canvas: &mut Canvas, top: usize, height: usize, title: &str) {
        let small = 0.8 * LETTER;
        let (left, right) = (52, canvas.width() - 28);
        let (upper, base) = (top + 40, top + height - 34);
        let whole = self.amounts.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let max = self.amounts.iter().copied().fold(0.0, f64::max) / whole;
        let scale = super::round_up(max.max(1e-6));
        canvas.text(title, [left as f64, (top + 26) as f64], Align::Left, small, palette::TEXT);
        for share in [0.0, 0.5, 1.0] {
            let y = base as f64 - share * (base - upper) as f64;
            let line = [[left as f64, y], [right as f64, y]];
            canvas.stroke(&[line], Pen::new(1.0, palette::TEXT).alpha(0.25));
            let label = format!("{:.0} %", 100.0 * share * scale);
            canvas.text(&label, [left as f64 - 6.0, y + 4.0], Align::Right, small, palette::TEXT);
        }
        let x = |n: usize| left + (right - left) * n / self.amounts.len();
        for (n, amount) in self.amounts.iter().enumerate() {
            let tall = amount / whole / scale * (base - upper) as f64;
            // What there is at all is seen.
            let tall = if *amount > 0.0 { tall.max(1.0) } else { 0.0 } as usize;
            let size = [(x(n + 1) - x(n)).saturating_sub(1), tall];
            canvas.rectangle([x(n), base - tall], size, (self.colour)(n), 1.0);
        }
        for n in (0..=self.amounts.len()).step_by(self.every) {
            let spot = [x(n) as f64, base as f64 + 6.0 + small];
            canvas.text(&(self.tick)(n), spot, Align::Centre, small, palette::TEXT);
        }
    }
}
