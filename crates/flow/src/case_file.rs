//! A case file that is edited: its text changes, comments and order stay; each change is on disk
//! before it counts.

use crate::Error;
use crate::folder::{USERS, write_atomically};
use crate::spec::{Edit, Spec, edit};
use crate::text_file::read_text;
use std::path::{Path, PathBuf};

/// The text of a case, all that it was before, and the file that holds it, if there is one.
#[derive(Debug)]
pub struct CaseFile {
    /// From where its paths lead.
    folder: PathBuf,
    path: Option<PathBuf>,
    /// What it was, is, and was before changes were taken back.
    texts: Vec<String>,
    /// Which of them it is.
    at: usize,
}

impl CaseFile {
    /// A case that no file holds yet; paths lead from `folder`.
    pub fn new(text: String, folder: PathBuf) -> Self {
        Self { folder, path: None, texts: vec![text], at: 0 }
    }

    /// The case of a file.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let text = read(path)?;
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        Ok(Self { path: Some(path.into()), ..Self::new(text, folder) })
    }

    /// Its text, TOML.
    pub fn text(&self) -> &str {
        &self.texts[self.at]
    }

    /// The file that holds it.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// What it says.
    ///
    /// # Errors
    /// When the text is no case, or its values contradict each other.
    pub fn spec(&self) -> Result<Spec, Error> {
        self.spec_of(self.text())
    }

    fn spec_of(&self, text: &str) -> Result<Spec, Error> {
        let spec = Spec::from_text(text, &self.folder)?;
        spec.case()?;
        Ok(spec)
    }

    /// Makes changes; what it says then.
    ///
    /// # Errors
    /// When a value does not fit, another program changed the file, or it cannot be written:
    /// nothing is changed then.
    pub fn edit(&mut self, edits: &[Edit]) -> Result<Spec, Error> {
        let text = edit(self.text(), edits)?;
        let spec = self.spec_of(&text)?;
        self.write(&text)?;
        self.put(text);
        Ok(spec)
    }

    fn put(&mut self, text: String) {
        if text != self.text() {
            self.texts.truncate(self.at + 1);
            self.texts.push(text);
            self.at += 1;
        }
    }

    /// Takes over what another program wrote into its file: what it says then, nothing when that is
    /// the same. It is a change that can be taken back.
    ///
    /// # Errors
    /// When the file cannot be read, or is no case: nothing is changed then.
    pub fn reread(&mut self) -> Result<Option<Spec>, Error> {
        let Some(path) = &self.path else { return Ok(None) };
        let text = read(path)?;
        if text == self.text() {
            return Ok(None);
        }
        let spec = self.spec_of(&text)?;
        self.put(text);
        Ok(Some(spec))
    }

    /// Whether a change can be taken back, and made again.
    pub fn can_undo_redo(&self) -> [bool; 2] {
        [self.at > 0, self.at + 1 < self.texts.len()]
    }

    /// Takes the last change back; what it says then, nothing when there is none.
    ///
    /// # Errors
    /// As [`Self::edit`].
    pub fn undo(&mut self) -> Result<Option<Spec>, Error> {
        self.at.checked_sub(1).map(|at| self.go(at)).transpose()
    }

    /// Makes the change again that was taken back last.
    ///
    /// # Errors
    /// As [`Self::edit`].
    pub fn redo(&mut self) -> Result<Option<Spec>, Error> {
        let next = Some(self.at + 1).filter(|at| *at < self.texts.len());
        next.map(|at| self.go(at)).transpose()
    }

    fn go(&mut self, at: usize) -> Result<Spec, Error> {
        let spec = self.spec_of(&self.texts[at])?;
        self.write(&self.texts[at])?;
        self.at = at;
        Ok(spec)
    }

    /// Puts it into a file, which holds it from then on.
    ///
    /// # Errors
    /// When there is such a file, or it cannot be written.
    pub fn save_as(&mut self, path: &Path) -> Result<(), Error> {
        if path.exists() {
            return Err(Error::CaseThere { path: path.into() });
        }
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        if folder != self.folder {
            // Its paths lead from another folder now, those of what is taken back too.
            let moved = |text: &String| Ok(edit(text, &self.spec_of(text)?.moved())?);
            self.texts = self.texts.iter().map(moved).collect::<Result<_, Error>>()?;
            self.folder = folder;
        }
        write_atomically(path, self.text().as_bytes(), USERS)?;
        self.path = Some(path.into());
        Ok(())
    }

    /// Replaces the file's text, if it is still the one that was written or read last.
    fn write(&self, text: &str) -> Result<(), Error> {
        let Some(path) = &self.path else { return Ok(()) };
        if read(path)? != self.text() {
            return Err(Error::CaseChanged { path: path.clone() });
        }
        write_atomically(path, text.as_bytes(), USERS)
    }
}

fn read(path: &Path) -> Result<String, Error> {
    read_text(path).map_err(|source| Error::Unread { path: path.into(), source })
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value as Json, json};

    const TEXT: &str = "# mine\nct = 'ct'\ntable = { ap = 7, lat = 5.0 } # tilt\n";

    fn change(key: &str, value: Json) -> [Edit; 1] {
        [Edit { key: key.into(), value }]
    }

    #[test]
    fn changes_are_on_disk_and_are_taken_back_to_the_letter() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("case.toml");
        std::fs::write(&path, TEXT).unwrap();
        let mut case = CaseFile::open(&path).unwrap();
        let on_disk = || std::fs::read_to_string(&path).unwrap();
        assert_eq!(case.can_undo_redo(), [false, false]);
        let spec = case.edit(&change("table.ap", json!(-3.5))).unwrap();
        assert_eq!(spec.case().unwrap().table_pose().unwrap().ap_deg, -3.5);
        assert_eq!(on_disk(), TEXT.replace("ap = 7", "ap = -3.5"));
        case.edit(&change("breast", json!("left"))).unwrap();
        // The same again is no change.
        case.edit(&change("breast", json!("left"))).unwrap();
        case.undo().unwrap().unwrap();
        case.undo().unwrap().unwrap();
        assert_eq!((on_disk().as_str(), case.can_undo_redo()), (TEXT, [false, true]));
        assert!(case.undo().unwrap().is_none());
        case.redo().unwrap().unwrap();
        assert_eq!(on_disk(), TEXT.replace("ap = 7", "ap = -3.5"));
        // A new change ends what could be made again.
        case.edit(&change("table.lat", json!(1.0))).unwrap();
        assert_eq!(case.can_undo_redo(), [true, false]);
    }

    #[test]
    fn a_bad_change_and_one_beside_another_program_change_nothing() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("case.toml");
        std::fs::write(&path, TEXT).unwrap();
        let mut case = CaseFile::open(&path).unwrap();
        for (key, value) in
            [("table.ap", json!(700)), ("no.such", json!(1)), ("tissue.fat", json!(1.0))]
        {
            assert!(case.edit(&change(key, value)).is_err(), "{key}");
        }
        assert_eq!((case.text(), case.can_undo_redo()), (TEXT, [false, false]));
        let theirs = TEXT.replace("lat = 5.0", "lat = 6.0");
        std::fs::write(&path, &theirs).unwrap();
        let error = case.edit(&change("table.ap", json!(1.0))).unwrap_err();
        assert!(matches!(error, Error::CaseChanged { .. }), "{error}");
        assert_eq!((std::fs::read_to_string(&path).unwrap(), case.text()), (theirs.clone(), TEXT));
        // What they wrote is taken over, can be changed, and taken back.
        assert_eq!(
            case.reread().unwrap().unwrap().case().unwrap().table_pose().unwrap().lat_deg,
            6.0
        );
        assert!(case.reread().unwrap().is_none());
        case.edit(&change("table.ap", json!(1.0))).unwrap();
        case.undo().unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), theirs);
        std::fs::write(&path, "no case").unwrap();
        assert!(case.reread().is_err() && case.text() == theirs);
    }

    #[test]
    fn the_paths_of_a_case_lead_to_the_same_files_from_another_folder() {
        let [dir, other] = [0, 1].map(|_| tempfile::tempdir().unwrap());
        let mut case = CaseFile::new(TEXT.into(), dir.path().into());
        case.edit(&change("table.ap", json!(1.0))).unwrap();
        let path = other.path().join("case.toml");
        case.save_as(&path).unwrap();
        let ct = |spec: Spec| spec.case().unwrap().ct().unwrap().to_path_buf();
        assert_eq!(ct(Spec::read(&path).unwrap()), dir.path().join("ct"));
        assert_eq!(ct(case.undo().unwrap().unwrap()), dir.path().join("ct"));
        assert!(std::fs::read_to_string(&path).unwrap().starts_with("# mine"));
    }

    #[test]
    fn a_new_case_gets_a_file_that_was_not_there() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("case.toml");
        let mut case = CaseFile::new("ct = 'ct'\n".into(), dir.path().into());
        case.edit(&change("breast", json!("right"))).unwrap();
        case.save_as(&path).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), case.text());
        assert!(matches!(case.save_as(&path), Err(Error::CaseThere { .. })));
        case.edit(&change("breast", json!("left"))).unwrap();
        assert!(std::fs::read_to_string(&path).unwrap().contains("left"));
    }
}
