//! The output folder, which appears complete or not at all.

use crate::error::Error;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A folder being written under a temporary name beside its final one.
#[derive(Debug)]
pub(super) struct Target {
    dir: PathBuf,
    temporary: TempDir,
}

impl Target {
    /// Prepares to write `dir`, which must be free, empty or an earlier export.
    pub(super) fn new(dir: &Path) -> Result<Self, Error> {
        let fail = |source| Error::Write { path: dir.to_owned(), source };
        if dir.exists() {
            let entries = std::fs::read_dir(dir).map_err(fail)?;
            for entry in entries {
                if !is_ours(&entry.map_err(fail)?.file_name().to_string_lossy()) {
                    return Err(Error::Occupied { path: dir.to_owned() });
                }
            }
        }
        let parent = match dir.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        std::fs::create_dir_all(parent).map_err(fail)?;
        let mut builder = tempfile::Builder::new();
        builder.prefix(".supine-ct-");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt as _;
            // As any folder of the user's: the mask of the process applies.
            builder.permissions(std::fs::Permissions::from_mode(0o777));
        }
        let temporary = builder.tempdir_in(parent).map_err(fail)?;
        Ok(Self { dir: dir.to_owned(), temporary })
    }

    /// Writes one file under the temporary name and says where it is.
    pub(super) fn write(&self, name: &str, bytes: &[u8]) -> Result<PathBuf, Error> {
        let path = self.temporary.path().join(name);
        match std::fs::write(&path, bytes) {
            Ok(()) => Ok(path),
            Err(source) => Err(Error::Write { path: self.dir.join(name), source }),
        }
    }

    /// Gives the folder its final name; an earlier export goes away with the temporary folder.
    pub(super) fn commit(self) -> Result<(), Error> {
        let fail = |source| Error::Write { path: self.dir.clone(), source };
        let new = self.temporary.path();
        if !self.dir.exists() {
            std::fs::rename(new, &self.dir).map_err(fail)?;
            return Ok(());
        }
        let parent = new.parent().unwrap_or(Path::new("."));
        let old =
            tempfile::Builder::new().prefix(".supine-old-").tempdir_in(parent).map_err(fail)?;
        let aside = old.path().join("ct");
        std::fs::rename(&self.dir, &aside).map_err(fail)?;
        if let Err(source) = std::fs::rename(new, &self.dir) {
            // The earlier export comes back rather than nothing.
            std::fs::rename(&aside, &self.dir).map_err(fail)?;
            return Err(fail(source));
        }
        Ok(())
    }
}

/// Whether a file name is one that exports have.
fn is_ours(name: &str) -> bool {
    name.strip_prefix("CT")
        .and_then(|rest| rest.strip_suffix(".dcm"))
        .is_some_and(|digits| digits.len() >= 4 && digits.bytes().all(|b| b.is_ascii_digit()))
}
