//! Whose CT a report shows.

/// Whose CT a report or the workstation shows: stands on their pages alone, never in the summary. What is not known is empty.
#[derive(Clone, Default, serde::Serialize)]
pub struct Whose {
    /// Name, family name first.
    pub name: String,
    /// Patient ID.
    pub id: String,
    /// Date of birth.
    pub born: String,
    /// Study and its date.
    pub study: String,
    /// Series.
    pub series: String,
}

impl std::fmt::Debug for Whose {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Whose(..)")
    }
}

impl Whose {
    /// What is known, each with what it is.
    pub(crate) fn known(&self) -> Vec<(&'static str, &str)> {
        let Self { name, id, born, study, series } = self;
        let all =
            [("Patient", name), ("ID", id), ("Born", born), ("Study", study), ("Series", series)];
        let known = all.into_iter().filter(|(_, text)| !text.is_empty());
        known.map(|(what, text)| (what, text.as_str())).collect()
    }
}
