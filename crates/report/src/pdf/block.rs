//! Blocks: what stands together on a page, drawn from its upper left corner downwards. Lengths in
//! points (1/72 inch).

use super::lines::lines;
use crate::canvas::Rgb;
use crate::fonts::Face;
use std::cell::Cell;
use supine_space::visible;

/// Grounds reach so far below their block: readers leave a bright line between those that only
/// touch, points.
const SEAM: f64 = 0.4;

/// What a text or a group of things is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// Not part of what is told: it is told elsewhere.
    Aside,
    Title,
    Heading,
    Paragraph,
    Caption,
    List,
    Item,
    Label,
    Body,
    Table,
    Row,
    ColumnHead,
    RowHead,
    Cell,
}

/// How a text looks, and what it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Style {
    pub(super) face: Face,
    /// Points.
    pub(super) size: f64,
    pub(super) rgb: Rgb,
    pub(super) role: Role,
}

impl Style {
    /// That of a paragraph.
    pub(super) const fn new(face: Face, size: f64, rgb: Rgb) -> Self {
        Self { face, size, rgb, role: Role::Paragraph }
    }

    pub(super) const fn role(self, role: Role) -> Self {
        Self { role, ..self }
    }

    /// Width of a line of it.
    pub(super) fn width(self, text: &str) -> f64 {
        self.face.width(text) * self.size
    }

    /// Distance of lines.
    fn leading(self) -> f64 {
        1.28 * self.size
    }
}

/// A thing on a page; places are those of the block, y downwards.
#[derive(Clone, Debug)]
pub(super) enum Op {
    /// `at` is where the base line begins.
    Text {
        at: [f64; 2],
        style: Style,
        text: String,
    },
    /// A filled rectangle: upper left corner and size.
    Fill {
        at: [f64; 2],
        size: [f64; 2],
        rgb: Rgb,
    },
    /// A picture, by its number, and what it shows in words.
    Picture {
        at: [f64; 2],
        size: [f64; 2],
        number: usize,
        told: String,
    },
    /// All up to its end is one thing; such things may hold each other.
    Open(Role),
    Close,
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
            if let Op::Text { at, .. } | Op::Fill { at, .. } | Op::Picture { at, .. } = &mut op {
                *at = [at[0] + dx, at[1] + dy];
            }
            op
        })
    }

    /// As one thing.
    pub(super) fn within(mut self, role: Role) -> Self {
        within(role, std::slice::from_mut(&mut self));
        self
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

/// Makes one thing of all blocks.
pub(super) fn within(role: Role, blocks: &mut [Block]) {
    if let Some(first) = blocks.first_mut() {
        first.ops.insert(0, Op::Open(role));
    }
    if let Some(last) = blocks.last_mut() {
        last.ops.push(Op::Close);
    }
}

/// Makes blocks of texts, and remembers whether a letter was lacking.
#[derive(Debug, Default)]
pub(super) struct Setter {
    pub(super) lacking: Cell<bool>,
}

impl Setter {
    /// The text in the letters of the fonts, question marks for others; letters that turn the
    /// direction of reading are shown as on the page.
    fn letters(&self, text: &str) -> String {
        let known = |letter: char| {
            // The faces have the same letters.
            let has = Face::Plain.has(letter);
            self.lacking.set(self.lacking.get() || !has);
            if has { letter } else { '?' }
        };
        visible(text).chars().map(known).collect()
    }

    /// A text in lines no wider than `wide`.
    pub(super) fn text(&self, text: &str, style: Style, wide: f64) -> Block {
        let text = self.letters(text);
        let ranges = lines(&text, style.face, style.size, wide);
        let ends = ranges.iter().skip(1).map(|line| line.start).chain([text.len()]);
        // The space at which a line is broken stays, so that words remain apart when they are read.
        let op = |(n, (line, end)): (usize, (&std::ops::Range<usize>, usize))| Op::Text {
            at: [0.0, style.size + n as f64 * style.leading()],
            style,
            text: text[line.start..end].into(),
        };
        let height = ranges.len() as f64 * style.leading();
        let ops = ranges.iter().zip(ends).enumerate().map(op).collect();
        Block { height, ops }.within(style.role)
    }

    /// A text that ends at `right`.
    pub(super) fn ending(&self, text: &str, style: Style, right: f64) -> Block {
        let text = self.letters(text);
        let at = [right - style.width(&text), style.size];
        let ops = vec![Op::Text { at, style, text }];
        Block { height: style.leading(), ops }.within(style.role)
    }

    /// Facts one after the other, each behind its bold name; none is broken unless it is wider than
    /// a line.
    pub(super) fn facts(&self, facts: &[(&str, &str)], style: Style, wide: f64) -> Block {
        const APART: f64 = 12.0;
        let bold = Style { face: Face::Bold, ..style };
        let (mut block, mut x) = (Block::gap(style.leading()), 0.0);
        let mut top = 0.0;
        for (name, value) in facts {
            let named = bold.width(&format!("{name} "));
            let whole = named + style.width(&self.letters(value));
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

    const STYLE: Style = Style::new(Face::Plain, 10.0, [0; 3]);

    #[test]
    fn a_text_is_as_high_as_its_lines() {
        let setter = Setter::default();
        assert_eq!(setter.text("one two", STYLE, 100.0).height, 12.8);
        assert_eq!(setter.text("one two", STYLE, 20.0).height, 25.6);
        assert!(!setter.lacking.get());
        setter.text("山", STYLE, 20.0);
        assert!(setter.lacking.get());
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
