//! A small patient: the middle slices of the fixture, a small sphere, a coarse mesh.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use supine_flow::{NodeId, Observer, Options, RunFolder, Session, Spec};

/// The fixture's slices that hold the breast.
const SLICES: std::ops::Range<usize> = 26..70;

fn fixture() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/patient")
}

/// Copies the patient into a folder; the text of her case.
pub(crate) fn patient(folder: &Path) -> String {
    let ct = folder.join("ct");
    std::fs::create_dir_all(&ct).unwrap();
    let mut slices: Vec<_> =
        std::fs::read_dir(fixture().join("ct")).unwrap().map(|e| e.unwrap().path()).collect();
    slices.sort();
    for slice in &slices[SLICES] {
        std::fs::copy(slice, ct.join(slice.file_name().unwrap())).unwrap();
    }
    "ct = \"ct\"\nbreast = \"left\"\nbed = { ap = 7.0, lat = 5.0 }\n\
     tumour = { centre = [91.37, -248.09, -594.5], radius = 9.0 }\n\
     region = { centre = [91.0, -235.0, -594.5], radius = 55.0 }\n\
     mesh = { tetrahedra = 500, order = 1 }\n"
        .into()
}

/// Sees which nodes were made.
#[derive(Default)]
pub(crate) struct Seen {
    pub(crate) ended: Mutex<BTreeMap<NodeId, bool>>,
    /// Ends the work when this many shares were told.
    pub(crate) patience: Option<std::sync::atomic::AtomicI64>,
}

impl Seen {
    pub(crate) fn made(&self) -> Vec<NodeId> {
        let ended = self.ended.lock().unwrap();
        ended.iter().filter(|(_, cached)| !**cached).map(|(node, _)| *node).collect()
    }
}

impl Observer for Seen {
    fn end(&self, node: NodeId, _: f64, cached: bool) {
        self.ended.lock().unwrap().insert(node, cached);
    }

    fn go_on(&self) -> bool {
        use std::sync::atomic::Ordering;
        self.patience.as_ref().is_none_or(|left| left.fetch_sub(1, Ordering::SeqCst) > 0)
    }
}

/// Runs a case into a folder; what was made.
pub(crate) fn run(case: &str, base: &Path, out: &Path) -> Result<Vec<NodeId>, String> {
    let seen = Seen::default();
    let spec = Spec::from_text(case, base).map_err(|e| e.to_string())?;
    let session = Session::new(spec, 2).map_err(|e| e.to_string())?;
    let folder = RunFolder::open(out).map_err(|e| e.to_string())?;
    let session = session.with_folder(folder).map_err(|e| e.to_string())?;
    supine_flow::run(&session, Options::default(), &seen).map_err(|e| e.to_string())?;
    Ok(seen.made())
}

/// Every file of a run with its content, but what differs from run to run.
pub(crate) fn results(out: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    collect(out, out, &mut files);
    let summary = files.get_mut("summary.json").expect("a finished run has a summary");
    let mut read: serde_json::Value = serde_json::from_slice(summary).unwrap();
    read.as_object_mut().unwrap().remove("run");
    *summary = serde_json::to_vec_pretty(&read).unwrap();
    files
}

fn collect(root: &Path, folder: &Path, files: &mut BTreeMap<String, Vec<u8>>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.strip_prefix(root).unwrap().to_string_lossy().into_owned();
        if path.is_dir() && name != ".stages" {
            collect(root, &path, files);
        } else if path.is_file() && name != "log.jsonl" {
            files.insert(name, std::fs::read(&path).unwrap());
        }
    }
}

/// Says which files differ.
pub(crate) fn assert_same(what: &str, kept: &Path, cold: &Path) {
    let (kept, cold) = (results(kept), results(cold));
    let names = |all: &BTreeMap<String, Vec<u8>>| all.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&kept), names(&cold), "{what}: the files of a changed run and of a cold one");
    let differing: Vec<&String> =
        kept.iter().filter(|(name, bytes)| cold[*name] != **bytes).map(|(name, _)| name).collect();
    assert!(differing.is_empty(), "{what}: differ from a cold run: {differing:?}");
}
