//! The folder of a run: the only place that knows the names of files.
//!
//! A node's result is there when its record holds the key that is asked for and its files are those
//! that were recorded. Before anything is made anew, all that no longer belongs is removed, so that
//! a folder never mixes results of two cases. Everything is written under a temporary name and
//! renamed.

mod changed;
mod cohort;
mod failed;
mod held;
mod lose_nothing;
mod names;
mod passing;
mod record;

pub(crate) use changed::changed_since;
pub(crate) use cohort::{CohortFolder, run_of, usable_name};
pub(crate) use failed::{failed_since, forget_failed, note_failed};
pub(crate) use held::{HeldResult, only_series};
pub(crate) use record::Record;

use crate::key::Key;
use crate::{Error, NodeId};
use record::Written;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use supine_report::Output;

/// The version of the layout. A folder of another version is made anew.
const FORMAT: &str = "3";

/// The folder of a run, held against others as long as it lives.
#[derive(Debug)]
pub struct RunFolder {
    root: PathBuf,
    overwrites: bool,
    _lock: File,
}

impl RunFolder {
    /// Opens or makes the folder.
    ///
    /// # Errors
    /// [`Error::Foreign`] when it holds something of a result's name that no run made,
    /// [`Error::Busy`] when somebody works in it, [`Error::Output`] when it cannot be written.
    pub fn open(root: &Path) -> Result<Self, Error> {
        let output = |source| Error::Output { path: root.into(), source };
        let records = root.join(names::RECORDS);
        if !records.exists() {
            refuse_within(root)?;
            refuse_foreign(root)?;
        }
        fs::create_dir_all(&records).map_err(output)?;
        let lock = File::create(root.join(names::LOCK)).map_err(output)?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(fs::TryLockError::WouldBlock) => return Err(Error::Busy { path: root.into() }),
            Err(fs::TryLockError::Error(e)) => return Err(output(e)),
        }
        let folder = Self { root: root.into(), overwrites: false, _lock: lock };
        folder.move_out()?;
        passing::sweep_run(root);
        if folder.former().next().is_none() {
            write_atomically(&root.join(names::FORMAT), FORMAT.as_bytes(), USERS)?;
        }
        Ok(folder)
    }

    /// The same, whose finished result may be replaced by that of another case.
    #[must_use]
    pub fn overwriting(mut self, overwrites: bool) -> Self {
        self.overwrites = overwrites;
        self
    }

    /// Whether its finished result may be replaced by that of another case.
    pub(crate) fn overwrites(&self) -> bool {
        self.overwrites
    }

    /// What another version left.
    fn former(&self) -> impl Iterator<Item = PathBuf> + '_ {
        let format = fs::read_to_string(self.root.join(names::FORMAT));
        let own = format.is_ok_and(|found| found == FORMAT);
        let all = names::all().chain(names::FORMER.iter().copied()).filter(move |_| !own);
        all.map(|path| self.root.join(path)).filter(|path| path.exists())
    }

    /// Whether it holds results of another version: they are set aside before the first result is
    /// written.
    pub fn is_former(&self) -> bool {
        self.former().next().is_some()
    }

    /// Sets aside what another version left.
    pub(crate) fn renew(&self) -> Result<(), Error> {
        if self.is_former() {
            let former: Vec<PathBuf> = self.former().collect();
            for path in &former {
                match path.strip_prefix(&self.root).ok().and_then(Path::to_str) {
                    Some(shown) if !shown.starts_with('.') => {
                        // A folder may have gone with the one that it lies in.
                        if path.exists() {
                            self.set_aside(shown)?;
                        }
                    }
                    _ => remove(path)?,
                }
            }
            write_atomically(&self.root.join(names::FORMAT), FORMAT.as_bytes(), USERS)?;
        }
        Ok(())
    }

    /// Where it is.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Where a node's files go.
    pub(crate) fn shelf(&self, node: NodeId) -> Shelf<'_> {
        Shelf { root: &self.root, node }
    }

    /// The record of a node whose result for this key is there with all its files.
    pub(crate) fn result(&self, node: NodeId, key: &Key) -> Option<Record> {
        let record = self.record(node).filter(|record| record.key == *key)?;
        record.files.iter().all(|file| file.is_whole(&self.root)).then_some(record)
    }

    fn record(&self, node: NodeId) -> Option<Record> {
        Record::read(&self.root, node.name())
    }

    fn record_path(&self, node: NodeId) -> PathBuf {
        record::path_of(&self.root, node.name())
    }

    /// Records a node as made, with the files that it left.
    pub(crate) fn keep(&self, node: NodeId, mut record: Record) -> Result<Record, Error> {
        for path in names::paths_of(node).filter(|p| self.root.join(p).exists()) {
            let output = |source| Error::Output { path: self.root.join(path), source };
            record.files.push(Written::of(&self.root, path).map_err(output)?);
        }
        write_atomically(&self.record_path(node), &record.to_file()?, USERS)?;
        record.files.iter().try_for_each(|made| self.drop_same(made))?;
        Ok(record)
    }

    /// Appends a line to the log.
    pub(crate) fn log(&self, line: &serde_json::Value) -> Result<(), Error> {
        let path = self.root.join(names::LOG);
        let output = |source| Error::Output { path: path.clone(), source };
        let mut file =
            fs::OpenOptions::new().create(true).append(true).open(&path).map_err(output)?;
        writeln!(file, "{line}").map_err(output)
    }

    /// The secret by which patients are taken out of exports, made on first use: the same patient
    /// keeps her pseudonym and UIDs when the run is repeated or more is carried. Whoever has it can
    /// test which patient this was.
    pub(crate) fn secret(&self) -> Result<[u8; 32], Error> {
        if let Some(known) = known_secret(&self.root)? {
            return Ok(known);
        }
        let made = crate::shared::random()?;
        self.keep_beside(names::SECRET, &made)?;
        Ok(made)
    }

    /// Writes the summary: the last file of a run. The result that it replaces goes with that.
    pub(crate) fn write_summary(&self, summary: &supine_report::Summary) -> Result<(), Error> {
        supine_report::write_summary(summary, &self.root.join(names::SUMMARY))?;
        forget_failed(&self.root)?;
        self.drop_previous()
    }

    /// Keeps the case of a de-identified run, whose summary names no files.
    pub(crate) fn keep_case(&self, case: &serde_json::Value) -> Result<(), Error> {
        self.keep_beside(names::CASE, &serde_json::to_vec_pretty(case)?)?;
        self.move_aside()?;
        if held::names_its_patient(&self.root) { self.move_sent() } else { Ok(()) }
    }

    /// Moves what was set aside out of the folder: what others wrote, and what a run before left
    /// beside it, may name the patient.
    fn move_aside(&self) -> Result<(), Error> {
        for name in self.set_aside_folders() {
            let beside = beside(&self.root)?;
            private(&beside).map_err(|source| Error::Output { path: beside.clone(), source })?;
            let numbered = (1..).map(|n| beside.join(format!("{}-{n}", names::SET_ASIDE)));
            let free = numbered.into_iter().find(|to| !to.exists()).unwrap_or(beside);
            fs::rename(self.root.join(&name), &free)
                .map_err(|source| Error::Output { path: free.clone(), source })?;
            self.log(&serde_json::json!({ "event": "moved out", "path": name }))?;
        }
        Ok(())
    }

    /// Moves the lists of objects that were sent from a result with the patient's name out of the
    /// folder: by their UIDs archives find her.
    fn move_sent(&self) -> Result<(), Error> {
        for name in names::SENT {
            let path = self.root.join(name);
            let output = |source| Error::Output { path: path.clone(), source };
            if path.is_file() {
                let bytes = fs::read(&path).map_err(output)?;
                self.keep_beside(&name.replace('/', "-"), &bytes)?;
                fs::remove_file(&path).map_err(output)?;
            }
        }
        Ok(())
    }

    /// Keeps what tells who the patient was beside the folder, for its owner alone.
    fn keep_beside(&self, name: &str, bytes: &[u8]) -> Result<(), Error> {
        let folder = beside(&self.root)?;
        private(&folder).map_err(|source| Error::Output { path: folder.clone(), source })?;
        write_atomically(&folder.join(name), bytes, OWNERS)
    }

    /// Moves what another version kept of the patient within the folder out of it.
    fn move_out(&self) -> Result<(), Error> {
        for name in [names::SECRET, names::CASE] {
            let within = self.root.join(names::WITHIN).join(name);
            if let Ok(bytes) = fs::read(&within) {
                self.keep_beside(name, &bytes)?;
                fs::remove_file(&within)
                    .map_err(|source| Error::Output { path: within, source })?;
            }
        }
        Ok(())
    }
}

/// The folder of the run that a file or folder is of, or that a link leads to.
pub(crate) fn run_around(path: &Path) -> Option<PathBuf> {
    let whole = fs::canonicalize(path).or_else(|_| std::path::absolute(path)).ok()?;
    // OUT, OUT/ct, OUT/ct/1.dcm.
    let run = whole.ancestors().take(3).find(|folder| is_run(folder))?;
    Some(run.to_path_buf())
}

/// Refuses a folder among what another run has made: two patients would share a series.
fn refuse_within(root: &Path) -> Result<(), Error> {
    if !is_result(root) {
        return Ok(());
    }
    let message =
        format!("{} lies among the results of another run: name another --out", root.display());
    Err(Error::Refused { kind: supine_space::Failure::Usage, message })
}

/// Whether a file or folder is one that the run in whose folder it lies has made, or holds some.
pub(crate) fn is_result(file: &Path) -> bool {
    let within = run_around(file).and_then(|run| Some(file.strip_prefix(run).ok()?.to_owned()));
    let shown = names::ARTIFACTS.iter().filter(|(_, _, path)| !path.starts_with('.'));
    let within = within.filter(|file| !file.as_os_str().is_empty());
    within.is_some_and(|file| {
        let is_part = |path: &Path| file.starts_with(path) || path.starts_with(&file);
        shown.into_iter().any(|(_, _, path)| is_part(Path::new(path)))
    })
}

/// The runs whose folders lie in a folder, however deep.
pub(crate) fn runs_within(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let mut runs = Vec::new();
    search(folder, DEEPEST, &mut runs)?;
    Ok(runs)
}

/// Folders deeper than this are not looked into: links may lead in a circle.
const DEEPEST: usize = 32;

fn search(folder: &Path, deeper: usize, found: &mut Vec<PathBuf>) -> Result<(), Error> {
    if !folder.is_dir() || deeper == 0 {
        return Ok(());
    }
    let missing = |source| Error::Missing { key: "paths", path: folder.into(), source };
    for entry in fs::read_dir(folder).map_err(missing)? {
        let path = entry.map_err(missing)?.path();
        match run_around(&path) {
            Some(run) => found.push(run),
            None => search(&path, deeper - 1, found)?,
        }
    }
    Ok(())
}

/// Whether a folder is that of a run, or a copy of one that lost its records.
fn is_run(folder: &Path) -> bool {
    let named = |summary: serde_json::Value| summary["tool"]["name"] == "supine";
    folder.join(names::RECORDS).is_dir() || summary_of(folder).is_some_and(named)
}

/// The summary in a run's folder as it stands; none of an unfinished run.
pub(crate) fn summary_of(run: &Path) -> Option<serde_json::Value> {
    serde_json::from_str(&fs::read_to_string(run.join(names::SUMMARY)).ok()?).ok()
}

/// The folder beside a run's, for what tells who the patient was.
fn beside(root: &Path) -> Result<PathBuf, Error> {
    let fail = |source| Error::Output { path: root.into(), source };
    let whole = std::path::absolute(root).map_err(fail)?;
    let Some(name) = whole.file_name() else {
        let message =
            "a de-identified run keeps its key beside its folder: name a folder in another one";
        return Err(fail(std::io::Error::other(message)));
    };
    let mut name = name.to_os_string();
    name.push(names::BESIDE);
    Ok(whole.with_file_name(name))
}

/// Makes a folder that its owner alone may read.
fn private(folder: &Path) -> std::io::Result<()> {
    let mut builder = fs::DirBuilder::new();
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder.recursive(true).create(folder)
}

/// The case that a de-identified run kept beside its folder.
pub(crate) fn kept_case(summary: &Path) -> Option<serde_json::Value> {
    let root = summary.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let path = beside(root).ok()?.join(names::CASE);
    serde_json::from_str(&fs::read_to_string(path).ok()?).ok()
}

/// The secret of the run in a folder; none when it is gone or never was.
///
/// # Errors
/// When it is there and cannot be read.
pub(crate) fn known_secret(root: &Path) -> Result<Option<[u8; 32]>, Error> {
    let path = beside(root)?.join(names::SECRET);
    match fs::read(&path) {
        Ok(bytes) => Ok(bytes.try_into().ok()),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(Error::Output { path, source }),
    }
}

/// What a finished run left, for those who only read. It may have been left by a version before.
#[derive(Clone, Debug)]
pub struct FinishedRun {
    root: PathBuf,
}

impl FinishedRun {
    /// The run in a folder.
    ///
    /// # Errors
    /// [`Error::Unfinished`] when there is none.
    pub fn open(root: &Path) -> Result<Self, Error> {
        let run = Self { root: root.into() };
        if run.deformed().is_file() {
            Ok(run)
        } else {
            Err(Error::Unfinished { path: root.into() })
        }
    }

    fn path(&self, node: NodeId, artifact: &str) -> PathBuf {
        self.root.join(names::path_of(node, artifact))
    }

    /// The mesh with its displacement.
    pub(crate) fn deformed(&self) -> PathBuf {
        self.path(NodeId::Solve, "deformed")
    }

    /// Why that mesh is not the one that the run left, as far as a summary tells.
    pub(crate) fn changed_mesh(&self) -> Option<String> {
        let path = names::path_of(NodeId::Solve, "deformed");
        changed::changed_file(&self.root, &summary_of(&self.root)?, path)
    }

    /// The labels.
    pub(crate) fn labels(&self) -> PathBuf {
        self.path(NodeId::Segment, "labels")
    }

    /// Skin and chest wall between the voxels.
    pub(crate) fn surfaces(&self) -> PathBuf {
        self.path(NodeId::Segment, "surfaces")
    }

    /// The deformed CT: a series, or a volume.
    pub(crate) fn ct(&self) -> Option<PathBuf> {
        let all = [self.path(NodeId::Export, "volume"), self.path(NodeId::Export, "series")];
        all.into_iter().find(|path| path.exists())
    }

    /// The exported series, where there is one.
    pub(crate) fn series(&self) -> Option<PathBuf> {
        Some(self.path(NodeId::Export, "series")).filter(|path| path.is_dir())
    }

    /// The registration of the series with the CT.
    pub(crate) fn registration(&self) -> PathBuf {
        self.path(NodeId::Registration, "registrations").join("deformable.dcm")
    }

    /// The sphere that it modelled, LPS, mm; of a run of the version before too.
    ///
    /// # Errors
    /// [`Error::Unfinished`] when its summary does not say it.
    pub(crate) fn region(&self) -> Result<supine_space::Sphere, Error> {
        let text = fs::read_to_string(self.root.join(names::SUMMARY)).unwrap_or_default();
        let summary: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
        let region = summary.pointer("/parameters/region").cloned().unwrap_or_default();
        let unfinished = || Error::Unfinished { path: self.root.clone() };
        let read: supine_report::RegionParameters =
            serde_json::from_value(region).map_err(|_| unfinished())?;
        let centre = supine_space::Point::from(read.centre_mm);
        supine_space::Sphere::new(centre, read.radius_mm).map_err(|_| unfinished())
    }

    /// Its summary.
    ///
    /// # Errors
    /// [`Error::Unfinished`] when there is none that this version understands.
    pub fn summary(&self) -> Result<supine_report::Summary, Error> {
        let unfinished = || Error::Unfinished { path: self.root.clone() };
        let text = fs::read_to_string(self.root.join(names::SUMMARY)).map_err(|_| unfinished())?;
        serde_json::from_str(&text).map_err(|_| unfinished())
    }

    /// Whether what it left is what a session makes of its case, with the same inputs and methods.
    ///
    /// # Errors
    /// When there is no summary, or an input cannot be read.
    pub fn is_of(&self, session: &crate::Session) -> Result<bool, Error> {
        let left = self.summary()?.chain;
        Ok(session.redone(&left, self.secret()?)?.is_empty())
    }

    /// Whether its files still are what it recorded.
    pub(crate) fn is_whole(&self, chain: &[supine_report::Link]) -> bool {
        chain.iter().all(|link| {
            let record = Record::read(&self.root, &link.stage).filter(|r| r.key == link.key);
            record.is_some_and(|record| record.files.iter().all(|file| file.is_whole(&self.root)))
        })
    }

    /// The secret that took the patient out, while it is there.
    ///
    /// # Errors
    /// When it cannot be read.
    pub(crate) fn secret(&self) -> Result<Option<[u8; 32]>, Error> {
        known_secret(&self.root)
    }
}

/// Where the files of one node go.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shelf<'a> {
    root: &'a Path,
    node: NodeId,
}

impl Shelf<'_> {
    /// Where an artifact goes; its parent folder is made.
    pub(crate) fn place(&self, artifact: &'static str) -> Result<PathBuf, Error> {
        let path = self.path(artifact);
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent)
                .map_err(|source| Error::Output { path: path.clone(), source })?;
        }
        Ok(path)
    }

    /// Has the folder of an artifact filled under a passing name and puts it in its place, which
    /// must be free.
    pub(crate) fn fill<T>(
        &self,
        artifact: &'static str,
        write: impl FnOnce(&Path) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let path = self.place(artifact)?;
        let output = |source| Error::Output { path: path.clone(), source };
        let mut builder = tempfile::Builder::new();
        builder.prefix(".supine-");
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
        let passing = builder.tempdir_in(path.parent().unwrap_or(self.root)).map_err(output)?;
        let written = write(passing.path())?;
        fs::rename(passing.path(), &path).map_err(output)?;
        // It has moved away: there is nothing left to delete.
        let _moved = passing.keep();
        Ok(written)
    }

    /// Where an artifact lies.
    pub(crate) fn path(&self, artifact: &'static str) -> PathBuf {
        self.root.join(names::path_of(self.node, artifact))
    }

    /// The name that the summary gives an artifact.
    pub(crate) fn name(&self, artifact: &'static str) -> &'static str {
        names::path_of(self.node, artifact)
    }
}

/// The visible files of a record, as the summary lists them.
pub(crate) fn visible(record: &Record) -> impl Iterator<Item = Output> + '_ {
    let shown = record.files.iter().filter(|file| !file.path.starts_with('.'));
    shown.map(|file| Output { path: file.path.clone(), blake3: file.blake3.clone() })
}

/// A folder that no run made may hold nothing that a run would replace.
fn refuse_foreign(root: &Path) -> Result<(), Error> {
    match names::all().map(|p| root.join(p)).find(|p| p.exists()) {
        Some(path) => Err(Error::Foreign { path }),
        None => Ok(()),
    }
}

/// A path from the root of the disk. That of a file without a folder, as it is typed where it lies,
/// is nothing.
pub(crate) fn whole(path: &Path) -> PathBuf {
    let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
    std::path::absolute(path).unwrap_or_else(|_| path.into())
}

/// The path without links, as far as it exists.
fn resolve(path: &Path) -> PathBuf {
    let path = whole(path);
    let known = path.ancestors().find_map(|a| Some((a, a.canonicalize().ok()?)));
    match known {
        Some((ancestor, real)) => match path.strip_prefix(ancestor) {
            Ok(rest) if !rest.as_os_str().is_empty() => real.join(rest),
            _ => real,
        },
        None => path,
    }
}

/// Where labels of the user's own lie in a run's folder.
pub(crate) fn own_labels(root: &Path) -> PathBuf {
    root.join(names::OWN_LABELS)
}

/// Whether the finished run in a folder read this very file: by the hash in its summary.
pub(crate) fn was_read(root: &Path, file: &Path) -> bool {
    let (Some(summary), Ok(found)) = (summary_of(root), crate::inputs::hash_of(file)) else {
        return false;
    };
    let inputs = summary["inputs"].as_array();
    inputs.is_some_and(|all| all.iter().any(|input| input["blake3"] == found.blake3))
}

/// Refuses an input that lies where the run writes: it would be lost.
pub(crate) fn refuse_overlap(root: &Path, key: &'static str, input: &Path) -> Result<(), Error> {
    let (root, input) = (resolve(root), resolve(input));
    let mut written = names::all().map(|p| root.join(p));
    let overlap =
        root.starts_with(&input) || written.any(|p| input.starts_with(&p) || p.starts_with(&input));
    if overlap { Err(Error::Overlap { key, path: input }) } else { Ok(()) }
}

/// Who may read a file: whom the user's umask lets, or its owner alone.
pub const USERS: u32 = 0o666;
const OWNERS: u32 = 0o600;

/// Writes a file under a temporary name beside it, then renames; `mode`: who may read it.
///
/// # Errors
/// [`Error::Output`].
#[cfg_attr(not(unix), expect(unused_variables, reason = "`mode` is one of Unix"))]
pub fn write_atomically(path: &Path, bytes: &[u8], mode: u32) -> Result<(), Error> {
    let output = |source| Error::Output { path: path.into(), source };
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let mut builder = tempfile::Builder::new();
    builder.prefix(".supine-").suffix(".part");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(mode));
    let mut file = builder.tempfile_in(folder.unwrap_or(Path::new("."))).map_err(output)?;
    file.write_all(bytes).map_err(output)?;
    file.persist(path).map_err(|e| output(e.error))?;
    Ok(())
}

fn remove(path: &Path) -> Result<(), Error> {
    let removed = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
    match removed {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
            Err(Error::Output { path: path.into(), source: e })
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests;
