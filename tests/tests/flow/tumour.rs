//! The tumour from a region of a structure set.

use crate::shared::{scratch, shared};
use serde_json::Value;
use std::ffi::OsStr;
use std::path::Path;
use supine_tests::{
    Case, Drawn, Outcome, frame_of_reference, source, supine, write_structures, write_structures_of,
};

/// The tumour of the fixture patient.
const GTV: Drawn = Drawn { name: "GTV", centre: [91.37, -248.09, -594.5], radius: 9.0 };
/// What else a planner draws.
const OTHERS: [Drawn; 2] = [
    Drawn { name: "PTV_Boost", radius: 15.0, ..GTV },
    Drawn { name: "Heart", centre: [20.0, -200.0, -630.0], radius: 40.0 },
];

fn frame() -> String {
    frame_of_reference(&source().join("IM0001"))
}

fn case(folder: &Path, tumour: &str) -> std::path::PathBuf {
    Case::small().with("tumour", tumour).write(folder)
}

fn run(case: &Path, out: &Path, until: &str) -> Outcome {
    supine(&[&"run", &case, &"--out", &out, &"--quiet", &"--json", &"--until", &until])
}

#[test]
fn the_tumour_is_the_sphere_of_its_region() {
    let folder = scratch();
    let rs = folder.path().join("RS.dcm");
    write_structures(&rs, &frame(), &[Drawn { radius: 12.0, ..GTV }]);
    let by_name = case(folder.path(), "{ structure = \"GTV\", file = \"RS.dcm\" }");
    let out = folder.path().join("out");
    shared().begin(&out);
    let number = |value: &Value| value.as_f64().expect("a number");
    let checked = supine(&[&"check", &by_name, &"--quiet", &"--json"]).success("supine check");
    let checked: Value = serde_json::from_str(&checked.stdout).expect("JSON");
    assert!((number(&checked["tumour"]["radius_mm"]) - 12.0).abs() < 0.2, "{checked}");
    run(&by_name, &out, "export").success("supine run");
    let before = std::fs::read(out.join("mesh/deformed.vtu")).expect("a mesh");

    // Another region drawn in the same file changes nothing but the file, and the tumour is that
    // region's.
    write_structures(&rs, &frame(), &[OTHERS[0], GTV, OTHERS[1]]);
    let said = run(&by_name, &out, "report").success("supine run");
    let summary: Value = serde_json::from_str(&said.stdout).expect("JSON");
    let tumour = &summary["position"]["tumour"];
    for (axis, centre) in GTV.centre.iter().enumerate() {
        assert!((number(&tumour["centre_mm"][axis]) - centre).abs() < 0.05, "{tumour}");
    }
    assert!((number(&tumour["radius_mm"]) - GTV.radius).abs() < 0.15, "{tumour}");
    assert_eq!(summary["case"]["tumour"]["structure"], "GTV");
    let inputs = summary["inputs"].as_array().expect("a list");
    assert!(inputs.iter().any(|input| input["role"] == "tumour"), "{inputs:?}");
    assert!(before == std::fs::read(out.join("mesh/deformed.vtu")).expect("a mesh"));
    let case = out.join("summary.json");
    let said = run(&case, &folder.path().join("again"), "region");
    said.success("the run of a summary");
}

#[test]
fn a_tumour_that_was_drawn_on_another_patient_is_refused() {
    let folder = scratch();
    let place = "{ structure = \"GTV\", file = \"RS.dcm\" }";
    for (patient, code) in [("PH0143", Some(0)), ("ZZ9", Some(1))] {
        write_structures_of(&folder.path().join("RS.dcm"), &frame(), patient, &[GTV]);
        let said = supine(&[&"check", &case(folder.path(), place)]);
        assert_eq!(said.code, code, "{}", said.stderr);
        let told = said.stderr.contains("of another patient than the CT");
        assert_eq!(told, code == Some(1), "{}", said.stderr);
    }
    let rs = folder.path().join("RS.dcm");
    let labels = format!("{{ file = '{}', chest_wall = \"GTV\" }}", rs.display());
    let said = run(
        &Case::small().with("labels", &labels).write(folder.path()),
        &folder.path().join("out"),
        "segment",
    );
    assert!(said.stderr.contains("of another patient than the CT"), "{}", said.stderr);
}

#[test]
fn a_region_that_is_not_there_names_the_nearest_and_all() {
    let folder = scratch();
    write_structures(&folder.path().join("RS.dcm"), &frame(), &[OTHERS[0], GTV]);
    let refused = |tumour: &str, words: &[&str]| {
        let out = folder.path().join("out");
        let said = run(&case(folder.path(), tumour), &out, "region");
        assert_eq!(said.code, Some(1), "{}", said.stderr);
        words.iter().for_each(|word| assert!(said.stderr.contains(word), "{}", said.stderr));
    };
    let words = ["`tumour.structure`", "did you mean \"GTV\"?", "\"PTV_Boost\", \"GTV\""];
    refused("{ structure = \"gtv \", file = \"RS.dcm\" }", &words);
    refused("{ structure = \"GTV\" }", &["`tumour.file` is missing"]);
    refused("{ structure = \"GTV\", file = \"none.dcm\" }", &["`tumour.file`", "none.dcm"]);
    let both = "{ structure = \"GTV\", file = \"RS.dcm\", radius = 9.0 }";
    refused(both, &["`tumour.structure`", "leave `tumour.centre` and `tumour.radius` out"]);
    let slice =
        format!("{{ structure = \"GTV\", file = '{}' }}", source().join("IM0001").display());
    refused(&slice, &["`tumour.file`", "not a structure set"]);
}

#[test]
fn a_region_of_another_scan_is_refused() {
    let folder = scratch();
    // An empty one says nothing of another.
    for (frame, words) in [("2.25.99", "drawn on another scan"), ("", "does not say on which scan")]
    {
        write_structures(&folder.path().join("RS.dcm"), frame, &[GTV]);
        let by_name = case(folder.path(), "{ structure = \"GTV\", file = \"RS.dcm\" }");
        let said = run(&by_name, &folder.path().join("out"), "region");
        assert_eq!(said.code, Some(1), "{}", said.stderr);
        assert!(said.stderr.contains(words), "{}", said.stderr);
    }
}

#[test]
fn single_commands_refuse_a_tumour_that_lies_nowhere() {
    let folder = scratch();
    let labels = shared().out.join("labels.seg.nrrd");
    let ct = source();
    let segment: [&dyn AsRef<OsStr>; 3] = [&"segment", &"--ct", &ct];
    let mesh: [&dyn AsRef<OsStr>; 7] = [
        &"mesh",
        &"--labels",
        &labels,
        &"--centre=99,-236.5,-612.5",
        &"--radius=96",
        &"--tetrahedra=1000",
        &"--refine=tumour",
    ];
    let calls: [(&[_], _, _, _); 2] = [
        (&segment, "--tumour-centre=1e30,0,0", "l.nrrd", "outside the CT"),
        (&mesh, "--tumour-centre=91,-500,-594", "m.vtu", "outside the region"),
    ];
    for (call, centre, out, words) in calls {
        let out = folder.path().join(out);
        let place: [&dyn AsRef<OsStr>; 4] = [&centre, &"--tumour-radius=9", &"--out", &out];
        let said = supine(&[call, &place].concat());
        assert_eq!(said.code, Some(1), "{}", said.stderr);
        assert!(said.stderr.contains(words) && !out.exists(), "{}", said.stderr);
    }
}
