//! Folders: what a run leaves, and copies of the fixture's series that can be spoiled.

use crate::case::source;
use std::path::{Path, PathBuf};

/// The names under which a run leaves its results; `ct.nrrd` stands in for `ct` when the CT did not
/// come as DICOM, `points.csv` is there when points are carried, `rt` when DICOM objects are,
/// `tissues.seg.nrrd` and `report.dcm` when they are asked for.
pub const FINAL_NAMES: [&str; 15] = [
    "rt",
    "registration",
    "labels.seg.nrrd",
    "labels.dcm",
    "structures.dcm",
    "labels-uncertainty.nrrd",
    "tissues.seg.nrrd",
    "mesh",
    "field",
    "points.csv",
    "ct",
    "ct.nrrd",
    "report",
    "report.dcm",
    "summary.json",
];

/// What a run keeps for itself beside its results.
const KEPT: [&str; 2] = [".stages", "log.jsonl"];

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

/// Files below a run's folder that are neither results nor what the run keeps for itself: what it
/// forgot to rename or remove. Results never begin with a dot, as temporary names do.
pub fn forgotten(out: &Path) -> Vec<PathBuf> {
    let mut files = files_below(out);
    files.retain(|path| {
        let names: Vec<_> = path.components().map(|c| c.as_os_str().to_string_lossy()).collect();
        let kept = KEPT.contains(&&*names[0]);
        let result = FINAL_NAMES.contains(&&*names[0]) && !names.iter().any(|n| n.starts_with('.'));
        !kept && !result
    });
    files
}

/// The results of a run: every file below its folder that it does not keep for itself.
pub fn results(out: &Path) -> Vec<PathBuf> {
    let mut files = files_below(out);
    files.retain(|path| !KEPT.iter().any(|kept| path.starts_with(kept)));
    files
}

/// Copies all files below a folder into another one.
pub fn copy_folder(from: &Path, to: &Path) {
    for file in files_below(from) {
        let copy = to.join(&file);
        let folder = copy.parent().expect("a file lies in a folder");
        std::fs::create_dir_all(folder).expect("a folder can be made");
        std::fs::copy(from.join(&file), &copy).expect("a file can be copied");
    }
}

/// Copies the fixture's series into `folder/ct` and tells the files in order along the patient.
pub fn copy_series(folder: &Path) -> (PathBuf, Vec<PathBuf>) {
    let (from, to) = (source(), folder.join("ct"));
    std::fs::create_dir(&to).expect("the copy's folder can be made");
    let mut files = Vec::new();
    for name in files_below(&from) {
        let copy = to.join(&name);
        std::fs::copy(from.join(&name), &copy).expect("the series can be copied");
        files.push(copy);
    }
    (to, files)
}
