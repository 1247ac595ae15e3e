//! The cases of a batch: case files, folders that hold one, and tables of which each row is one.

use super::Batch;
use super::rows::{Row, refused, rows};
use crate::Error;
use crate::commands::run::Change;
use crate::folder::usable_name;
use crate::spec::Spec;
use crate::status::case_name;
use serde_json::Value as Json;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use supine_report::RunPlace;

/// The case file of a folder.
const CASE_FILE: &str = "case.toml";

/// A case that is to be run.
#[derive(Clone, Debug)]
pub(super) struct Case {
    /// Its name, which that of no other equals.
    pub(super) name: String,
    /// Its case file, or the table in which it stands.
    pub(super) file: PathBuf,
    /// Its row in a table.
    pub(super) row: Option<Row>,
    /// The file that its values begin with.
    pub(super) base: PathBuf,
}

impl Case {
    /// A case of a case file, or of a row of a table.
    pub(super) fn new(name: String, file: PathBuf, row: Option<Row>) -> Self {
        let base = row.as_ref().and_then(|row| row.base(&file)).unwrap_or_else(|| file.clone());
        Self { name, file, row, base }
    }

    /// The values that a batch runs it with.
    ///
    /// # Errors
    /// When the file cannot be read, or a value does not fit.
    pub(super) fn values(&self, given: &Batch) -> Result<Spec, Error> {
        let mut spec = match &self.row {
            Some(row) => row.spec(&self.file)?,
            None => Spec::read(&self.file)?,
        };
        for Change { key, value } in &given.changes {
            spec.change(key, value)?;
        }
        if given.anonymise {
            spec.set("export.anonymise", &Json::Bool(true))?;
        }
        Ok(spec)
    }
}

/// All cases that paths name, by name.
///
/// # Errors
/// When a table cannot be read, a name cannot be that of a folder, or two cases have the same:
/// nothing has been run then.
pub(super) fn cases(paths: &[PathBuf]) -> Result<Vec<Case>, Error> {
    let mut all = Vec::new();
    for path in paths {
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv")) {
            let of_row = |row: Row| Case::new(row.name.clone(), path.clone(), Some(row));
            all.extend(rows(path)?.into_iter().map(of_row));
            continue;
        }
        let file = if path.is_dir() { path.join(CASE_FILE) } else { path.clone() };
        all.push(Case::new(case_name(&resolved(&file)), file, None));
    }
    all.sort_by(|a, b| a.name.cmp(&b.name));
    check_names(&all)?;
    Ok(all)
}

/// A path with the name of its folder in it, where it was given as `.` or `..`.
fn resolved(file: &Path) -> PathBuf {
    let folder = file.parent().and_then(|folder| std::fs::canonicalize(folder).ok());
    let dots = file.components().any(|part| matches!(part, std::path::Component::ParentDir));
    let bare =
        file.parent().is_none_or(|folder| folder.ends_with(".") || folder.as_os_str().is_empty());
    match (folder, file.file_name()) {
        (Some(folder), Some(name)) if dots || bare => folder.join(name),
        _ => file.into(),
    }
}

/// That every name is one of a folder and that no two are the same, in small letters: not every
/// disk tells them apart.
fn check_names(all: &[Case]) -> Result<(), Error> {
    let mut seen: BTreeMap<String, &Case> = BTreeMap::new();
    for case in all {
        usable_name(&case.name).map_err(|problem| {
            refused(format!("{}: {problem}; give it another name", case.file.display()))
        })?;
        if let Some(other) = seen.insert(case.name.to_lowercase(), case) {
            let [a, b] = [other, case].map(|case| match &case.row {
                Some(row) => format!("row {} of {}", row.number, case.file.display()),
                None => case.file.display().to_string(),
            });
            let text = format!(
                "two cases are called {:?}: {a} and {b}; rename one: runs are kept by name",
                case.name
            );
            return Err(refused(text));
        }
    }
    Ok(())
}

/// Where a failure of a row lies: in the table, where its own error does not say it.
pub(super) fn place_in(mut place: RunPlace, case: &Case) -> RunPlace {
    if case.row.is_some() && place.file.is_none() {
        place.file = Some(case.file.clone());
    }
    place
}
