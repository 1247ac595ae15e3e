//! Blocks: what stands together on a page, drawn from its upper left corner downwards. Lengths in
//! points (1/72 inch).

use super::ansi::ansi;
use super::metrics::{Font, lines, width};
use crate::canvas::Rgb;
use std::cell::Cell;

/// Grounds reach so far below their block: readers leave a bright line between those that only
/// touch, points.
const SEAM: f64 = 0.4;

/// How a text looks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Style {
    pub(super) font: Font,
    /// Points.
    pub(super) size: f64,
    pub(super) rgb: Rgb,
}

impl Style {
    pub(super) const fn new(font: Font, size: f64, rgb: Rgb) -> Self {
        Self { font, size, rgb }
    }

    /// Distance of lines.
    fn leading(self) -> f64 {
        1.28 * self.size
    }
}

/// A thing on a page; places are those of the block, y downwards.
#[derive(Clone, Debug)]
pub(super) enum Op {
    /// Letters in WinAnsiEncoding; `at` is where their base line begins.
    Text { at: [f64; 2], style: Style, letters: Vec<u8> },
    /// A filled rectangle: upper left corner and size.
    Fill { at: [f64; 2], size: [f64; 2], rgb: Rgb },
    /// A picture, by its number.
    Picture { at: [f64; 2], size: [f64; 2], number: usize },
}

/// What is never cut by the end of a page.
#[derive(Clone, Debug, Default)]
pub(super) struct Block {
    pub(super) height: f64,
    pub(super) ops: Vec<Op>,
}

impl Block {
    /// Nothing, so high.
    pub(super) fn gap(height: f64) -> Self {
        Self { height, ops: Vec::new() }
    }

    /// Its things, moved.
    pub(super) fn at(&self, [dx, dy]: [f64; 2]) -> impl Iterator<Item = Op> + '_ {
        self.ops.iter().cloned().map(move |mut op| {
            let (Op::Text { at, .. } | Op::Fill { at, .. } | Op::Picture { at, .. }) = &mut op;
            *at = [at[0] + dx, at[1] + dy];
            op
        })
    }

    /// With another one below.
    pub(super) fn above(mut self, below: Self) -> Self {
        self.ops.extend(below.at([0.0, self.height]));
        self.height += below.height;
        self
    }

    /// With another one beside it, from `x` on.
    pub(super) fn beside(mut self, x: f64, other: &Self) -> Self {
        self.ops.extend(other.at([x, 0.0]));
        self.height = self.height.max(other.height);
        self
    }

    /// On a ground of its own, so far within it.
    pub(super) fn on(self, rgb: Rgb, wide: f64, [x, y]: [f64; 2]) -> Self {
        let height = self.height + 2.0 * y;
        let mut ops = vec![Op::Fill { at: [0.0, 0.0], size: [wide, height + SEAM], rgb }];
        ops.extend(self.at([x, y]));
        Self { height, ops }
    }

    /// With a bar at its left edge.
    pub(super) fn barred(mut self, rgb: Rgb, wide: f64) -> Self {
        let size = [wide, self.height + SEAM];
        self.ops.push(Op::Fill { at: [0.0, 0.0], size, rgb });
        self
    }
}

/// Makes blocks of texts, and remembers whether a letter was lacking.
#[derive(Debug, Default)]
pub(super) struct Setter {
    lacking: Cell<bool>,
}

impl Setter {
    /// Whether a text had a letter that the fonts lack.
    pub(super) fn lacks(&self) -> bool {
        self.lacking.get()
    }

    /// The text in the letters of the fonts.
    pub(super) fn letters(&self, text: &str) -> Vec<u8> {
        let (letters, whole) = ansi(text);
        self.lacking.set(self.lacking.get() || !whole);
        letters
    }

    /// A text in lines no wider than `wide`.
    pub(super) fn text(&self, text: &str, style: Style, wide: f64) -> Block {
        let letters = self.letters(text);
        let found = lines(&letters, style.font, style.size, wide);
        let op = |(n, line): (usize, std::ops::Range<usize>)| Op::Text {
            at: [0.0, style.size + n as f64 * style.leading()],
            style,
            letters: letters[line].to_vec(),
        };
        let height = found.len() as f64 * style.leading();
        Block { height, ops: found.into_iter().enumerate().map(op).collect() }
    }

    /// A text that ends at `right`.
    pub(super) fn ending(&self, text: &str, style: Style, right: f64) -> Block {
        let letters = self.letters(text);
        let x = right - width(&letters, style.font, style.size);
        let at = [x, style.size];
        Block { height: style.leading(), ops: vec![Op::Text { at, style, letters }] }
    }

    /// Facts one after the other, each behind its bold name; none is broken unless it is wider than
    /// a line.
    pub(super) fn facts(&self, facts: &[(&str, &str)], style: Style, wide: f64) -> Block {
        const APART: f64 = 12.0;
        let bold = Style { font: Font::Bold, ..style };
        let (mut block, mut x) = (Block::gap(style.leading()), 0.0);
        let mut top = 0.0;
        for (name, value) in facts {
            let named = width(&self.letters(&format!("{name} ")), Font::Bold, style.size);
            let whole = named + width(&self.letters(value), style.font, style.size);
            if x > 0.0 && x + whole > wide {
                (x, top) = (0.0, block.height);
            }
            let name = self.text(name, bold, wide);
            let value = self.text(value, style, wide - x - named);
            let fact = name.beside(named, &value);
            block.ops.extend(fact.at([x, top]));
            block.height = block.height.max(top + fact.height);
            x += whole + APART;
        }
        block
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STYLE: Style = Style::new(Font::Plain, 10.0, [0; 3]);

    #[test]
    fn a_text_is_as_high_as_its_lines() {
        let setter = Setter::default();
        assert_eq!(setter.text("one two", STYLE, 100.0).height, 12.8);
        assert_eq!(setter.text("one two", STYLE, 20.0).height, 25.6);
        assert!(!setter.lacks());
        setter.text("山", STYLE, 20.0);
        assert!(setter.lacks());
    }

    #[test]
    fn facts_go_on_in_the_next_line() {
        let setter = Setter::default();
        let facts = [("Patient", "Doe, Jane"), ("ID", "4711"), ("Born", "1960-05-17")];
        assert_eq!(setter.facts(&facts, STYLE, 500.0).height, 12.8);
        assert_eq!(setter.facts(&facts, STYLE, 120.0).height, 25.6 + 12.8);
        assert_eq!(setter.facts(&facts, STYLE, 90.0).height, 3.0 * 12.8);
    }
}
