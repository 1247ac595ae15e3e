//! What a case lacks that a whole run needs: all of it at once, each with a line to add.

use super::edit::toml_value;
use super::error::CaseError;
use super::example::quoted;
use super::given::Given;
use super::read::Values;
use super::table::{TABLE, position};
use serde_json::Value as Json;

/// Keys that make one thing together.
struct Group {
    keys: &'static [&'static str],
    /// Whether a run needs it; else half of it is too little all the same.
    needed: bool,
}

const fn needed(keys: &'static [&'static str]) -> Group {
    Group { keys, needed: true }
}

const SPHERE: &[&str] = &["tumour.centre", "tumour.radius"];
const DRAWN: &[&str] = &["tumour.structure", "tumour.file"];

/// That nothing is missing.
///
/// # Errors
/// [`CaseError::Incomplete`] with all of it.
pub(super) fn check(values: &Values) -> Result<(), CaseError> {
    let given = Given(values);
    let begun = |keys: &[&str]| keys.iter().any(|key| given.get(key).is_some());
    let tumour = match (begun(SPHERE), begun(DRAWN)) {
        // They contradict each other, and the case says so.
        (true, true) => Group { keys: &[], needed: false },
        (false, true) => needed(DRAWN),
        _ => needed(SPHERE),
    };
    let groups = [
        needed(&["ct"]),
        needed(&["breast"]),
        needed(&["table.ap", "table.lat"]),
        tumour,
        Group { keys: &["region.centre", "region.radius"], needed: false },
    ];
    let (mut keys, mut add) = (Vec::new(), String::new());
    for group in groups.iter().filter(|group| group.needed || begun(group.keys)) {
        let lacks = group.keys.iter().copied().filter(|key| given.get(key).is_none());
        let lacking: Vec<&'static str> = lacks.collect();
        if lacking.len() == group.keys.len() {
            // The first stands for the whole.
            keys.extend(lacking.first());
        } else {
            keys.extend(&lacking);
        }
        if let Some(first) = lacking.first() {
            add += &format!("\n  {}", line(given, group.keys, first, lacking.len()));
        }
    }
    if keys.is_empty() { Ok(()) } else { Err(CaseError::Incomplete { keys, add }) }
}

/// The line to add; of a table of which half is there, the whole in its place, since TOML has no
/// second half elsewhere.
fn line(given: Given<'_>, keys: &[&str], lacking: &str, count: usize) -> String {
    let Some(parameter) = position(lacking).map(|n| &TABLE[n]) else { return String::new() };
    let Some(table) = parameter.path().0.filter(|_| count < keys.len()) else {
        return format!("{}   # {}", parameter.example_line(), parameter.help);
    };
    let entries = keys.iter().filter_map(|key| position(key)).map(|n| {
        let (one, held) = (&TABLE[n], given.get(TABLE[n].key).map(|value| written(&value.json())));
        format!("{} = {}", one.path().1, held.unwrap_or_else(|| one.example()))
    });
    let entries: Vec<String> = entries.collect();
    format!(
        "{table} = {{ {} }}   # in place of the `{table}` that is there; {}: {}",
        entries.join(", "),
        parameter.path().1,
        parameter.help
    )
}

fn written(value: &Json) -> String {
    value.as_str().map_or_else(|| toml_value(value).to_string(), quoted)
}
