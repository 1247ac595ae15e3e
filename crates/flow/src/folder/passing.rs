//! What a run that was killed had begun to write: files and folders under passing names.

use super::{names, remove};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// Letters and digits by which the passing names of two runs differ.
const VARYING: usize = 6;

/// Removes what lies under passing names where a run writes. Nobody else may be at work in the
/// folder. What cannot be removed stays: it is no result.
pub(super) fn sweep_run(root: &Path) {
    let places: BTreeSet<_> =
        names::all().filter_map(|path| Some(root.join(path).parent()?.to_owned())).collect();
    places.iter().for_each(|place| sweep(place));
}

/// As [`sweep_run`], in this folder alone.
pub(super) fn sweep(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    let passing = entries.flatten().filter(|e| is_passing(&e.file_name().to_string_lossy()));
    passing.for_each(|entry| drop(remove(&entry.path())));
}

/// Whether a name is one under which this program writes what is to be renamed when it is whole.
fn is_passing(name: &str) -> bool {
    let Some(rest) = name.strip_prefix(".supine-") else { return false };
    let rest = rest.strip_suffix(".part").unwrap_or(rest);
    let kinds = ["ct-", "old-"];
    let varying = kinds.iter().find_map(|kind| rest.strip_prefix(kind)).unwrap_or(rest);
    varying.len() == VARYING && varying.bytes().all(|b| b.is_ascii_alphanumeric())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_begun_goes_and_all_else_stays() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        let begun =
            [".supine-ct-2qsxe7/CT0001.dcm", "field/.supine-aB3dE6.part", ".supine-Xy12Zw/a.png"];
        let kept = [
            ".supine-sent",
            "ct/.supine-sent",
            ".supine-mine",
            "report/index.html",
            "mine/.supine-aB3dE6.part",
        ];
        for path in begun.iter().chain(&kept) {
            let path = root.join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, "bytes").unwrap();
        }
        sweep_run(root);
        for path in begun {
            assert!(!root.join(path).exists(), "{path}");
        }
        for path in kept {
            assert!(root.join(path).exists(), "{path}");
        }
    }

    /// The names that the crates give to what they begin.
    #[test]
    fn the_names_of_what_is_begun_are_known() {
        for (prefix, suffix) in
            [(".supine-", ".part"), (".supine-ct-", ""), (".supine-old-", ""), (".supine-", "")]
        {
            let made = tempfile::Builder::new().prefix(prefix).suffix(suffix).tempfile().unwrap();
            let name = made.path().file_name().unwrap().to_string_lossy().into_owned();
            assert!(is_passing(&name), "{name}");
        }
    }
}
