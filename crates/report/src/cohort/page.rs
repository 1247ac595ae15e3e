//! The page of a cohort: one file that asks for nothing but the pictures of the runs beside it.

use super::Patient;
use super::card::{Card, anchor, class, headline, rank};
use super::forest::forest;
use super::plot::{Plot, plots};
use crate::html::shown;
use crate::{Ended, Error};
use askama::Template;
use std::collections::BTreeMap;

/// The page as the template sees it.
#[derive(Template)]
#[template(path = "cohort.html")]
struct Page<'a> {
    version: &'static str,
    patients: usize,
    counts: Vec<Count>,
    /// What wants a look: where it stands, its name, its class, why.
    first: Vec<(String, &'a str, &'static str, String)>,
    /// How many more there are.
    more: usize,
    /// Displacements with their intervals, SVG.
    forest: Option<String>,
    plots: Vec<Plot>,
    /// Codes with the number of patients, the commonest first.
    codes: Vec<(&'a str, usize)>,
    cards: Vec<Card<'a>>,
    /// The table beside the page.
    table: &'a str,
}

/// How many ended in one way.
struct Count {
    word: &'static str,
    headline: &'static str,
    class: &'static str,
    number: usize,
    /// Of all patients, percent.
    percent: f64,
}

/// So many that want a look are named above all others.
const FIRST: usize = 20;

/// The page of patients, in the order given; `table` is the address of their table.
///
/// # Errors
/// [`Error::Page`] when it cannot be made.
pub fn page(patients: &[Patient], table: &str) -> Result<String, Error> {
    let plots = plots(patients);
    let (first, more) = first(patients, &plots);
    Ok(Page {
        version: env!("CARGO_PKG_VERSION"),
        patients: patients.len(),
        counts: counts(patients),
        first,
        more,
        forest: forest(patients),
        plots,
        codes: codes(patients),
        cards: patients.iter().map(Card::of).collect(),
        table,
    }
    .render()
    .map(shown)?)
}

fn counts(patients: &[Patient]) -> Vec<Count> {
    let count = |ended: Ended| {
        let number = patients.iter().filter(|patient| patient.status.status == ended).count();
        let percent = 100.0 * number as f64 / patients.len().max(1) as f64;
        let (word, class, headline) = (ended.word(), class(ended), headline(ended));
        Count { word, headline, class, number, percent }
    };
    // The four that there always are, and the others where there are some.
    let told = Ended::ALL.into_iter().map(count).enumerate();
    told.filter(|(n, count)| *n < 4 || count.number > 0).map(|(_, count)| count).collect()
}

/// Who wants a look first: those without a result that may be used, then those who lie apart from
/// the others.
fn first<'a>(
    patients: &'a [Patient],
    plots: &[Plot],
) -> (Vec<(String, &'a str, &'static str, String)>, usize) {
    let mut apart: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for plot in plots {
        for (anchor, told) in &plot.apart {
            let value = told.rsplit_once(": ").map_or(told.as_str(), |(_, value)| value);
            let (title, _) = plot.title.rsplit_once(", ").unwrap_or((&plot.title, ""));
            let (first, rest) = title.split_at(1);
            let text = format!("{}{rest} {value}", first.to_lowercase());
            apart.entry(anchor).or_default().push(text);
        }
    }
    let mut ranked = Vec::new();
    for patient in patients {
        let (status, place) = (&patient.status, anchor(&patient.status.case));
        let (rank, why) = match (status.status, apart.get(place.as_str())) {
            (Ended::Usable | Ended::Flagged, Some(all)) => {
                (10, format!("Apart from the others: {}", all.join("; ")))
            }
            (Ended::Usable | Ended::Flagged | Ended::Partial, _) => continue,
            (ended, _) => {
                let failed = status.error.as_ref().filter(|error| error.exit != 4);
                let failed = failed.map(|error| error.message.clone());
                let why = failed.or_else(|| status.reasons.first().cloned()).unwrap_or_default();
                (rank(ended), format!("{}. {why}", headline(ended)))
            }
        };
        ranked.push((rank, (place, status.case.as_str(), class(status.status), why)));
    }
    // A stable sort: names stay in order.
    ranked.sort_by_key(|(rank, _)| *rank);
    let more = ranked.len().saturating_sub(FIRST);
    (ranked.into_iter().take(FIRST).map(|(_, line)| line).collect(), more)
}

fn codes(patients: &[Patient]) -> Vec<(&str, usize)> {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for code in patients.iter().flat_map(|patient| &patient.codes) {
        *counts.entry(code).or_default() += 1;
    }
    let mut all: Vec<_> = counts.into_iter().collect();
    all.sort_by_key(|(_, number)| std::cmp::Reverse(*number));
    all
}
