//! Lines of a case file, as examples.

use super::table::{Kind, Parameter, Preset};

/// Values where the kind alone would give a strange one.
const VALUES: &[(&str, &str)] = &[
    ("ct", "'CT'"),
    ("series", "\"1.2.840.113619.2.55\""),
    ("breast", "\"left\""),
    ("table.ap", "7.0"),
    ("table.lat", "5.0"),
    ("tumour.radius", "9.0"),
    ("tumour.structure", "\"GTV\""),
    ("region.radius", "95.0"),
    ("mesh.tumour_edge", "4.0"),
    ("mesh.tumour_growth", "0.5"),
    ("tissue.young", "0.609"),
    ("tissue.spring", "0.02"),
    ("tissue.young_interval", "[0.4, 0.9]"),
    ("seeds.file", "'seeds.mrk.json'"),
    ("carry.points", "'points.csv'"),
];

/// Lines for the tables that a case must have.
const LINES: [(&str, &str); 2] = [
    ("table", "table = { ap = 7.0, lat = 5.0 }"),
    ("tumour", "tumour = { centre = [91.4, -248.1, -594.5], radius = 9.0 }"),
];

impl Parameter {
    /// A value as a case file has it, to show how it is written.
    pub fn example(&self) -> String {
        if let Some((_, value)) = VALUES.iter().find(|(key, _)| *key == self.key) {
            return (*value).into();
        }
        match (self.kind, self.default) {
            (_, Preset::Switch(on)) => on.to_string(),
            (_, Preset::Number(x)) => x.to_string(),
            (_, Preset::Whole(n)) => n.to_string(),
            (_, Preset::Choice(word)) => format!("\"{word}\""),
            (Kind::Switch, _) => "true".into(),
            (Kind::Number { .. }, _) => "1.0".into(),
            (Kind::Whole { min, .. }, _) => min.to_string(),
            (Kind::Choice(words), _) => format!("\"{}\"", words.first().unwrap_or(&"")),
            (Kind::Text, _) => "\"text\"".into(),
            (Kind::Point, _) => "[91.4, -248.1, -594.5]".into(),
            (Kind::Points, _) => "[[91.4, -248.1, -594.5]]".into(),
            (Kind::Strokes, _) => {
                "[{ tissue = \"chest_wall\", radius = 6.0, points = [[91.4, -200.0, -594.5]] }]"
                    .into()
            }
            (Kind::Interval { .. }, _) => "[0.5, 2.0]".into(),
            (Kind::File | Kind::Files, _) => "'file.dcm'".into(),
            (Kind::Names, _) => "\"name\"".into(),
        }
    }

    /// A line of a case file that gives it; with its table where that has to be given whole.
    pub fn example_line(&self) -> String {
        let whole = LINES.iter().find(|(table, _)| self.path().0 == Some(table));
        whole.map_or_else(
            || format!("{} = {}", self.key, self.example()),
            |(_, line)| (*line).into(),
        )
    }
}

/// A text as a case file has it: in '...', where a backslash is a backslash, unless it holds that
/// mark.
pub fn quoted(text: &str) -> String {
    if text.contains('\'') || text.chars().any(char::is_control) {
        return toml::Value::from(text).to_string();
    }
    format!("'{text}'")
}

#[cfg(test)]
mod tests {
    use super::super::table::TABLE;
    use super::super::value::Value;
    use super::*;

    #[test]
    fn every_example_is_a_value_of_its_key() {
        for parameter in TABLE {
            let table: toml::Table = format!("v = {}", parameter.example()).parse().unwrap();
            let value = serde_json::to_value(&table["v"]).unwrap();
            assert!(Value::of(parameter, &value).is_ok(), "{}", parameter.key);
        }
    }

    #[test]
    fn quoted_texts_are_read_back() {
        for text in ["C:\\new\\ct", "Mrs O'Hara\\x", "plain", "tab\t"] {
            let table: toml::Table = format!("v = {}", quoted(text)).parse().unwrap();
            assert_eq!(table["v"].as_str(), Some(text));
        }
    }
}
