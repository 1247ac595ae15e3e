//! Nested keys and values to the table's parameters: unknown ones are refused and the nearest known
//! one is named.

use super::error::CaseError;
use super::table::{TABLE, position};
use super::value::Value;
use crate::nearest::nearest;
use serde_json::{Map, Value as Json};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// Keys with a short form: `seeds = "file"` stands for `seeds = { file = "file" }`.
pub(super) const SHORT: &[&str] = &["seeds", "labels"];

/// Keys of older versions, with what they are called now: they are refused.
const RENAMED: &[(&str, &str)] = &[("mesh.sides", "mesh.geometry")];

/// Former names of tables of keys, with what they are called now: they are read.
pub(super) const FORMER: &[(&str, &str)] = &[("bed", "table")];

/// Keys of the case file's format that a later version will understand. They are refused rather
/// than ignored: a planner who asks for a thing must not believe that it was done.
const LATER: &[&str] = &["export.spacing"];

/// Values by the place of their parameter in the table.
pub(super) type Values = BTreeMap<usize, Value>;

/// The values of a case as an object: `null` is the same as not given.
///
/// # Errors
/// [`CaseError`] for the first key that there is not, and the first value that does not fit.
pub(super) fn values(case: &Map<String, Json>) -> Result<Values, CaseError> {
    let mut values = Values::new();
    for (name, given) in case {
        let name = &*current(name);
        refuse_others(name, given)?;
        match given {
            Json::Object(table) if is_table(name) => {
                for (inner, given) in table {
                    add(&mut values, &format!("{name}.{inner}"), given)?;
                }
            }
            given if SHORT.contains(&name) => {
                add(&mut values, &format!("{name}.file"), given)?;
            }
            Json::Null => {}
            given if is_table(name) => return Err(no_table(name, given)),
            given => add(&mut values, name, given)?,
        }
    }
    Ok(values)
}

/// The key, or table of keys, that a name stands for: itself, or what a former one is called now.
pub(super) fn current(name: &str) -> Cow<'_, str> {
    let (table, inner) = name.split_once('.').map_or((name, None), |(t, i)| (t, Some(i)));
    match (FORMER.iter().find(|(former, _)| *former == table), inner) {
        (None, _) => name.into(),
        (Some((_, now)), None) => (*now).into(),
        (Some((_, now)), Some(inner)) => format!("{now}.{inner}").into(),
    }
}

/// The former name that a key uses, if it does.
pub(super) fn former_of(key: &str) -> Option<&'static str> {
    let table = key.split('.').next();
    FORMER.iter().map(|(former, _)| *former).find(|former| Some(*former) == table)
}

/// The former names that a case uses.
///
/// # Errors
/// [`CaseError::Key`] where the present name stands beside it: which of both holds, nothing says.
pub(super) fn former(case: &Map<String, Json>) -> Result<Vec<&'static str>, CaseError> {
    let holds = |table: &str| case.keys().any(|key| key.split('.').next() == Some(table));
    let used = FORMER.iter().filter(|(former, _)| holds(former));
    let one = |&(former, now): &(&'static str, &str)| match holds(now) {
        true => {
            Err(CaseError::Key(format!("`{former}` and `{now}` are the same: give `{now}` alone")))
        }
        false => Ok(former),
    };
    used.map(one).collect()
}

fn add(values: &mut Values, key: &str, given: &Json) -> Result<(), CaseError> {
    let place = place(key)?;
    if !given.is_null() {
        values.insert(place, Value::of(&TABLE[place], given)?);
    }
    Ok(())
}

/// The place of a key in the table; the short form of a table stands for its file.
///
/// # Errors
/// [`CaseError::Key`] when there is none: with its new name, or the nearest known one.
pub(super) fn place(key: &str) -> Result<usize, CaseError> {
    let now = current(key);
    let full = if SHORT.contains(&&*now) { format!("{now}.file") } else { now.into_owned() };
    position(&full).ok_or_else(|| CaseError::Key(complaint(key)))
}

/// Renamed keys and those of later versions may be whole tables.
fn refuse_others(name: &str, given: &Json) -> Result<(), CaseError> {
    let known = is_table(name) || position(name).is_some();
    if known || given.is_null() { Ok(()) } else { Err(CaseError::Key(complaint(name))) }
}

pub(super) fn is_table(name: &str) -> bool {
    let name = &*current(name);
    TABLE.iter().any(|p| p.path().0 == Some(name))
}

fn complaint(key: &str) -> String {
    if let Some((_, now)) = RENAMED.iter().find(|(old, _)| *old == key) {
        return format!("the key `{key}` is called `{now}` now");
    }
    if LATER.contains(&key) {
        return format!("the key `{key}` is not supported by this version: remove it");
    }
    let name = key.rsplit('.').next().unwrap_or(key);
    let tables = || TABLE.iter().map(|p| p.path().0.unwrap_or(p.key));
    let lower = key.to_lowercase();
    let near = match current(&lower).split_once('.') {
        Some((table, _)) => {
            let table = if is_table(table) { Some(table) } else { nearest(table, tables()) };
            let within = TABLE.iter().filter(|p| p.path().0 == table).map(|p| p.path().1);
            table.zip(nearest(name, within)).map(|(table, key)| format!("{table}.{key}"))
        }
        None if is_table(&lower) => Some(current(&lower).into_owned()),
        None => nearest(name, tables()).map(str::to_owned),
    };
    let hint = near.map_or(String::new(), |k| format!(": did you mean `{k}`?"));
    format!("unknown key `{key}`{hint}")
}

/// The complaint about a single value where keys within are expected.
pub(super) fn no_table(name: &str, given: &Json) -> CaseError {
    let name = &*current(name);
    let inner: Vec<&str> =
        TABLE.iter().filter(|p| p.path().0 == Some(name)).map(|p| p.path().1).collect();
    let near = |p: &&super::Parameter| {
        p.path().0.is_none() && strsim::damerau_levenshtein(p.key, name) == 1
    };
    let hint = TABLE.iter().find(near).map(|p| format!("; did you mean `{}`?", p.key));
    let (keys, hint) = (inner.join(", "), hint.unwrap_or_default());
    CaseError::Key(format!(
        "`{name}` takes keys, not {given}: {name} = {{ ... }} with {keys}{hint}"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn complaint_about(text: &str) -> Option<String> {
        let table: toml::Table = text.parse().unwrap();
        let Json::Object(case) = serde_json::to_value(table).unwrap() else { panic!() };
        values(&case).err().map(|e| e.to_string())
    }

    #[test]
    fn typos_name_the_nearest_key() {
        for (text, told) in [
            ("tumor = 1", "unknown key `tumor`: did you mean `tumour`?"),
            ("[tissue]\nyuong = 1", "unknown key `tissue.yuong`: did you mean `tissue.young`?"),
            ("tisue = { young = 1.0 }", "unknown key `tisue`: did you mean `tissue`?"),
            ("Bed = { ap = 5.0 }", "unknown key `Bed`: did you mean `table`?"),
            ("'tumor.radius' = 9", "unknown key `tumor.radius`: did you mean `tumour.radius`?"),
        ] {
            assert_eq!(complaint_about(text).as_deref(), Some(told));
        }
        assert_eq!(complaint_about("seeds = 'a.mrk.json'\nct = 'x'"), None);
    }

    #[test]
    fn a_former_name_is_read_and_not_beside_the_present_one() {
        let read = |text: &str| {
            let spec = crate::spec::Spec::from_text(text, "").map_err(|e| e.to_string())?;
            Ok::<_, String>((spec.get("table.ap").cloned(), spec.former().to_vec()))
        };
        let now = read("table = { ap = 7.0 }").unwrap();
        let then = read("bed = { ap = 7.0 }").unwrap();
        assert!(now.0.is_some() && now.0 == then.0);
        assert_eq!((now.1, then.1), (vec![], vec!["bed"]));
        let both = read("bed = { ap = 7.0 }\ntable = { lat = 5.0 }").unwrap_err();
        assert!(both.contains("give `table` alone"), "{both}");
        let same = crate::spec::Spec::says_the_same;
        assert!(
            same("bed.ap", "table.ap") && same("table", "bed.lat") && !same("bed.ap", "bed.lat")
        );
        assert!(!same("tissue", "tissues"));
        let two = crate::spec::Spec::by_two_names;
        assert!(two("bed.ap", "table.ap") && two("table", "bed.lat"));
        assert!(!two("table.ap", "table.ap") && !two("bed.ap", "bed.ap"));
        let none = read("table = { ap = nan }").unwrap_err();
        assert!(none.contains("`table.ap`: nan and inf are no numbers"), "{none}");
        let typo = read("bed = { app = 7.0 }").unwrap_err();
        assert!(typo.contains("did you mean `table.ap`?"), "{typo}");
    }

    #[test]
    fn a_single_value_for_a_table_is_told_with_its_keys() {
        let text = complaint_about("tissue = true").unwrap();
        assert!(text.contains("young, poisson") && text.contains("mean `tissues`?"), "{text}");
        let text = complaint_about("bed = [7, 5]").unwrap();
        assert!(text.ends_with("table = { ... } with ap, lat"), "{text}");
        assert_eq!(complaint_about("tissues = true\nlabels = 'l.nrrd'\nseeds = 's.csv'"), None);
    }

    #[test]
    fn what_is_renamed_or_not_built_is_refused_and_not_ignored() {
        let text = complaint_about("mesh = { sides = 'curved' }").unwrap();
        assert_eq!(text, "the key `mesh.sides` is called `mesh.geometry` now");
        assert!(complaint_about("[export]\nspacing = 1.0").unwrap().contains("not supported"));
        assert_eq!(complaint_about("[export]\nregistration = false"), None);
    }
}
