//! What passed with the same bytes before is not run again: a test sees nothing but what its key is
//! made of.
//!
//! A result is kept as soon as a job ends, so that a check that was broken off goes on where it
//! was. Only what passed is kept.

use super::inputs::Inputs;
use anyhow::{Context, Result};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// So many results are kept, a dozen for each test; when there are more, the older half goes.
const MOST: usize = 20_000;

/// What is run: its name, the files that it is made of, and the key of all that its outcome rests
/// on, if that can be had.
#[derive(Clone)]
pub(crate) struct Subject {
    name: String,
    with: Vec<PathBuf>,
    key: Option<String>,
}

/// Results of the runs before, and those of this one.
pub(crate) struct Known {
    file: PathBuf,
    /// How many tests passed under a name, by its key and the name.
    passed: BTreeMap<(String, String), usize>,
    /// None where digests cannot be had: then nothing is known and nothing is kept.
    inputs: Option<Inputs>,
    writing: Mutex<()>,
    /// Whether all is run again.
    again: bool,
}

impl Known {
    /// Reads what a file keeps. Where digests cannot be had, that is said.
    pub(crate) fn read(file: PathBuf, inputs: Result<Inputs>, again: bool) -> Self {
        let text = newest(&file);
        let inputs =
            inputs.inspect_err(|why| println!("what passed before is not known: {why:#}")).ok();
        Self {
            passed: text.lines().filter_map(line).collect(),
            file,
            inputs,
            writing: Mutex::new(()),
            again,
        }
    }

    /// What is run under a name, with these files beside those of the project.
    ///
    /// # Errors
    /// When a file cannot be read.
    pub(crate) fn subject(&self, name: &str, with: &[&Path]) -> Result<Subject> {
        let key = self.inputs.as_ref().map(|inputs| inputs.key(name, with)).transpose()?;
        let with = with.iter().map(|path| path.to_path_buf()).collect();
        Ok(Subject { name: name.into(), with, key })
    }

    /// What rests on all sources; of a part of it nothing is known.
    pub(crate) fn sources(&self, name: &str, whole: bool) -> Subject {
        let key = self.inputs.as_ref().filter(|_| whole).map(Inputs::sources);
        Subject { name: name.into(), with: Vec::new(), key }
    }

    /// How many tests passed under this name with the same bytes, if it is not to be run again.
    pub(crate) fn passed(&self, subject: &Subject, name: &str) -> Option<usize> {
        let key = subject.key.clone().filter(|_| !self.again)?;
        self.passed.get(&(key, name.to_owned())).copied()
    }

    /// Keeps that these passed, unless something that counts was changed while they ran.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub(crate) fn keep<'a>(
        &self,
        subject: &Subject,
        passed: impl Iterator<Item = (&'a str, usize)>,
    ) -> Result<()> {
        let (Some(inputs), Some(key)) = (&self.inputs, &subject.key) else { return Ok(()) };
        let with: Vec<&Path> = subject.with.iter().map(PathBuf::as_path).collect();
        let is_same = with.is_empty() || inputs.key(&subject.name, &with)? == *key;
        if !is_same || !inputs.are_as_they_were() {
            return Ok(());
        }
        let text: String = passed.map(|(name, tests)| format!("{key} {tests} {name}\n")).collect();
        let _one_at_a_time = self.writing.lock();
        let file = File::options().create(true).append(true).open(&self.file);
        let mut file = file.with_context(|| self.file.display().to_string())?;
        file.write_all(text.as_bytes()).with_context(|| self.file.display().to_string())
    }
}

/// What a file keeps. One that has grown is made shorter; where that cannot be done it stays.
fn newest(file: &Path) -> String {
    let text = std::fs::read_to_string(file).unwrap_or_default();
    let lines = text.lines().count();
    if lines <= MOST {
        return text;
    }
    let kept: String = text.split_inclusive('\n').skip(lines - MOST / 2).collect();
    let _longer = std::fs::write(file, &kept);
    kept
}

/// A line as [`Known::keep`] writes it; one that was cut off names nothing that is run.
fn line(text: &str) -> Option<((String, String), usize)> {
    let (key, rest) = text.split_once(' ')?;
    let (tests, name) = rest.split_once(' ')?;
    Some(((key.to_owned(), name.to_owned()), tests.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::anyhow;

    /// What stands in a file of these lines, of which a check without digests was told.
    fn known(lines: &str, again: bool) -> Known {
        let mut known = Known::read(PathBuf::new(), Err(anyhow!("no clone")), again);
        known.passed = lines.lines().filter_map(line).collect();
        known
    }

    fn subject(key: Option<&str>) -> Subject {
        Subject { name: "package".into(), with: Vec::new(), key: key.map(String::from) }
    }

    #[test]
    fn what_passed_is_known_by_its_key_until_all_is_asked_for_again() {
        let lines = "k1 1 a::b\nk1 24 package\nk2 1 a::b\nk1 1 cut o";
        let passed = |again, key, name| known(lines, again).passed(&subject(key), name);
        assert_eq!(passed(false, Some("k1"), "package"), Some(24));
        assert_eq!(passed(false, Some("k2"), "a::b"), Some(1));
        assert_eq!(passed(false, Some("k2"), "package"), None);
        assert_eq!(passed(false, None, "package"), None);
        assert_eq!(passed(true, Some("k1"), "package"), None);
    }

    #[test]
    fn without_digests_nothing_is_kept() {
        let known = known("", false);
        let subject = known.subject("a", &[]).expect("nothing is read");
        assert!(subject.key.is_none());
        known.keep(&subject, [("a::b", 1)].into_iter()).expect("nothing is written");
        assert!(!known.file.exists());
    }

    #[test]
    fn a_file_that_has_grown_keeps_its_newer_half() {
        let file = std::env::temp_dir().join(format!("supine-known-{}", std::process::id()));
        let text: String = (0..=MOST).map(|n| format!("k 1 {n}\n")).collect();
        std::fs::write(&file, text).expect("it can be written");
        let kept = newest(&file);
        let lines: Vec<&str> = kept.lines().collect();
        assert_eq!((lines.len(), lines.last().copied()), (MOST / 2, Some("k 1 20000")));
        assert_eq!(newest(&file), kept);
        std::fs::remove_file(&file).expect("it was made here");
    }
}
