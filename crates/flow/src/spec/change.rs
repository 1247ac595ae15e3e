//! `KEY=VALUE` as it is typed: the value as a case file has it, or without the marks that a shell
//! eats.

use super::error::CaseError;
use super::read::{SHORT, Values, current, is_table, no_table, place, values};
use super::table::{TABLE, position};
use super::value::Value;
use serde_json::{Map, Value as Json};

/// The two forms of a tumour: a whole one takes the place of the other.
const FORMS: [[&str; 2]; 2] =
    [["tumour.centre", "tumour.radius"], ["tumour.structure", "tumour.file"]];

/// What a change gives, and the places whose values it takes away.
pub(super) struct Change {
    pub(super) given: Values,
    pub(super) gone: Vec<usize>,
}

/// Reads a change: a text, a list or a table as TOML; a number or a word as TOML where that fits
/// the key, else as it is typed.
///
/// # Errors
/// [`CaseError`] when there is no such key or the value does not fit.
pub(super) fn read(key: &str, text: &str) -> Result<Change, CaseError> {
    let given = match written(text) {
        Some(toml::Value::Datetime(_)) | None => typed(key, text)?,
        Some(value @ (toml::Value::String(_) | toml::Value::Array(_) | toml::Value::Table(_))) => {
            as_written(key, value)?
        }
        Some(value) => match as_written(key, value) {
            Ok(given) => given,
            Err(_) => typed(key, text)?,
        },
    };
    let gone = replaced(&given);
    Ok(Change { given, gone })
}

/// Reads values as a case file has them, some of them `null`: those are taken away.
///
/// # Errors
/// As [`read`].
pub(super) fn merge(all: &Map<String, Json>) -> Result<Change, CaseError> {
    let given = values(all)?;
    let mut gone = replaced(&given);
    for (name, value) in all {
        match value {
            Json::Object(table) => {
                for (inner, _) in table.iter().filter(|(_, value)| value.is_null()) {
                    gone.push(place(&format!("{name}.{inner}"))?);
                }
            }
            Json::Null if is_table(name) && !SHORT.contains(&name.as_str()) => {
                let table = &*current(name);
                let of_table = |p: &&super::Parameter| p.path().0 == Some(table);
                gone.extend(TABLE.iter().filter(of_table).filter_map(|p| position(p.key)));
            }
            Json::Null => gone.push(place(name)?),
            _ => {}
        }
    }
    Ok(Change { given, gone })
}

/// The keys of the other form of a tumour that is given whole.
fn replaced(given: &Values) -> Vec<usize> {
    let has = |key: &&str| position(key).is_some_and(|place| given.contains_key(&place));
    let whole = FORMS.iter().position(|form| form.iter().all(has));
    let gone = whole.map(|n| FORMS[1 - n]).into_iter().flatten().filter(|key| !has(key));
    gone.filter_map(position).collect()
}

/// The text as one value of TOML, if it is that.
fn written(text: &str) -> Option<toml::Value> {
    let mut table: toml::Table = format!("value = {text}").parse().ok()?;
    let value = table.remove("value");
    value.filter(|_| table.is_empty())
}

fn as_written(key: &str, value: toml::Value) -> Result<Values, CaseError> {
    let json = serde_json::to_value(value)
        .map_err(|e| CaseError::Key(format!("`{key}`: its value cannot be read: {e}")))?;
    values(&Map::from_iter([(key.to_owned(), json)]))
}

fn typed(key: &str, text: &str) -> Result<Values, CaseError> {
    if is_table(key) && !SHORT.contains(&key) {
        return Err(no_table(key, &Json::from(text)));
    }
    let place = place(key)?;
    Ok(Values::from([(place, Value::typed(&TABLE[place], text)?)]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::Spec;

    fn changed(case: &str, key: &str, text: &str) -> Result<Spec, String> {
        let mut spec = Spec::from_text(case, "/cases").map_err(|e| e.to_string())?;
        spec.change(key, text).map_err(|e| e.to_string())?;
        Ok(spec)
    }

    /// A change says what the same line of a case file says.
    #[test]
    fn toml_is_read_as_a_case_file_reads_it() {
        for (key, text) in [
            ("breast", "\"left\""),
            ("breast", "'left'"),
            ("ct", "\"/x\""),
            ("exclude", "\"2-01.dcm\""),
            ("exclude", "[\"2-01.dcm\", '2-02.dcm']"),
            ("table", "{ap=3,lat=2}"),
            ("bed", "{ ap = 3.0 }"),
            ("tumour", "{structure=\"GTV\",file=\"/RS.dcm\"}"),
            ("tumour.centre", "[1, 2.5, -3]"),
            ("seeds", "\"/a.csv\""),
            ("labels", "{file=\"/l.nrrd\", body=\"B\"}"),
            ("seeds.exclude", "[[1,2,3],[4,5,6]]"),
            ("tissues", "true"),
            ("mesh.tetrahedra", "3_000"),
            ("tissue.young", "6e-1"),
        ] {
            let spec = changed("", key, text).unwrap();
            let file = Spec::from_text(&format!("{key} = {text}"), "/cases").unwrap();
            assert_eq!(spec, file, "{key}={text}");
        }
    }

    #[test]
    fn what_is_no_toml_is_taken_as_it_is_typed() {
        for (key, text, value) in [
            ("breast", "left", "left"),
            ("ct", "/data/CT 7", "/data/CT 7"),
            ("ct", "/7", "/7"),
            ("series", "1.2", "1.2"),
            ("series", "7", "7"),
            ("export.clock", "2026-03-01 12:00:00", "2026-03-01 12:00:00"),
        ] {
            assert_eq!(changed("", key, text).unwrap().get(key).unwrap().json(), value, "{key}");
        }
        let spec = changed("", "tumour.centre", "1,-2.5, 3").unwrap();
        assert_eq!(spec.get("tumour.centre"), Some(&Value::Point([1.0, -2.5, 3.0])));
        let told = changed("", "table.ap", "7,5").unwrap_err();
        assert!(
            told.contains("\"7,5\" is not a number") && told.contains("7.0, not 7,0"),
            "{told}"
        );
        assert!(changed("", "table.ap", "\"7\"").unwrap_err().contains("\"7\" is not a number"));
        assert!(changed("", "breast", "lft").unwrap_err().contains("\"lft\" is not one of"));
        let told = changed("", "table", "7,5").unwrap_err();
        assert!(told.contains("`table` takes keys") && told.contains("ap, lat"), "{told}");
        let told = changed("", "table", "{ap=3,lt=2}").unwrap_err();
        assert!(told.contains("did you mean `table.lat`?"), "{told}");
        let told = changed("", "tabel", "{ap=3}").unwrap_err();
        assert!(told.contains("did you mean `table`?"), "{told}");
    }

    #[test]
    fn a_table_sets_its_keys_and_a_tumour_takes_the_place_of_another() {
        let case = "table = { ap = 7, lat = 5 }\ntumour = { centre = [1, 2, 3], radius = 9 }";
        let spec = changed(case, "bed", "{ap=3}").unwrap();
        assert_eq!(
            (spec.get("table.ap"), spec.get("table.lat")),
            (Some(&Value::Number(3.0)), Some(&Value::Number(5.0)))
        );
        let spec = changed(case, "tumour", "{structure='GTV',file='/RS.dcm'}").unwrap();
        assert!(spec.case().is_ok() && spec.get("tumour.centre").is_none());
        let half = changed(case, "tumour", "{structure='GTV'}").unwrap();
        assert!(half.get("tumour.centre").is_some(), "half of it takes no place");
        let drawn = "tumour = { structure = 'GTV', file = '/RS.dcm' }";
        let spec = changed(drawn, "tumour", "{centre=[1,2,3],radius=9}").unwrap();
        assert!(spec.case().is_ok() && spec.get("tumour.file").is_none());
    }
}
