//! The folder objects arrive in, which goes again when nothing arrived.

use crate::error::Error;
use std::path::{Path, PathBuf};

/// A folder that is there, with those above it that had to be made. What of them is empty when this
/// is dropped is removed.
#[derive(Debug)]
pub(crate) struct Made {
    /// Those that were made, deepest first.
    folders: Vec<PathBuf>,
}

impl Made {
    /// Makes a folder where it is missing.
    ///
    /// # Errors
    /// When it cannot be made.
    pub(crate) fn new(folder: &Path) -> Result<Self, Error> {
        let above = folder.ancestors().filter(|path| !path.as_os_str().is_empty());
        let folders = above.take_while(|path| !path.exists()).map(Path::to_owned).collect();
        // From here on, since of several the first may have been made before another failed.
        let made = Self { folders };
        std::fs::create_dir_all(folder)
            .map_err(|source| Error::Write { path: folder.into(), source })?;
        Ok(made)
    }
}

impl Drop for Made {
    fn drop(&mut self) {
        // One that holds something stays, and so do those above it.
        let _emptied = self.folders.iter().try_for_each(std::fs::remove_dir);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_made_and_stayed_empty_goes_and_nothing_else() {
        let root = tempfile::tempdir().unwrap();
        let (there, deep) = (root.path().join("there"), root.path().join("there/a/b"));
        std::fs::create_dir(&there).unwrap();
        drop(Made::new(&there).unwrap());
        assert!(there.is_dir(), "it was there before");
        drop(Made::new(&deep).unwrap());
        assert!(there.is_dir() && !there.join("a").exists());
        let made = Made::new(&deep).unwrap();
        std::fs::write(there.join("a/file"), "").unwrap();
        drop(made);
        assert!(there.join("a/file").is_file() && !deep.exists());
        std::fs::write(there.join("file"), "").unwrap();
        assert!(Made::new(&there.join("file/c")).is_err());
    }
}
