//! The date and time of what is written.

/// The one date and time that is written wherever "now" is meant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Clock {
    /// YYYYMMDD.
    pub date: String,
    /// HHMMSS.
    pub time: String,
}
