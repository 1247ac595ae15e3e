//! Sheets of A4: blocks one below the other, whole.

use super::block::{Block, Op};

/// A4, points.
pub(super) const WIDTH: f64 = 595.28;
pub(super) const HEIGHT: f64 = 841.89;
/// What stays free at the left and right edge: printers do not reach it.
pub(super) const SIDE: f64 = 42.0;
/// What stays free above and below.
const EDGE: f64 = 26.0;
/// Width of what is written.
pub(super) const WIDE: f64 = WIDTH - 2.0 * SIDE;

/// What stands on every sheet.
pub(super) struct Frame<'a> {
    /// At the head of the first sheet and of the others.
    pub(super) heads: [Block; 2],
    /// At the foot of a sheet, from its number and how many there are.
    pub(super) foot: &'a dyn Fn(usize, usize) -> Block,
}

/// The blocks on as many sheets as they take. One that does not fit what is left of a sheet begins
/// the next.
pub(super) fn sheets(blocks: &[Block], frame: &Frame<'_>) -> Vec<Vec<Op>> {
    let head = |n: usize| &frame.heads[n.min(1)];
    let begun = |n: usize| head(n).at([SIDE, EDGE]).collect::<Vec<Op>>();
    let bottom = HEIGHT - EDGE - (frame.foot)(1, 1).height;
    let mut sheets = vec![begun(0)];
    let mut y = EDGE + head(0).height;
    for block in blocks {
        let n = sheets.len();
        if y + block.height > bottom && y > EDGE + head(n - 1).height {
            sheets.push(begun(n));
            y = EDGE + head(n).height;
        }
        if let Some(sheet) = sheets.last_mut() {
            sheet.extend(block.at([SIDE, y]));
        }
        y += block.height;
    }
    let count = sheets.len();
    for (n, sheet) in sheets.iter_mut().enumerate() {
        sheet.extend((frame.foot)(n + 1, count).at([SIDE, bottom]));
    }
    sheets
}

#[cfg(test)]
mod tests {
    use super::super::block::{Setter, Style};
    use super::*;
    use crate::fonts::Face;

    #[test]
    fn no_block_is_cut_or_lost() {
        let setter = Setter::default();
        let line = |text: &str| setter.text(text, Style::new(Face::Plain, 10.0, [0; 3]), WIDE);
        let foot = |n: usize, of: usize| line(&format!("{n} of {of}"));
        let frame = Frame { heads: [line("head"), line("other")], foot: &foot };
        let blocks: Vec<Block> =
            (0..40).map(|n| line(&format!("block {n}")).above(Block::gap(50.0))).collect();
        let sheets = sheets(&blocks, &frame);
        assert_eq!(sheets.len(), 4);
        let texts = |sheet: &[Op]| -> Vec<(String, f64)> {
            let text = |op: &Op| match op {
                Op::Text { text, at, .. } => Some((text.clone(), at[1])),
                _ => None,
            };
            sheet.iter().filter_map(text).collect()
        };
        let all: Vec<_> = sheets.iter().flat_map(|sheet| texts(sheet)).collect();
        let named = all.iter().filter(|(text, _)| text.starts_with("block"));
        assert_eq!(named.clone().count(), 40);
        assert!(named.clone().all(|(_, y)| y + 50.0 < HEIGHT - EDGE));
        assert_eq!(texts(&sheets[3]).last().unwrap().0, "4 of 4");
        assert_eq!((&*texts(&sheets[0])[0].0, &*texts(&sheets[1])[0].0), ("head", "other"));
    }
}
