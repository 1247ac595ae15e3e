//! Where a command may write.

use super::usage;
use crate::Error;
use std::path::{Path, PathBuf};
use supine_exchange::MeshFile;

/// Endings of files that hold a volume.
pub(super) const VOLUMES: [&str; 4] = [".nrrd", ".nii", ".nii.gz", ".mha"];

/// What a command is to write, which is checked before its work is begun.
#[derive(Default)]
pub(super) struct Outputs<'a> {
    inputs: Vec<&'a Path>,
    files: Vec<(&'static str, PathBuf)>,
    folders: Vec<(&'static str, &'a Path)>,
}

impl<'a> Outputs<'a> {
    /// Of a command that reads these.
    pub(super) fn beside(inputs: impl IntoIterator<Item = &'a Path>) -> Self {
        Self { inputs: inputs.into_iter().collect(), ..Self::default() }
    }

    /// Adds a file that an option names.
    pub(super) fn file(mut self, option: &'static str, file: Option<&Path>) -> Self {
        self.files.extend(file.map(|file| (option, file.to_owned())));
        self
    }

    /// Adds files in a folder that an option names.
    pub(super) fn within(
        mut self,
        option: &'static str,
        folder: Option<&'a Path>,
        names: &[&str],
    ) -> Self {
        if let Some(folder) = folder {
            self.files.extend(names.iter().map(|name| (option, folder.join(name))));
            self.folders.push((option, folder));
        }
        self
    }

    /// Adds a folder that is replaced as a whole.
    pub(super) fn folder(mut self, option: &'static str, folder: Option<&'a Path>) -> Self {
        self.folders.extend(folder.map(|folder| (option, folder)));
        if let Some(folder) = folder.filter(|folder| is_filled(folder)) {
            self.files.push((option, folder.to_owned()));
        }
        self
    }

    /// That all of this may be written: every file has a folder or gets one, is none of the inputs,
    /// belongs to no finished run, and is not there yet unless it may be replaced.
    ///
    /// # Errors
    /// [`Error::Output`], [`Error::Refused`].
    pub(super) fn check(&self, overwrite: bool) -> Result<(), Error> {
        for (option, folder) in &self.folders {
            refuse_result(option, folder)?;
        }
        for (n, (option, file)) in self.files.iter().enumerate() {
            if !self.folders.iter().any(|(_, folder)| file.starts_with(folder)) {
                check_folder_of(file)?;
            }
            let twice = self.files[..n].iter().find(|(_, other)| same(other, file));
            if let Some((other, _)) = twice {
                let file = file.display();
                return Err(usage(format!("{other} and {option} both name {file}")));
            }
            self.check_there(option, file, overwrite)?;
        }
        Ok(())
    }

    /// What is checked of a file that is there.
    fn check_there(&self, option: &str, file: &Path, overwrite: bool) -> Result<(), Error> {
        let Ok(there) = file.canonicalize() else { return Ok(()) };
        if self.inputs.iter().any(|input| same(input, &there)) {
            let file = file.display();
            return Err(usage(format!(
                "{option} {file} is what is read, and would be lost; name another file"
            )));
        }
        refuse_result(option, &there)?;
        // A pipe or a device takes what is written and loses nothing.
        if overwrite || !(there.is_file() || there.is_dir()) {
            return Ok(());
        }
        let file = file.display();
        Err(usage(format!(
            "{option} {file} is there already; name another place, or add --overwrite to have it replaced"
        )))
    }
}

/// Whether a folder holds anything, or is a file.
fn is_filled(folder: &Path) -> bool {
    let mut entries = std::fs::read_dir(folder).into_iter().flatten();
    folder.is_file() || entries.next().is_some()
}

/// Whether two paths lead to one place, which need not be there yet.
fn same(one: &Path, other: &Path) -> bool {
    let place = |path: &Path| {
        path.canonicalize().ok().or_else(|| {
            let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
            let folder = folder.unwrap_or(Path::new(".")).canonicalize().ok()?;
            Some(folder.join(path.file_name()?))
        })
    };
    place(one).is_some_and(|place_of_one| place(other) == Some(place_of_one))
}

/// That a file has a folder.
fn check_folder_of(file: &Path) -> Result<(), Error> {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty());
    let readable = folder.map_or(Ok(()), |folder| std::fs::read_dir(folder).map(drop));
    readable.map_err(|source| Error::Output { path: file.into(), source })
}

/// Refuses to write where a run has left a result.
fn refuse_result(option: &str, place: &Path) -> Result<(), Error> {
    if !crate::folder::is_result(place) {
        return Ok(());
    }
    Err(usage(format!(
        "{option} {} is a result of the run in its folder, which would then be another; name another place",
        place.display()
    )))
}

/// Refuses a name that says no format in which something is written, before the work is begun.
pub(super) fn check_ending(
    option: &str,
    file: &Path,
    what: &str,
    endings: &[&str],
) -> Result<(), Error> {
    let (false, Some((last, others))) = (ends(file, endings), endings.split_last()) else {
        return Ok(());
    };
    let others = if others.is_empty() { String::new() } else { others.join(", ") + " or " };
    Err(usage(format!("{option} {}: {what} written as {others}{last}", file.display())))
}

/// The format of a mesh that is to be written, by its name.
pub(super) fn mesh_file(out: &Path) -> Result<MeshFile, Error> {
    MeshFile::of(out).map_err(|error| usage(format!("--out: {error}")))
}

/// Whether a name has one of these endings, which are in small letters.
pub(super) fn ends(path: &Path, endings: &[&str]) -> bool {
    let name = path.to_string_lossy().to_lowercase();
    endings.iter().any(|ending| name.ends_with(ending))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_is_there_is_replaced_unless_it_may_be() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        let (ct, mine, free) = (at("ct.nrrd"), at("mine.csv"), at("free.csv"));
        std::fs::write(&ct, "a CT").unwrap();
        std::fs::write(&mine, "mine").unwrap();
        let of = |path: &Path, overwrite| {
            Outputs::beside([ct.as_path()]).file("--out", Some(path)).check(overwrite)
        };
        let refused = of(&mine, false).unwrap_err().to_string();
        assert!(refused.contains("mine.csv is there already"), "{refused}");
        of(&mine, true).unwrap();
        of(&free, false).unwrap();
        for overwrite in [false, true] {
            let refused = of(&ct, overwrite).unwrap_err().to_string();
            assert!(refused.contains("is what is read"), "{refused}");
        }
        assert!(matches!(of(&at("gone/free.csv"), true), Err(Error::Output { .. })));
        let twice = Outputs::default().file("--out", Some(&free));
        let twice = twice.file("--problem", Some(&dir.path().join("./free.csv")));
        let refused = twice.check(true).unwrap_err().to_string();
        assert!(refused.starts_with("--out and --problem both name"), "{refused}");
    }

    #[test]
    fn of_a_folder_the_files_of_their_names_are_kept_and_of_a_whole_one_all() {
        let dir = tempfile::tempdir().unwrap();
        let within = |names: &[&str]| {
            Outputs::default().within("--fields", Some(dir.path()), names).check(false)
        };
        std::fs::write(dir.path().join("notes.txt"), "mine").unwrap();
        within(&["jacobian.nrrd"]).unwrap();
        let refused = within(&["notes.txt"]).unwrap_err().to_string();
        assert!(refused.contains("notes.txt is there already"), "{refused}");
        let whole = |path: &Path, overwrite| {
            Outputs::default().folder("--out", Some(path)).check(overwrite)
        };
        whole(dir.path(), true).unwrap();
        whole(&dir.path().join("new/folder"), false).unwrap();
        let refused = whole(dir.path(), false).unwrap_err().to_string();
        assert!(refused.contains("is there already"), "{refused}");
    }

    #[cfg(unix)]
    #[test]
    fn a_device_takes_what_is_written() {
        Outputs::default().file("--out", Some(Path::new("/dev/null"))).check(false).unwrap();
    }
}
