//! What a folder holds of a node beside its files.

use crate::inputs::{files_below, hash_of, times};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use supine_report::Warning;

/// The record of a node that was made.
#[derive(Serialize, Deserialize, Clone, Debug)]
pub(crate) struct Record {
    /// The key of its result.
    pub(crate) key: String,
    /// Version of its method.
    pub(crate) method: u32,
    /// Keys of its parents.
    pub(crate) parents: Vec<String>,
    /// Its files.
    pub(crate) files: Vec<Written>,
    /// The part of its result that is not in files.
    pub(crate) facts: serde_json::Value,
    /// What it warned of.
    pub(crate) warnings: Vec<Warning>,
}

/// A record as it is kept: with the hash of all that it says, so that a changed number is no
/// result.
#[derive(Serialize, Deserialize)]
struct Kept {
    blake3: String,
    record: Box<serde_json::value::RawValue>,
}

impl Record {
    /// Its file.
    ///
    /// # Errors
    /// When it holds what JSON cannot.
    pub(super) fn to_file(&self) -> serde_json::Result<Vec<u8>> {
        let record = serde_json::value::to_raw_value(self)?;
        serde_json::to_vec(&Kept { blake3: hash_of_text(record.get()), record })
    }

    /// The record of a stage in a run's folder; none when it is not there or was changed since it
    /// was written.
    pub(super) fn read(run: &Path, stage: &str) -> Option<Self> {
        let text = std::fs::read_to_string(path_of(run, stage)).ok()?;
        let kept: Kept = serde_json::from_str(&text).ok()?;
        let whole = hash_of_text(kept.record.get()) == kept.blake3;
        serde_json::from_str(kept.record.get()).ok().filter(|_| whole)
    }
}

/// Where the record of a stage lies.
pub(super) fn path_of(run: &Path, stage: &str) -> PathBuf {
    run.join(super::names::RECORDS).join(format!("{stage}.json"))
}

fn hash_of_text(text: &str) -> String {
    blake3::hash(text.as_bytes()).to_hex().to_string()
}

/// A file or folder that was written.
#[derive(Serialize, Deserialize, Clone, Debug)]
pub(crate) struct Written {
    /// Its path, relative to the folder.
    pub(crate) path: String,
    /// Its content.
    pub(crate) blake3: String,
    /// Sizes and times of its files, hashed.
    stamp: String,
}

impl Written {
    /// What lies at a path of a folder.
    pub(super) fn of(root: &Path, path: &str) -> std::io::Result<Self> {
        let whole = root.join(path);
        let blake3 = hash_of(&whole)?.blake3;
        Ok(Self { path: path.into(), blake3, stamp: stamp(&whole)? })
    }

    /// Whether it is still what was written: untouched, or with the same content.
    pub(super) fn is_whole(&self, root: &Path) -> bool {
        let path = root.join(&self.path);
        match stamp(&path) {
            Ok(found) if found == self.stamp => true,
            Ok(_) => hash_of(&path).is_ok_and(|found| found.blake3 == self.blake3),
            Err(_) => false,
        }
    }
}

/// Names, sizes and times of a file, or of the files below a folder.
fn stamp(path: &Path) -> std::io::Result<String> {
    let files: Vec<PathBuf> =
        if path.is_dir() { files_below(path)? } else { vec![path.to_owned()] };
    let mut hasher = blake3::Hasher::new();
    for file in &files {
        let name = file.strip_prefix(path).unwrap_or(file).to_string_lossy().into_owned();
        hasher.update(name.as_bytes()).update(b"\0");
        for number in times(&std::fs::metadata(file)?) {
            hasher.update(&number.to_le_bytes());
        }
    }
    Ok(hasher.finalize().to_hex().to_string())
}
