//! Lists and positions as JSON has them.

use serde_json::Value as Json;

/// So many numbers.
pub(super) fn numbers<const N: usize>(given: &Json) -> Option<[f64; N]> {
    let all: Option<Vec<f64>> = given.as_array()?.iter().map(Json::as_f64).collect();
    all?.try_into().ok()
}

/// A list, each of whose entries is read by `one`.
pub(super) fn list<T>(given: &Json, one: impl Fn(&Json) -> Option<T>) -> Option<Vec<T>> {
    given.as_array()?.iter().map(one).collect()
}
