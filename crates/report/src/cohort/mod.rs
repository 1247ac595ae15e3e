//! Many patients beside each other: a table for spreadsheets and one page.

mod card;
mod figures;
mod forest;
mod outliers;
mod page;
mod plot;
mod table;
#[cfg(test)]
pub(crate) mod tests;

pub use figures::Figures;
pub use page::page as cohort_page;
pub use table::{TABLE_HEAD, table as cohort_table};

use crate::{RunStatus, Summary};

/// A patient of a cohort: how her run ended and what of it is shown.
#[derive(Clone, Debug)]
pub struct Patient {
    /// How the run ended.
    pub status: RunStatus,
    /// Figures of its result; none without one.
    pub figures: Option<Figures>,
    /// Codes of the verdict's reasons, of the warnings and of the error, each once, sorted.
    pub codes: Vec<String>,
    /// The folder of the run as it leads from the page's own, with `/` between its parts; none
    /// without a report.
    pub run: Option<String>,
    /// Names of the pictures that its report has, of those in [`PICTURES`].
    pub pictures: Vec<&'static str>,
}

/// Pictures of a run's report that the page shows, with what they are called there.
pub const PICTURES: [(&str, &str); 3] = [
    ("axial_before.png", "CT"),
    ("axial_after.png", "Simulated, on the table"),
    ("axial_displacement.png", "Displacement"),
];

impl Patient {
    /// A patient whose run ended so, with its result where there is one. Nothing is shown of her
    /// before [`Self::run`] is set.
    pub fn new(status: RunStatus, summary: Option<&Summary>) -> Self {
        let of_verdict = summary.iter().flat_map(|s| &s.verdict.reasons).map(|r| r.code.clone());
        let warned = summary.iter().flat_map(|s| &s.warnings).map(|w| w.code.clone());
        let failed = status.error.iter().map(|error| error.code.clone());
        let mut codes: Vec<String> = of_verdict.chain(warned).chain(failed).collect();
        codes.retain(|code| !code.is_empty());
        codes.sort_unstable();
        codes.dedup();
        let figures = summary.map(Figures::of);
        Self { status, figures, codes, run: None, pictures: Vec::new() }
    }
}
