//! Whether the runs that files belong to may be used: what `supine send` asks before anything
//! leaves.

use crate::Error;
use crate::folder::{RunFolder, changed_since, failed_since, run_around, runs_within, summary_of};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use supine_dicom::{ObjectFile, is_ct, is_registration, object_files};
use supine_report::{Colour, Verdict};
use supine_space::{Progress, Warning};

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

/// What was found of the runs that files and folders belong to.
#[derive(Debug, Default)]
pub struct Looked {
    /// What must not leave.
    pub unusable: Vec<Unusable>,
    /// What may leave and has to be told.
    pub warnings: Vec<Warning>,
}

/// The runs to which these files and folders belong, or which lie in them, that must not be used:
/// unfinished ones, those whose verdict is red, and those whose files are not what the run left.
/// And of objects beside runs those that were carried from one that must not be used, and those of
/// a series of which a part is missing.
///
/// # Errors
/// When a folder cannot be read.
pub fn unusable(paths: &[PathBuf]) -> Result<Vec<Unusable>, Error> {
    look(paths).map(|looked| looked.unusable)
}

/// The same, with what has to be told of objects that no run's record tells about.
///
/// # Errors
/// When a folder cannot be read.
pub fn look(paths: &[PathBuf]) -> Result<Looked, Error> {
    let (mut runs, mut beside): (Vec<PathBuf>, Vec<ObjectFile>) = (Vec::new(), Vec::new());
    for path in paths {
        match run_around(path) {
            Some(run) => runs.push(run),
            None => {
                runs.extend(runs_within(path)?);
                let files = object_files(path, Progress::none()).map_err(Error::Dicom)?;
                beside.extend(files.objects.into_iter().filter(|object| object.own));
            }
        }
    }
    beside.retain(|object| run_around(&object.path).is_none());
    runs.sort();
    runs.dedup();
    let told = |run: PathBuf| {
        let changed = summary_of(&run).and_then(|summary| changed_since(&run, &summary));
        let (changed, why) = (changed.is_some(), changed.or_else(|| why_not(&run))?);
        Some(Unusable { path: run, why, changed })
    };
    let marked = beside.iter().filter(|object| object.not_usable).map(|object| Unusable {
        path: object.path.clone(),
        why: "it was carried from a run that must not be used".into(),
        changed: false,
    });
    let unusable = runs.into_iter().filter_map(told).chain(marked).chain(not_whole(&beside));
    let unusable = unusable.collect();
    Ok(Looked { unusable, warnings: without_record(&beside).into_iter().collect() })
}

/// The exported CT series among objects beside runs of which an image is missing: their images are
/// numbered from 1 on. A single image is sent as one.
fn not_whole(beside: &[ObjectFile]) -> Vec<Unusable> {
    let mut series: BTreeMap<&str, (&Path, BTreeSet<i64>)> = BTreeMap::new();
    for object in beside.iter().filter(|object| is_ct(&object.class)) {
        let of = series.entry(&object.owner.series).or_insert((&object.path, BTreeSet::new()));
        of.1.extend(object.number);
    }
    let mut unusable = Vec::new();
    for (first, numbers) in series.into_values().filter(|(_, numbers)| numbers.len() > 1) {
        if let Some(missing) = (1..).zip(&numbers).find_map(|(n, at)| (n != *at).then_some(n)) {
            let why =
                format!("it is of a series that is not whole here: its image {missing} is missing");
            unusable.push(Unusable { path: first.to_path_buf(), why, changed: false });
        }
    }
    unusable
}

/// That nothing here tells of the run that left these objects. Those that `supine carry` makes as
/// well do not count.
fn without_record(beside: &[ObjectFile]) -> Option<Warning> {
    let of_runs = |object: &&ObjectFile| is_ct(&object.class) || is_registration(&object.class);
    let count = beside.iter().filter(of_runs).count();
    (count > 0).then(|| {
        let text = format!(
            "{count} objects that a run left lie outside its folder: whether it may be used, and whether they are as it left \
             them, nothing here tells; send from the run's folder"
        );
        Warning::new("verdict-unknown", text)
    })
}

/// Why a run must not be used by its own word: it is unfinished, its verdict is red, or a later run
/// into its folder failed.
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
    use supine_dicom::Owner;

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

    /// A slice of a series that this program exported.
    fn slice(number: i64, series: &str) -> ObjectFile {
        let owner = Owner { series: series.into(), ..Owner::default() };
        ObjectFile {
            path: format!("copy/{series}-{number}.dcm").into(),
            name: String::new(),
            class: "1.2.840.10008.5.1.4.1.1.2".into(),
            instance: format!("{series}.{number}"),
            syntax: String::new(),
            data_start: 0,
            data_bytes: 0,
            owner,
            number: Some(number),
            own: true,
            not_usable: false,
        }
    }

    #[test]
    fn a_series_copied_from_its_run_is_told_and_one_with_a_gap_is_unusable() {
        let series = |numbers: &[i64]| -> Vec<ObjectFile> {
            numbers.iter().map(|n| slice(*n, "1.2")).collect()
        };
        assert!(not_whole(&series(&[3, 1, 2])).is_empty());
        assert!(not_whole(&series(&[7])).is_empty(), "a single image is sent as one");
        for (numbers, missing) in [(&[1, 2, 4][..], 3), (&[2, 3], 1)] {
            let found = not_whole(&series(numbers));
            assert!(found[0].why.contains(&format!("image {missing} is missing")), "{found:?}");
        }
        // Its third image gave way to that of another run.
        let mut mixed = series(&[1, 2, 4]);
        mixed.push(slice(3, "1.3"));
        assert_eq!(not_whole(&mixed).len(), 1);
        let told = without_record(&mixed).unwrap().to_string();
        assert!(told.starts_with("4 objects that a run left lie outside its folder"), "{told}");
        assert!(without_record(&[]).is_none());
    }
}
