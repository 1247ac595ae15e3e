//! The modulus by scans of the fixture patient: true is 0.9 kPa in the unloaded state.

use crate::shared::{run_until, scratch, shared};
use serde_json::Value;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use supine_tests::{Case, Outcome, copy_folder, root, supine};

/// A case with scans of which its folder has copies.
fn case(folder: &Path, scans: &str) -> PathBuf {
    copy_scans(folder);
    case_of(folder, scans)
}

const SCANS: [&str; 3] = ["sitting.ply", "supine.ply", "intraop.ply"];

/// One in so many of their points tells the modulus to the same hundredth, in half the time.
const ONE_IN: usize = 5;

fn copy_scans(folder: &Path) {
    copy_scans_thinned(folder, ONE_IN);
}

/// Where it is not the modulus that is looked at.
fn copy_sparse_scans(folder: &Path) {
    copy_scans_thinned(folder, 2 * ONE_IN);
}

fn copy_scans_thinned(folder: &Path, one_in: usize) {
    let from = root().join("fixtures/patient/scans");
    for name in SCANS.into_iter().chain(["landmarks.json"]) {
        std::fs::copy(from.join(name), folder.join(name)).expect("a copy");
    }
    // Of the scan on the operating table all points are held against the result.
    SCANS[..2].iter().for_each(|name| thin(&folder.join(name), one_in));
}

/// Keeps one in so many points of a scan of the fixture.
fn thin(path: &Path, one_in: usize) {
    let bytes = std::fs::read(path).expect("a scan");
    let (head, rows) = bytes.split_at(end_of_head(&bytes));
    let kept: Vec<&[u8]> = rows.chunks_exact(ROW).step_by(one_in).collect();
    let count = |n: usize| format!("element vertex {n}\n");
    let head = String::from_utf8_lossy(head);
    let fewer = head.replace(&count(rows.len() / ROW), &count(kept.len()));
    assert!(fewer != head, "{head}");
    std::fs::write(path, [fewer.as_bytes(), &kept.concat()].concat()).expect("a scan");
}

/// Bytes of a point of the fixture's scans: place and normal.
const ROW: usize = 24;

fn end_of_head(scan: &[u8]) -> usize {
    scan.windows(11).position(|w| w == b"end_header\n").expect("a header") + 11
}

/// Fits into a folder in which the small case was run: labels are there, and its mesh.
fn fit_on(case: &Path, out: &Path) -> Outcome {
    shared().begin(out);
    fit(case, out)
}

fn case_of(folder: &Path, scans: &str) -> PathBuf {
    Case::small()
        .with("mesh", "{ tetrahedra = 1000, order = 2 }")
        .with("scans", scans)
        .write(folder)
}

fn fit(case: &Path, out: &Path) -> Outcome {
    supine(&[&"fit", &case, &"--out", &out, &"--quiet", &"--json"])
}

fn json(said: Outcome) -> Value {
    serde_json::from_str(&said.success("supine fit").stdout).expect("JSON")
}

const ALL: &str = "{ sitting = \"sitting.ply\", supine = \"supine.ply\", intraop = \"intraop.ply\", \
                   landmarks = \"landmarks.json\" }";

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

/// Changes the first six numbers of each point of the fixture's binary scans: place and normal.
fn change_scan(path: &Path, mut change: impl FnMut([f32; 6]) -> [f32; 6]) {
    let mut bytes = std::fs::read(path).expect("a scan");
    let end = end_of_head(&bytes);
    let head = String::from_utf8_lossy(&bytes[..end]).into_owned();
    assert!(head.contains("binary_little_endian") && head.contains("float nz"), "{head}");
    for row in bytes[end..].chunks_exact_mut(ROW) {
        let read =
            |n: usize| f32::from_le_bytes(row[4 * n..4 * n + 4].try_into().expect("4 bytes"));
        let new = change([0, 1, 2, 3, 4, 5].map(read));
        let words = row.chunks_exact_mut(4).zip(new);
        words.for_each(|(word, x)| word.copy_from_slice(&x.to_le_bytes()));
    }
    std::fs::write(path, bytes).expect("a scan");
}

/// Changes the landmarks of a scan in the same way.
fn change_landmarks(path: &Path, frame: &str, change: impl Fn([f64; 3]) -> [f64; 3]) {
    let text = std::fs::read_to_string(path).expect("landmarks");
    let mut all: Value = serde_json::from_str(&text).expect("JSON");
    for (_, point) in all[frame].as_object_mut().expect("points") {
        let new = change([0, 1, 2].map(|a| number(&point[a])));
        *point = new.to_vec().into();
    }
    std::fs::write(path, all.to_string()).expect("landmarks");
}

/// What a run keeps of how the scan on the operating table lies.
fn facts(out: &Path) -> Value {
    let text = std::fs::read_to_string(out.join(".stages/evaluation.json")).expect("a record");
    let record: Value = serde_json::from_str(&text).expect("JSON");
    let facts = &record["record"]["facts"];
    assert!(facts["facts"].is_object(), "{record}");
    facts.clone()
}

/// Linear elements in one rest state: quick.
const QUICK: [&str; 4] = ["--set", "tissue.rest=net", "--set", "mesh={tetrahedra=1000,order=1}"];

fn quick(case: &Path, out: &Path) -> Outcome {
    if !out.exists() {
        shared().begin(out);
    }
    let mut arguments: Vec<&dyn AsRef<OsStr>> =
        vec![&"fit", &case, &"--out", &out, &"--quiet", &"--json"];
    arguments.extend(QUICK.iter().map(|s| s as &dyn AsRef<OsStr>));
    supine(&arguments)
}

#[test]
fn the_modulus_and_the_rest_state_come_from_the_scans_and_the_run_goes_on_with_them() {
    let folder = scratch();
    let (case, out) = (case(folder.path(), ALL), folder.path().join("out"));
    let found = json(fit_on(&case, &out));
    let fitted = folder.path().join("fitted");
    copy_folder(&out, &fitted);
    let states = found["fit"]["states"].as_array().expect("a list");
    assert_eq!((states.len(), &states[0]["rest"]), (2, &Value::from("unloaded")), "{found}");
    assert_eq!(found["fit"]["decided"], true, "{found}");
    let kpa = number(&states[0]["young_kpa"]);
    assert!((kpa / 0.9 - 1.0).abs() < 0.05, "{kpa} kPa");
    let [low, high] = [0, 1].map(|n| number(&states[0]["interval_kpa"][n]));
    assert!(low < 0.9 && 0.9 < high && high / low < 1.2, "{low} to {high} kPa");
    assert!(number(&found["fit"]["supine"]["rms_mm"]) < 0.6, "{found}");

    let said = supine(&[&"run", &case, &"--out", &out, &"--quiet", &"--json"]);
    let summary: Value = serde_json::from_str(&said.stdout).expect("JSON");
    assert_eq!(summary["fit"], found["fit"]);
    assert_eq!(number(&summary["parameters"]["tissue"]["young_kpa"]), kpa);
    assert_eq!(summary["parameters"]["tissue"]["rest"], "unloaded");
    let interval = &summary["tumour_interval"];
    assert_eq!(interval["modulus"]["origin"], "scans");
    // The tumour's true displacement.
    let moved = (0..3).map(|a| number(&summary["tumour"]["displacement_mm"][a]));
    let off = moved.zip([1.56, 0.78, -2.33]).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    assert!(off < 0.2 && off < number(&interval["within_mm"]), "{off} mm, {interval}");
    let inputs = summary["inputs"].as_array().expect("a list");
    for key in ["scans.sitting", "scans.supine", "scans.landmarks", "scans.intraop"] {
        assert!(inputs.iter().any(|input| input["role"] == key), "{key}: {inputs:?}");
    }
    // The scan on the operating table lies nearer to the result than to the CT.
    let held = summary["evaluation"]["surfaces"].as_array().expect("a list");
    let names: Vec<&str> = held.iter().filter_map(|surface| surface["name"].as_str()).collect();
    assert_eq!(names, ["ct", "default", "run"]);
    let breast = |n: usize| number(&held[n]["breast"]["rms_mm"]);
    assert!(breast(2) < 0.5 && breast(2) < breast(1) && breast(1) < breast(0), "{held:?}");
    assert!(number(&held[2]["near"]["points"]) > 100.0, "{held:?}");
    assert!(number(&summary["evaluation"]["torso_mm"]) < 0.6, "{summary}");
    for name in ["sitting.csv", "modulus.csv", "intraop.csv", "evaluation.csv"] {
        assert!(out.join("scans").join(name).is_file(), "{name}");
    }
    // Another scan on the operating table is held anew, as in a run that held none yet; what was
    // fitted stays.
    change_scan(&folder.path().join("intraop.ply"), |p| {
        [p[0] * 1.002, p[1], p[2], p[3], p[4], p[5]]
    });
    let picture = || std::fs::read(out.join("report/scan_intraop_run.png")).expect("one");
    let before = picture();
    let said = supine(&[&"run", &case, &"--out", &out, &"--quiet", &"--json"]);
    let changed: Value = serde_json::from_str(&said.stdout).expect("JSON");
    run_until("evaluation", &case, &fitted).success("supine run --until evaluation");
    assert_eq!(facts(&out), facts(&fitted));
    for name in ["intraop.csv", "evaluation.csv"] {
        let [anew, cold] = [&out, &fitted]
            .map(|out| std::fs::read(out.join("scans").join(name)).expect("a table"));
        assert!(anew == cold, "{name}");
    }
    assert_ne!(changed["evaluation"], summary["evaluation"]);
    // The laws are held against it too; what was fitted rests on the sitting scan.
    assert_eq!(changed["fit"]["states"], summary["fit"]["states"]);
    let on_table = |summary: &Value| number(&summary["fit"]["laws"][0]["table_mm"]);
    assert!((on_table(&changed) - on_table(&summary)).abs() > 1e-3, "{changed}");
    assert!(picture() != before, "it shows the scan as it is now");
    // The summary repeats the run.
    let again = supine(&[&"fit", &out.join("summary.json"), &"--out", &out, &"--quiet", &"--json"]);
    assert_eq!(json(again)["fit"], changed["fit"]);
}

#[test]
fn what_changes_in_the_scans_is_fitted_anew_as_a_cold_run_does() {
    let folder = scratch();
    let out = folder.path().join("out");
    let run = |scans: &str, out: &Path| {
        let case = case_of(folder.path(), scans);
        json(quick(&case, out))["fit"].clone()
    };
    copy_sparse_scans(folder.path());
    let first = run(ALL, &out);
    let cold = |scans: &str, name: &str| run(scans, &folder.path().join(name));
    // Without the lying scan, with the unit stated: the same modulus, and other facts.
    let fewer = "{ sitting = \"sitting.ply\", landmarks = \"landmarks.json\", unit = \"mm\" }";
    let (changed, anew) = (run(fewer, &out), cold(fewer, "cold-1"));
    assert_eq!(changed, anew);
    assert_eq!(changed["states"], first["states"]);
    assert_ne!(changed, first);
    // Without other laws: the same modulus, as the patient is of the plain one.
    let alone = ALL.replace('}', ", laws = false }");
    let (changed, anew) = (run(&alone, &out), cold(&alone, "cold-3"));
    assert_eq!(changed, anew);
    // The fit begins elsewhere then, and ends within its tolerance.
    let kpa = |fit: &Value| number(&fit["states"][0]["young_kpa"]);
    assert!((kpa(&changed) / kpa(&first) - 1.0).abs() < 1e-4, "{changed}");
    assert_eq!(changed["states"][0]["rest"], first["states"][0]["rest"]);
    assert!(first["laws"].is_array() && changed["laws"].is_null(), "{changed}");
    // A lean that she is said to have is not fitted again.
    let leaning = alone.replace('}', ", lean = 6.0 }");
    let (changed, anew) = (run(&leaning, &out), cold(&leaning, "cold-4"));
    assert_eq!(changed, anew);
    let lean = |fit: &Value| number(&fit["states"][0]["lean_deg"]);
    assert!((-8.0..-3.0).contains(&(lean(&changed) - lean(&first))), "{changed}");
    assert!((kpa(&changed) / kpa(&first) - 1.0).abs() < 0.05, "{changed}");
    // Other points in the sitting scan.
    let scan = folder.path().join("sitting.ply");
    let mut count = 0;
    // Every tenth point lies a little farther out.
    change_scan(&scan, |[x, y, z, nx, ny, nz]| {
        count += 1;
        let out = if count % 10 == 0 { 0.3 } else { 0.0 };
        [x + out * nx, y + out * ny, z + out * nz, nx, ny, nz]
    });
    let (changed, anew) = (run(ALL, &out), cold(ALL, "cold-2"));
    assert_eq!(changed, anew);
    assert_ne!(changed["states"], first["states"]);
}

#[test]
fn scans_that_cannot_be_used_give_one_clear_error() {
    let folder = scratch();
    let without = Case::small().write(folder.path());
    let said = fit(&without, &folder.path().join("none"));
    assert_eq!(said.code, Some(1), "{}", said.stderr);
    assert!(said.stderr.contains("scans = {") || said.stdout.contains("scans = {"), "{said:?}");
    // The scan of the lying patient as that of the sitting one shows no motion.
    copy_sparse_scans(folder.path());
    let still = case_of(folder.path(), "{ sitting = \"supine.ply\", landmarks = \"l.json\" }");
    let text = std::fs::read_to_string(folder.path().join("landmarks.json")).expect("landmarks");
    let mut all: Value = serde_json::from_str(&text).expect("JSON");
    all["sitting"] = all["supine"].clone();
    std::fs::write(folder.path().join("l.json"), all.to_string()).expect("landmarks");
    let said = quick(&still, &folder.path().join("still"));
    assert_eq!(said.code, Some(3), "{said:?}");
    // Left and right exchanged.
    for (_, point) in all["sitting"].as_object_mut().expect("points") {
        point[0] = Value::from(-point[0].as_f64().expect("a number"));
    }
    std::fs::write(folder.path().join("l.json"), all.to_string()).expect("landmarks");
    let said = quick(&still, &folder.path().join("still"));
    assert!(matches!(said.code, Some(1 | 3)), "{said:?}");
}

#[test]
fn a_mirrored_scan_is_refused_and_one_that_is_too_large_is_told() {
    let folder = scratch();
    copy_sparse_scans(folder.path());
    let case = case_of(folder.path(), ALL);
    let (scan, marks) = (folder.path().join("supine.ply"), folder.path().join("landmarks.json"));
    change_scan(&scan, |p| [p[0] * 1.01, p[1] * 1.01, p[2] * 1.01, p[3], p[4], p[5]]);
    change_landmarks(&marks, "supine", |p| p.map(|x| x * 1.01));
    let found = json(quick(&case, &folder.path().join("large")));
    let scale = number(&found["fit"]["supine"]["scale"]);
    assert!((scale - 1.01).abs() < 0.002, "{scale}");
    assert!(found["warnings"].to_string().contains("1.0 % larger"), "{}", found["warnings"]);

    copy_sparse_scans(folder.path());
    change_scan(&scan, |p| [-p[0], p[1], p[2], -p[3], p[4], p[5]]);
    // Landmarks would tell at once: they are left out.
    let text = std::fs::read_to_string(&marks).expect("landmarks");
    let mut all: Value = serde_json::from_str(&text).expect("JSON");
    all.as_object_mut().expect("frames").remove("supine");
    std::fs::write(&marks, all.to_string()).expect("landmarks");
    let said = quick(&case, &folder.path().join("mirrored"));
    assert!(said.code == Some(1) && said.stdout.contains("scan-mirrored"), "{said:?}");
}

#[test]
fn a_pose_in_place_of_landmarks_gives_the_same_modulus() {
    let folder = scratch();
    copy_sparse_scans(folder.path());
    let case =
        case_of(folder.path(), "{ sitting = \"sitting.ply\", landmarks = \"landmarks.json\" }");
    let first = json(quick(&case, &folder.path().join("landmarks")));
    let state = |found: &Value| found["fit"]["states"][0].clone();
    let pose = serde_json::json!({ "sitting": state(&first)["patient_from_scan"] });
    std::fs::write(folder.path().join("landmarks.json"), pose.to_string()).expect("a pose");
    let second = json(quick(&case, &folder.path().join("pose")));
    let ratio = number(&state(&second)["young_kpa"]) / number(&state(&first)["young_kpa"]);
    assert!((ratio - 1.0).abs() < 0.005, "{ratio}");
}

#[test]
fn moduli_by_tissue_that_the_scan_speaks_against_are_told() {
    let folder = scratch();
    copy_scans(folder.path());
    let case = Case::small()
        .with("mesh", "{ tetrahedra = 1000, order = 2 }")
        .with("tissue", "{ map = \"labels\", rest = \"unloaded\" }")
        .with("scans", "{ sitting = \"sitting.ply\", landmarks = \"landmarks.json\" }")
        .write(folder.path());
    let found = json(fit_on(&case, &folder.path().join("out")));
    // The patient was made of one tissue.
    let one = &found["fit"]["one_modulus"];
    assert!((number(&one["young_kpa"]) / 0.9 - 1.0).abs() < 0.05, "{one}");
    assert!(number(&one["evidence"]) > 10.0, "{one}");
    assert!(found["warnings"].to_string().contains("against the moduli by tissue"), "{found}");
}
