//! Writing: under a temporary name beside the goal, then renamed.

use crate::{Error, Summary};
use std::io::Write;
use std::path::Path;

/// Writes the summary as JSON to `path`; an existing file is replaced whole.
///
/// # Errors
/// [`Error::Write`] when the folder does not exist or cannot be written.
pub fn write_summary(summary: &Summary, path: &Path) -> Result<(), Error> {
    write_text(&summary.to_json(), path)
}

/// Writes text to `path`; an existing file is replaced whole.
pub(crate) fn write_text(text: &str, path: &Path) -> Result<(), Error> {
    let fail = |source| Error::Write { path: path.to_path_buf(), source };
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut file = builder(0o666).tempfile_in(folder).map_err(fail)?;
    file.write_all(text.as_bytes()).map_err(fail)?;
    file.persist(path).map_err(|e| fail(e.error))?;
    Ok(())
}

/// Temporary files are private by default, results are not: what the user's mask leaves of `mode`.
pub(crate) fn builder(mode: u32) -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".supine-");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(mode));
    #[cfg(not(unix))]
    let _ = mode;
    builder
}

/// Puts a finished temporary folder in the place of `dir`; an older `dir` goes once the new one
/// stands.
pub(crate) fn replace_folder(fresh: tempfile::TempDir, dir: &Path) -> std::io::Result<()> {
    let mut old = None;
    if dir.exists() {
        let parent = fresh.path().parent().unwrap_or(Path::new("."));
        let aside = builder(0o777).tempdir_in(parent)?;
        std::fs::rename(dir, aside.path().join("old"))?;
        old = Some(aside);
    }
    match std::fs::rename(fresh.path(), dir) {
        Ok(()) => {
            // The folder has moved away: there is nothing left to delete.
            let _ = fresh.keep();
            Ok(())
        }
        Err(error) => {
            if let Some(aside) = old {
                std::fs::rename(aside.path().join("old"), dir)?;
            }
            Err(error)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::summary::tests::example;

    #[test]
    fn the_summary_is_written_whole_or_not_at_all() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("summary.json");
        write_summary(&example(), &path).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), example().to_json());
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
        let nowhere = dir.path().join("none").join("summary.json");
        let error = write_summary(&example(), &nowhere).unwrap_err();
        assert!(error.to_string().contains("summary.json"), "{error}");
    }
}
