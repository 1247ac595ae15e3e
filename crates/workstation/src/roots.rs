//! What may be seen of the disk: what lies below the folders named at the start.
//!
//! The page names folders and files by numbers that were given out here, never by paths.

use crate::Error;
use crate::names::name_of;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Entries of a folder that are listed, at most.
const MOST: usize = 2000;
/// Files of a folder that are looked at to tell whether it may hold DICOM.
const LOOKED_AT: usize = 400;

/// A folder or a file that the page may name.
#[derive(Clone, Debug, Serialize, PartialEq, Eq)]
pub(crate) struct Named {
    pub(crate) id: String,
    pub(crate) name: String,
}

/// What a folder holds.
#[derive(Debug, Serialize)]
pub(crate) struct Listing {
    dir: Named,
    up: Option<String>,
    folders: Vec<Named>,
    /// Case files.
    cases: Vec<Named>,
    /// Folders of finished runs.
    runs: Vec<Named>,
    /// Files that may be DICOM.
    dicom: usize,
}

/// Paths by the numbers that were given out for them.
#[derive(Debug)]
pub(crate) struct Roots {
    root: PathBuf,
    given: Vec<PathBuf>,
}

impl Roots {
    /// All below a folder.
    ///
    /// # Errors
    /// When it is not there.
    pub(crate) fn new(root: &Path) -> Result<Self, Error> {
        let root = root.canonicalize().map_err(|source| Error::unreadable(root, source))?;
        Ok(Self { given: vec![root.clone()], root })
    }

    /// The path of a number.
    ///
    /// # Errors
    /// [`Error::NotBelow`] when it was not given out, or what it names now lies elsewhere: a link
    /// was put there.
    pub(crate) fn path(&self, id: &str) -> Result<PathBuf, Error> {
        let given = id.parse().ok().and_then(|n: usize| self.given.get(n));
        self.below(given.ok_or(Error::NotBelow)?)
    }

    /// A path of a name in a folder, which need not be there yet.
    ///
    /// # Errors
    /// As [`Self::path`]; [`Error::Request`] when the name is none, [`Error::NotBelow`] when a link
    /// of that name is there.
    pub(crate) fn path_of(&self, dir: &str, name: &str) -> Result<PathBuf, Error> {
        let path = self.path(dir)?.join(name);
        let plain = |c: char| c.is_alphanumeric() || " ._-()".contains(c);
        if name.is_empty() || name.starts_with('.') || !name.chars().all(plain) {
            let why =
                "a name is of letters, digits, spaces and . _ - ( ), and does not begin with a dot";
            return Err(Error::Request(why.into()));
        }
        if path.is_symlink() { Err(Error::NotBelow) } else { Ok(path) }
    }

    /// What a folder holds.
    ///
    /// # Errors
    /// As [`Self::path`]; when it cannot be read.
    pub(crate) fn list(&mut self, id: &str) -> Result<Listing, Error> {
        let dir = self.path(id)?;
        let up = (dir != self.root).then(|| dir.parent().map(Path::to_path_buf)).flatten();
        let entries = std::fs::read_dir(&dir).map_err(|source| Error::unreadable(&dir, source))?;
        let mut entries: Vec<PathBuf> =
            entries.filter_map(|entry| Some(entry.ok()?.path())).take(MOST).collect();
        entries.sort();
        let (mut folders, mut cases, mut runs) = (vec![], vec![], vec![]);
        let (mut dicom, mut looked_at) = (0, 0);
        for path in entries.iter().filter(|path| !is_hidden(path)) {
            let Ok(path) = self.below(path) else { continue };
            if path.is_dir() {
                let into = if is_run(&path) { &mut runs } else { &mut folders };
                into.push(self.name(&path));
            } else if is_case(&path) {
                cases.push(self.name(&path));
            } else if looked_at < LOOKED_AT {
                looked_at += 1;
                dicom += usize::from(may_be_dicom(&path));
            }
        }
        let up = up.map(|up| self.name(&up).id);
        Ok(Listing { dir: self.name(&dir), up, folders, cases, runs, dicom })
    }

    /// A path with its number.
    pub(crate) fn name(&mut self, path: &Path) -> Named {
        let known = self.given.iter().position(|given| given == path);
        let place = known.unwrap_or_else(|| {
            self.given.push(path.to_path_buf());
            self.given.len() - 1
        });
        Named { id: place.to_string(), name: name_of(path) }
    }

    /// Whether a folder is there, at or below the root.
    pub(crate) fn holds(&self, path: &Path) -> bool {
        self.below(path).is_ok_and(|path| path.is_dir())
    }

    /// A path with all links followed, if it lies below the root.
    fn below(&self, path: &Path) -> Result<PathBuf, Error> {
        let there = path.canonicalize().map_err(|source| Error::unreadable(path, source))?;
        if there.starts_with(&self.root) { Ok(there) } else { Err(Error::NotBelow) }
    }
}

fn is_hidden(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'))
}

/// Whether a folder itself, and no folder in it, holds files that may be DICOM.
pub(crate) fn holds_dicom(path: &Path) -> bool {
    let entries = std::fs::read_dir(path).into_iter().flatten().take(LOOKED_AT);
    let files = entries.filter_map(|entry| Some(entry.ok()?.path())).filter(|path| path.is_file());
    files.into_iter().any(|path| may_be_dicom(&path))
}

/// Whether a folder is that of a finished run.
pub(crate) fn is_run(path: &Path) -> bool {
    path.join("summary.json").is_file()
}

/// Whether a file is a case.
pub(crate) fn is_case(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"))
}

/// Whether a file begins as DICOM files do, or has no name that tells another kind.
fn may_be_dicom(path: &Path) -> bool {
    let name = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    match name.as_deref() {
        Some("dcm" | "ima") => true,
        Some("toml" | "json" | "txt" | "md" | "html" | "csv" | "png" | "nrrd" | "gz" | "ply") => {
            false
        }
        _ => starts_as_dicom(path),
    }
}

fn starts_as_dicom(path: &Path) -> bool {
    use std::io::Read;
    let mut head = [0; 132];
    let read = std::fs::File::open(path).and_then(|mut file| file.read_exact(&mut head));
    read.is_ok() && &head[128..] == b"DICM"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_tells_its_folders_cases_runs_and_dicom() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        std::fs::create_dir_all(at("scans/one")).unwrap();
        std::fs::create_dir(at("done")).unwrap();
        std::fs::write(at("done/summary.json"), "{}").unwrap();
        std::fs::write(at("case.toml"), "").unwrap();
        std::fs::write(at("a.dcm"), "").unwrap();
        let mut dicom = vec![0; 128];
        dicom.extend(b"DICM");
        std::fs::write(at("b"), dicom).unwrap();
        std::fs::write(at("notes.txt"), "").unwrap();
        std::fs::create_dir(at(".hidden")).unwrap();
        let mut roots = Roots::new(dir.path()).unwrap();
        let found = roots.list("0").unwrap();
        let names = |all: &[Named]| all.iter().map(|n| n.name.clone()).collect::<Vec<_>>();
        assert_eq!(names(&found.folders), ["scans"]);
        assert_eq!(
            (names(&found.cases), names(&found.runs)),
            (vec!["case.toml".into()], vec!["done".into()])
        );
        assert_eq!((found.dicom, found.up), (2, None));
        let inner = roots.list(&found.folders[0].id).unwrap();
        assert_eq!((names(&inner.folders), inner.up), (vec!["one".into()], Some("0".into())));
    }

    #[test]
    fn nothing_beside_the_root_is_seen() {
        let (dir, other) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        std::fs::create_dir(other.path().join("secret")).unwrap();
        let mut roots = Roots::new(dir.path()).unwrap();
        for id in ["7", "-1", "..", "/etc", ""] {
            assert!(matches!(roots.path(id), Err(Error::NotBelow)), "{id}");
        }
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(other.path(), dir.path().join("link")).unwrap();
            assert!(roots.list("0").unwrap().folders.is_empty());
            assert!(matches!(roots.path_of("0", "link"), Err(Error::NotBelow)));
            assert!(roots.path_of("0", "new").is_ok());
            // A folder that was given out and became a link since.
            std::fs::create_dir(dir.path().join("folder")).unwrap();
            let id = roots.list("0").unwrap().folders[0].id.clone();
            std::fs::remove_dir(dir.path().join("folder")).unwrap();
            std::os::unix::fs::symlink(other.path(), dir.path().join("folder")).unwrap();
            assert!(matches!(roots.list(&id), Err(Error::NotBelow)));
        }
    }
}
