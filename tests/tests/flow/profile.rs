//! `--profile`: Perfetto reads the trace, and it says what the summary says.

use crate::shared::{scratch, shared, summary};
use serde_json::Value;
use std::collections::BTreeMap;
use supine_tests::{readers_python, supine};

#[test]
fn perfetto_opens_the_trace_of_a_run() {
    let folder = scratch();
    let [out, trace, picture] =
        ["out", "trace.json", "perfetto.png"].map(|n| folder.path().join(n));
    let words: [&dyn AsRef<std::ffi::OsStr>; 7] =
        [&"run", &shared().case, &"--out", &out, &"--quiet", &"--profile", &trace];
    supine(&words).success("run --profile");
    let said = readers_python("perfetto.py", [&trace, &picture]).success("Perfetto");
    let told: Value = serde_json::from_str(&said.stdout).expect("JSON");
    assert_eq!(told["errors"], Value::Array(vec![]), "{told}");
    let seconds: BTreeMap<&str, f64> = told["slices"]
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(|slice| Some((slice[0].as_str()?, slice[1].as_f64()?)))
        .collect();
    let run = &summary(&out)["run"];
    for stage in run["stages"].as_array().expect("a list") {
        let name = stage["name"].as_str().expect("a name");
        let (ours, theirs) = (stage["seconds"].as_f64().expect("a number"), seconds.get(name));
        assert!(
            theirs.is_some_and(|s| (s - ours).abs() < 0.5 + 0.1 * ours),
            "{name}: {ours} {theirs:?}"
        );
    }
    let peak = run["peak_memory_mb"].as_f64().expect("a number");
    let resident = told["memory"].as_f64().expect("a number");
    assert!(resident > 0.5 * peak && resident < 10.0 * peak, "{resident} MB, {peak} counted");
    // Also in the middle of a stage.
    assert!(told["looks"].as_u64() > Some(60), "{told}");
}
