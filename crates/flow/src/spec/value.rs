//! A parameter's value, checked against the table.

use super::error::{CaseError, unfit};
use super::hint;
use super::json::{list, numbers};
use super::stroke;
use super::table::{Kind, Parameter};
use serde_json::Value as Json;
use std::path::PathBuf;
use supine_volume::Stroke;

/// A value that is what its parameter may be.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Of [`Kind::Switch`].
    Switch(bool),
    /// Of [`Kind::Number`].
    Number(f64),
    /// Of [`Kind::Whole`].
    Whole(u64),
    /// Of [`Kind::Choice`]: one of the table's words.
    Choice(&'static str),
    /// Of [`Kind::Text`].
    Text(String),
    /// Of [`Kind::Point`].
    Point([f64; 3]),
    /// Of [`Kind::Points`].
    Points(Vec<[f64; 3]>),
    /// Of [`Kind::Strokes`].
    Strokes(Vec<Stroke>),
    /// Of [`Kind::Interval`].
    Interval([f64; 2]),
    /// Of [`Kind::File`].
    File(PathBuf),
    /// Of [`Kind::Files`].
    Files(Vec<PathBuf>),
    /// Of [`Kind::Names`].
    Names(Vec<String>),
}

impl Value {
    /// The value of a parameter as a case file, a summary or a program gives it.
    ///
    /// # Errors
    /// [`CaseError::Value`] with key, value and what is expected.
    pub fn of(parameter: &Parameter, given: &Json) -> Result<Self, CaseError> {
        let value = match parameter.kind {
            Kind::Switch => given.as_bool().map(Self::Switch),
            Kind::Number { min, max } => {
                given.as_f64().filter(|x| (min..=max).contains(x)).map(Self::Number)
            }
            Kind::Whole { min, max } => {
                given.as_u64().filter(|n| (min..=max).contains(n)).map(Self::Whole)
            }
            Kind::Choice(words) => {
                words.iter().find(|w| given.as_str() == Some(w)).map(|w| Self::Choice(w))
            }
            Kind::Text => given.as_str().map(|text| Self::Text(text.into())),
            Kind::Point => numbers(given).map(Self::Point),
            Kind::Points => list(given, numbers).map(Self::Points),
            Kind::Strokes => list(given, stroke::of_json).map(Self::Strokes),
            Kind::Interval { min, max } => {
                numbers(given).filter(|[a, b]| a < b && min <= *a && *b <= max).map(Self::Interval)
            }
            Kind::File => path(given).map(Self::File),
            Kind::Files => match given {
                Json::String(_) => path(given).map(|one| Self::Files(vec![one])),
                given => list(given, path).map(Self::Files),
            },
            Kind::Names => texts(given).map(Self::Names),
        };
        value.ok_or_else(|| unfit(parameter, &short(given), hint::of_value(parameter.kind, given)))
    }

    /// The value of a parameter as it is typed on the command line: words and paths without
    /// quotation marks, numbers of a position with commas between them, positions with semicolons.
    ///
    /// # Errors
    /// As [`Value::of`].
    pub fn typed(parameter: &Parameter, text: &str) -> Result<Self, CaseError> {
        let given = match parameter.kind {
            Kind::Text | Kind::File | Kind::Choice(_) => Json::from(text),
            Kind::Files | Kind::Names => match serde_json::from_str(text) {
                Ok(list @ Json::Array(_)) => list,
                _ => Json::from(text),
            },
            Kind::Number { .. } => number(text).unwrap_or_else(|| text.into()),
            Kind::Point | Kind::Interval { .. } if !text.trim_start().starts_with('[') => {
                split(text, ',', number).unwrap_or_else(|| text.into())
            }
            Kind::Points if !text.trim_start().starts_with('[') => {
                split(text, ';', |point| split(point, ',', number)).unwrap_or_else(|| text.into())
            }
            _ => serde_json::from_str(text).unwrap_or_else(|_| text.into()),
        };
        Self::of(parameter, &given)
    }

    /// The value as a case file or a summary holds it.
    pub fn json(&self) -> Json {
        match self {
            Self::Switch(on) => (*on).into(),
            Self::Number(x) => (*x).into(),
            Self::Whole(n) => (*n).into(),
            Self::Choice(word) => (*word).into(),
            Self::Text(text) => text.as_str().into(),
            Self::Point(p) => p.to_vec().into(),
            Self::Points(all) => all.iter().map(|p| p.to_vec()).collect(),
            Self::Strokes(all) => all.iter().map(stroke::to_json).collect(),
            Self::Interval(ends) => ends.to_vec().into(),
            Self::File(path) => path.to_string_lossy().into(),
            Self::Files(all) => all.iter().map(|p| p.to_string_lossy()).collect(),
            Self::Names(all) => all.iter().map(String::as_str).collect(),
        }
    }

    /// The paths that it names.
    pub(crate) fn paths(&self) -> &[PathBuf] {
        match self {
            Self::File(path) => std::slice::from_ref(path),
            Self::Files(all) => all,
            _ => &[],
        }
    }

    /// The same with its paths made whole by a folder.
    pub(crate) fn within(self, folder: &std::path::Path) -> Self {
        match self {
            Self::File(path) => Self::File(folder.join(path)),
            Self::Files(all) => Self::Files(all.iter().map(|p| folder.join(p)).collect()),
            other => other,
        }
    }
}

/// A number as it is typed: also in forms that JSON does not know, such as `.5`.
fn number(text: &str) -> Option<Json> {
    let typed = || text.trim().parse().ok().filter(|x: &f64| x.is_finite()).map(Json::from);
    serde_json::from_str(text).ok().filter(Json::is_number).or_else(typed)
}

/// What is typed with separators between.
fn split(text: &str, by: char, one: impl Fn(&str) -> Option<Json>) -> Option<Json> {
    text.split(by).map(one).collect::<Option<Vec<Json>>>().map(Json::Array)
}

/// A path that this machine can have.
fn path(given: &Json) -> Option<PathBuf> {
    let path = hint::path(given.as_str()?);
    path.to_str().is_none_or(hint::usable).then_some(path)
}

/// One text, or several.
fn texts(given: &Json) -> Option<Vec<String>> {
    match given {
        Json::String(one) if !one.is_empty() => Some(vec![one.clone()]),
        given => list(given, |one| one.as_str().map(String::from)),
    }
}

/// A value as messages show it: a number without the `.0` that one way of typing it has and another
/// has not.
fn short(given: &Json) -> String {
    const LENGTH: usize = 60;
    let text = match given.as_f64() {
        Some(number) => number.to_string(),
        None => given.to_string(),
    };
    match text.char_indices().nth(LENGTH) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::super::table::{TABLE, position};
    use super::*;

    fn parameter(key: &str) -> &'static Parameter {
        &TABLE[position(key).unwrap()]
    }

    #[test]
    fn typed_text_is_what_a_case_file_says() {
        for (key, typed, written) in [
            ("tissue.young", "0.9", "0.9"),
            ("mesh.tetrahedra", "3000", "3000"),
            ("breast", "left", "\"left\""),
            ("tumour.centre", "1,-2.5, 3", "[1,-2.5,3]"),
            ("tumour.centre", "[1,-2.5,3]", "[1,-2.5,3]"),
            ("seeds.exclude", "1,2,3;4,5,6", "[[1,2,3],[4,5,6]]"),
            ("tissue.young", ".9", "0.9"),
            ("tissue.young_interval", "0.3,2", "[0.3,2]"),
            ("carry.dose", "a b.dcm", "\"a b.dcm\""),
            ("carry.dose", "[\"a\",\"b\"]", "[\"a\",\"b\"]"),
            ("seeds.chest_wall", "[[1,2,3]]", "[[1,2,3]]"),
            ("tissues", "true", "true"),
            ("ct", "7", "\"7\""),
        ] {
            let of = Value::of(parameter(key), &serde_json::from_str(written).unwrap()).unwrap();
            assert_eq!(Value::typed(parameter(key), typed).unwrap(), of, "{key}");
            assert_eq!(Value::of(parameter(key), &of.json()).unwrap(), of, "{key}");
        }
    }

    #[test]
    fn what_does_not_fit_is_told_with_key_value_and_range() {
        let error = Value::typed(parameter("table.ap"), "700").unwrap_err().to_string();
        assert_eq!(error, "`table.ap`: 700 is not a number from -180 to 180 degrees");
        let error = Value::typed(parameter("mesh.mesher"), "magic").unwrap_err().to_string();
        assert!(error.contains("\"magic\" is not one of \"native\", \"cgal\""), "{error}");
        for (key, bad) in [
            ("tissue.young", "nan"),
            ("tissue.young_interval", "2,0.3"),
            ("tumour.centre", "1,2"),
            ("mesh.order", "1.5"),
            ("tissues", "yes"),
        ] {
            assert!(Value::typed(parameter(key), bad).is_err(), "{key} {bad}");
        }
    }
}
