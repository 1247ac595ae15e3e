//! The files of a folder, and which of them a series is looked for in.

use crate::error::Error;
use crate::excluded::{LeftOut, LeftOutReason};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Deepest folder below the given one that is searched.
pub(crate) const MAX_FOLDER_DEPTH: usize = 8;
/// Most files that are looked at.
const MAX_FILES: usize = 200_000;
/// Where the files lie that are looked at for the series that a path names.
pub(crate) struct Place {
    /// The folder that all of them lie below, and that their names are relative to.
    pub(crate) root: PathBuf,
    depth: usize,
    /// Whether the path is a file of the series, and not a folder or a DICOMDIR.
    pub(crate) one_file: bool,
}

impl Place {
    /// Of a folder, of a file, which stands for its folder, or of a DICOMDIR, which stands for all
    /// below its folder: looking there instead of following its paths (PS3.10 8.6) finds what it
    /// forgot, and never leaves the folder.
    pub(crate) fn of(path: &Path) -> Result<Self, Error> {
        let read_error = |source| Error::Read { path: path.to_owned(), source };
        if std::fs::metadata(path).map_err(read_error)?.is_dir() {
            return Ok(Self { root: path.to_owned(), depth: MAX_FOLDER_DEPTH, one_file: false });
        }
        let parent = path.parent().filter(|p| !p.as_os_str().is_empty());
        let root = parent.unwrap_or(Path::new(".")).to_owned();
        let directory = path.file_name().is_some_and(|name| name == "DICOMDIR");
        let depth = if directory { MAX_FOLDER_DEPTH } else { 0 };
        Ok(Self { root, depth, one_file: !directory })
    }

    /// Its files.
    pub(crate) fn files(&self) -> Result<Listed, Error> {
        below(&self.root, self.depth)
    }
}

/// The files that [`crate::read_series`] looks into for this path, ascending: those of a folder and
/// of the folders in it, those beside a single file, those below the folder of a DICOMDIR. Hidden
/// files and folders that must not be read are passed over. Nothing is opened.
///
/// # Errors
/// When there is no such path, a folder cannot be read, or there are too many files.
pub fn source_files(path: &Path) -> Result<Vec<PathBuf>, Error> {
    Ok(Place::of(path)?.files()?.files)
}

/// The folder that all of [`source_files`] lie below: files are named by their path from there, in
/// messages and in [`crate::LeftOut`].
///
/// # Errors
/// When there is no such path.
pub fn source_folder(path: &Path) -> Result<PathBuf, Error> {
    Ok(Place::of(path)?.root)
}

/// What lies below a folder, ascending by path.
#[derive(Debug, Default)]
pub(crate) struct Listed {
    /// Regular files.
    pub(crate) files: Vec<PathBuf>,
    /// Folders that were not looked into.
    closed: Vec<PathBuf>,
}

impl Listed {
    /// One file.
    pub(crate) fn one(path: &Path) -> Self {
        Self { files: vec![path.to_owned()], closed: vec![] }
    }

    /// The folders that were not looked into, named from the root, with why.
    pub(crate) fn closed<'a>(&'a self, root: &'a Path) -> impl Iterator<Item = LeftOut> + 'a {
        self.closed.iter().map(move |path| {
            let why = if path.is_symlink() { LINK } else { NOT_READABLE };
            let file = path.strip_prefix(root).unwrap_or(path).display().to_string();
            LeftOut { file, reason: LeftOutReason::NotDicom(why) }
        })
    }
}

/// Why a folder was not looked into.
const NOT_READABLE: &str = "a folder that you may not read";
const LINK: &str = "a link to a folder, which is not followed: name the folder itself, or copy it";
/// What file systems keep of repairs, for the administrator alone.
const OF_REPAIRS: &str = "lost+found";

/// Regular files of a folder and of the folders in it; hidden files are passed over.
pub(crate) fn below(folder: &Path, depth: usize) -> Result<Listed, Error> {
    let mut listed = Listed::default();
    list(folder, depth, &mut listed)?;
    listed.files.sort();
    listed.closed.sort();
    Ok(listed)
}

fn list(folder: &Path, depth: usize, listed: &mut Listed) -> Result<(), Error> {
    let read_error = |source| Error::Read { path: folder.to_owned(), source };
    for entry in std::fs::read_dir(folder).map_err(read_error)? {
        let entry = entry.map_err(read_error)?;
        let name = entry.file_name();
        if name.to_string_lossy().starts_with('.') || name == OF_REPAIRS {
            continue;
        }
        let path = entry.path();
        if entry.file_type().map_err(read_error)?.is_dir() {
            let listing = if depth > 0 { list(&path, depth - 1, listed) } else { Ok(()) };
            match listing {
                Err(Error::Read { source, path: at })
                    if source.kind() == ErrorKind::PermissionDenied && at == path =>
                {
                    listed.closed.push(path);
                }
                listing => listing?,
            }
        } else if path.is_file() {
            listed.files.push(path);
        } else if depth > 0 && path.is_dir() {
            listed.closed.push(path);
        }
        if listed.files.len() + listed.closed.len() > MAX_FILES {
            let reason = format!("more than {MAX_FILES} files; name a folder closer to the series");
            return Err(Error::NoCt { path: folder.to_owned(), found: reason });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::{create_dir_all, write};

    fn names(files: &[PathBuf], root: &Path) -> Vec<String> {
        let name = |f: &PathBuf| f.strip_prefix(root).unwrap().display().to_string();
        files.iter().map(name).collect()
    }

    #[test]
    fn the_files_of_a_path_are_those_of_its_folder_in_order() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        create_dir_all(root.join("b/deep")).unwrap();
        create_dir_all(root.join(".hidden")).unwrap();
        create_dir_all(root.join("lost+found")).unwrap();
        for name in ["c", "a", "DICOMDIR", ".d", "b/1", "b/deep/2", ".hidden/3", "lost+found/4"] {
            write(root.join(name), "").unwrap();
        }
        let all = ["DICOMDIR", "a", "b/1", "b/deep/2", "c"];
        let beside = ["DICOMDIR", "a", "c"];
        for (given, below, expected) in [
            (root.to_owned(), root, &all[..]),
            (root.join("DICOMDIR"), root, &all[..]),
            (root.join("a"), root, &beside[..]),
            (root.join("b"), &root.join("b"), &["1", "deep/2"][..]),
            (root.join("b/1"), &root.join("b"), &["1"][..]),
        ] {
            assert_eq!(source_folder(&given).unwrap(), below);
            assert_eq!(names(&source_files(&given).unwrap(), below), expected, "{given:?}");
        }
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let deep = root.join("b/deep");
            std::fs::set_permissions(&deep, PermissionsExt::from_mode(0o000)).unwrap();
            // Whoever may read everything sees what is in it.
            let seen = std::fs::read_dir(&deep).is_ok();
            std::os::unix::fs::symlink("b", root.join("link")).unwrap();
            let found = below(root, MAX_FOLDER_DEPTH).unwrap();
            std::fs::set_permissions(&deep, PermissionsExt::from_mode(0o700)).unwrap();
            let inner = if seen { &["b/deep/2"][..] } else { &[] };
            let all = [&["DICOMDIR", "a", "b/1"], inner, &["c"]].concat();
            assert_eq!(names(&found.files, root), all);
            let closed: Vec<(String, String)> =
                found.closed(root).map(|left| (left.file, left.reason.to_string())).collect();
            let unread = (!seen).then(|| ("b/deep".to_owned(), NOT_READABLE.to_owned()));
            let link = ("link".to_owned(), LINK.to_owned());
            assert_eq!(closed, unread.into_iter().chain([link]).collect::<Vec<_>>());
        }
        let nowhere = source_files(&root.join("z")).unwrap_err().to_string();
        assert!(nowhere.starts_with("cannot read"), "{nowhere}");
    }
}
