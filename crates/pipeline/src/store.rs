//! The stages that are done, by content hash: a second run does nothing.
//!
//! A stage is done when its record holds the key of what is asked now and its products still have
//! the bytes they were recorded with. When one is not, its products and those of the stages that
//! rest on it are removed before it runs, so that a folder never mixes results of two cases.

use crate::{RunError, Stage};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use std::fs::{self, File};
use std::path::{Path, PathBuf};

/// The output folder of a run.
#[derive(Debug)]
pub(crate) struct Store {
    root: PathBuf,
    force: Option<Stage>,
    /// Held for the life of the run: two runs in one folder would mix their results.
    _lock: File,
}

/// What a stage leaves beside its products.
#[derive(Serialize, Deserialize, Debug)]
pub(crate) struct Record<T> {
    key: String,
    products: Vec<(String, String)>,
    /// The stage's part of the summary.
    pub(crate) facts: T,
    /// What the user must know.
    pub(crate) warnings: Vec<String>,
}

/// The hash of everything that decides a product.
pub(crate) fn key(parts: &[&str]) -> String {
    let mut hasher = blake3::Hasher::new();
    for part in parts {
        hasher.update(&(part.len() as u64).to_le_bytes());
        hasher.update(part.as_bytes());
    }
    hasher.finalize().to_hex().to_string()
}

impl Store {
    /// Opens or makes the output folder.
    pub(crate) fn open(root: &Path, force: Option<Stage>) -> Result<Self, RunError> {
        let output = |source| RunError::Output { path: root.into(), source };
        let records = root.join(".stages");
        if !records.exists() {
            refuse_foreign(root)?;
        }
        fs::create_dir_all(&records).map_err(output)?;
        let lock = File::create(records.join("lock")).map_err(output)?;
        match lock.try_lock() {
            Ok(()) => Ok(Self { root: root.into(), force, _lock: lock }),
            Err(fs::TryLockError::WouldBlock) => Err(RunError::Busy { path: root.into() }),
            Err(fs::TryLockError::Error(e)) => Err(output(e)),
        }
    }

    /// A path in the output folder, with its parent folder made.
    pub(crate) fn path(&self, relative: &str) -> Result<PathBuf, RunError> {
        let path = self.root.join(relative);
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent)
                .map_err(|source| RunError::Output { path: path.clone(), source })?;
        }
        Ok(path)
    }

    fn record(&self, stage: Stage) -> PathBuf {
        self.root.join(".stages").join(format!("{stage}.json"))
    }

    /// The record of a stage that is done for this key, with all its products as they were.
    pub(crate) fn done<T: DeserializeOwned>(&self, stage: Stage, key: &str) -> Option<Record<T>> {
        if self.force.is_some_and(|from| from.spoils(stage)) {
            return None;
        }
        let text = fs::read_to_string(self.record(stage)).ok()?;
        let record: Record<T> = serde_json::from_str(&text).ok()?;
        let whole = record.key == key
            && record.products.iter().all(|(path, hash)| {
                hash_of(&self.root.join(path)).is_ok_and(|found| found.blake3 == *hash)
            });
        whole.then_some(record)
    }

    /// Removes what this stage and those that rest on it left.
    pub(crate) fn clear_from(&self, stage: Stage) -> Result<(), RunError> {
        for later in Stage::ALL.into_iter().filter(|s| stage.spoils(*s)) {
            remove(&self.record(later))?;
            for product in later.products() {
                remove(&self.root.join(product))?;
            }
        }
        Ok(())
    }

    /// Records a stage as done, with the products that are there.
    pub(crate) fn keep<T: Serialize>(
        &self,
        stage: Stage,
        key: &str,
        facts: T,
        warnings: Vec<String>,
    ) -> Result<Record<T>, RunError> {
        let mut products = Vec::new();
        // summary.json is written after the report's record, from it.
        let mine = stage.products().iter().filter(|p| **p != "summary.json");
        for product in mine.filter(|p| self.root.join(p).exists()) {
            let path = self.root.join(product);
            let found =
                hash_of(&path).map_err(|source| RunError::Output { path: path.clone(), source })?;
            products.push(((*product).to_string(), found.blake3));
        }
        let record = Record { key: key.into(), products, facts, warnings };
        write_atomically(&self.record(stage), &serde_json::to_vec(&record)?)?;
        Ok(record)
    }

    /// The products of all stages that are done, with their hashes, in order; `.stages` left out.
    pub(crate) fn outputs(&self) -> Vec<supine_report::Output> {
        let visible = |path: &&&str| !path.starts_with('.') && **path != "summary.json";
        let products = Stage::ALL.into_iter().flat_map(|s| s.products().iter().filter(visible));
        products
            .filter_map(|path| {
                let found = hash_of(&self.root.join(path)).ok()?;
                Some(supine_report::Output { path: (*path).into(), blake3: found.blake3 })
            })
            .collect()
    }
}

/// A folder that no run made may hold nothing that a run would replace.
fn refuse_foreign(root: &Path) -> Result<(), RunError> {
    let products = Stage::ALL.into_iter().flat_map(Stage::products);
    match products.map(|p| root.join(p)).find(|p| p.exists()) {
        Some(path) => Err(RunError::Foreign { path }),
        None => Ok(()),
    }
}

/// The path without links, as far as it exists.
fn resolve(path: &Path) -> PathBuf {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.into());
    let known = path.ancestors().find_map(|a| Some((a, a.canonicalize().ok()?)));
    match known {
        Some((ancestor, real)) => match path.strip_prefix(ancestor) {
            Ok(rest) if !rest.as_os_str().is_empty() => real.join(rest),
            _ => real,
        },
        None => path,
    }
}

/// Refuses an input that lies where the run writes: it would be lost.
pub(crate) fn refuse_overlap(
    root: &Path,
    role: &'static str,
    input: &Path,
) -> Result<(), RunError> {
    let (root, input) = (resolve(root), resolve(input));
    let mut products = Stage::ALL.into_iter().flat_map(Stage::products).map(|p| root.join(p));
    let overlap = root.starts_with(&input)
        || products.any(|p| input.starts_with(&p) || p.starts_with(&input));
    if overlap { Err(RunError::Overlap { role, path: input }) } else { Ok(()) }
}

/// Writes a file under a temporary name beside it, then renames.
pub(crate) fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), RunError> {
    let output = |source| RunError::Output { path: path.into(), source };
    let folder = path.parent().unwrap_or(Path::new("."));
    let mut file = tempfile::NamedTempFile::new_in(folder).map_err(output)?;
    std::io::Write::write_all(&mut file, bytes).map_err(output)?;
    file.persist(path).map_err(|e| output(e.error))?;
    Ok(())
}

fn remove(path: &Path) -> Result<(), RunError> {
    let removed = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
    match removed {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
            Err(RunError::Output { path: path.into(), source: e })
        }
        _ => Ok(()),
    }
}

/// Hash of a file, or of all files below a folder.
pub(crate) struct Hashed {
    /// Number of files.
    pub(crate) files: usize,
    /// blake3 in hexadecimal; of a folder: of the names and hashes of its files in order of name.
    pub(crate) blake3: String,
}

/// Deepest nesting of input folders that is followed.
const MAX_DEPTH: usize = 8;

/// What an input is, without its name: sites name files and folders after patients.
pub(crate) fn form(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    let known = [".seg.nrrd", ".nrrd", ".nii.gz", ".nii", ".mrk.json", ".csv", ".dcm"];
    match known.iter().find(|end| name.ends_with(**end)) {
        _ if path.is_dir() => "folder".into(),
        Some(end) => (*end).into(),
        None => "file".into(),
    }
}

/// The hash of a file or folder; links to folders are not followed.
pub(crate) fn hash_of(path: &Path) -> std::io::Result<Hashed> {
    if path.is_file() {
        return Ok(Hashed { files: 1, blake3: hash_file(path)? });
    }
    let mut files = Vec::new();
    collect(path, MAX_DEPTH, &mut files)?;
    files.sort();
    let mut hasher = blake3::Hasher::new();
    for file in &files {
        let name = file.strip_prefix(path).unwrap_or(file).to_string_lossy().into_owned();
        hasher.update(name.as_bytes()).update(b"\0").update(hash_file(file)?.as_bytes());
    }
    Ok(Hashed { files: files.len(), blake3: hasher.finalize().to_hex().to_string() })
}

fn hash_file(path: &Path) -> std::io::Result<String> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(File::open(path)?)?;
    Ok(hasher.finalize().to_hex().to_string())
}

fn collect(folder: &Path, depth: usize, files: &mut Vec<PathBuf>) -> std::io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        // Hidden files are no data: the record of `supine send`, what a file manager leaves.
        if entry.file_name().to_string_lossy().starts_with('.') {
            continue;
        }
        let kind = entry.file_type()?;
        if kind.is_dir() && depth > 0 {
            collect(&entry.path(), depth - 1, files)?;
        } else if kind.is_file() || (kind.is_symlink() && entry.path().is_file()) {
            files.push(entry.path());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn store(dir: &Path, force: Option<Stage>) -> Store {
        Store::open(dir, force).unwrap()
    }

    #[test]
    fn hidden_files_do_not_count() {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("slice"), "pixels").unwrap();
        let before = hash_of(dir.path()).unwrap();
        fs::write(dir.path().join(".supine-sent"), "a record").unwrap();
        let after = hash_of(dir.path()).unwrap();
        assert_eq!((before.files, before.blake3), (after.files, after.blake3));
        fs::write(dir.path().join("other"), "pixels").unwrap();
        assert_ne!(before.files, hash_of(dir.path()).unwrap().files);
    }

    #[test]
    fn a_stage_is_done_until_its_key_or_product_changes() {
        let dir = tempfile::tempdir().unwrap();
        let s = store(dir.path(), None);
        let product = s.path("mesh/rest.vtu").unwrap();
        fs::write(&product, "mesh").unwrap();
        s.keep(Stage::Mesh, "k1", 5u32, vec!["w".into()]).unwrap();
        assert_eq!(s.done::<u32>(Stage::Mesh, "k1").unwrap().facts, 5);
        assert!(s.done::<u32>(Stage::Mesh, "k2").is_none());
        fs::write(&product, "mush").unwrap();
        assert!(s.done::<u32>(Stage::Mesh, "k1").is_none());
    }

    #[test]
    fn clearing_a_stage_clears_all_later_ones() {
        let dir = tempfile::tempdir().unwrap();
        let s = store(dir.path(), None);
        for stage in [Stage::Mesh, Stage::Solve, Stage::Export] {
            for product in stage.products().iter().take(1) {
                fs::write(s.path(product).unwrap(), "x").unwrap();
            }
            s.keep(stage, "k", (), vec![]).unwrap();
        }
        s.clear_from(Stage::Solve).unwrap();
        assert!(s.done::<()>(Stage::Mesh, "k").is_some());
        assert!(s.done::<()>(Stage::Solve, "k").is_none());
        assert!(s.done::<()>(Stage::Export, "k").is_none());
        assert!(dir.path().join("mesh/rest.vtu").exists());
        assert!(!dir.path().join("mesh/deformed.vtu").exists());
    }

    #[test]
    fn the_finer_tissues_spoil_the_report_alone() {
        let dir = tempfile::tempdir().unwrap();
        let s = store(dir.path(), None);
        for stage in [Stage::Tissues, Stage::Mesh, Stage::Report] {
            s.keep(stage, "k", (), vec![]).unwrap();
        }
        s.clear_from(Stage::Tissues).unwrap();
        let done = |stage| s.done::<()>(stage, "k").is_some();
        assert_eq!([Stage::Tissues, Stage::Mesh, Stage::Report].map(done), [false, true, false]);
        s.keep(Stage::Tissues, "k", (), vec![]).unwrap();
        s.clear_from(Stage::Mesh).unwrap();
        assert_eq!([Stage::Tissues, Stage::Mesh].map(done), [true, false]);
    }

    #[test]
    fn forcing_redoes_from_there() {
        let dir = tempfile::tempdir().unwrap();
        let first = store(dir.path(), None);
        first.keep(Stage::Segment, "k", (), vec![]).unwrap();
        first.keep(Stage::Solve, "k", (), vec![]).unwrap();
        drop(first);
        let s = store(dir.path(), Some(Stage::Mesh));
        assert!(s.done::<()>(Stage::Segment, "k").is_some());
        assert!(s.done::<()>(Stage::Solve, "k").is_none());
    }

    #[test]
    fn what_no_run_made_is_not_touched() {
        let dir = tempfile::tempdir().unwrap();
        let mine = dir.path().join("ct/IM0001");
        fs::create_dir(dir.path().join("ct")).unwrap();
        fs::write(&mine, "a patient").unwrap();
        assert!(matches!(Store::open(dir.path(), None), Err(RunError::Foreign { .. })));
        assert!(mine.exists() && !dir.path().join(".stages").exists());
    }

    #[test]
    fn inputs_where_the_run_writes_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let labels = dir.path().join("labels.seg.nrrd");
        fs::write(&labels, "edited by hand").unwrap();
        let beside = dir.path().join("mine.seg.nrrd");
        fs::write(&beside, "edited by hand").unwrap();
        let out = dir.path();
        assert!(matches!(
            refuse_overlap(out, "`labels`", &labels),
            Err(RunError::Overlap { role: "`labels`", .. })
        ));
        assert!(refuse_overlap(out, "`labels`", &beside).is_ok());
        assert!(refuse_overlap(out, "`ct`", out).is_err(), "results among the input's files");
        assert!(refuse_overlap(&out.join("new"), "`ct`", out).is_err(), "out is yet to be made");
        assert!(refuse_overlap(out, "`ct`", Path::new("/nowhere")).is_ok());
    }

    #[test]
    fn a_folder_in_use_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let _first = store(dir.path(), None);
        assert!(matches!(Store::open(dir.path(), None), Err(RunError::Busy { .. })));
    }
}
