//! `supine check` answers at once, and a run fails in the same words.

use crate::shared::scratch;
use serde_json::Value;
use std::time::{Duration, Instant};
use supine_tests::{Case, supine};

/// Far more than it takes, on a machine that has other work.
const AT_ONCE: Duration = Duration::from_secs(5);

#[test]
fn a_check_tells_what_a_run_would_do_and_runs_nothing() {
    let folder = scratch();
    let case = Case::small().write(folder.path());
    // Builds the program, if need be.
    supine(&[&"--version"]);
    let start = Instant::now();
    let said = supine(&[&"check", &case, &"--json", &"--quiet"]).success("supine check");
    assert!(start.elapsed() < AT_ONCE, "{:?}", start.elapsed());
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
