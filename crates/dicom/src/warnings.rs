//! Warnings of several parts of a series, and how they are written.

use serde::{Serializer, ser::SerializeSeq as _};
use std::collections::BTreeMap;
use supine_space::Warning;

/// Each warning once, in the order of their texts: slices say the same again and again.
pub(crate) fn distinct(warnings: impl IntoIterator<Item = Warning>) -> Vec<Warning> {
    let by_text: BTreeMap<String, Warning> =
        warnings.into_iter().map(|warning| (warning.to_string(), warning)).collect();
    by_text.into_values().collect()
}

/// Writes warnings as their texts.
pub(crate) fn texts<S: Serializer>(warnings: &[Warning], serializer: S) -> Result<S::Ok, S::Error> {
    let mut texts = serializer.serialize_seq(Some(warnings.len()))?;
    for warning in warnings {
        texts.serialize_element(&warning.to_string())?;
    }
    texts.end()
}
