//! Two runs of one patient are told apart in a planning system's list.

use crate::shared::{run, run_until, scratch, shared};
use serde_json::Value as Json;
use std::collections::BTreeSet;
use std::path::Path;
use supine_tests::{Case, readers_python};

/// What a list shows of the series of a run, its CT first.
fn listed(out: &Path) -> Vec<Json> {
    let names = ["ct/CT0001.dcm", "registration/deformable.dcm", "registration/chest-wall.dcm"];
    let files =
        names.into_iter().chain(["structures.dcm", "labels.dcm"]).map(|name| out.join(name));
    let said = readers_python("named.py", files).success("named.py").stdout;
    said.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect()
}

/// The short name of a result, which its report shows.
fn name(out: &Path) -> String {
    let read = |file: &str| std::fs::read_to_string(out.join(file)).expect("the run left it");
    let summary: Json = serde_json::from_str(&read("summary.json")).expect("JSON");
    let name = summary["id"].as_str().expect("a name").to_owned();
    assert!(read("report/index.html").contains(&format!("<b>Result</b> {name}<")), "{name}");
    name
}

#[test]
fn runs_on_other_tables_are_told_apart_and_bear_the_time_of_the_run() {
    let scratch = scratch();
    let out = scratch.path().join("out");
    let case = Case::small().with("table", "{ ap = 9.0, lat = 5.0 }").write(scratch.path());
    shared().begin(&out);
    run(&case, &out, 2).success("supine run");
    let runs = [shared().out.as_path(), &out];
    let (series, names) = (runs.map(listed), runs.map(name));
    for ((series, name), table) in series.iter().zip(&names).zip(["AP 7", "AP 9"]) {
        let called = series[0]["description"].as_str().expect("a description");
        assert_eq!(called, format!("DEFORMED {table} LAT 5 E 0.609 kPa net {name}"));
        for object in &series[1..4] {
            let called = object["description"].as_str().expect("a description");
            assert!(called.ends_with(&format!("[supine] {name}")), "{called}");
        }
        for object in series {
            assert_eq!(object["content"], "20260301 120000", "{object}");
            assert_eq!(object["series"], "20260301 120000", "{object}");
        }
    }
    assert_ne!(names[0], names[1]);
    readers_python("own_regions.py", [&out]).success("own_regions.py");
    let numbers: Vec<i64> =
        series.iter().flatten().filter_map(|object| object["number"].as_i64()).collect();
    // The labels do not depend on the table: theirs is the same object.
    let different: BTreeSet<i64> = numbers.iter().copied().collect();
    assert_eq!((numbers.len(), different.len()), (10, 9), "{numbers:?}");
}

#[test]
fn the_clock_of_the_case_comes_before_that_of_the_run() {
    let scratch = scratch();
    let out = scratch.path().join("out");
    let case = Case::small().with("export", "{ clock = \"2025-11-03 08:09:10\" }");
    let case = case.write(scratch.path());
    shared().begin(&out);
    for stage in ["labels-object", "registration", "structures"] {
        run_until(stage, &case, &out).success(stage);
    }
    assert!(listed(&out).iter().all(|object| object["content"] == "20251103 080910"));
}
