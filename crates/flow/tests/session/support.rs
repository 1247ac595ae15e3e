//! The patient of these tests: the middle slices of the fixture, a small sphere, a coarse mesh.
//! Where the size of her CT is not what is tested, its pixels are three times as wide. With some
//! other widths (two and four) a change of the tumour's place moved the nipple, and what must be
//! left alone was made again.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::{LazyLock, Mutex};
use supine_flow::{NodeId, Observer, Options, Request, RunFolder, Session, Spec, read_ct};
use supine_space::Progress;
use supine_volume::Ct;

/// The fixture's slices that hold the breast.
const SLICES: std::ops::Range<usize> = 26..70;
/// Pixels of the fixture across one of the coarse patient: 85 x 85 of 4.5 mm.
const WIDER: usize = 3;
/// What is added to stored values to have HU.
const INTERCEPT: i32 = -1024;

/// The content of files by their path in a folder.
pub(crate) type Files = BTreeMap<String, Vec<u8>>;

/// The text of the patient's case; her CT, made coarser, is written into the folder.
pub(crate) fn patient(folder: &Path) -> String {
    static COARSE: LazyLock<Files> = LazyLock::new(coarse);
    write_all(&folder.join("ct"), &COARSE);
    case()
}

/// The same with a finished run in `out`.
pub(crate) fn finished_patient(folder: &Path) -> String {
    static FIRST: LazyLock<Files> = LazyLock::new(|| read_all(&first_run()));
    write_all(&folder.join("out"), &FIRST);
    patient(folder)
}

/// The patient's finished run, equal to a second one: whichever process of this test program needs
/// it first makes both.
fn first_run() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("session");
    std::fs::create_dir_all(&folder).unwrap();
    let lock = File::create(folder.join("lock")).unwrap();
    lock.lock().unwrap();
    let (out, complete) = (folder.join("out"), folder.join("complete"));
    let program = std::env::current_exe().unwrap();
    let written = std::fs::metadata(&program).unwrap().modified().unwrap();
    let by = format!("{} {written:?}", program.display());
    if std::fs::read_to_string(&complete).is_ok_and(|text| text == by) {
        return out;
    }
    let _none_yet = std::fs::remove_dir_all(&out);
    let again = tempfile::tempdir().unwrap();
    let case = patient(again.path());
    for to in [&out, &again.path().join("out")] {
        run(&case, again.path(), to).unwrap();
    }
    assert_same("the first run", &again.path().join("out"), &out);
    std::fs::write(complete, by).unwrap();
    out
}

/// The text of the case; her CT is written as the fixture has it.
pub(crate) fn full_size_patient(folder: &Path) -> String {
    write_all(&folder.join("ct"), &slices());
    case()
}

fn slices() -> Files {
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/patient/ct");
    read_all(&fixture).into_iter().skip(SLICES.start).take(SLICES.len()).collect()
}

fn coarse() -> Files {
    let dir = tempfile::tempdir().unwrap();
    full_size_patient(dir.path());
    let ct = read_ct(&dir.path().join("ct"), &Default::default(), Progress::none()).unwrap().ct;
    // From the feet up, as the files are numbered.
    let slices = slices().into_iter().enumerate();
    slices.map(|(k, (name, file))| (name, coarser(file, &ct, k))).collect()
}

/// A slice whose pixels are the means of squares of those of the CT, uncompressed; all else that it
/// tells stays.
fn coarser(mut file: Vec<u8>, ct: &Ct, k: usize) -> Vec<u8> {
    let grid = ct.grid();
    let [n, middle] = [grid.size()[0] / WIDER, WIDER - 1];
    let corner = grid.patient_from_index([0.5 * middle as f64, 0.5 * middle as f64, k as f64]);
    let width = grid.spacing().x * WIDER as f64;
    let mut set = |tag, kind, text: &[u8]| {
        let value = value(&mut file, tag, kind);
        value.fill(b' ');
        value[..text.len()].copy_from_slice(text);
    };
    set(0x0002_0010, b"UI", b"1.2.840.10008.1.2.1\0");
    set(0x0028_0010, b"US", &(n as u16).to_le_bytes());
    set(0x0028_0011, b"US", &(n as u16).to_le_bytes());
    set(0x0028_0030, b"DS", format!("{width}\\{width}").as_bytes());
    let corner = format!("{:.2}\\{:.2}\\{}", corner.x, corner.y, corner.z);
    set(0x0020_0032, b"DS", corner.as_bytes());
    file.truncate(element(&file, 0x7fe0_0010, b"OB"));
    file.extend(b"\xe0\x7f\x10\0OW\0\0");
    file.extend((2 * n as u32 * n as u32).to_le_bytes());
    for [j, i] in (0..n * n).map(|at| [at / n * WIDER, at % n * WIDER]) {
        let square = (0..WIDER * WIDER).map(|m| ct.at([i + m % WIDER, j + m / WIDER, k]));
        let sum: i32 = square.map(|hu| i32::from(hu) - INTERCEPT).sum();
        file.extend(((sum as usize / (WIDER * WIDER)) as u16).to_le_bytes());
    }
    file
}

/// Where an element of a file begins whose values are written with their kind.
fn element(file: &[u8], tag: u32, kind: &[u8; 2]) -> usize {
    let [group, element] = [(tag >> 16) as u16, tag as u16].map(u16::to_le_bytes);
    let head = [&group[..], &element, kind].concat();
    file.windows(head.len()).position(|window| window == head).unwrap()
}

/// The value of an element with a short length.
pub(crate) fn value<'a>(file: &'a mut [u8], tag: u32, kind: &[u8; 2]) -> &'a mut [u8] {
    let at = element(file, tag, kind) + 8;
    let length = u16::from_le_bytes([file[at - 2], file[at - 1]]);
    &mut file[at..at + usize::from(length)]
}

/// Writes files, and the folders they lie in.
pub(crate) fn write_all(folder: &Path, files: &Files) {
    for (name, bytes) in files {
        let path = folder.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
}

fn case() -> String {
    "ct = \"ct\"\nbreast = \"left\"\ntable = { ap = 7.0, lat = 5.0 }\n\
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
    let session = session(case, base, out)?;
    supine_flow::run(&session, Options::default(), &seen).map_err(|e| e.to_string())?;
    Ok(seen.made())
}

/// The same up to the report and its pictures, which are most of a small run.
pub(crate) fn run_stages(case: &str, base: &Path, out: &Path) -> Result<Vec<NodeId>, String> {
    let seen = Seen::default();
    let last = [NodeId::Pictures, NodeId::Report, NodeId::ReportObject];
    let stages: Vec<_> = NodeId::ALL.into_iter().filter(|node| !last.contains(node)).collect();
    let request = Request { observer: &seen, drops: true, ..Request::default() };
    session(case, base, out)?.update(&stages, &request).map_err(|e| e.to_string())?;
    Ok(seen.made())
}

fn session(case: &str, base: &Path, out: &Path) -> Result<Session, String> {
    let spec = Spec::from_text(case, base).map_err(|e| e.to_string())?;
    let session = Session::new(spec, 2).map_err(|e| e.to_string())?;
    let folder = RunFolder::open(out).map_err(|e| e.to_string())?;
    session.with_folder(folder).map_err(|e| e.to_string())
}

/// Every file of a run with its content, but what differs from run to run.
pub(crate) fn results(out: &Path) -> Files {
    let mut files = read_all(out);
    files.retain(|name, _| name != "log.jsonl" && !name.starts_with(".stages/"));
    let summary = files.get_mut("summary.json").expect("a finished run has a summary");
    let mut read: serde_json::Value = serde_json::from_slice(summary).unwrap();
    read.as_object_mut().unwrap().remove("run");
    *summary = serde_json::to_vec_pretty(&read).unwrap();
    files
}

/// All files of a folder and of those below it.
pub(crate) fn read_all(folder: &Path) -> Files {
    let mut files = Files::new();
    let mut open = vec![folder.to_owned()];
    while let Some(path) = open.pop() {
        if path.is_dir() {
            open.extend(std::fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path()));
        } else {
            let name = path.strip_prefix(folder).unwrap().to_string_lossy().into_owned();
            files.insert(name, std::fs::read(&path).unwrap());
        }
    }
    files
}

/// Says which files of two runs differ.
pub(crate) fn assert_same(what: &str, kept: &Path, cold: &Path) {
    same_files(what, &results(kept), &results(cold));
}

/// Says which files of the stages before the report differ, or their records: keys, facts,
/// warnings.
pub(crate) fn assert_same_stages(what: &str, kept: &Path, cold: &Path) {
    let apart = ["log.jsonl", "previous/", ".stages/pictures", ".stages/report"];
    let [kept, cold] = [kept, cold].map(|out| {
        let mut files = read_all(out);
        files.retain(|name, _| !apart.iter().any(|start| name.starts_with(start)));
        let is_record = |name: &str| name.starts_with(".stages/") && name.ends_with(".json");
        files.iter_mut().filter(|(name, _)| is_record(name)).for_each(|(_, file)| {
            let kept: serde_json::Value = serde_json::from_slice(file).unwrap();
            let mut record = kept["record"].clone();
            // Its files are looked at themselves; that it knows their times differs.
            record.as_object_mut().unwrap().remove("files").unwrap();
            *file = serde_json::to_vec(&record).unwrap();
        });
        files
    });
    same_files(what, &kept, &cold);
}

fn same_files(what: &str, kept: &Files, cold: &Files) {
    let names = |all: &Files| all.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(kept), names(cold), "{what}: the files of a changed run and of a cold one");
    let differing: Vec<&String> =
        kept.iter().filter(|(name, bytes)| cold[*name] != **bytes).map(|(name, _)| name).collect();
    assert!(differing.is_empty(), "{what}: differ from a cold run: {differing:?}");
}
