//! What decides a result: one table of parameters, values for them, and the case that they make.
//!
//! [`TABLE`] is the truth of keys, options, ranges, defaults and help. A [`Spec`] holds values as
//! they were given, from a case file, a summary or a program; [`Spec::case`] checks them together.

mod boundary;
mod canonical;
mod case;
mod change;
mod complete;
mod derived;
mod edit;
mod error;
mod example;
mod given;
mod hint;
mod json;
mod mesh;
mod parameter;
mod read;
mod recorded;
mod schema;
mod stroke;
mod table;
mod tissue;
mod typed;
mod value;

pub use case::{
    Case, ExportSpec, FitScans, MeshSpec, PostureSpec, Refinement, ScansSpec, SeedsSpec, Stiffness,
    StiffnessMap, Tolerance, TumourSpec,
};
pub use edit::{Edit, edit, set_argument};
pub use error::CaseError;
pub(crate) use error::readable;
pub use example::quoted;
pub use schema::{case_schema, guide_table, key_list};
pub(crate) use stroke::to_json as stroke_json;
pub use table::{Kind, Parameter, Preset, TABLE};
pub use value::Value;

use crate::Observer;
use crate::text_file::read_text;
use read::{Values, place, values};
use recorded::Recorded;
use serde_json::Value as Json;
use std::path::{Path, PathBuf};

/// Values for the parameters of [`TABLE`], as they were given, and the folder from which their
/// paths lead.
#[derive(Clone, Debug)]
pub struct Spec {
    values: Values,
    folder: PathBuf,
    /// Of a summary that is repeated: the values that name files, with the hashes of what its run
    /// read by them.
    recorded: Recorded,
    /// Former names that its text uses.
    former: Vec<&'static str>,
}

/// The first key of a table whose value holds a number that is none.
fn not_finite(table: &toml::Table) -> Option<String> {
    fn holds(value: &toml::Value) -> bool {
        match value {
            toml::Value::Float(number) => !number.is_finite(),
            toml::Value::Array(all) => all.iter().any(holds),
            _ => false,
        }
    }
    table.iter().find_map(|(key, value)| match value {
        toml::Value::Table(inner) => not_finite(inner).map(|within| format!("{key}.{within}")),
        value => holds(value).then(|| key.clone()),
    })
}

/// No breast is stiffer as a whole, kPa: its gland comes to some tens (Krouskop et al. 1998).
const STIFFEST_KPA: f64 = 100.0;

/// The same values, whatever their keys were called.
impl PartialEq for Spec {
    fn eq(&self, other: &Self) -> bool {
        let Self { values, folder, recorded, former: _ } = self;
        (values, folder, recorded) == (&other.values, &other.folder, &other.recorded)
    }
}

impl Spec {
    /// Nothing given; paths lead from `folder`.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        let (values, recorded, former) = (Values::new(), Recorded::new(), Vec::new());
        Self { values, folder: folder.into(), recorded, former }
    }

    /// Reads a case file (TOML) or the `summary.json` of a run, whose case it repeats.
    ///
    /// Paths in a case file lead from its folder, those in a summary from the folder of its case
    /// file.
    ///
    /// # Errors
    /// [`CaseError`], naming the key and what to do.
    pub fn read(path: &Path) -> Result<Self, CaseError> {
        let text = read_text(path)
            .map_err(|source| CaseError::Unreadable { path: path.into(), source })?;
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) {
            return Self::from_summary(&text, path);
        }
        let folder = path.parent().unwrap_or(Path::new(""));
        Self::from_text(&text, folder).map_err(|error| match error {
            CaseError::Invalid { reason, .. } => CaseError::Invalid { path: path.into(), reason },
            other => other,
        })
    }

    /// The values of a case file's text; paths lead from `folder`.
    ///
    /// # Errors
    /// As [`Spec::read`].
    pub fn from_text(text: &str, folder: impl Into<PathBuf>) -> Result<Self, CaseError> {
        let invalid = |reason| CaseError::Invalid { path: PathBuf::new(), reason };
        let table: toml::Table = text.parse().map_err(|e: toml::de::Error| {
            let before = e.span().and_then(|span| text.get(..span.start));
            let line = before.map_or(usize::MAX, |before| before.matches('\n').count());
            invalid(e.to_string().trim_end().to_owned() + hint::of_text(text, line))
        })?;
        // JSON has no such numbers: they would be read as not given.
        if let Some(key) = not_finite(&table) {
            return Err(CaseError::Key(format!("`{key}`: nan and inf are no numbers of a case")));
        }
        let object = serde_json::to_value(table).map_err(|e| invalid(e.to_string()))?;
        let Json::Object(object) = object else { return Err(invalid("no table".into())) };
        let former = read::former(&object)?;
        Ok(Self { values: values(&object)?, former, ..Self::new(folder) })
    }

    /// Former names of keys that its text uses; they are read as the present ones.
    pub fn former(&self) -> &[&'static str] {
        &self.former
    }

    /// Notes the former names that were used, and a modulus that seems to be in Pa.
    pub(crate) fn note_doubts(&self, observer: &dyn Observer) {
        for (former, now) in read::FORMER.iter().filter(|(old, _)| self.former.contains(old)) {
            observer
                .note(&format!("the key `{former}` is called `{now}` now; it is read as before"));
        }
        if let Some(&Value::Number(kpa)) = self.get("tissue.young")
            && kpa > STIFFEST_KPA
        {
            observer.note(&format!(
                "`tissue.young` is {kpa} kPa, far beyond any breast: was {} kPa ({kpa} Pa) meant?",
                kpa / 1000.0
            ));
        }
    }

    /// The case of a summary; of a de-identified run, whose summary names no files, the case that
    /// it kept beside it.
    fn from_summary(text: &str, path: &Path) -> Result<Self, CaseError> {
        let invalid = |reason: String| CaseError::Invalid { path: path.into(), reason };
        let summary: Json = serde_json::from_str(text).map_err(|e| invalid(e.to_string()))?;
        let schema = summary.get("schema").and_then(Json::as_u64);
        if schema != Some(u64::from(supine_report::Summary::SCHEMA)) {
            return Err(invalid(
                "it is no summary of a run of this version: run the case file instead".into(),
            ));
        }
        let nameless = summary.pointer("/case/export/anonymise") == Some(&Json::Bool(true));
        let inputs = summary["inputs"].clone();
        let kept = match nameless {
            true => crate::folder::kept_case(path)
                .ok_or_else(|| CaseError::Withheld { path: path.into() })?,
            false => summary,
        };
        let case = kept.get("case").and_then(Json::as_object);
        let folder = kept.pointer("/run/case_folder").and_then(Json::as_str).unwrap_or_default();
        let mut spec =
            Self::from_canonical(case.ok_or_else(|| invalid("it holds no case".into()))?, folder)?;
        spec.recorded = recorded::of(&spec.values, &inputs);
        Ok(spec)
    }

    /// The same, whose files may differ from those that the run of its summary read.
    #[must_use]
    pub fn with_inputs_changed(mut self) -> Self {
        self.recorded.clear();
        self
    }

    /// Keys and paths of the files that the run of a repeated summary read, with the hashes that it
    /// recorded, while the values are those of the summary.
    pub(crate) fn recorded(&self) -> impl Iterator<Item = (&'static str, &Path, Vec<&str>)> {
        let same = self
            .recorded
            .iter()
            .filter(|(place, (value, _))| self.values.get(place) == Some(value));
        same.flat_map(|(&place, (value, hashes))| {
            let hashes: Vec<&str> = hashes.iter().map(String::as_str).collect();
            value.paths().iter().map(move |path| (TABLE[place].key, path.as_path(), hashes.clone()))
        })
    }

    /// Every path that is given, with its key.
    pub(crate) fn paths(&self) -> impl Iterator<Item = (&'static str, &Path)> {
        self.values.iter().flat_map(|(&place, value)| {
            value.paths().iter().map(move |path| (TABLE[place].key, path.as_path()))
        })
    }

    /// Every path that is given.
    pub(crate) fn files(&self) -> impl Iterator<Item = &Path> {
        self.paths().map(|(_, path)| path)
    }

    /// The values of a case in its canonical form; paths lead from `folder`.
    ///
    /// # Errors
    /// As [`Spec::read`].
    pub fn from_canonical(
        case: &serde_json::Map<String, Json>,
        folder: impl Into<PathBuf>,
    ) -> Result<Self, CaseError> {
        let former = read::former(case)?;
        Ok(Self { values: values(case)?, former, ..Self::new(folder) })
    }

    /// Whether two keys give a value for the same, one of them perhaps by its former name or with
    /// the whole table.
    pub(crate) fn says_the_same(one: &str, other: &str) -> bool {
        let [one, other] = [one, other].map(read::current);
        let within = |key: &str, table: &str| {
            key.strip_prefix(table).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        within(&one, &other) || within(&other, &one)
    }

    /// Whether two keys give a value for the same, one by its former name and one by its present.
    pub(crate) fn by_two_names(one: &str, other: &str) -> bool {
        Self::says_the_same(one, other) && read::former_of(one) != read::former_of(other)
    }

    /// The folder from which paths lead.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Gives a parameter a value; `null` takes its value away.
    ///
    /// # Errors
    /// [`CaseError`] when there is no such key or the value does not fit.
    pub fn set(&mut self, key: &str, given: &Json) -> Result<(), CaseError> {
        let place = place(key)?;
        match given {
            Json::Null => self.values.remove(&place),
            given => self.values.insert(place, Value::of(&TABLE[place], given)?),
        };
        Ok(())
    }

    /// Gives a parameter a value as it is typed on the command line; its paths lead from the
    /// working folder.
    ///
    /// # Errors
    /// As [`Spec::set`].
    pub fn set_typed(&mut self, key: &str, text: &str) -> Result<(), CaseError> {
        let place = place(key)?;
        let here = std::path::absolute(".").unwrap_or_default();
        let value = Value::typed(&TABLE[place], text)?.within(&here);
        self.values.insert(place, value);
        Ok(())
    }

    /// Makes a change `KEY=VALUE` as it is typed: a table sets each of its keys; paths lead from
    /// the working folder.
    ///
    /// # Errors
    /// As [`Spec::set`].
    pub fn change(&mut self, key: &str, text: &str) -> Result<(), CaseError> {
        self.change_from(&std::path::absolute(".").unwrap_or_default(), key, text)
    }

    /// The same, its paths leading from a folder.
    pub(crate) fn change_from(
        &mut self,
        here: &Path,
        key: &str,
        text: &str,
    ) -> Result<(), CaseError> {
        let change::Change { given, gone } = change::read(key, text)?;
        self.former.extend(read::former_of(key));
        self.values.retain(|place, _| !gone.contains(place));
        self.values.extend(given.into_iter().map(|(place, value)| (place, value.within(here))));
        Ok(())
    }

    /// Gives values as a case file has them, by keys or tables of keys, on top of those that are
    /// given; `null` takes one away. A tumour that is given whole takes the place of one that was
    /// given in the other way.
    ///
    /// # Errors
    /// As [`Spec::set`].
    pub fn merge(&mut self, given: &serde_json::Map<String, Json>) -> Result<(), CaseError> {
        let change::Change { given, gone } = change::merge(given)?;
        self.values.retain(|place, _| !gone.contains(place));
        self.values.extend(given);
        Ok(())
    }

    /// That there is such a key, or a table of keys.
    ///
    /// # Errors
    /// [`CaseError::Key`] with the nearest known one.
    pub(crate) fn check_key(key: &str) -> Result<(), CaseError> {
        if read::is_table(key) { Ok(()) } else { place(key).map(drop) }
    }

    /// The value that was given for a key.
    pub fn get(&self, key: &str) -> Option<&Value> {
        self.values.get(&place(key).ok()?)
    }

    /// That nothing is missing that a whole run needs, not even half of a pair.
    ///
    /// # Errors
    /// [`CaseError::Incomplete`] with all of it.
    pub fn check_complete(&self) -> Result<(), CaseError> {
        complete::check(&self.values)
    }

    /// The changes that make an empty case file in the same folder say the same.
    pub fn edits(&self) -> Vec<Edit> {
        let edit = |(place, value): (&usize, &Value)| Edit {
            key: TABLE[*place].key.into(),
            value: value.json(),
        };
        self.values.iter().map(edit).collect()
    }

    /// The changes that let the paths of its text lead to the same files from any folder.
    pub(crate) fn moved(&self) -> Vec<Edit> {
        let edit = |(place, value): (&usize, &Value)| {
            let moved = value.clone().within(&self.folder);
            (moved != *value).then(|| Edit { key: TABLE[*place].key.into(), value: moved.json() })
        };
        self.values.iter().filter_map(edit).collect()
    }

    /// The values checked together.
    ///
    /// # Errors
    /// [`CaseError::Value`] when they contradict each other, [`CaseError::Missing`] when half of a
    /// pair is missing.
    pub fn case(&self) -> Result<Case, CaseError> {
        Case::of(&self.values)
    }
}

#[cfg(test)]
mod tests;
