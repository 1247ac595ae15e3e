//! What the run of a summary read, by the parameters that name it.

use super::read::Values;
use super::table::TABLE;
use super::value::Value;
use serde_json::Value as Json;
use std::collections::BTreeMap;

/// By the place of their parameter in the table: its value, and the hashes of what was read by it.
pub(super) type Recorded = BTreeMap<usize, (Value, Vec<String>)>;

/// The hashes in the list of inputs of a summary. What it does not list was not read.
pub(super) fn of(values: &Values, inputs: &Json) -> Recorded {
    let hashes = |role: &str| -> Vec<String> {
        let all = inputs.as_array().into_iter().flatten();
        let own = all.filter(|input| input["role"] == role);
        own.filter_map(|input| input["blake3"].as_str().map(str::to_owned)).collect()
    };
    let named = values.iter().filter(|(_, value)| !value.paths().is_empty());
    let read =
        named.map(|(&place, value)| (place, (value.clone(), hashes(role(TABLE[place].key)))));
    read.filter(|(_, (_, hashes))| !hashes.is_empty()).collect()
}

/// As what the summary lists the files of a key.
fn role(key: &str) -> &str {
    let key = key.strip_suffix(".file").unwrap_or(key);
    key.strip_prefix("carry.").unwrap_or(key)
}
