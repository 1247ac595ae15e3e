//! The report's folder.

use crate::files::{builder, replace_folder};
use crate::{Error, Scene, Summary, html, pictures};
use std::path::{Path, PathBuf};
use supine_space::Progress;

/// What was written.
#[derive(Clone, Debug, PartialEq)]
pub struct Info {
    /// The files, relative to the report's folder: `index.html`, then the pictures.
    pub files: Vec<PathBuf>,
    /// What the user must know; the report has nothing to warn of so far.
    pub warnings: Vec<String>,
}

/// Writes `dir/index.html`, self-contained, and its pictures as `dir/*.png`.
///
/// Everything is written into a temporary folder beside `dir`, which then takes the place of
/// `dir`. Nothing in it differs from run to run of the same case.
///
/// # Errors
/// [`Error::Write`] when the folder cannot be written, [`Error::Page`] and [`Error::Picture`] when
/// an encoder fails, [`Error::Stopped`] when the user asked to stop. `dir` is then as it was.
pub fn write(
    summary: &Summary,
    scene: &Scene<'_>,
    dir: &Path,
    progress: Progress<'_>,
) -> Result<Info, Error> {
    let rows = pictures::rows(summary, scene, progress.part(0.0, 0.7))?;
    let all: Vec<_> = rows.iter().flat_map(|row| &row.pictures).collect();
    let encoding = progress.part(0.7, 0.95);
    let mut pngs = Vec::with_capacity(all.len());
    for (n, picture) in all.iter().enumerate() {
        encoding.at(n as f64 / all.len() as f64)?;
        let fail = |source| Error::Picture { name: picture.name.clone(), source };
        pngs.push(picture.canvas.png().map_err(fail)?);
    }
    let page = html::page(summary, &rows, &pngs)?;
    progress.at(0.95)?;

    let parent = dir.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let fail = |source| Error::Write { path: dir.to_path_buf(), source };
    std::fs::create_dir_all(parent).map_err(fail)?;
    let fresh = builder(0o777).tempdir_in(parent).map_err(fail)?;
    let mut files = Vec::with_capacity(1 + all.len());
    let names = all.iter().map(|p| format!("{}.png", p.name));
    let pages = std::iter::once(("index.html".to_string(), page.as_bytes()));
    for (name, bytes) in pages.chain(names.zip(pngs.iter().map(Vec::as_slice))) {
        std::fs::write(fresh.path().join(&name), bytes).map_err(fail)?;
        files.push(PathBuf::from(name));
    }
    replace_folder(fresh, dir).map_err(fail)?;
    Ok(Info { files, warnings: Vec::new() })
}
