//! The finer labels of a run: there when asked for, and never in the way.

use crate::shared::{run, scratch, shared, summary};
use std::path::Path;
use supine_tests::{Case, readers_python, results, supine};

#[test]
fn tissues_inform_the_report_and_change_nothing_else() {
    let folder = scratch();
    let case = Case::small().with("tissues", "true").write(folder.path());
    let out = folder.path().join("out");
    shared().begin(&out);
    run(&case, &out, 2).success("supine run");
    let plain = &shared().out;
    let read = |out: &Path, path: &Path| std::fs::read(out.join(path)).expect("it is read");
    // Mesh, displacement, deformed CT, fields, labels: all but the report and its summary.
    let own = ["report", "summary.json", "tissues.seg.nrrd"];
    let mut compared = 0;
    for path in results(&out).iter().filter(|p| !own.iter().any(|own| p.starts_with(own))) {
        assert!(read(&out, path) == read(plain, path), "{} differs", path.display());
        compared += 1;
    }
    assert!(compared > 90, "{compared} files compared");
    assert!(!plain.join("tissues.seg.nrrd").exists(), "not asked for, not there");
    let page =
        |out: &Path| String::from_utf8_lossy(&read(out, "report/index.html".as_ref())).into_owned();
    assert!(page(&out).contains("Breast density") && !page(plain).contains("Breast density"));
    assert!(out.join("report/axial_tissues.png").is_file());

    let tissues = summary(&out)["segmentation"]["tissues"].clone();
    assert!(summary(plain)["segmentation"]["tissues"].is_null());
    let density = tissues["density_percent"].as_f64().expect("a density");
    assert!((2.0..60.0).contains(&density), "{density}");
    let script =
        readers_python("tissues.py", [out.join("tissues.seg.nrrd"), out.join("summary.json")]);
    script.success("tissues.py");

    // Switched off again, the next run takes them away and redoes the report alone.
    let case = Case::small().write(folder.path());
    run(&case, &out, 2).success("supine run");
    assert!(
        !out.join("tissues.seg.nrrd").exists()
            && summary(&out)["segmentation"]["tissues"].is_null()
    );
    let stages = summary(&out)["run"]["stages"].as_array().expect("the stages").clone();
    let redone = stages.iter().filter(|s| s["cached"] == false).map(|s| s["name"].to_string());
    let redone: Vec<String> = redone.collect();
    assert!(!redone.iter().any(|s| s.contains("mesh") || s.contains("solve")), "{redone:?}");
    assert!(redone.iter().any(|s| s.contains("report")), "{redone:?}");
}

#[test]
fn a_typing_error_in_the_key_is_told() {
    let folder = scratch();
    let case = Case::small().with("tisues", "true").write(folder.path());
    let said = supine(&[&"run", &case, &"--out", &folder.path().join("out")]);
    assert_eq!(said.code, Some(1), "{}", said.stderr);
    assert!(said.stderr.contains("did you mean `tissues`"), "{}", said.stderr);
    let case = Case::small().with("tissues", "'yes'").write(folder.path());
    let said = supine(&[&"run", &case, &"--out", &folder.path().join("out")]);
    assert_eq!(said.code, Some(1), "{}", said.stderr);
    assert!(said.stderr.contains("`tissues`: \"yes\" is not true or false"), "{}", said.stderr);
}
