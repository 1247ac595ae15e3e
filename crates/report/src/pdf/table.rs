//! Tables, a block for each row.

use super::block::{Block, Op, Role, Setter, Style, within};
use crate::fonts::Face;
use crate::palette::{INK, LINE, QUIET};
use crate::tables::Table;

/// Between columns, points.
const APART: f64 = 10.0;
/// Above and below the text of a row, points.
const AIR: f64 = 1.2;
const SIZE: f64 = 8.5;
const HEAD: Style = Style::new(Face::Bold, 7.5, QUIET).role(Role::ColumnHead);
const CELL: Style = Style::new(Face::Plain, SIZE, INK).role(Role::Cell);

/// The rows of a table of facts or of a list with its head, no wider than `wide`; rows of a list
/// stand together with what comes before when a page ends, its head with the first one.
pub(super) fn rows(setter: &Setter, table: &Table, wide: f64) -> Vec<Block> {
    let columns = columns(table, wide);
    let mut blocks = Vec::new();
    if !table.head.is_empty() {
        let head: Vec<String> = table.head.iter().map(|name| (*name).to_owned()).collect();
        blocks.push(row(setter, &head, &columns, |_| HEAD, wide));
    }
    let bold = Style { face: Face::Bold, ..CELL }.role(Role::RowHead);
    let named = table.head.is_empty();
    let style = |column: usize| if named && column == 0 { bold } else { CELL };
    blocks.extend(table.rows.iter().map(|cells| row(setter, cells, &columns, style, wide)));
    if !table.head.is_empty() && blocks.len() > 1 {
        let first = blocks.remove(1);
        blocks[0] = std::mem::take(&mut blocks[0]).above(first);
    }
    within(Role::Table, &mut blocks);
    blocks
}

/// A row over a thin line.
fn row(
    setter: &Setter,
    cells: &[String],
    columns: &[f64],
    style: impl Fn(usize) -> Style,
    wide: f64,
) -> Block {
    let (mut block, mut x) = (Block::default(), 0.0);
    for (n, (cell, column)) in cells.iter().zip(columns).enumerate() {
        block = block.beside(x, &setter.text(cell, style(n), *column));
        x += column + APART;
    }
    let mut block = Block::gap(AIR).above(block.within(Role::Row)).above(Block::gap(AIR));
    let at = [0.0, block.height - 0.4];
    block.ops.push(Op::Fill { at, size: [wide, 0.4], rgb: LINE });
    block
}

/// Widths of the columns: what each asks for, or an even share of what those leave that ask for
/// less.
fn columns(table: &Table, wide: f64) -> Vec<f64> {
    let count = table.rows.iter().map(Vec::len).max().unwrap_or(0).max(table.head.len());
    let asked = |column: usize| {
        let head = table.head.get(column).map(|h| HEAD.width(h));
        let cells = table.rows.iter().filter_map(|row| row.get(column));
        let bold = Style { face: Face::Bold, ..CELL };
        let cells = cells.map(|cell| bold.width(cell));
        // Rounding must not break a line that fits exactly.
        cells.chain(head).fold(0.0, f64::max) + 0.1
    };
    shared((0..count).map(asked).collect(), wide - APART * count.saturating_sub(1) as f64)
}

fn shared(mut asked: Vec<f64>, wide: f64) -> Vec<f64> {
    let mut open: Vec<usize> = (0..asked.len()).collect();
    let mut left = wide;
    while !open.is_empty() {
        let even = left / open.len() as f64;
        let (content, greedy): (Vec<usize>, Vec<usize>) =
            open.iter().partition(|&&column| asked[column] <= even);
        if content.is_empty() {
            greedy.iter().for_each(|&column| asked[column] = even);
            break;
        }
        left -= content.iter().map(|&column| asked[column]).sum::<f64>();
        open = greedy;
    }
    asked
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_that_ask_for_little_get_it() {
        assert_eq!(shared(vec![10.0, 20.0], 100.0), [10.0, 20.0]);
        assert_eq!(shared(vec![10.0, 200.0, 300.0], 110.0), [10.0, 50.0, 50.0]);
        assert_eq!(shared(vec![10.0, 60.0, 300.0], 150.0), [10.0, 60.0, 80.0]);
    }
}
