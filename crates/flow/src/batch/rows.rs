//! A table of cases (CSV, RFC 4180): the head names keys of the case, each row is one.

use crate::Error;
use crate::spec::Spec;
use crate::text_file::read_text;
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::path::{Path, PathBuf};
use supine_space::Failure;

/// The column of the names.
const NAME: &str = "name";
/// The column of the case files whose values the other columns change.
const CASE: &str = "case";

/// A row of a table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Row {
    pub(super) name: String,
    /// Its number in the table, as spreadsheets count: the head is row 1.
    pub(super) number: usize,
    /// A case file whose values the row changes, from the folder of the table.
    base: Option<String>,
    /// Keys and what stands for them; nothing stands for those that are not given.
    values: Vec<(String, String)>,
}

impl Row {
    /// The case file whose values it changes.
    pub(super) fn base(&self, table: &Path) -> Option<PathBuf> {
        self.base.as_ref().map(|base| folder_of(table).join(base))
    }

    /// As text.
    pub(super) fn text(&self) -> String {
        json!(self).to_string()
    }

    /// That of [`Row::text`].
    ///
    /// # Errors
    /// When it is another text.
    pub(super) fn from_text(text: &str) -> Result<Self, Error> {
        serde_json::from_str(text).map_err(|error| refused(format!("no row of a table: {error}")))
    }

    /// Its values; paths lead from the folder of the table, those of its case file from that
    /// file's.
    ///
    /// # Errors
    /// When its case file cannot be read, or a value does not fit: with row and table.
    pub(super) fn spec(&self, table: &Path) -> Result<Spec, Error> {
        let folder = folder_of(table);
        let mut spec = match self.base(table) {
            Some(base) => Spec::read(&base)?,
            None => Spec::new(folder.clone()),
        };
        for (key, value) in &self.values {
            spec.change_from(&folder, key, value)?;
        }
        Ok(spec)
    }
}

/// The folder of a table, whole.
fn folder_of(table: &Path) -> PathBuf {
    let folder = table.parent().unwrap_or(Path::new(""));
    std::path::absolute(folder).or_else(|_| std::path::absolute(".")).unwrap_or_default()
}

/// The rows of a table. Separators are commas, or semicolons or tabs where the head has those
/// alone.
///
/// # Errors
/// When it cannot be read, the head names no key of a case, or a row has no name.
pub(super) fn rows(table: &Path) -> Result<Vec<Row>, Error> {
    let text = read_text(table).map_err(|source| Error::Unread { path: table.into(), source })?;
    let head = text.lines().next().unwrap_or_default();
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(supine_space::separator(head))
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let wrong = |what: String| refused(format!("the table {}: {what}", table.display()));
    let read = |error: csv::Error| wrong(format!("{error}; write it as CSV (RFC 4180)"));
    let head: Vec<String> = reader.headers().map_err(read)?.iter().map(str::to_owned).collect();
    check_head(&head).map_err(&wrong)?;
    let mut rows = Vec::new();
    for (number, record) in (2..).zip(reader.records()) {
        let record = record.map_err(read)?;
        let given = head.iter().zip(record.iter()).filter(|(_, cell)| !cell.is_empty());
        let mut row = Row { name: String::new(), number, base: None, values: vec![] };
        for (key, cell) in given {
            match key.as_str() {
                NAME => row.name = cell.into(),
                CASE => row.base = Some(cell.into()),
                _ => row.values.push((key.clone(), cell.into())),
            }
        }
        if row.name.is_empty() {
            let text = format!("row {number} has no {NAME}; give each case one of its own");
            return Err(wrong(text));
        }
        rows.push(row);
    }
    if rows.is_empty() {
        return Err(wrong("it holds no case; add a row for each below the head".into()));
    }
    Ok(rows)
}

/// That the head has names, and keys of a case beside them, each once.
fn check_head(head: &[String]) -> Result<(), String> {
    if !head.iter().any(|key| key == NAME) {
        let keys = head.join(", ");
        return Err(format!(
            "its head has no column {NAME} ({keys}); add one with a name for each case"
        ));
    }
    for (n, key) in head.iter().enumerate() {
        if let Some(other) = head[..n].iter().find(|other| Spec::says_the_same(other, key)) {
            let told = if other == key { String::new() } else { format!(" and {other}") };
            return Err(format!("two columns are called {key}{told}; leave one out"));
        }
        if ![NAME, CASE].contains(&key.as_str()) {
            let hint = "; `supine help case` lists the keys";
            Spec::check_key(key).map_err(|e| format!("column {}: {e}{hint}", n + 1))?;
        }
    }
    Ok(())
}

/// Cases that cannot be told apart or named.
pub(super) fn refused(message: String) -> Error {
    Error::Refused { kind: Failure::Input, message }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_columns_for_one_value_are_refused() {
        let head =
            |keys: &[&str]| check_head(&keys.iter().map(|k| (*k).to_owned()).collect::<Vec<_>>());
        assert!(head(&["name", "bed.ap", "table.lat"]).is_ok());
        for keys in [["name", "bed.ap", "table.ap"], ["name", "table", "table.ap"]] {
            let told = head(&keys).unwrap_err();
            assert!(told.contains("two columns are called table.ap and"), "{told}");
        }
    }

    fn table(dir: &Path, text: &str) -> PathBuf {
        let path = dir.join("cases.csv");
        std::fs::write(&path, text).unwrap();
        path
    }

    #[test]
    fn a_row_is_a_case_with_paths_from_the_tables_folder() {
        let dir = tempfile::tempdir().unwrap();
        let path = table(
            dir.path(),
            "\u{feff}name,ct,breast,table.ap,table.lat,tumour.centre,tumour.radius\r\n\
             p1,a/ct,left,7,5,\"1,2.5,-3\",9\r\n\"p, 2\",/b,right,,,,\r\n",
        );
        let rows = rows(&path).unwrap();
        assert_eq!((rows[0].name.as_str(), rows[1].name.as_str()), ("p1", "p, 2"));
        assert_eq!((rows[0].number, rows[1].number), (2, 3));
        let spec = rows[0].spec(&path).unwrap();
        let case = spec.case().unwrap();
        assert_eq!(case.ct().unwrap().to_path_buf(), dir.path().join("a/ct"));
        assert_eq!(case.table_pose().unwrap().ap_deg, 7.0);
        let spec = rows[1].spec(&path).unwrap();
        assert!(spec.get("table.ap").is_none(), "an empty cell gives nothing");
        let path = table(dir.path(), "name\tct\ttumour.centre\np1\ta/ct\t1,2.5,-3\n");
        let spec = super::rows(&path).unwrap()[0].spec(&path).unwrap();
        assert!(spec.get("tumour.centre").is_some() && spec.get("ct").is_some());
    }

    #[test]
    fn a_case_file_is_changed_by_the_other_columns() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir(dir.path().join("a")).unwrap();
        let case = "ct = 'ct'\nbreast = 'left'\ntable = { ap = 1, lat = 2 }\n";
        std::fs::write(dir.path().join("a/case.toml"), case).unwrap();
        let path = table(dir.path(), "name;case;table.ap;seeds.file\nx;a/case.toml;9.5;s.csv\n");
        let row = &rows(&path).unwrap()[0];
        let spec = row.spec(&path).unwrap();
        let case = spec.case().unwrap();
        assert_eq!(spec.folder().join(case.ct().unwrap()), dir.path().join("a/ct"));
        assert_eq!(
            (case.table_pose().unwrap().ap_deg, case.table_pose().unwrap().lat_deg),
            (9.5, 2.0)
        );
        assert_eq!(case.seeds.files[0], dir.path().join("s.csv"));
    }

    #[test]
    fn tables_that_cannot_be_are_refused_with_what_to_do() {
        let dir = tempfile::tempdir().unwrap();
        for (text, told) in [
            ("nme,ct\na,b\n", "no column name (nme, ct)"),
            ("name,brest\na,left\n", "column 2: unknown key `brest`: did you mean `breast`?"),
            ("name,ct,ct\na,b,c\n", "two columns are called ct"),
            ("name,ct\n,b\n", "row 2 has no name"),
            ("name,ct\n", "it holds no case"),
            ("name,ct\na,b,c\n", "RFC 4180"),
        ] {
            let error = rows(&table(dir.path(), text)).unwrap_err();
            assert!(error.to_string().contains(told), "{error}");
            assert_eq!(error.kind().exit_code(), 1);
        }
        // A typo in a cell is that row's own.
        let path = table(dir.path(), "name,breast\na,lft\nb,left\n");
        let rows = rows(&path).unwrap();
        assert!(rows[0].spec(&path).unwrap_err().to_string().contains("lft"));
        assert!(rows[1].spec(&path).is_ok());
    }
}
