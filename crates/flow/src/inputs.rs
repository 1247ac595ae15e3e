//! The files that a result is made from: what they hold, by hash, of exactly the files that the
//! readers read.

use crate::Error;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::UNIX_EPOCH;
use supine_exchange::{is_volume_name, volume_files};
use supine_report::Input;

/// A file or folder that a node reads.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct InputFile {
    /// Which key of the case names it.
    pub(crate) key: &'static str,
    /// Where it is: does not decide a result.
    #[serde(skip)]
    pub(crate) path: PathBuf,
    /// What its name ends with: decides how it is read.
    form: String,
    /// Name of the file where a reader takes it for what the file holds (seeds of a tissue); else
    /// empty.
    name: String,
    files: usize,
    blake3: String,
    #[serde(skip)]
    stamp: Stamp,
}

impl InputFile {
    /// The hash of its content.
    pub(crate) fn hash(&self) -> &str {
        &self.blake3
    }

    /// Its entry in the summary; `role` says what it served for.
    pub(crate) fn told(&self, role: &str) -> Input {
        let (form, blake3) = (self.form.clone(), self.blake3.clone());
        Input { role: role.into(), form, files: self.files, blake3 }
    }

    /// That its files are still those that were hashed: asked after they were read.
    ///
    /// # Errors
    /// [`Error::Changed`].
    pub(crate) fn check_unchanged(&self) -> Result<(), Error> {
        let now = files_of(&self.path, self.key == "ct")
            .and_then(|files| Stamp::of(&files))
            .map_err(|source| missing(self.key, &self.path, source))?;
        if now == self.stamp {
            Ok(())
        } else {
            Err(Error::Changed { key: self.key, path: self.path.clone() })
        }
    }
}

/// Size and times of files, as the system keeps them: the same stamp, the same bytes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Stamp(Vec<(PathBuf, [u128; 3])>);

impl Stamp {
    pub(crate) fn of(files: &[PathBuf]) -> std::io::Result<Self> {
        let one = |path: &PathBuf| Ok((path.clone(), times(&std::fs::metadata(path)?)));
        files.iter().map(one).collect::<std::io::Result<_>>().map(Self)
    }
}

/// Size, time of modification and, where the system keeps it, of the last change of the entry,
/// which no program can set back.
pub(crate) fn times(meta: &std::fs::Metadata) -> [u128; 3] {
    let modified = meta.modified().ok().and_then(|t| t.duration_since(UNIX_EPOCH).ok());
    #[cfg(unix)]
    let changed = {
        use std::os::unix::fs::MetadataExt;
        meta.ctime() as u128 * 1_000_000_000 + meta.ctime_nsec() as u128
    };
    #[cfg(not(unix))]
    let changed = 0;
    [meta.len().into(), modified.map_or(0, |t| t.as_nanos()), changed]
}

/// Hashes of files, kept as long as their stamps stay.
#[derive(Debug, Default)]
pub(crate) struct Inputs(Mutex<BTreeMap<PathBuf, (Stamp, Hashed)>>);

impl Inputs {
    /// The file or folder that a key of the case names.
    ///
    /// # Errors
    /// [`Error::Missing`] when it is not there.
    pub(crate) fn file(&self, key: &'static str, path: &Path) -> Result<InputFile, Error> {
        let fail = |source| missing(key, path, source);
        std::fs::metadata(path).map_err(fail)?;
        let files = files_of(path, key == "ct").map_err(fail)?;
        let stamp = Stamp::of(&files).map_err(fail)?;
        let hashed = self.hashed(path, &files, &stamp).map_err(fail)?;
        let form = form(path);
        // The name of a CT or of a folder of it says nothing of what it holds.
        let name = match path.file_name() {
            Some(name) if key == "seeds.file" => name.to_string_lossy().to_lowercase(),
            _ => String::new(),
        };
        let (path, blake3) = (path.to_owned(), hashed.blake3);
        Ok(InputFile { key, path, form, name, files: hashed.files, blake3, stamp })
    }

    fn hashed(&self, path: &Path, files: &[PathBuf], stamp: &Stamp) -> std::io::Result<Hashed> {
        let known = |map: &BTreeMap<PathBuf, (Stamp, Hashed)>| {
            map.get(path).filter(|(at, _)| at == stamp).map(|(_, hashed)| hashed.clone())
        };
        if let Some(hashed) = self.0.lock().ok().and_then(|map| known(&map)) {
            return Ok(hashed);
        }
        let hashed = hash_files(root_of(path), files)?;
        if let Ok(mut map) = self.0.lock() {
            map.insert(path.to_owned(), (stamp.clone(), hashed.clone()));
        }
        Ok(hashed)
    }
}

fn missing(key: &'static str, path: &Path, source: std::io::Error) -> Error {
    Error::Missing { key, path: path.into(), source }
}

/// The folder that names are relative to.
fn root_of(path: &Path) -> &Path {
    if path.is_dir() { path } else { path.parent().unwrap_or(Path::new("")) }
}

/// The files that are read when a path is named; of one DICOM file of a CT, those of its folder; of
/// a header whose samples lie beside it (`.mhd`), both.
fn files_of(path: &Path, ct: bool) -> std::io::Result<Vec<PathBuf>> {
    match path.is_file() {
        _ if ct && !is_volume_name(path) => {
            supine_dicom::source_files(path).map_err(std::io::Error::other)
        }
        true => volume_files(path),
        false => files_below(path),
    }
}

/// Hash of some files.
#[derive(Clone, Debug)]
pub(crate) struct Hashed {
    /// Number of files.
    pub(crate) files: usize,
    /// blake3 in hexadecimal; of several: of their names and hashes in order.
    pub(crate) blake3: String,
}

/// The hash of a file, or of all files below a folder, but hidden ones.
pub(crate) fn hash_of(path: &Path) -> std::io::Result<Hashed> {
    if path.is_file() {
        return hash_files(root_of(path), &[path.to_owned()]);
    }
    hash_files(path, &files_below(path)?)
}

fn hash_files(root: &Path, files: &[PathBuf]) -> std::io::Result<Hashed> {
    use rayon::prelude::*;
    if let [one] = files
        && (one.parent() == Some(root) || one == root)
    {
        return Ok(Hashed { files: 1, blake3: hash_file(one)? });
    }
    let hashes: Vec<String> =
        files.par_iter().map(|file| hash_file(file)).collect::<std::io::Result<_>>()?;
    let mut hasher = blake3::Hasher::new();
    for (file, hash) in files.iter().zip(hashes) {
        let name = file.strip_prefix(root).unwrap_or(file).to_string_lossy().into_owned();
        hasher.update(name.as_bytes()).update(b"\0").update(hash.as_bytes());
    }
    Ok(Hashed { files: files.len(), blake3: hasher.finalize().to_hex().to_string() })
}

fn hash_file(path: &Path) -> std::io::Result<String> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(std::fs::File::open(path)?)?;
    Ok(hasher.finalize().to_hex().to_string())
}

/// Deepest nesting of input folders that is followed.
const MAX_DEPTH: usize = 8;

/// All files below a folder in order of name; hidden ones and folders that must not be read left
/// out, links to folders not followed.
pub(crate) fn files_below(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    collect(folder, MAX_DEPTH, &mut files)?;
    files.sort();
    Ok(files)
}

fn collect(folder: &Path, depth: usize, files: &mut Vec<PathBuf>) -> std::io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        // Hidden files are no data: the record of `supine send`, what a file manager leaves.
        if entry.file_name().to_string_lossy().starts_with('.') {
            continue;
        }
        let kind = entry.file_type()?;
        if kind.is_dir() && depth > 0 {
            match collect(&entry.path(), depth - 1, files) {
                Err(error) if error.kind() == std::io::ErrorKind::PermissionDenied => {}
                below => below?,
            }
        } else if kind.is_file() || (kind.is_symlink() && entry.path().is_file()) {
            files.push(entry.path());
        }
    }
    Ok(())
}

/// What an input is, without its name: sites name files and folders after patients.
fn form(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    let known =
        [".seg.nrrd", ".nrrd", ".nii.gz", ".nii", ".mha", ".mhd", ".mrk.json", ".csv", ".dcm"];
    match known.iter().find(|end| name.ends_with(**end)) {
        _ if path.is_dir() => "folder".into(),
        Some(end) => (*end).into(),
        None => "file".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn key_of(input: &InputFile) -> String {
        serde_json::to_string(input).unwrap()
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
    fn the_samples_beside_a_header_count() {
        let dir = tempfile::tempdir().unwrap();
        let [header, samples] = ["ct.mhd", "ct.raw"].map(|name| dir.path().join(name));
        fs::write(&header, "ObjectType = Image\nElementDataFile = ct.raw\n").unwrap();
        fs::write(&samples, "a").unwrap();
        let inputs = Inputs::default();
        let before = inputs.file("ct", &header).unwrap();
        assert_eq!((before.files, before.form.as_str()), (2, ".mhd"));
        fs::write(&samples, "bb").unwrap();
        assert!(before.check_unchanged().is_err());
        assert_ne!(key_of(&before), key_of(&inputs.file("ct", &header).unwrap()));
    }

    #[test]
    fn a_file_of_a_series_stands_for_its_folder() {
        let dir = tempfile::tempdir().unwrap();
        let [named, other] = ["IM0001", "IM0002"].map(|name| dir.path().join(name));
        fs::write(&named, "a").unwrap();
        fs::write(&other, "b").unwrap();
        let inputs = Inputs::default();
        let before = inputs.file("ct", &named).unwrap();
        assert_eq!(before.files, 2);
        fs::write(&other, "c").unwrap();
        let after = inputs.file("ct", &named).unwrap();
        assert_ne!(key_of(&before), key_of(&after), "the reader reads the whole folder");
        assert!(before.check_unchanged().is_err() && after.check_unchanged().is_ok());
    }

    #[test]
    fn where_a_file_lies_does_not_count_but_what_its_name_says_does() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("Mrs X");
        fs::create_dir(&folder).unwrap();
        let at = |path: &str| {
            let path = dir.path().join(path);
            fs::write(&path, "p,1,2,3").unwrap();
            path
        };
        let inputs = Inputs::default();
        let key = |role, path: &str| key_of(&inputs.file(role, &at(path)).unwrap());
        assert_eq!(key("seeds.file", "chest_wall.csv"), key("seeds.file", "Mrs X/chest_wall.csv"));
        assert_ne!(key("seeds.file", "chest_wall.csv"), key("seeds.file", "soft_tissue.csv"));
        assert_eq!(key("carry.points", "a.csv"), key("carry.points", "Mrs X/b.csv"));
    }
}
