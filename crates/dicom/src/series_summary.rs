//! A CT series, in one line.

/// A CT series, in one line.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct SeriesSummary {
    /// Series Instance UID.
    pub uid: String,
    /// Series Description.
    pub description: String,
    /// Number of slices without localizers.
    pub slices: usize,
}
