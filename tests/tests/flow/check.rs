//! `supine check` answers at once, and a run fails in the same words.

use crate::shared::{scratch, shared};
use serde_json::Value;
use supine_tests::{Case, supine};

/// The stages that look at what is given; all others are work.
const LOOKS: [&str; 4] = ["import", "source", "objects", "tumour"];

#[test]
fn a_check_tells_what_a_run_would_do_and_runs_nothing() {
    let folder = scratch();
    let case = Case::small().write(folder.path());
    let beside = scratch();
    let trace = beside.path().join("trace.json");
    let words: [&dyn AsRef<std::ffi::OsStr>; 6] =
        [&"check", &case, &"--json", &"--quiet", &"--profile", &trace];
    let said = supine(&words).success("supine check");
    let trace = std::fs::read_to_string(trace).expect("a trace");
    let trace: Value = serde_json::from_str(&trace).expect("the trace is JSON");
    let events = trace["traceEvents"].as_array().expect("events").iter();
    let stages: Vec<&str> =
        events.filter(|e| e["cat"] == "stage").filter_map(|e| e["name"].as_str()).collect();
    assert!(stages.contains(&"import"), "{stages:?}");
    assert!(stages.iter().all(|stage| LOOKS.contains(stage)), "{stages:?}");
    let told: Value = serde_json::from_str(&said.stdout).expect("JSON");
    assert_eq!(told["ct"]["size"], serde_json::json!([256, 256, 86]));
    assert_eq!((&told["breast"], &told["tetrahedra"]), (&"left".into(), &1000.into()));
    let hu = told["tumour"]["mean_hu"].as_f64().expect("HU");
    assert!((0.0..100.0).contains(&hu), "{told}");
    let said = supine(&[&"check", &case]).success("supine check");
    assert!(said.stderr.contains("head raised by 7°, left side lowered by 5°"), "{}", said.stderr);
    assert_eq!(std::fs::read_dir(folder.path()).expect("the folder").count(), 1);
}

#[test]
fn a_check_and_a_run_refuse_a_case_in_the_same_words() {
    for (tumour, words) in [
        (
            "{ centre = [-91.4, -240.0, -594.5], radius = 9.0 }",
            "error: `tumour`: it lies on the patient's right",
        ),
        ("{ centre = [91.4, -300.0, -594.5], radius = 9.0 }", "lies in air or lung (-1"),
        (
            "{ centre = [91.4, -248.1, 594.5], radius = 9.0 }",
            "lies outside the CT, which reaches x from",
        ),
    ] {
        let folder = scratch();
        let case = Case::small().with("tumour", tumour).write(folder.path());
        let checked = supine(&[&"check", &case, &"--quiet"]);
        let out = folder.path().join("out");
        let run = supine(&[&"run", &case, &"--out", &out, &"--quiet"]);
        assert_eq!((checked.code, run.code), (Some(1), Some(1)), "{}", run.stderr);
        assert!(checked.stderr.contains(words), "{}", checked.stderr);
        assert_eq!(checked.stderr, run.stderr);
    }
}

#[test]
fn what_lies_metres_beside_the_ct_is_refused_before_any_work() {
    let words_of = |key: &str, value: &str| {
        let folder = scratch();
        let out = folder.path().join("out");
        shared().begin(&out);
        let case = Case::small().with(key, value).write(folder.path());
        let checked = supine(&[&"check", &case, &"--quiet"]);
        let run = supine(&[&"run", &case, &"--out", &out, &"--quiet"]);
        assert_eq!((checked.code, run.code), (Some(1), Some(1)), "{}", run.stderr);
        assert_eq!(checked.stderr, run.stderr);
        checked.stderr
    };
    let said = words_of("region", "{ centre = [9900.0, -236.5, -612.5], radius = 96.0 }");
    assert!(said.contains("holds no soft tissue"), "{said}");
    for kind in ["chest_wall", "soft_tissue", "exclude"] {
        let said = words_of("seeds", &format!("{{ {kind} = [[5000.0, 0.0, 0.0]] }}"));
        assert!(said.contains("lies outside the CT; move or remove it"), "{said}");
    }
}

#[test]
fn scans_and_labels_are_read_before_any_work() {
    let folder = scratch();
    let scan = folder.path().join("scan.ply");
    let write = |unit: f64| {
        // A sheet the size of a torso.
        let at = |n: usize, step: f64| f64::from((n % 30) as u32) * step * unit;
        let points = (0..900).map(|n| format!("{} {} 0\n", at(n, 12.0), at(n / 30, 12.0)));
        let head = "ply\nformat ascii 1.0\nelement vertex 900\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
        std::fs::write(&scan, head.to_owned() + &points.collect::<String>()).expect("a scan");
    };
    let check = |key: &str, value: &str| {
        let case = Case::small().with(key, value).write(folder.path());
        supine(&[&"check", &case])
    };
    for (unit, said) in
        [(1.0, "900 points in mm, by its size"), (0.001, "900 points in m, by its size")]
    {
        write(unit);
        let told = check("scans", "{ sitting = 'scan.ply' }").success("supine check");
        assert!(told.stderr.contains(said), "{}", told.stderr);
    }
    write(1.0);
    let told = check("scans", "{ sitting = 'scan.ply', unit = 'm' }");
    assert_eq!(told.code, Some(1), "half a kilometre: {}", told.stderr);
    std::fs::write(&scan, "no scan").expect("a file");
    let told = check("scans", "{ sitting = 'scan.ply' }");
    assert!(told.code == Some(1) && told.stderr.contains("scan.ply"), "{}", told.stderr);
    std::fs::write(folder.path().join("labels.nrrd"), "no labels").expect("a file");
    let told = check("labels", "'labels.nrrd'");
    assert!(told.code == Some(1) && told.stderr.contains("labels.nrrd"), "{}", told.stderr);
}
