//! Taking results out of a folder without a loss: what a record confirms goes, all else is set
//! aside, and the visible results of a finished run stay in a folder of their own until another run
//! is finished.

use super::record::Written;
use super::{Record, RunFolder, names, remove, summary_of};
use crate::inputs::hash_of;
use crate::{Error, NodeId};
use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

impl RunFolder {
    /// Begins to replace a finished result, of which some nodes' files will go: all that it shows
    /// is kept in a folder of its own, together with its summary. Nothing happens where no run is
    /// finished.
    ///
    /// # Errors
    /// [`Error::Output`] when files cannot be moved.
    pub(crate) fn retire(&self, gone: &BTreeSet<NodeId>) -> Result<(), Error> {
        let summary = self.root.join(names::SUMMARY);
        if gone.is_empty() || !exists(&summary) {
            return Ok(());
        }
        if !summary_of(&self.root).is_some_and(|s| s["tool"]["name"] == "supine") {
            self.set_aside(names::SUMMARY)?;
            return Ok(());
        }
        let previous = self.root.join(names::PREVIOUS);
        // Without a summary it is what an interruption left of this very work.
        if exists(&previous.join(names::SUMMARY)) {
            self.drop_previous()?;
        }
        let shown = names::ARTIFACTS.iter().filter(|(_, _, path)| !path.starts_with('.'));
        for (node, _, path) in shown {
            let (from, to) = (self.root.join(path), previous.join(path));
            if !exists(&from) || exists(&to) {
                continue;
            }
            let moved = if gone.contains(node) {
                if !self.confirms(self.record(*node).as_ref(), path) {
                    continue;
                }
                make_parent(&to).and_then(|()| fs::rename(&from, &to))
            } else {
                make_parent(&to).and_then(|()| link(&from, &to))
            };
            moved.map_err(|source| Error::Output { path: to, source })?;
        }
        let to = previous.join(names::SUMMARY);
        let moved = make_parent(&to).and_then(|()| fs::rename(&summary, &to));
        moved.map_err(|source| Error::Output { path: to, source })
    }

    /// Removes the result that was kept: another one is finished.
    ///
    /// # Errors
    /// [`Error::Output`] when it cannot be removed.
    pub(crate) fn drop_previous(&self) -> Result<(), Error> {
        let previous = self.root.join(names::PREVIOUS);
        if !exists(&previous) {
            return Ok(());
        }
        let summary = summary_of(&previous).unwrap_or_default();
        for output in summary["outputs"].as_array().into_iter().flatten() {
            let (Some(path), Some(hash)) = (output["path"].as_str(), output["blake3"].as_str())
            else {
                continue;
            };
            // A path of a run, and not whatever a changed summary names.
            if !names::ARTIFACTS.iter().any(|(_, _, known)| *known == path) {
                continue;
            }
            let whole = previous.join(path);
            let own = exists(&whole) && !holds_others(&whole);
            if own && hash_of(&whole).is_ok_and(|found| found.blake3 == hash) {
                remove(&whole)?;
            }
        }
        let left = files_left(&previous);
        if left.iter().all(|path| path == &previous.join(names::SUMMARY)) {
            remove(&previous)
        } else {
            self.set_aside(names::PREVIOUS).map(drop)
        }
    }

    /// Removes a node's record and files. What its record does not confirm was changed or written
    /// by somebody else: it is set aside; where to, for people.
    ///
    /// # Errors
    /// [`Error::Output`] when something cannot be removed or moved.
    pub(crate) fn clear(&self, node: NodeId) -> Result<Vec<PathBuf>, Error> {
        let record = self.record(node);
        let mut aside = Vec::new();
        for path in names::paths_of(node) {
            let whole = self.root.join(path);
            if !exists(&whole) {
                continue;
            }
            if path.starts_with('.') || self.confirms(record.as_ref(), path) {
                remove(&whole)?;
            } else {
                aside.push(self.set_aside(path)?);
            }
        }
        remove(&self.record_path(node))?;
        Ok(aside)
    }

    /// Removes what this program has just begun to leave for a node whose result could not be kept.
    pub(crate) fn undo(&self, node: NodeId) {
        for path in names::paths_of(node) {
            // What cannot be removed is set aside by the next run.
            let _kept = remove(&self.root.join(path));
        }
    }

    /// Whether all that lies at a path was written by the program and is unchanged.
    fn confirms(&self, record: Option<&Record>, path: &str) -> bool {
        let written = record.and_then(|r| r.files.iter().find(|file| file.path == path));
        written.is_some_and(|file| file.is_whole(&self.root))
            && !holds_others(&self.root.join(path))
    }

    /// Moves what lies at a path of the folder into one for what this program did not write; where
    /// it is now.
    pub(super) fn set_aside(&self, path: &str) -> Result<PathBuf, Error> {
        let free = (1..).map(|n| self.aside(n).join(path)).find(|to| !exists(to));
        let to = free.unwrap_or_else(|| self.aside(1).join(path));
        let moved = make_parent(&to).and_then(|()| fs::rename(self.root.join(path), &to));
        moved.map_err(|source| Error::Output { path: to.clone(), source })?;
        self.log(&serde_json::json!({ "event": "set aside", "path": path, "to": to }))?;
        Ok(to)
    }

    /// Removes what was set aside where the same was made again: a run that was killed had written
    /// it, and had not yet recorded that.
    ///
    /// # Errors
    /// [`Error::Output`] when it cannot be removed or logged.
    pub(super) fn drop_same(&self, made: &Written) -> Result<(), Error> {
        for folder in (1..).map(|n| self.aside(n)).take_while(|folder| exists(folder)) {
            let path = folder.join(&made.path);
            if !exists(&path) || holds_others(&path) || !made.is_whole(&folder) {
                continue;
            }
            remove(&path)?;
            // Folders that hold something else stay.
            let above = path.ancestors().skip(1).take_while(|above| *above != self.root);
            let _emptied = above.take_while(|above| fs::remove_dir(above).is_ok()).count();
            let path = &made.path;
            self.log(
                &serde_json::json!({ "event": "made again as it was set aside", "path": path }),
            )?;
        }
        Ok(())
    }

    /// Names of the folders that are there for what this program did not write.
    pub(super) fn set_aside_folders(&self) -> Vec<PathBuf> {
        let folders = (1..).map(|n| self.aside(n)).take_while(|folder| exists(folder));
        folders.filter_map(|folder| Some(folder.file_name()?.into())).collect()
    }

    /// The folders for what this program did not write, from 1 on.
    fn aside(&self, n: usize) -> PathBuf {
        let numbered = |n| format!("{}-{n}", names::SET_ASIDE);
        self.root.join(if n == 1 { names::SET_ASIDE.to_owned() } else { numbered(n) })
    }
}

/// Whether something is there, a link that leads nowhere too.
fn exists(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok()
}

fn make_parent(path: &Path) -> io::Result<()> {
    path.parent().map_or(Ok(()), fs::create_dir_all)
}

/// Whether a folder holds what no record counts: hidden files and links to folders. What this
/// program keeps beside its objects, and file managers beside anything, is nobody's.
fn holds_others(path: &Path) -> bool {
    let Ok(entries) = fs::read_dir(path) else { return false };
    entries.flatten().any(|entry| {
        let name = entry.file_name().to_string_lossy().into_owned();
        match entry.file_type() {
            _ if name == ".DS_Store" || name.starts_with(".supine-") => false,
            _ if name.starts_with('.') => true,
            Ok(kind) if kind.is_dir() => holds_others(&entry.path()),
            Ok(kind) if kind.is_symlink() => entry.path().is_dir(),
            Ok(_) => false,
            Err(_) => true,
        }
    })
}

/// All files below a folder, hidden ones too.
fn files_left(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let below = |entry: fs::DirEntry| match entry.file_type() {
        Ok(kind) if kind.is_dir() => files_left(&entry.path()),
        _ => vec![entry.path()],
    };
    entries.flatten().flat_map(below).collect()
}

/// The same file under a second name, or a copy of it where a file can have but one; of a folder,
/// of all its files but hidden ones.
fn link(from: &Path, to: &Path) -> io::Result<()> {
    if from.is_dir() {
        fs::create_dir_all(to)?;
        for entry in fs::read_dir(from)? {
            let entry = entry?;
            if !entry.file_name().to_string_lossy().starts_with('.') {
                link(&entry.path(), &to.join(entry.file_name()))?;
            }
        }
        return Ok(());
    }
    fs::hard_link(from, to).or_else(|_| fs::copy(from, to).map(drop))
}
