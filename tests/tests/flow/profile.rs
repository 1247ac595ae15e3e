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
    // On another table all is done anew from the mechanics on: enough to be seen.
    shared().begin(&out);
    let words: [&dyn AsRef<std::ffi::OsStr>; 9] = [
        &"run",
        &shared().case,
        &"--out",
        &out,
        &"--quiet",
        &"--set",
        &"table.ap=9",
        &"--profile",
        &trace,
    ];
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
    let stages = run["stages"].as_array().expect("a list");
    let mut sums = [0.0; 2];
    for stage in stages {
        let name = stage["name"].as_str().expect("a name");
        let ours = stage["seconds"].as_f64().expect("a number");
        let theirs = *seconds.get(name).unwrap_or_else(|| panic!("no {name}: {told}"));
        // The clock is looked at one after the other, and a machine with other work holds the run
        // up in between.
        assert!((theirs - ours).abs() < 2.0 + 0.5 * ours, "{name}: {ours} {theirs}");
        sums = [sums[0] + ours, sums[1] + theirs];
    }
    assert!((0.5..2.0).contains(&(sums[1] / sums[0])), "all together: {sums:?}");
    let peak = run["peak_memory_mb"].as_f64().expect("a number");
    let resident = told["memory"].as_f64().expect("a number");
    assert!(resident > 0.5 * peak && resident < 10.0 * peak, "{resident} MB, {peak} counted");
    // Also in the middle of a stage, not only where one begins or ends or a warning comes.
    let warnings = told["instants"].as_array().expect("a list").len();
    let between = 2 * stages.len().max(seconds.len()) + warnings;
    assert!(told["looks"].as_u64() > Some(between as u64), "{between}: {told}");
}
