//! Every parameter, and every input file's bytes, changed in a finished run: the result equals that
//! of a cold run to the byte, and what the change does not reach is not made again.

use crate::support::{
    assert_same, assert_same_stages, finished_patient, full_size_patient, patient, run, run_stages,
    value as dicom_value,
};
use std::fs;
use std::path::{Path, PathBuf};
use supine_flow::NodeId;
use supine_flow::spec::{Edit, TABLE, edit};

/// What a change must leave alone.
const NOTHING: &[NodeId] = &[];
const LABELS: &[NodeId] = &[NodeId::Segment];
const MESH: &[NodeId] = &[NodeId::Segment, NodeId::Region, NodeId::Mesh];
/// The sphere is found or checked again; what rests on it knows it by where it is.
const SPHERE: &[NodeId] = &[NodeId::Segment, NodeId::Mesh, NodeId::Solve, NodeId::Fields];
const SOLUTION: &[NodeId] =
    &[NodeId::Segment, NodeId::Region, NodeId::Mesh, NodeId::Solve, NodeId::Fields];
const SERIES: &[NodeId] = &[
    NodeId::Segment,
    NodeId::Region,
    NodeId::Mesh,
    NodeId::Solve,
    NodeId::Fields,
    NodeId::Export,
    NodeId::Registration,
];

/// A key, another value for it as TOML, and what that leaves alone.
type Change<'a> = (&'a str, &'a str, &'a [NodeId]);

/// How far a change is followed. The report takes up the whole case and is written anew after any
/// change, so that it cannot be an old one: it is compared where a change reaches little else, and
/// at the end of each walk.
#[derive(Clone, Copy)]
enum To {
    Stages,
    Report,
}

/// Every key: what comes before the tissue, the tissue, and what comes after. A key with several
/// rows is changed several times.
const CHANGES: [&[Change<'_>]; 3] = [GEOMETRY, TISSUE, RESULTS];

const GEOMETRY: &[Change<'_>] = &[
    ("ct", "\"ct/IM0040\"", NOTHING),
    ("series", "\"UID\"", NOTHING),
    ("exclude", "\"IM0027\"", NOTHING),
    ("exclude", "", NOTHING),
    ("position", "\"upright\"", NOTHING),
    ("position", "\"supine\"", NOTHING),
    ("assume_hu", "true", NOTHING),
    ("equalise_steps", "true", NOTHING),
    ("table.ap", "3.0", MESH),
    ("table.lat", "-4.0", MESH),
    ("tumour.centre", "[90.0, -247.0, -594.5]", SPHERE),
    ("tumour.radius", "8.0", SPHERE),
    ("region.centre", "[92.0, -235.0, -594.5]", LABELS),
    ("region.radius", "54.0", LABELS),
    ("mesh.tetrahedra", "450", LABELS),
    ("mesh.order", "2", MESH),
    ("mesh.geometry", "\"curved\"", LABELS),
    ("mesh.piece", "\"centre\"", LABELS),
    ("mesh.refine", "\"goal\"", LABELS),
    ("mesh.refine", "\"tumour\"", LABELS),
    ("mesh.tumour_edge", "13.0", LABELS),
    ("mesh.tumour_growth", "0.6", LABELS),
    ("mesh.refine", "\"none\"", LABELS),
    ("seeds.chest_wall", "[[60.0, -190.0, -594.5]]", NOTHING),
    ("seeds.soft_tissue", "[[91.0, -250.0, -590.0]]", NOTHING),
    ("seeds.exclude", "[[150.0, -300.0, -600.0]]", NOTHING),
    (
        "seeds.strokes",
        "[{ tissue = \"soft_tissue\", radius = 3.0, points = [[91.0, -250.0, -590.0], [95.0, -250.0, -590.0]] }]",
        NOTHING,
    ),
    ("seeds.file", "\"chest_wall.csv\"", NOTHING),
];

const TISSUE: &[Change<'_>] = &[
    ("tissue.young", "0.7", MESH),
    ("tissue.poisson", "0.44", MESH),
    ("tissue.density", "950.0", MESH),
    ("tissue.law", "\"exponential\"", MESH),
    ("tissue.stiffening", "1.2", MESH),
    ("tissue.fibres", "0.5", MESH),
    ("tissue.fibre_stiffening", "2.0", MESH),
    ("tissue.fibre_direction", "[0.0, -1.0, 0.2]", MESH),
    ("tissue.rest", "\"unloaded\"", MESH),
    ("tissue.spring", "0.05", MESH),
    ("wall.hold", "\"sliding\"", MESH),
    ("wall.shear", "0.05", MESH),
    ("wall.radius", "40.0", MESH),
    ("wall.centre", "[80.0, -210.0, -594.5]", MESH),
    ("skin.young", "40.0", MESH),
    ("skin.thickness", "2.0", MESH),
    ("skin.stretch", "1.01", MESH),
    ("tissue.young_interval", "[0.5, 0.9]", MESH),
    // The tumour of the interval: the report spoke of the one before.
    ("tumour.centre", "[92.0, -248.0, -594.5]", SPHERE),
    ("tumour.centre", "[91.0, -248.0, -594.5]", SPHERE),
    ("tissue.map", "\"hu\"", MESH),
    ("tissue.young", "0.8", MESH),
    ("tissue.fat", "0.5", MESH),
    ("tissue.gland", "0.8", MESH),
    ("tissue.skin", "5.0", MESH),
    ("tissue.tumour", "3.0", MESH),
    ("tissue.map", "\"none\"", MESH),
    ("tissue.cut", "\"free\"", MESH),
];

const RESULTS: &[Change<'_>] = &[
    ("tissues", "true", SOLUTION),
    ("warp.interpolation", "\"linear\"", SOLUTION),
    ("carry.points", "\"points.csv\"", SERIES),
    ("carry.segmentation", "\"labels.dcm\"", SERIES),
    ("export.study", "\"new\"", SOLUTION),
    ("export.equipment", "\"scanner\"", SOLUTION),
    ("export.registration", "false", SOLUTION),
    ("export.frame", "\"source, although the breast has moved in it\"", SOLUTION),
    ("export.padding", "\"clipped\"", SOLUTION),
    ("export.structures", "false", SERIES),
    ("export.pdf", "true", SERIES),
    ("export.clock", "\"2026-03-01 12:00:00\"", SOLUTION),
    ("report.seen", "\"poor-dihedral-angle-0123456789ab\"", SERIES),
    ("tolerance", "5.0", SERIES),
    ("tolerance", "", SERIES),
    ("dose.tolerance", "20.0", SERIES),
    ("dose.at", "25.0", SERIES),
    ("posture.arms", "\"moved\"", SERIES),
    ("posture.breathing", "0.5", SERIES),
    ("labels.file", "\"labels.seg.nrrd\"", NOTHING),
    ("labels.body", "[]", NOTHING),
    ("labels.soft_tissue", "\"soft tissue\"", NOTHING),
    ("labels.chest_wall", "\"chest wall\"", NOTHING),
];

/// Keys whose change is shown elsewhere, and why.
const ELSEWHERE: &[(&str, &str)] = &[
    ("breast", "the patient's other breast has no tumour: `another_side_is_refused`"),
    ("mesh.mesher", "the other meshers are features: cli/tests/meshers.rs"),
    ("tumour.structure", "structure sets are written there: tests/tests/flow/tumour.rs"),
    ("tumour.file", "structure sets are written there: tests/tests/flow/tumour.rs"),
    ("carry.dose", "RT objects are made in Python: tests/tests/flow/rt.rs"),
    ("carry.structures", "RT objects are made in Python: tests/tests/flow/rt.rs"),
    ("scans.sitting", "scans are fitted there, and changed: tests/tests/flow/fit.rs"),
    ("scans.supine", "scans are fitted there, and changed: tests/tests/flow/fit.rs"),
    (
        "scans.intraop",
        "a scan is held against the result there, and changed: tests/tests/flow/fit.rs",
    ),
    ("scans.landmarks", "scans are fitted there, and changed: tests/tests/flow/fit.rs"),
    ("scans.laws", "scans are fitted there, and changed: tests/tests/flow/fit.rs"),
    ("scans.lean", "scans are fitted there, and changed: tests/tests/flow/fit.rs"),
    ("scans.unit", "scans are fitted there, and changed: tests/tests/flow/fit.rs"),
    ("export.anonymise", "its key is drawn by chance: `anonymised`"),
];

/// Values that a change needs beside it.
const WITH: &[(&str, &str, &str)] = &[
    ("mesh.geometry", "mesh.order", "2"),
    ("tissue.fat", "tissue.young", ""),
    ("tissue.map \"none\"", "tissue.fat", ""),
    ("tissue.map \"none\"", "tissue.gland", ""),
    ("tissue.map \"none\"", "tissue.skin", ""),
    ("tissue.map \"none\"", "tissue.tumour", ""),
    ("tissue.cut", "tissue.spring", ""),
    ("mesh.refine \"goal\"", "mesh.geometry", ""),
    ("mesh.refine \"tumour\"", "mesh.tumour_edge", "14.0"),
    ("mesh.refine \"none\"", "mesh.tumour_edge", ""),
    ("mesh.refine \"none\"", "mesh.tumour_growth", ""),
    ("export.frame", "export.registration", ""),
    ("labels.file", "seeds.file", ""),
];

fn value(toml: &str) -> serde_json::Value {
    if toml.is_empty() {
        return serde_json::Value::Null;
    }
    let table: toml::Table = format!("v = {toml}").parse().unwrap();
    serde_json::to_value(&table["v"]).unwrap()
}

fn changed(case: &str, key: &str, toml: &str) -> String {
    let beside = WITH.iter().filter(|(of, ..)| *of == key || *of == format!("{key} {toml}"));
    let mut edits: Vec<Edit> =
        beside.map(|(_, key, toml)| Edit { key: (*key).into(), value: value(toml) }).collect();
    edits.push(Edit { key: key.into(), value: value(toml) });
    edit(case, &edits).unwrap()
}

/// A finished run that is changed step by step; each step is compared with a cold run.
struct Walk {
    dir: tempfile::TempDir,
    case: String,
}

impl Walk {
    /// From the first run of the case.
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        Self { case: finished_patient(dir.path()), dir }.with_files()
    }

    /// From the first run of a case that is the patient's in full size with some lines more.
    fn in_full_size(more: &str) -> Self {
        let dir = tempfile::tempdir().unwrap();
        let walk = Self { case: full_size_patient(dir.path()) + more, dir };
        walk.again("the first run");
        walk.with_files()
    }

    /// Writes what some changes name beside the case.
    fn with_files(self) -> Self {
        for name in ["labels.dcm", "labels.seg.nrrd"] {
            fs::copy(self.out().join(name), self.dir.path().join(name)).unwrap();
        }
        self.write("points.csv", "name,x,y,z\nclip,90,-240,-590\n");
        self.write("chest_wall.csv", "name,x,y,z\nF1,60,-190,-594.5\n");
        self
    }

    fn out(&self) -> PathBuf {
        self.dir.path().join("out")
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.dir.path().join(name), text).unwrap();
    }

    fn cold(&self) -> PathBuf {
        self.dir.path().join("cold")
    }

    /// Runs the case again; what was made again.
    fn again(&self, what: &str) -> Vec<NodeId> {
        let made = run(&self.case, self.dir.path(), &self.out());
        made.unwrap_or_else(|e| panic!("{what}: {e}"))
    }

    /// Runs the case again and cold; what was made again.
    fn run(&self, what: &str) -> Vec<NodeId> {
        let made = self.again(what);
        let _none_yet = fs::remove_dir_all(self.cold());
        let cold = run(&self.case, self.dir.path(), &self.cold());
        cold.unwrap_or_else(|e| panic!("{what}, cold: {e}"));
        assert_same(what, &self.out(), &self.cold());
        made
    }

    /// The same up to the report.
    fn run_stages(&self, what: &str) -> Vec<NodeId> {
        let made = run_stages(&self.case, self.dir.path(), &self.out());
        let made = made.unwrap_or_else(|e| panic!("{what}: {e}"));
        let _none_yet = fs::remove_dir_all(self.cold());
        let cold = run_stages(&self.case, self.dir.path(), &self.cold());
        cold.unwrap_or_else(|e| panic!("{what}, cold: {e}"));
        assert_same_stages(what, &self.out(), &self.cold());
        made
    }

    /// Runs the case again whose cold run was the last one, and of which none of the files that it
    /// names has changed.
    fn repair(&self, what: &str) -> Vec<NodeId> {
        let made = self.again(what);
        assert_same(what, &self.out(), &self.cold());
        made
    }

    fn edit(&mut self, key: &str, toml: &str) {
        self.case = changed(&self.case, key, toml);
    }

    /// Changes a value and compares with a cold run up to a point; what was made again.
    fn change(&mut self, (key, toml, untouched): Change<'_>, to: To) -> Vec<NodeId> {
        self.edit(key, toml);
        let what = format!("{key} = {toml}");
        let made = match to {
            To::Report => self.run(&what),
            To::Stages => self.run_stages(&what),
        };
        let needless: Vec<_> = untouched.iter().filter(|node| made.contains(node)).collect();
        assert!(needless.is_empty(), "{what}: made {needless:?} again");
        made
    }
}

#[test]
fn every_parameter_is_changed() {
    let covered = |key: &str| {
        let changed = CHANGES.iter().flat_map(|part| *part).any(|(k, ..)| *k == key);
        changed || ELSEWHERE.iter().any(|(k, _)| *k == key)
    };
    let open: Vec<_> = TABLE.iter().map(|p| p.key).filter(|key| !covered(key)).collect();
    assert!(open.is_empty(), "no change of {open:?} is tried");
}

fn changed_equals_cold(changes: &[Change<'_>]) {
    let mut walk = Walk::new();
    let uid = series_uid(&walk.out());
    for (key, toml, untouched) in changes {
        let to = if *untouched == SERIES { To::Report } else { To::Stages };
        walk.change((key, &toml.replace("UID", &uid), untouched), to);
    }
    walk.run("the last change");
}

#[test]
fn what_comes_before_the_tissue_changed_equals_a_cold_run() {
    changed_equals_cold(GEOMETRY);
}

#[test]
fn the_tissue_changed_equals_a_cold_run() {
    changed_equals_cold(TISSUE);
}

#[test]
fn what_comes_after_the_tissue_changed_equals_a_cold_run() {
    changed_equals_cold(RESULTS);
}

/// What asks for the stages that the patient's case leaves out, but those that need scans.
const ALL_STAGES: &str = "tissues = true\nexport = { pdf = true }\n[tissue]\nmap = \"hu\"\n";

/// Changes that reach, together, every stage of such a case.
const FULL_SIZE: &[Change<'_>] = &[
    ("carry.segmentation", "\"labels.dcm\"", SERIES),
    ("table.ap", "3.0", MESH),
    ("mesh.tetrahedra", "450", LABELS),
    ("seeds.chest_wall", "[[60.0, -190.0, -594.5]]", NOTHING),
    ("equalise_steps", "true", NOTHING),
];

#[test]
fn a_ct_in_full_size_changed_equals_a_cold_run() {
    let mut walk = Walk::in_full_size(ALL_STAGES);
    let mut open = NodeId::ALL.to_vec();
    for (n, change) in FULL_SIZE.iter().enumerate() {
        let is_outermost = n == 0 || n + 1 == FULL_SIZE.len();
        let made = walk.change(*change, if is_outermost { To::Report } else { To::Stages });
        open.retain(|node| !made.contains(node));
    }
    // A case without scans has nothing to fit.
    assert_eq!(open, [NodeId::Fit], "made again by no change");
}

fn series_uid(out: &Path) -> String {
    // The exported series names its source's study; inspecting the source is the shorter way.
    let ct = out.parent().unwrap().join("ct");
    let found = supine_dicom::inspect(
        &ct,
        supine_dicom::Depth::Headers,
        supine_dicom::Accept::default(),
        supine_space::Progress::none(),
    );
    found.unwrap().series[0].uid.clone()
}

#[test]
fn every_input_files_bytes_count() {
    let mut walk = Walk::new();
    // That these changes equal cold runs is shown above; here they are where the way begins.
    walk.edit("ct", "\"ct/IM0040\"");
    walk.edit("carry.points", "\"points.csv\"");
    walk.edit("seeds.file", "\"chest_wall.csv\"");
    walk.again("files named");
    // Another file of the series than the one that is named: the reader reads the folder.
    brighten(&walk.dir.path().join("ct"), "IM0050");
    assert!(walk.run("another slice").contains(&NodeId::Segment));
    walk.write("points.csv", "name,x,y,z\nclip,90,-241,-590\n");
    let made = walk.run("points");
    assert!(made.contains(&NodeId::Points) && !made.contains(&NodeId::Solve), "{made:?}");
    walk.write("chest_wall.csv", "name,x,y,z\nF1,61,-190,-594.5\n");
    assert!(walk.run("seeds").contains(&NodeId::Segment));
    // The name of the file says which tissue its points are of.
    fs::rename(walk.dir.path().join("chest_wall.csv"), walk.dir.path().join("exclude.csv"))
        .unwrap();
    walk.change(("seeds.file", "\"exclude.csv\"", NOTHING), To::Report);
}

/// Makes a slice brighter by 1 HU, whether its pixels are compressed or not: the number that is
/// added to them is text.
fn brighten(ct: &Path, name: &str) {
    let path = ct.join(name);
    let mut file = fs::read(&path).unwrap();
    let intercept = dicom_value(&mut file, 0x0028_1052, b"DS");
    assert_eq!(intercept, b"-1024 ");
    intercept.copy_from_slice(b"-1023 ");
    fs::write(path, file).unwrap();
}

#[test]
fn what_was_deleted_comes_back() {
    let mut walk = Walk::new();
    walk.edit("mesh.geometry", "\"curved\"");
    walk.again("curved");
    fs::remove_file(walk.out().join(".stages/curved.vtu")).unwrap();
    walk.change(("tissue.young", "0.7", LABELS), To::Report);
    fs::remove_dir_all(walk.out().join("field")).unwrap();
    assert!(walk.repair("fields deleted").contains(&NodeId::Fields));
    fs::remove_dir_all(walk.out().join(".stages/surfaces")).unwrap();
    assert!(walk.repair("surfaces deleted").contains(&NodeId::Segment));
}

#[test]
fn the_summary_repeats_the_run() {
    let dir = tempfile::tempdir().unwrap();
    let case = changed(&patient(dir.path()), "tissue.spring", "0.05");
    let case = changed(&case, "seeds.chest_wall", "[[60.0, -190.0, -594.5]]");
    let [first, again] = ["first", "again"].map(|name| dir.path().join(name));
    run(&case, dir.path(), &first).unwrap();
    let spec = supine_flow::Spec::read(&first.join("summary.json")).unwrap();
    let session = supine_flow::Session::new(spec, 2).unwrap();
    let session = session.with_folder(supine_flow::RunFolder::open(&again).unwrap()).unwrap();
    supine_flow::run(&session, Default::default(), &supine_flow::Unwatched).unwrap();
    assert_same("from the summary", &again, &first);
}

/// The same patient keeps her pseudonym in a folder, another folder gives another one.
#[test]
fn anonymised() {
    let mut walk = Walk::new();
    walk.case = changed(&walk.case, "export.anonymise", "true");
    let made = run(&walk.case, walk.dir.path(), &walk.out()).unwrap();
    assert!(!made.contains(&NodeId::Segment) && made.contains(&NodeId::Export), "{made:?}");
    let summary = fs::read_to_string(walk.out().join("summary.json")).unwrap();
    assert!(!summary.contains("\"ct\": \"ct\""), "a de-identified run names no files");
    assert_eq!(run(&walk.case, walk.dir.path(), &walk.out()).unwrap(), []);
    walk.change(("export.anonymise", "false", LABELS), To::Report);
}

#[test]
fn another_side_is_refused() {
    let mut walk = Walk::new();
    walk.case = changed(&walk.case, "breast", "\"right\"");
    let made = run(&walk.case, walk.dir.path(), &walk.out());
    let cold = run(&walk.case, walk.dir.path(), &walk.dir.path().join("other"));
    match (made, cold) {
        (Ok(_), Ok(_)) => assert_same("breast", &walk.out(), &walk.dir.path().join("other")),
        (Err(a), Err(b)) => assert_eq!(a, b),
        (a, b) => panic!("{a:?} but cold {b:?}"),
    }
}
