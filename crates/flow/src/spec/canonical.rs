//! The canonical form of a case: every value that made a result, by table and key.
//!
//! A value is as it was given, or the table's default. The few that rest on other values are asked
//! of the case, by a function that their row of the table names.

use super::case::Case;
use super::parameter::{Parameter, Preset};
use super::read::Values;
use super::table::TABLE;
use serde_json::{Map, Value as Json};

/// The values of a case in the order of the parameters; what does not apply is left out.
pub(super) fn object(case: &Case, values: &Values) -> Map<String, Json> {
    let mut object = Map::new();
    for (place, parameter) in TABLE.iter().enumerate() {
        let value = match (parameter.derived, values.get(&place)) {
            (Some(derived), _) => derived(case),
            (None, Some(given)) => given.json(),
            (None, None) => default(parameter),
        };
        if !value.is_null() && value.as_array().is_none_or(|list| !list.is_empty()) {
            insert(&mut object, parameter, value);
        }
    }
    object
}

/// The form without what may identify the patient.
pub(super) fn nameless(canonical: &Map<String, Json>) -> Map<String, Json> {
    let mut object = Map::new();
    for parameter in TABLE.iter().filter(|parameter| !parameter.may_identify()) {
        let (table, name) = parameter.path();
        let inner = table.map_or(Some(canonical), |table| canonical.get(table)?.as_object());
        if let Some(found) = inner.and_then(|inner| inner.get(name)) {
            insert(&mut object, parameter, found.clone());
        }
    }
    object
}

fn insert(object: &mut Map<String, Json>, parameter: &Parameter, value: Json) {
    let (table, name) = parameter.path();
    let inner = match table {
        None => Some(object),
        Some(table) => {
            object.entry(table).or_insert_with(|| Json::Object(Map::new())).as_object_mut()
        }
    };
    inner.map(|inner| inner.insert(name.into(), value));
}

fn default(parameter: &Parameter) -> Json {
    match parameter.default {
        Preset::Required | Preset::RequiredOr(_) | Preset::Absent(_) => Json::Null,
        Preset::Switch(on) => on.into(),
        Preset::Number(x) => x.into(),
        Preset::Whole(n) => n.into(),
        Preset::Choice(word) => word.into(),
    }
}
