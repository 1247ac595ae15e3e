//! The keys of a case file: unknown ones are refused and the nearest known one is named.

use toml::{Table, Value};

/// A key with the keys within it; no keys within means any value.
struct Key {
    name: &'static str,
    within: &'static [&'static str],
}

const fn key(name: &'static str, within: &'static [&'static str]) -> Key {
    Key { name, within }
}

/// All keys that this version understands.
const KEYS: &[Key] = &[
    key("ct", &[]),
    key("series", &[]),
    key("assume_hu", &[]),
    key("equalise_steps", &[]),
    key("breast", &[]),
    key("bed", &["ap", "lat"]),
    key("tumour", &["centre", "radius"]),
    key("region", &["centre", "radius"]),
    key(
        "mesh",
        &["tetrahedra", "order", "sides", "mesher", "refine", "tumour_edge", "tumour_growth"],
    ),
    key(
        "tissue",
        &[
            "young",
            "poisson",
            "density",
            "rest",
            "cut",
            "spring",
            "map",
            "fat",
            "gland",
            "skin",
            "tumour",
            "young_interval",
        ],
    ),
    key("seeds", &["chest_wall", "soft_tissue", "exclude"]),
    key("labels", &["file", "body", "soft_tissue", "chest_wall"]),
    key("warp", &["interpolation"]),
    key("carry", &["points", "dose", "structures", "segmentation"]),
    key("export", &["anonymise", "study", "equipment", "frame", "registration"]),
    key("tissues", &[]),
];

/// Keys of the case file's format that a later version will understand. They are refused rather
/// than ignored: a planner who asks for a thing must not believe that it was done.
const LATER: &[&str] = &["scans", "export.spacing"];

/// The first key that cannot be used, in words; `None` when all are known.
pub(crate) fn first_unknown(case: &Table) -> Option<String> {
    for (name, value) in case {
        let Some(known) = KEYS.iter().find(|k| k.name == name) else {
            return Some(complain(name, KEYS.iter().map(|k| k.name)));
        };
        if let Some(complaint) = no_table(known, value) {
            return Some(complaint);
        }
        let (Value::Table(table), false) = (value, known.within.is_empty()) else { continue };
        if let Some(inner) = table.keys().find(|k| !known.within.contains(&k.as_str())) {
            let path = format!("{name}.{inner}");
            return Some(complain(&path, known.within.iter().copied()));
        }
    }
    None
}

/// What is wrong with a single value where keys within are expected; seeds and labels may also be a
/// file alone.
fn no_table(known: &Key, value: &Value) -> Option<String> {
    let single = known.within.is_empty() || matches!(known.name, "seeds" | "labels");
    if single || value.is_table() {
        return None;
    }
    let (name, within) = (known.name, known.within.join(", "));
    let near = |k: &&Key| k.within.is_empty() && strsim::damerau_levenshtein(k.name, name) == 1;
    let hint = KEYS.iter().find(near).map(|k| format!("; did you mean `{}`?", k.name));
    let hint = hint.unwrap_or_default();
    Some(format!("`{name}` takes keys: {name} = {{ ... }} with {within}{hint}"))
}

fn complain<'a>(path: &str, known: impl Iterator<Item = &'a str>) -> String {
    if LATER.contains(&path) {
        return format!("the key `{path}` is not supported by this version: remove it");
    }
    let name = path.rsplit('.').next().unwrap_or(path);
    let nearest = known.min_by_key(|k| strsim::damerau_levenshtein(k, name));
    match (nearest, path.rsplit_once('.')) {
        (Some(k), Some((table, _))) => {
            format!("unknown key `{path}`: did you mean `{table}.{k}`?")
        }
        (Some(k), None) => format!("unknown key `{path}`: did you mean `{k}`?"),
        (None, _) => format!("unknown key `{path}`"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn first(text: &str) -> Option<String> {
        first_unknown(&text.parse::<Table>().unwrap())
    }

    #[test]
    fn typos_name_the_nearest_key() {
        assert_eq!(first("tumor = 1"), Some("unknown key `tumor`: did you mean `tumour`?".into()));
        assert_eq!(
            first("[tissue]\nyuong = 1"),
            Some("unknown key `tissue.yuong`: did you mean `tissue.young`?".into())
        );
        assert_eq!(first("seeds = 'a.mrk.json'\nct = 'x'"), None);
    }

    #[test]
    fn a_single_value_for_a_table_is_told_with_its_keys() {
        let text = first("tissue = true").unwrap();
        assert!(text.contains("young, poisson") && text.contains("mean `tissues`?"), "{text}");
        let text = first("bed = [7, 5]").unwrap();
        assert!(text.ends_with("bed = { ... } with ap, lat"), "{text}");
        assert_eq!(first("tissues = true\nlabels = 'l.nrrd'\nseeds = 's.csv'"), None);
    }

    #[test]
    fn what_is_not_built_is_refused_and_not_ignored() {
        assert!(first("[scans]\nsupine = 's.ply'").unwrap().contains("not supported"));
        assert_eq!(first("[carry]\ndose = ['d.dcm']"), None);
        assert!(first("[export]\nspacing = 1.0").unwrap().contains("not supported"));
        assert_eq!(first("[export]\nregistration = false"), None);
    }
}
