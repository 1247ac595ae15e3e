//! The folder of a cohort: `runs/NAME`, `status/NAME.json`, a table and a page.

use super::passing::sweep;
use super::{FinishedRun, is_run, names};
use crate::status::{NOT_ENDED, is_status, write_text};
use crate::{Error, NodeId};
use std::collections::BTreeSet;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use supine_report::{PICTURES, Patient, RunStatus, Summary, TABLE_HEAD, cohort_page, cohort_table};

/// The folder of a cohort.
#[derive(Clone, Debug)]
pub(crate) struct CohortFolder {
    root: PathBuf,
}

/// Held as long as somebody works in the folder.
#[derive(Debug)]
pub(crate) struct CohortLock {
    _file: File,
}

/// The folder of a case's run in that of a batch.
pub(crate) fn run_of(root: &Path, name: &str) -> PathBuf {
    root.join(names::RUNS).join(name)
}

impl CohortFolder {
    /// The folder at a path; nothing is made.
    ///
    /// # Errors
    /// [`Error::Foreign`] when it holds a table, a page or a status that no batch made.
    pub(crate) fn open(root: &Path) -> Result<Self, Error> {
        let marks = [(names::TABLE, TABLE_HEAD), (names::PAGE, "content=\"supine batch ")];
        for (name, mark) in marks {
            let path = root.join(name);
            if fs::read(&path).is_ok_and(|text| !String::from_utf8_lossy(&text).contains(mark)) {
                return Err(Error::Foreign { path });
            }
        }
        let folder = Self { root: root.into() };
        let foreign = |path: &PathBuf| {
            path.extension().is_some_and(|ending| ending == "json")
                && fs::read_to_string(path).is_ok_and(|text| !text.is_empty() && !is_status(&text))
        };
        match folder.entries(names::STATUS).into_iter().find(foreign) {
            Some(path) => Err(Error::Foreign { path }),
            None => Ok(folder),
        }
    }

    /// What lies in one of its folders.
    fn entries(&self, folder: &str) -> Vec<PathBuf> {
        let listed = fs::read_dir(self.root.join(folder)).into_iter().flatten().flatten();
        listed.map(|entry| entry.path()).collect()
    }

    /// Holds it against others.
    ///
    /// # Errors
    /// [`Error::Busy`] when somebody works in it, [`Error::Output`] when it cannot be written.
    pub(crate) fn lock(&self) -> Result<CohortLock, Error> {
        let output = |source| Error::Output { path: self.root.clone(), source };
        for folder in [names::RUNS, names::STATUS] {
            fs::create_dir_all(self.root.join(folder)).map_err(output)?;
        }
        let file = File::create(self.root.join(names::COHORT_LOCK)).map_err(output)?;
        match file.try_lock() {
            Ok(()) => {
                // Runs elsewhere may be telling how they ended: their folder is left alone.
                sweep(&self.root);
                Ok(CohortLock { _file: file })
            }
            Err(fs::TryLockError::WouldBlock) => Err(Error::Busy { path: self.root.clone() }),
            Err(fs::TryLockError::Error(e)) => Err(output(e)),
        }
    }

    /// The folder of a case's run.
    pub(crate) fn run(&self, name: &str) -> PathBuf {
        run_of(&self.root, name)
    }

    /// Where it is told how a case's run ended.
    pub(crate) fn status(&self, name: &str) -> PathBuf {
        self.root.join(names::STATUS).join(format!("{name}.json"))
    }

    /// Tells how a run ended. Where it `before` ended so, time and memory aside, the file says what
    /// it said.
    ///
    /// # Errors
    /// [`Error::Output`] when it cannot be written.
    pub(crate) fn keep(
        &self,
        name: &str,
        status: &RunStatus,
        before: Option<&RunStatus>,
    ) -> Result<(), Error> {
        let same = before.filter(|known| {
            *known == status || (known.says_the_same(status) && known.error.is_some())
        });
        let status = same.unwrap_or(status);
        if self.kept(name).as_ref() == Some(status) {
            return Ok(());
        }
        write_text(&self.status(name), &status.text())
    }

    /// How a case's run is told to have ended, if at all.
    pub(crate) fn kept(&self, name: &str) -> Option<RunStatus> {
        RunStatus::read(&fs::read_to_string(self.status(name)).ok()?)
    }

    /// Whether the system ended an earlier run of a case.
    pub(crate) fn was_not_ended(&self, name: &str) -> bool {
        let error = self.kept(name).and_then(|status| status.error);
        error.is_some_and(|error| error.code == NOT_ENDED)
    }

    /// The names of all cases that it knows of, by a run or by how it ended.
    pub(crate) fn names(&self) -> BTreeSet<String> {
        let name = |path: &Path| path.file_name().map(|name| name.to_string_lossy().into_owned());
        let runs = self.entries(names::RUNS).into_iter().filter(|path| is_run(path));
        let told = self.entries(names::STATUS).into_iter();
        let told = told.filter_map(|path| Some(name(&path)?.strip_suffix(".json")?.to_owned()));
        let named = runs.filter_map(|path| name(&path)).chain(told);
        named.filter(|name| usable_name(name).is_ok()).collect()
    }

    /// The patients of some names. One without a status has that of her summary, made by
    /// `of_summary`; one who has neither was stopped.
    pub(crate) fn patients(
        &self,
        names: Vec<String>,
        of_summary: &dyn Fn(&str, &Summary) -> RunStatus,
    ) -> Vec<Patient> {
        let patient = |name: String| {
            let root = self.run(&name);
            let summary = FinishedRun::open(&root).ok().and_then(|run| run.summary().ok());
            let told = self.kept(&name).map(|status| RunStatus { case: name.clone(), ..status });
            // A case that failed may stand beside what it left when it still went well.
            let summary = summary.filter(|_| told.as_ref().is_none_or(|t| t.colour.is_some()));
            let status = told.unwrap_or_else(|| match &summary {
                Some(summary) => of_summary(&name, summary),
                None => RunStatus::unfinished(&name),
            });
            let mut patient = Patient::new(status, summary.as_ref());
            let report = root.join(names::path_of(NodeId::Report, "report"));
            if summary.is_some() && report.is_dir() {
                let there = |file: &&str| report.join(file).is_file();
                patient.pictures =
                    PICTURES.map(|(file, _)| file).into_iter().filter(there).collect();
                patient.run = Some(format!("{}/{name}", names::RUNS));
            }
            patient
        };
        names.into_iter().map(patient).collect()
    }

    /// Writes the table and the page of some patients; their paths. What holds the same already
    /// stays as it is.
    ///
    /// # Errors
    /// [`Error::Output`] when one cannot be written.
    pub(crate) fn write(&self, patients: &[Patient]) -> Result<[PathBuf; 2], Error> {
        let [table, page] = [names::TABLE, names::PAGE].map(|name| self.root.join(name));
        let made = [cohort_table(patients), cohort_page(patients, names::TABLE)?];
        for (path, text) in [&table, &page].into_iter().zip(&made) {
            if fs::read_to_string(path).is_ok_and(|known| known == *text) {
                continue;
            }
            write_text(path, text)?;
        }
        Ok([table, page])
    }
}

/// That a name can be that of a folder, here and elsewhere; what is wrong with it.
pub(crate) fn usable_name(name: &str) -> Result<(), String> {
    let wrong = |c: char| c.is_control() || "/\\:*?\"<>|".contains(c);
    let problem = match name {
        "" => "it is empty",
        name if name.chars().any(wrong) => {
            "it holds one of / \\ : * ? \" < > | or a control character"
        }
        name if name.starts_with('.') => "it begins with a dot",
        name if name.ends_with(['.', ' ']) || name.starts_with(' ') => {
            "a space or dot stands at its end"
        }
        name if name.ends_with(names::BESIDE) => "folders of keys are called so",
        name if name.len() > 200 => "it is longer than 200 bytes",
        _ => return Ok(()),
    };
    Err(format!("{name:?} cannot be the name of a case: {problem}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_folders() {
        for good in ["p1", "Ms X", "p-1.b", "Ö"] {
            assert_eq!(usable_name(good), Ok(()), "{good}");
        }
        for bad in ["", ".", "..", "a/b", "a\\b", ".a", "a.", "a ", "x-reidentification", "a\nb"] {
            assert!(usable_name(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_page_that_no_batch_made_is_not_touched() {
        let dir = tempfile::tempdir().unwrap();
        let folder = CohortFolder::open(dir.path()).unwrap();
        folder.write(&[]).unwrap();
        assert!(CohortFolder::open(dir.path()).is_ok(), "its own");
        fs::write(dir.path().join("cohort.csv"), "mine;1\n").unwrap();
        assert!(matches!(CohortFolder::open(dir.path()), Err(Error::Foreign { .. })));
        fs::remove_file(dir.path().join("cohort.csv")).unwrap();
        fs::create_dir_all(folder.status("x").parent().unwrap()).unwrap();
        fs::write(folder.status("p1"), "{\"mine\": 1}").unwrap();
        assert!(matches!(CohortFolder::open(dir.path()), Err(Error::Foreign { .. })));
    }

    #[test]
    fn two_at_once_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let folder = CohortFolder::open(dir.path()).unwrap();
        let _held = folder.lock().unwrap();
        assert!(matches!(folder.lock(), Err(Error::Busy { .. })));
        assert!(folder.names().is_empty());
    }
}
