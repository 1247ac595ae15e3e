//! Folders: what a run leaves, and copies of the fixture's series that can be spoiled.

use crate::workspace::root;
use std::path::{Path, PathBuf};

/// The names under which a run leaves its results (docs/ARCHITECTURE.md).
pub const FINAL_NAMES: [&str; 6] =
    ["ct", "report", "summary.json", "labels.seg.nrrd", "mesh", "field"];

/// Every file below a folder, relative to it, sorted.
pub fn files_below(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        let entries =
            std::fs::read_dir(&next).unwrap_or_else(|e| panic!("{}: {e}", next.display()));
        for entry in entries {
            let path = entry.expect("the folder can be listed").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let below = path.strip_prefix(folder).expect("it lies below");
                files.push(below.to_owned());
            }
        }
    }
    files.sort();
    files
}

/// The final names that exist in a run's folder.
pub fn leftovers(out: &Path) -> Vec<&'static str> {
    FINAL_NAMES.into_iter().filter(|name| out.join(name).exists()).collect()
}

/// Files and folders below `out`, outside the cache, that a run forgot to rename or remove:
/// their names are not of those a run leaves.
pub fn half_written(out: &Path) -> Vec<PathBuf> {
    let known = |first: &str| {
        FINAL_NAMES.contains(&first) || [".stages", "log.jsonl", "case.toml"].contains(&first)
    };
    let temporary = |path: &Path| {
        path.components().any(|c| {
            let name = c.as_os_str().to_string_lossy();
            name.starts_with(".tmp") || name.ends_with(".tmp") || name.ends_with(".part")
        })
    };
    let mut found = files_below(out);
    found.retain(|path| {
        let first = path.components().next().map(|c| c.as_os_str().to_string_lossy().into_owned());
        temporary(path) || !first.is_some_and(|f| known(&f))
    });
    found
}

/// Copies the fixture's series into `folder/ct` and tells the files in order along the patient.
pub fn copy_series(folder: &Path) -> (PathBuf, Vec<PathBuf>) {
    let (from, to) = (root().join("fixtures/patient/ct"), folder.join("ct"));
    std::fs::create_dir(&to).expect("the copy's folder can be made");
    let mut files = Vec::new();
    for name in files_below(&from) {
        let copy = to.join(&name);
        std::fs::copy(from.join(&name), &copy).expect("the series can be copied");
        files.push(copy);
    }
    (to, files)
}
