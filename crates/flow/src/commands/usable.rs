//! Whether the runs that files belong to may be used: what `supine send` asks before anything leaves.

use crate::Error;
use crate::folder::{RunFolder, changed_since, failed_since, run_around, runs_within, summary_of};
use std::path::{Path, PathBuf};
use supine_dicom::object_files;
use supine_report::{Colour, Verdict};
use supine_space::Progress;

/// What must not leave, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unusable {
    /// The folder of a run, or an object that was carried from one.
    pub path: PathBuf,
    /// Why.
    pub why: String,
    /// Its files are not those that the run left: they are not sent even if one insists.
    pub changed: bool,
}

impl Unusable {
    /// Notes in the log of a run that its files left all the same.
    ///
    /// # Errors
    /// When another run works in the folder, or it cannot be written.
    pub fn note_override(&self, to: &str) -> Result<(), Error> {
        if !self.path.is_dir() {
            return Ok(());
        }
        let folder = RunFolder::open(&self.path)?;
        folder.log(&serde_json::json!({
            "event": "sent although not usable", "to": to, "why": self.why,
        }))
    }
}

/// The runs to which these files and folders belong, or which lie in them, that must not be used: unfinished ones, those
/// whose verdict is red, and those whose files are not what the run left. And objects beside runs that were carried from one
/// that must not be used.
///
/// # Errors
/// When a folder cannot be read.
pub fn unusable(paths: &[PathBuf]) -> Result<Vec<Unusable>, Error> {
    let (mut runs, mut marked): (Vec<PathBuf>, Vec<PathBuf>) = (Vec::new(), Vec::new());
    for path in paths {
        match run_around(path) {
            Some(run) => runs.push(run),
            None => {
                runs.extend(runs_within(path)?);
                let found = object_files(path, Progress::none()).map_err(Error::Dicom)?;
                let objects = found.objects.into_iter().filter(|object| object.not_usable);
                marked.extend(objects.map(|object| object.path));
            }
        }
    }
    marked.retain(|object| run_around(object).is_none());
    runs.sort();
    runs.dedup();
    let told = |run: PathBuf| {
        let changed = summary_of(&run).and_then(|summary| changed_since(&run, &summary));
        let (changed, why) = (changed.is_some(), changed.or_else(|| why_not(&run))?);
        Some(Unusable { path: run, why, changed })
    };
    let carried = |path: PathBuf| {
        let why = "it was carried from a run that must not be used".to_owned();
        Unusable { path, why, changed: false }
    };
    Ok(runs.into_iter().filter_map(told).chain(marked.into_iter().map(carried)).collect())
}

/// Why a run must not be used by its own word: it is unfinished, its verdict is red, or a later run into its folder failed.
pub(crate) fn why_not(run: &Path) -> Option<String> {
    let Some(summary) = summary_of(run) else {
        return Some("the run is unfinished: it has no summary.json".into());
    };
    let ended = |status: &serde_json::Value| status == "done" || status == "not-usable";
    if summary.get("status").is_some_and(|status| !ended(status)) {
        return Some("the run is unfinished: its summary.json does not say that it is done".into());
    }
    if let Some(code) = failed_since(run) {
        let text = format!(
            "a later run into this folder failed ({code}): this is the result of the run before"
        );
        return Some(text);
    }
    let verdict = summary.get("verdict").cloned().unwrap_or_default();
    match serde_json::from_value::<Verdict>(verdict) {
        Ok(verdict) if verdict.colour == Colour::Red => {
            let first = verdict.reasons.first();
            Some(first.map_or("its verdict is red".into(), |reason| reason.message.clone()))
        }
        Ok(_) => None,
        Err(_) => Some("it was left by another version, without a verdict: run it again".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn run(root: &Path, name: &str, summary: Option<&str>) -> PathBuf {
        let run = root.join(name);
        fs::create_dir_all(run.join("ct")).unwrap();
        fs::create_dir_all(run.join(".stages")).unwrap();
        fs::write(run.join("ct/1.dcm"), "").unwrap();
        if let Some(summary) = summary {
            fs::write(run.join("summary.json"), summary).unwrap();
        }
        run
    }

    fn verdict(colour: &str) -> String {
        let reason = r#"{"colour": "red", "code": "tumour-held", "message": "It is held.",
                         "effect_mm": null, "place_mm": null}"#;
        format!(
            r#"{{"tool": {{"name": "supine"}}, "verdict": {{"colour": "{colour}", "tolerance_mm": 2, "reasons": [{reason}]}}}}"#
        )
    }

    #[test]
    fn red_and_unfinished_runs_are_found_from_any_of_their_files() {
        let root = tempfile::tempdir().unwrap();
        let red = run(root.path(), "red", Some(&verdict("red")));
        let amber = run(root.path(), "amber", Some(&verdict("amber")));
        let open = run(root.path(), "open", None);
        let old = run(root.path(), "old", Some("{}"));
        let of = |path: &Path| -> Vec<PathBuf> {
            unusable(&[path.to_path_buf()]).unwrap().into_iter().map(|u| u.path).collect()
        };
        for path in [red.clone(), red.join("ct"), red.join("ct/1.dcm")] {
            assert_eq!(of(&path), std::slice::from_ref(&red), "{}", path.display());
        }
        assert_eq!(unusable(std::slice::from_ref(&red)).unwrap()[0].why, "It is held.");
        assert!(of(&amber).is_empty());
        assert_eq!(of(root.path()), [old, open, red.clone()]);
        // Deeper, by a link, and as a copy without its records.
        let deep = root.path().join("a/b/c");
        fs::create_dir_all(&deep).unwrap();
        let inner = run(&deep, "red", Some(&verdict("red")));
        assert_eq!(of(&root.path().join("a")), std::slice::from_ref(&inner));
        #[cfg(unix)]
        for (name, to) in [("link", red.join("ct")), ("one.dcm", red.join("ct/1.dcm"))] {
            let link = deep.join(name);
            std::os::unix::fs::symlink(to, &link).unwrap();
            assert_eq!(of(&link), std::slice::from_ref(&red), "{name}");
        }
        let copy = root.path().join("copy");
        fs::create_dir_all(copy.join("ct")).unwrap();
        fs::copy(red.join("summary.json"), copy.join("summary.json")).unwrap();
        assert_eq!(of(&copy.join("ct")), [copy]);
        let foreign = tempfile::tempdir().unwrap();
        assert!(of(foreign.path()).is_empty());
        unusable(std::slice::from_ref(&red)).unwrap()[0].note_override("PACS").unwrap();
        assert!(fs::read_to_string(red.join("log.jsonl")).unwrap().contains("It is held."));
    }
}
