//! The modulus by scans of the fixture patient: true is 0.9 kPa in the unloaded state.

use crate::shared::scratch;
use serde_json::Value;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use supine_tests::{Case, Outcome, root, supine};

/// A case with scans of which its folder has copies.
fn case(folder: &Path, scans: &str) -> PathBuf {
    copy_scans(folder);
    case_of(folder, scans)
}

fn copy_scans(folder: &Path) {
    let from = root().join("fixtures/patient/scans");
    for name in ["sitting.ply", "supine.ply", "landmarks.json"] {
        std::fs::copy(from.join(name), folder.join(name)).expect("a copy");
    }
}

fn case_of(folder: &Path, scans: &str) -> PathBuf {
    Case::small()
        .with("mesh", "{ tetrahedra = 1600, order = 2 }")
        .with("scans", scans)
        .write(folder)
}

fn fit(case: &Path, out: &Path) -> Outcome {
    supine(&[&"fit", &case, &"--out", &out, &"--quiet", &"--json"])
}

fn json(said: Outcome) -> Value {
    serde_json::from_str(&said.success("supine fit").stdout).expect("JSON")
}

const ALL: &str =
    "{ sitting = \"sitting.ply\", supine = \"supine.ply\", landmarks = \"landmarks.json\" }";

#[test]
fn the_modulus_and_the_rest_state_come_from_the_scans_and_the_run_goes_on_with_them() {
    let folder = scratch();
    let (case, out) = (case(folder.path(), ALL), folder.path().join("out"));
    let found = json(fit(&case, &out));
    let number = |value: &Value| value.as_f64().expect("a number");
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
    for key in ["scans.sitting", "scans.supine", "scans.landmarks"] {
        assert!(inputs.iter().any(|input| input["role"] == key), "{key}: {inputs:?}");
    }
    // The summary repeats the run.
    let again = supine(&[&"fit", &out.join("summary.json"), &"--out", &out, &"--quiet", &"--json"]);
    assert_eq!(json(again)["fit"], found["fit"]);
}

#[test]
fn what_changes_in_the_scans_is_fitted_anew_as_a_cold_run_does() {
    let folder = scratch();
    let out = folder.path().join("out");
    let linear = "mesh={tetrahedra=1000,order=1}";
    let run = |scans: &str, out: &Path| {
        let case = case_of(folder.path(), scans);
        let set = ["--set", "tissue.rest=net", "--set", linear];
        let mut arguments: Vec<&dyn AsRef<OsStr>> =
            vec![&"fit", &case, &"--out", &out, &"--quiet", &"--json"];
        arguments.extend(set.iter().map(|s| s as &dyn AsRef<OsStr>));
        json(supine(&arguments))["fit"].clone()
    };
    copy_scans(folder.path());
    let first = run(ALL, &out);
    let cold = |scans: &str, name: &str| run(scans, &folder.path().join(name));
    // Without the lying scan, with the unit stated: the same modulus, and other facts.
    let fewer = "{ sitting = \"sitting.ply\", landmarks = \"landmarks.json\", unit = \"mm\" }";
    let (changed, anew) = (run(fewer, &out), cold(fewer, "cold-1"));
    assert_eq!(changed, anew);
    assert_eq!(changed["states"], first["states"]);
    assert_ne!(changed, first);
    // Other points in the sitting scan.
    let scan = folder.path().join("sitting.ply");
    let bytes = std::fs::read(&scan).expect("a scan");
    let binary = String::from_utf8_lossy(&bytes[..400]).contains("binary_little_endian");
    assert!(binary, "the fixture's scans are binary");
    let header = bytes.windows(11).position(|w| w == b"end_header\n").expect("a header") + 11;
    let mut other = bytes.clone();
    // Every tenth point lies where the one before does.
    let row = 24;
    for point in (0..4000).step_by(10) {
        let (from, to) = (header + point * row, header + (point + 1) * row);
        let copy = other[from..from + row].to_vec();
        other[to..to + row].copy_from_slice(&copy);
    }
    std::fs::write(&scan, other).expect("a scan");
    let (changed, anew) = (run(ALL, &out), cold(ALL, "cold-2"));
    assert_eq!(changed, anew);
    assert_ne!(changed["states"], first["states"]);
}

#[test]
fn scans_that_cannot_be_used_give_one_clear_error() {
    let folder = scratch();
    let without = Case::small().write(folder.path());
    let said = fit(&without, &folder.path().join("none"));
    assert_eq!(said.code, Some(2), "{}", said.stderr);
    assert!(said.stderr.contains("scans = {") || said.stdout.contains("scans = {"), "{said:?}");
    // The scan of the lying patient as that of the sitting one shows no motion.
    let still = case(folder.path(), "{ sitting = \"supine.ply\", landmarks = \"l.json\" }");
    let text = std::fs::read_to_string(folder.path().join("landmarks.json")).expect("landmarks");
    let mut all: Value = serde_json::from_str(&text).expect("JSON");
    all["sitting"] = all["supine"].clone();
    std::fs::write(folder.path().join("l.json"), all.to_string()).expect("landmarks");
    let said = fit(&still, &folder.path().join("still"));
    assert_eq!(said.code, Some(3), "{said:?}");
    // Left and right exchanged.
    for (_, point) in all["sitting"].as_object_mut().expect("points") {
        point[0] = Value::from(-point[0].as_f64().expect("a number"));
    }
    std::fs::write(folder.path().join("l.json"), all.to_string()).expect("landmarks");
    let said = fit(&still, &folder.path().join("still"));
    assert!(matches!(said.code, Some(1 | 3)), "{said:?}");
}
