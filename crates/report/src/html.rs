//! The page: one file, with the slice viewer's script in it, nothing loaded from elsewhere.

use crate::dose_volume::Chart;
use crate::encoded::EncodedRow;
use crate::first::First;
use crate::pictures::Part;
use crate::place::{self, Place};
use crate::tables::{self, Table};
use crate::verdict::notes;
use crate::{Mesh, PatientIdentity, Summary, dose_volume, patient_identity, tg132, words};
use askama::Template;
use base64::Engine;
use std::borrow::Cow;
use supine_space::{Warning, visible};

/// The page as the template sees it.
#[derive(Template)]
#[template(path = "index.html")]
struct Page<'a> {
    summary: &'a Summary,
    /// Whose CT it is; empty when the patient was taken out.
    whose: Vec<(&'static str, &'a str)>,
    /// The same for the head of each printed page, inside a CSS string.
    printed: String,
    first: First,
    /// What was warned of beside the verdict.
    notes: Vec<&'a str>,
    key: Table,
    tables: Vec<Table>,
    points: Option<Table>,
    carried: Option<Table>,
    charts: Vec<Chart>,
    dose_volume: Option<Table>,
    tg132: Option<Table>,
    files: Vec<Table>,
    /// The row that a planner looks at first.
    leading: Vec<Section<'a>>,
    /// The chest wall with its uncertain places.
    uncertain: Vec<Section<'a>>,
    /// All others, closed until someone opens them.
    still: Vec<Section<'a>>,
    /// How many pictures they are.
    stills: usize,
    /// The slice viewer's data, JSON.
    viewer: &'a str,
    /// Where the viewer can be brought.
    places: Vec<Place>,
}

/// Rows of pictures under one heading.
struct Section<'a> {
    title: &'a str,
    rows: Vec<Shown<'a>>,
}

/// A row of pictures.
struct Shown<'a> {
    text: &'a str,
    pair: bool,
    /// Shares of the width, so that all pictures of the row have one scale: `520fr 310fr 520fr`.
    columns: String,
    figures: Vec<Figure<'a>>,
    table: Option<&'a Table>,
}

/// A picture, embedded.
struct Figure<'a> {
    caption: &'a str,
    alt: String,
    data: String,
    width: usize,
    height: usize,
}

/// The page.
///
/// # Errors
/// What the template engine says.
pub(crate) fn page(
    summary: &Summary,
    whose: Option<&PatientIdentity>,
    rows: &[EncodedRow],
    viewer: &str,
) -> Result<String, askama::Error> {
    let of = |part| sections(rows.iter().filter(move |row| row.part == part));
    let still = rows.iter().filter(|row| row.part == Part::Still);
    Page {
        summary,
        whose: whose.map(PatientIdentity::known).unwrap_or_default(),
        printed: whose.map(patient_identity::printed).unwrap_or_default(),
        first: First::new(summary),
        notes: notes(summary),
        key: tables::key(summary),
        tables: tables::stages(summary),
        points: tables::points(summary),
        carried: tables::carried(summary),
        charts: dose_volume::charts(summary),
        dose_volume: dose_volume::table(summary),
        tg132: tg132::table(summary),
        files: tables::files(summary),
        leading: of(Part::First),
        uncertain: of(Part::Uncertain),
        still: of(Part::Still),
        stills: still.map(|row| row.pictures.len()).sum(),
        viewer,
        places: place::places(summary),
    }
    .render()
    .map(shown)
}

/// A page whose texts read in the direction in which they stand, whatever names are in them.
pub(crate) fn shown(page: String) -> String {
    match visible(&page) {
        Cow::Owned(shown) => shown,
        Cow::Borrowed(_) => page,
    }
}

/// The page of a mesh alone as the template sees it.
#[derive(Template)]
#[template(path = "mesh.html")]
struct MeshPage<'a> {
    title: String,
    warnings: &'a [Warning],
    version: &'static str,
    table: Table,
    sections: Vec<Section<'a>>,
}

/// The page of a mesh alone.
///
/// # Errors
/// What the template engine says.
pub(crate) fn mesh_page(
    facts: &Mesh,
    warnings: &[Warning],
    rows: &[EncodedRow],
) -> Result<String, askama::Error> {
    let version = env!("CARGO_PKG_VERSION");
    let title = format!("Mesh of {} tetrahedra", words::count(facts.tetrahedra));
    let (table, sections) = (tables::shape(facts), sections(rows));
    MeshPage { title, warnings, version, table, sections }.render().map(shown)
}

/// The rows under their headings, with their pictures in order.
fn sections<'a>(rows: impl IntoIterator<Item = &'a EncodedRow>) -> Vec<Section<'a>> {
    let mut sections: Vec<Section<'_>> = Vec::new();
    for row in rows {
        let figures = row.pictures.iter().map(|picture| Figure {
            caption: &picture.caption,
            alt: format!("{}. {}", picture.caption, row.text),
            data: base64::engine::general_purpose::STANDARD.encode(&picture.png),
            width: picture.width,
            height: picture.height,
        });
        let shown = Shown {
            text: &row.text,
            pair: row.pair,
            columns: columns(row),
            figures: figures.collect(),
            table: row.table.as_ref(),
        };
        match sections.last_mut() {
            Some(section) if row.title.is_empty() => section.rows.push(shown),
            _ => sections.push(Section { title: &row.title, rows: vec![shown] }),
        }
    }
    sections
}

fn columns(row: &EncodedRow) -> String {
    let widths = row.pictures.iter().map(|p| format!("{}fr", p.width));
    widths.collect::<Vec<_>>().join(" ")
}
