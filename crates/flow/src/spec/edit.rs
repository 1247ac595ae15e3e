//! Changes to a case file's text that leave its comments and order alone.

use super::error::CaseError;
use super::read::{FORMER, SHORT, place};
use super::table::TABLE;
use super::value::Value;
use serde_json::Value as Json;
use std::path::PathBuf;
use toml_edit::{Array, DocumentMut, InlineTable, Item, Table, TableLike};

/// A change of one parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Edit {
    /// Its key.
    pub key: String,
    /// Its new value; `null` takes it away.
    pub value: Json,
}

/// The text with the changes made; comments, order and all other keys stay as they are.
///
/// # Errors
/// [`CaseError`] when the text is not TOML, there is no such key, or a value does not fit.
pub fn edit(text: &str, edits: &[Edit]) -> Result<String, CaseError> {
    let invalid = |reason: String| CaseError::Invalid { path: PathBuf::new(), reason };
    let mut document: DocumentMut =
        text.parse().map_err(|e: toml_edit::TomlError| invalid(e.to_string()))?;
    for Edit { key, value } in edits {
        let parameter = &TABLE[place(key)?];
        let new = match value {
            Json::Null => None,
            given => Some(item(&Value::of(parameter, given)?.json())),
        };
        let (table, name) = parameter.path();
        match table {
            None => put(document.as_table_mut(), name, new),
            Some(table) => {
                let table = written_name(&document, table);
                put_within(document.as_table_mut(), table, (name, new));
            }
        }
    }
    Ok(document.to_string())
}

/// What a table of keys is called in a document: by its former name where it stands there so.
fn written_name<'a>(document: &DocumentMut, table: &'a str) -> &'a str {
    let former = FORMER.iter().find(|(former, now)| *now == table && document.contains_key(former));
    former.map_or(table, |(former, _)| former)
}

/// Puts a key into a table of the document, which is made where there is none. A short form becomes
/// the full one, unless it is the short form's own value that changes.
fn put_within(document: &mut Table, table: &str, (name, new): (&str, Option<Item>)) {
    let single = document.get(table).is_some_and(|found| !found.is_table_like());
    if single && SHORT.contains(&table) {
        if name == "file" {
            return put(document, table, new);
        }
        let mut full = InlineTable::new();
        if let Some(Item::Value(file)) = document.remove(table) {
            full.insert("file", file.decorated(" ", " "));
        }
        document.insert(table, Item::Value(full.into()));
    }
    if document.get(table).is_none() {
        if new.is_none() {
            return;
        }
        document.insert(table, Item::Value(InlineTable::new().into()));
    }
    if let Some(inner) = document.get_mut(table).and_then(Item::as_table_like_mut) {
        put(inner, name, new);
        if inner.is_empty() {
            document.remove(table);
        }
    }
}

fn put(table: &mut (impl TableLike + ?Sized), name: &str, new: Option<Item>) {
    match (table.get_mut(name), new) {
        // What stands around the value, a comment behind it too, stays.
        (Some(Item::Value(old)), Some(Item::Value(mut new))) => {
            *new.decor_mut() = old.decor().clone();
            *old = new;
        }
        (_, Some(new)) => drop(table.insert(name, new)),
        (_, None) => drop(table.remove(name)),
    }
}

/// A change as `--set` takes it; nothing where a key is taken away.
pub fn set_argument(edit: &Edit) -> Option<String> {
    let value = (!edit.value.is_null()).then(|| toml_value(&edit.value))?;
    Some(format!("{}={value}", edit.key))
}

fn item(value: &Json) -> Item {
    Item::Value(toml_value(value))
}

pub(super) fn toml_value(value: &Json) -> toml_edit::Value {
    match value {
        Json::Bool(on) => (*on).into(),
        Json::Number(n) => match n.as_i64() {
            Some(whole) => whole.into(),
            None => n.as_f64().unwrap_or_default().into(),
        },
        Json::Array(all) => all.iter().map(toml_value).collect::<Array>().into(),
        Json::Object(table) => {
            let mut inner: Vec<_> = table.iter().collect();
            // Long lists come last: people read the rest.
            inner.sort_by_key(|(_, value)| value.is_array());
            inner
                .into_iter()
                .map(|(key, value)| (key.as_str(), toml_value(value)))
                .collect::<InlineTable>()
                .into()
        }
        other => other.as_str().unwrap_or_default().into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn changed(text: &str, key: &str, value: Json) -> String {
        edit(text, &[Edit { key: key.into(), value }]).unwrap()
    }

    const TEXT: &str = "# Mrs X is not named here\nct = 'ct'  # the scan\ntable = { ap = 7, lat = 5.0 } # tilt\n\n\
                        [tissue]\nyoung = 0.9 # fitted\n";

    #[test]
    fn comments_and_other_keys_stay() {
        let text = changed(TEXT, "tissue.young", json!(0.5));
        assert_eq!(text, TEXT.replace("0.9", "0.5"));
        let former = changed("bed = { ap = 7 } # mine\n", "table.lat", json!(2.0));
        assert_eq!(former, "bed = { ap = 7 , lat = 2.0 } # mine\n");
        let text = changed(TEXT, "table.ap", json!(-3.5));
        assert_eq!(text, TEXT.replace("ap = 7", "ap = -3.5"));
        let text = changed(TEXT, "mesh.tetrahedra", json!(3000));
        assert!(
            text.contains("mesh = { tetrahedra = 3000 }") && text.contains("# fitted"),
            "{text}"
        );
        assert_eq!(changed(&text, "mesh.tetrahedra", Json::Null), TEXT);
        assert_eq!(changed(TEXT, "mesh.tetrahedra", Json::Null), TEXT);
    }

    #[test]
    fn short_forms_are_kept_or_made_full() {
        let short = "seeds = 'a.csv' # mine\n";
        assert_eq!(changed(short, "seeds.file", json!("b.csv")), "seeds = [\"b.csv\"] # mine\n");
        let full = changed(short, "seeds.chest_wall", json!([[1, 2, 3]]));
        let table: toml::Table = full.parse().unwrap();
        assert_eq!(table["seeds"]["file"].as_str(), Some("a.csv"), "{full}");
        assert_eq!(table["seeds"]["chest_wall"][0][2].as_float(), Some(3.0), "{full}");
    }

    #[test]
    fn strokes_are_written_as_people_write_them() {
        let strokes = json!([{ "tissue": "erase", "radius": 2.5, "points": [[1, 2, 3.5]] }]);
        let text = changed(TEXT, "seeds.strokes", strokes);
        let line = "seeds = { strokes = [{ tissue = \"erase\", radius = 2.5, points = [[1.0, 2.0, 3.5]] }] }";
        assert!(text.contains(line), "{text}");
        assert_eq!(changed(&text, "seeds.strokes", Json::Null), TEXT);
    }

    #[test]
    fn a_change_is_told_as_the_command_line_takes_it() {
        let told = |key: &str, value: Json| set_argument(&Edit { key: key.into(), value });
        assert_eq!(told("table.ap", json!(7.5)).as_deref(), Some("table.ap=7.5"));
        assert_eq!(told("breast", json!("left")).as_deref(), Some("breast=\"left\""));
        assert_eq!(told("breast", Json::Null), None);
    }

    #[test]
    fn bad_edits_are_refused() {
        for (key, value) in [("tissue.yuong", json!(1)), ("tissue.young", json!(-1))] {
            assert!(edit(TEXT, &[Edit { key: key.into(), value }]).is_err(), "{key}");
        }
    }
}
