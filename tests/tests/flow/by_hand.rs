//! Stage by stage with the commands: the same bytes as the run.

use crate::shared::{scratch, shared, summary};
use std::path::Path;
use supine_tests::supine;

fn same(by_hand: &Path, run: &str) {
    let read =
        |path: &Path| std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let of_run = shared().out.join(run);
    assert!(read(by_hand) == read(&of_run), "{} is not {run} of the run", by_hand.display());
}

#[test]
fn stages_by_hand_are_those_of_the_run() {
    let folder = scratch();
    let at = |name: &str| folder.path().join(name);
    let told = summary(&shared().out);
    let case = &told["case"];
    let labels = at("labels.seg.nrrd");
    let (surfaces, uncertainty) = (at("surfaces"), at("uncertainty.nrrd"));
    let ct = shared()
        .case
        .parent()
        .expect("a case lies in a folder")
        .join(case["ct"].as_str().expect("the CT"));
    supine(&[
        &"segment",
        &"--ct",
        &ct,
        &"--out",
        &labels,
        &"--surfaces",
        &surfaces,
        &"--uncertainty",
        &uncertainty,
    ])
    .success("supine segment");
    same(&labels, "labels.seg.nrrd");
    same(&uncertainty, "labels-uncertainty.nrrd");

    let region = &told["parameters"]["region"];
    let list = |value: &serde_json::Value| {
        let all = value.as_array().expect("a place").iter();
        all.map(ToString::to_string).collect::<Vec<_>>().join(",")
    };
    let mesh = at("rest.vtu");
    supine(&[
        &"mesh",
        &"--labels",
        &labels,
        &"--surfaces",
        &surfaces,
        &format!("--centre={}", list(&region["centre_mm"])),
        &format!("--radius={}", region["radius_mm"]),
        &format!("--tetrahedra={}", case["mesh"]["tetrahedra"]),
        &"--out",
        &mesh,
    ])
    .success("supine mesh");
    same(&mesh, "mesh/rest.vtu");

    let deformed = at("deformed.vtu");
    let tissue = &case["tissue"];
    let word = |key: &str| tissue[key].as_str().expect("a word").to_owned();
    supine(&[
        &"solve",
        &"--mesh",
        &mesh,
        &format!("--table={},{}", case["table"]["ap"], case["table"]["lat"]),
        &format!("--young={}", tissue["young"]),
        &format!("--rest={}", word("rest")),
        &format!("--order={}", case["mesh"]["order"]),
        &"--out",
        &deformed,
    ])
    .success("supine solve");
    same(&deformed, "mesh/deformed.vtu");
}

#[test]
fn a_tilt_that_no_table_has_is_refused_in_the_same_words_everywhere() {
    let folder = scratch();
    let out = folder.path().join("deformed.vtu");
    let mesh = shared().out.join("mesh/rest.vtu");
    let solve = supine(&[&"solve", &"--mesh", &mesh, &"--table", &"900,5", &"--out", &out]);
    let run = supine(&[
        &"run",
        &shared().case,
        &"--set",
        &"table.ap=900",
        &"--out",
        &folder.path().join("out"),
    ]);
    let words = "`table.ap`: 900 is not a number from -180 to 180 degrees";
    assert!(solve.stderr.contains(words) && run.stderr.contains(words), "{solve:?} {run:?}");
    assert_eq!((solve.code, run.code), (Some(2), Some(1)));
    assert!(!out.exists() && !folder.path().join("out").exists(), "nothing was begun");
}
