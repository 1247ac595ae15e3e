//! What a planner reads first, as a PDF of one or two sheets of A4, in the words of the page.

mod block;
mod file;
mod lines;
mod sheet;
mod table;
#[cfg(test)]
mod tests;

use crate::encoded::{EncodedPicture, EncodedRow};
use crate::first::{ABOUT, BANNER, BEFORE_SEEDS, First, LEGEND, NOT_FOR, PLACES, WINDOW};
use crate::fonts::Face;
use crate::palette::{CHECK, GOOD, INK, LINE, QUIET, STOP, WHITE};
use crate::pictures::Part;
use crate::tables::{self, Table};
use crate::{Error, PatientIdentity, Pictures, Summary};
use block::{Block, Op, Role, Setter, Style, within};
use sheet::{Frame, SIDE, WIDE, WIDTH};

const TITLE: Style = Style::new(Face::Bold, 16.0, INK).role(Role::Title);
const HEADING: Style = Style::new(Face::Bold, 10.5, INK).role(Role::Heading);
const BODY: Style = Style::new(Face::Plain, 9.0, INK);
const SMALL: Style = Style::new(Face::Plain, 7.5, QUIET);
/// Between pictures or columns, points.
const APART: f64 = 8.0;
/// Between parts, points.
const AIR: f64 = 6.5;
/// More uncertain places than these are left to the page, which has their seeds too.
const MOST_PLACES: usize = 8;
/// What is said where letters are lacking.
const LACKING: &str =
    "Letters that this document cannot show stand as ?; the object's own header has them.";

/// The first screen of the page as a PDF of A4: verdict, displacement, pictures, uncertain places.
/// `date` is that of the run, `YYYY-MM-DD HH:MM:SS`. The same input gives the same bytes; whose CT
/// it is stands on every sheet.
///
/// # Errors
/// [`Error::Pdf`] when a picture is no PNG file or the file would be no PDF/A.
pub fn pdf(
    (summary, whose): (&Summary, Option<&PatientIdentity>),
    pictures: &Pictures,
    date: &str,
) -> Result<Vec<u8>, Error> {
    let shown: Vec<&EncodedPicture> = leading(pictures).flat_map(|row| &row.pictures).collect();
    let producer = format!("{} {}", summary.tool.name, summary.tool.version);
    let title = format!("{} (simulated)", First::new(summary).title);
    let sheets = sheets((summary, whose), pictures, date);
    file::bytes(&sheets, &shown, (title, producer, date))
}

/// The rows of pictures that are shown.
fn leading(pictures: &Pictures) -> impl Iterator<Item = &EncodedRow> {
    pictures.rows.iter().filter(|row| row.part == Part::First)
}

/// What stands on each sheet.
fn sheets(
    (summary, whose): (&Summary, Option<&PatientIdentity>),
    pictures: &Pictures,
    date: &str,
) -> Vec<Vec<Op>> {
    let first = First::new(summary);
    let facts = facts(summary, whose);
    let setter = Setter::default();
    let mut blocks = vec![
        setter.text(&first.title, TITLE, WIDE),
        Block::gap(2.0),
        setter.facts(&facts, BODY, WIDE),
        setter.text(ABOUT, SMALL, WIDE),
        Block::gap(AIR),
    ];
    let below_facts = 3;
    blocks.extend(verdict(&setter, &first));
    blocks.extend([Block::gap(AIR), displacement(&setter, &first), Block::gap(AIR)]);
    let mut number = 0;
    for row in leading(pictures) {
        blocks.push(row_of(&setter, row, number));
        number += row.pictures.len();
    }
    blocks.extend([Block::gap(3.0), legend(&setter), Block::gap(AIR)]);
    blocks.extend(places(&setter, &first));
    blocks.extend(headed(&setter, &tables::key(summary)));
    blocks.push(Block::gap(AIR));
    blocks.push(limits(&setter, summary));
    let frame = framed(&setter, (&first.title, &facts), summary);
    if setter.lacking.get() {
        blocks.insert(below_facts, setter.text(LACKING, SMALL, WIDE));
    }
    let foot = |n: usize, of: usize| foot(&setter, summary, date, [n, of]);
    sheet::sheets(&blocks, &Frame { heads: frame, foot: &foot })
}

/// Whose CT it is, and which result: without the patient where she was taken out.
fn facts<'a>(
    summary: &'a Summary,
    whose: Option<&'a PatientIdentity>,
) -> Vec<(&'static str, &'a str)> {
    let mut facts = whose.map(PatientIdentity::known).unwrap_or_default();
    facts.extend(summary.id.iter().map(|id| ("Result", id.as_str())));
    let exported = summary.export.iter();
    facts.extend(exported.map(|export| ("Exported as", export.series_description.as_str())));
    facts
}

/// The verdict in words on a tinted ground, each reason whole.
fn verdict(setter: &Setter, first: &First) -> Vec<Block> {
    let [bar, ground] = match first.class {
        "good" => GOOD,
        "stop" => STOP,
        _ => CHECK,
    };
    const IN: [f64; 2] = [10.0, 2.0];
    const NUMBER: f64 = 14.0;
    let boxed = |block: Block| block.on(ground, WIDE, IN).barred(bar, 4.0);
    let inner = WIDE - 2.0 * IN[0];
    let headline = Style::new(Face::Bold, 13.0, bar).role(Role::Heading);
    let mut blocks = vec![boxed(setter.text(&format!("{}.", first.headline), headline, inner))];
    for (n, (reason, _)) in first.reasons.iter().enumerate() {
        let number = setter.text(&format!("{}. ", n + 1), BODY.role(Role::Label), NUMBER);
        let reason = setter.text(reason, BODY.role(Role::Body), inner - NUMBER);
        blocks.push(boxed(number.beside(NUMBER, &reason).within(Role::Item)));
    }
    within(Role::List, &mut blocks[1..]);
    // The headline does not stand alone at the foot of a sheet.
    if blocks.len() > 1 {
        let reason = blocks.remove(1);
        blocks[0] = std::mem::take(&mut blocks[0]).above(reason);
    }
    blocks
}

/// How far the tumour moves, and beside it what makes that uncertain.
fn displacement(setter: &Setter, first: &First) -> Block {
    let large = Style::new(Face::Bold, 11.5, INK);
    let told = |wide: f64| {
        let moves = setter.text(&first.moves, large, wide).above(Block::gap(3.0));
        moves.above(setter.text(&first.sure, BODY, wide))
    };
    let Some(shares) = &first.shares else { return told(WIDE) };
    let left = 0.42 * WIDE;
    let right = WIDE - left - 2.0 * APART;
    let small = Style::new(Face::Bold, 8.5, INK);
    let heading = setter.text(&shares.title, small, right);
    let rows = table::rows(setter, shares, right).into_iter();
    told(left).beside(left + 2.0 * APART, &rows.fold(heading, Block::above))
}

/// A row of pictures, all to one scale, with what to look at; the first of them has this number.
fn row_of(setter: &Setter, row: &EncodedRow, number: usize) -> Block {
    let pixels: usize = row.pictures.iter().map(|picture| picture.width).sum();
    let gaps = APART * row.pictures.len().saturating_sub(1) as f64;
    let scale = (WIDE - gaps) / pixels.max(1) as f64;
    let (mut block, mut x) = (Block::default(), 0.0);
    for (n, picture) in row.pictures.iter().enumerate() {
        let size = [picture.width as f64 * scale, picture.height as f64 * scale];
        let told = format!("{}. {}", picture.caption, row.text);
        let drawn = Op::Picture { at: [0.0, 0.0], size, number: number + n, told };
        let caption = setter.text(&picture.caption, SMALL.role(Role::Caption), size[0]);
        let shown = Block { height: size[1] + 2.0, ops: vec![drawn] }.above(caption);
        block = block.beside(x, &shown);
        x += size[0] + APART;
    }
    let title = setter.text(&row.title, HEADING, WIDE);
    title.above(setter.text(&row.text, BODY, WIDE)).above(Block::gap(3.0)).above(block)
}

/// What the colours in the pictures shown here mean, each with a sample of it.
fn legend(setter: &Setter) -> Block {
    const SAMPLE: f64 = 6.5;
    let mut block = Block::default();
    let mut x = 0.0;
    for (rgb, text) in LEGEND {
        let rim = Op::Fill { at: [x, 1.5], size: [SAMPLE; 2], rgb: QUIET };
        let sample = Op::Fill { at: [x + 0.5, 2.0], size: [SAMPLE - 1.0; 2], rgb };
        block.ops.extend([rim, sample]);
        block = block.beside(x + SAMPLE + 3.0, &setter.text(text, SMALL, WIDE));
        x += SAMPLE + 11.0 + SMALL.width(text);
    }
    let window = setter.text(WINDOW, SMALL, WIDE);
    if x + SMALL.width(WINDOW) <= WIDE { block.beside(x, &window) } else { block.above(window) }
}

/// The uncertain places, what moves the tumour most first.
fn places(setter: &Setter, first: &First) -> Vec<Block> {
    let Some(all) = &first.places else { return Vec::new() };
    let head: Vec<&'static str> = all.head.iter().take(BEFORE_SEEDS).copied().collect();
    let mut shown = Table::list(PLACES, &head);
    let cut = |row: &Vec<String>| row.iter().take(BEFORE_SEEDS).cloned().collect();
    shown.rows = all.rows.iter().take(MOST_PLACES).map(cut).collect();
    let mut blocks = headed(setter, &shown);
    if let Some(more) = all.rows.len().checked_sub(MOST_PLACES).filter(|more| *more > 0) {
        let text = format!("{more} more, which do less to the tumour: report/index.html.");
        blocks.push(setter.text(&text, SMALL, WIDE));
    }
    blocks.push(Block::gap(AIR));
    blocks
}

/// A table below its title, which stays with the first row.
fn headed(setter: &Setter, table: &Table) -> Vec<Block> {
    let mut blocks = table::rows(setter, table, WIDE);
    let heading = setter.text(&table.title, HEADING, WIDE);
    let first = if blocks.is_empty() { Block::default() } else { blocks.remove(0) };
    blocks.insert(0, heading.above(first));
    blocks
}

/// What the result must not be used for.
fn limits(setter: &Setter, summary: &Summary) -> Block {
    const INDENT: f64 = 10.0;
    let style = Style { size: 8.0, ..BODY };
    let heading = setter.text(NOT_FOR, HEADING, WIDE);
    let list = summary.must_not_be_used_for.iter().fold(Block::default(), |list, limit| {
        let dot = setter.text("\u{2022} ", style.role(Role::Label), INDENT);
        let limit = setter.text(limit, style.role(Role::Body), WIDE - INDENT);
        list.above(dot.beside(INDENT, &limit).within(Role::Item))
    });
    heading.above(list.within(Role::List))
}

/// The heads of the first sheet and of the others, which say again whose it is.
fn framed(
    setter: &Setter,
    (title, facts): (&str, &[(&'static str, &str)]),
    summary: &Summary,
) -> [Block; 2] {
    const IN: [f64; 2] = [7.0, 4.0];
    let style = Style::new(Face::Bold, 8.5, WHITE);
    let banner = setter.text(BANNER, style, WIDE - 2.0 * IN[0]).on(STOP[0], WIDE, IN);
    let identity: Vec<(&str, &str)> = facts
        .iter()
        .filter(|(what, _)| ["Patient", "ID", "Born"].contains(what))
        .copied()
        .collect();
    let result = summary.id.iter().map(|id| ("Result", id.as_str()));
    let again: Vec<(&str, &str)> =
        std::iter::once((title, "")).chain(identity).chain(result).collect();
    let first = banner.clone().above(Block::gap(AIR));
    let other = banner.above(Block::gap(3.0)).above(setter.facts(&again, BODY, WIDE));
    [first, other.above(Block::gap(AIR)).within(Role::Aside)]
}

/// Maker, result and number of a sheet.
fn foot(setter: &Setter, summary: &Summary, date: &str, [n, of]: [usize; 2]) -> Block {
    let id = summary.id.iter().map(|id| format!("Result {id}, "));
    let result: String = id.collect();
    let made = format!("{} {}. {result}{date}.", summary.tool.name, summary.tool.version);
    let line = Op::Fill { at: [0.0, 0.0], size: [WIDTH - 2.0 * SIDE, 0.4], rgb: LINE };
    let left = setter.text(&made, SMALL, WIDE);
    let line = Block { height: 3.0, ops: vec![line] };
    let page = setter.ending(&format!("Page {n} of {of}"), SMALL, WIDE);
    line.above(left.beside(0.0, &page)).within(Role::Aside)
}
