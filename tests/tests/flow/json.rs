//! What scripts read: one JSON document on stdout, whose `status` agrees with the exit code.
#![expect(clippy::disallowed_methods, reason = "the tests spoil files")]

use crate::shared::{scratch, shared, summary};
use serde_json::Value;
use std::ffi::OsStr;
use supine_tests::{Case, Outcome, copy_series, source, supine, supine_command};

/// The one document, which says how the command ended.
fn failed(said: &Outcome, code: i32) -> Value {
    assert_eq!(said.code, Some(code), "{}\n{}", said.stdout, said.stderr);
    let document: Value = serde_json::from_str(&said.stdout).expect("stdout is one JSON document");
    let error = &document["error"];
    assert_eq!(error["exit"], code, "{document}");
    for name in ["code", "kind", "message", "place", "advice"] {
        assert!(error.get(name).is_some(), "no {name}: {document}");
    }
    assert!(error["advice"].as_str().is_some_and(|advice| advice.len() > 5), "{document}");
    document
}

#[test]
fn usage_is_told_in_whole_with_what_to_do() {
    let told = |words: &[&str]| {
        let said = Outcome::of(supine_command().args(words).arg("--json"));
        let document = failed(&said, 2);
        assert_eq!(document["status"], "failed");
        let text = |name: &str| document["error"][name].as_str().unwrap_or_default().to_owned();
        (text("message"), text("advice"))
    };
    let (message, advice) = told(&["run"]);
    assert!(message.contains("<CASE>") && message.contains("--out <DIR>"), "{message}");
    assert!(!message.contains("Usage:") && advice.contains("Usage: supine run"), "{advice}");
    assert!(advice.contains("--help"), "{advice}");
    let (message, advice) = told(&["run", "case.toml", "--unti", "mesh"]);
    assert!(message.contains("'--unti'") && advice.contains("'--until'"), "{message}: {advice}");
    assert!(!advice.contains("Usage"), "{advice}");
    assert!(told(&[]).1.contains("--help"));
}

#[test]
fn a_file_that_is_not_there_is_called_so_and_named() {
    let folder = scratch();
    let (gone, out) = (folder.path().join("nowhere"), folder.path().join("out.vtu"));
    let (to, deformed) = ("PACS@127.0.0.1:9", folder.path().join("out.nrrd"));
    let calls: [&[&dyn AsRef<OsStr>]; 6] = [
        &[&"warp", &"--ct", &gone, &"--mesh", &gone, &"--out", &deformed],
        &[&"solve", &"--mesh", &gone, &"--table", &"7,5", &"--out", &out],
        &[&"coarsen", &gone, &"--tetrahedra", &"9", &"--out", &out],
        &[&"send", &gone, &"--to", &to],
        &[&"inspect", &gone],
        &[&"verify-export", &gone],
    ];
    for words in calls {
        let document = failed(&supine(&[words, &[&"--json"]].concat()), 1);
        let error = &document["error"];
        assert_eq!(error["code"], "input-missing", "{document}");
        assert!(
            error["place"]["file"].as_str().unwrap_or_default().ends_with("nowhere"),
            "{document}"
        );
    }
}

#[test]
fn an_answer_that_something_is_wrong_stays_one_document() {
    let folder = scratch();
    let (ct, files) = copy_series(folder.path());
    std::fs::remove_file(&files[30]).expect("a slice is lost");
    let document = failed(&supine(&[&"inspect", &ct, &"--json"]), 1);
    assert_eq!(document["status"], "failed");
    assert_eq!(document["error"]["code"], "no-usable-series");
    let reason = document["series"][0]["reason"].as_str().expect("the inspection is there");
    assert!(document["error"]["message"].as_str().unwrap_or_default().contains(reason));

    // Nobody listens at that port.
    let sent = supine(&[&"send", &files[0], &"--to", &"PACS@127.0.0.1:9", &"--json"]);
    let document = failed(&sent, 75);
    assert_eq!(document["error"]["code"], "network");
}

#[test]
fn a_run_says_how_it_ended_in_a_word() {
    let folder = scratch();
    let out = folder.path().join("out");
    shared().copy_to(&out);
    let before = summary(&out);
    assert_eq!(
        (&before["status"], &before["verdict"]["colour"]),
        (&"done".into(), &"amber".into())
    );
    let words: [&dyn AsRef<OsStr>; 6] =
        [&"run", &shared().case, &"--out", &out, &"--deny-warnings", &"--json"];
    let document = failed(&supine(&words), 4);
    assert_eq!(document["status"], "failed");
    assert_eq!(document["error"]["code"], "verdict-not-green");
    assert_eq!(document["verdict"], before["verdict"]);
    assert_eq!(summary(&out)["status"], "done", "the result itself is as it was");

    let (ct, source) = (out.join("ct"), source());
    let words: [&dyn AsRef<OsStr>; 6] =
        [&"verify-export", &ct, &"--source", &source, &"--new-study", &"--json"];
    let document = failed(&supine(&words), 4);
    assert_eq!(document["error"]["code"], "check-failed");
    assert!(document["checks"].is_array(), "{document}");
    let gone = ct.join("nowhere.csv");
    let words: [&dyn AsRef<OsStr>; 6] = [&"carry", &out, &gone, &"--out", &"never.csv", &"--json"];
    assert_eq!(failed(&supine(&words), 1)["error"]["code"], "input-missing");
}

/// Soft tissue in a small sphere on a steep table, told by `--set`, moves far where the region
/// ends.
#[test]
fn warnings_have_the_numbers_that_were_measured() {
    let folder = scratch();
    let region = "{ centre = [91.0, -235.0, -594.5], radius = 55.0 }";
    let case = Case::small().with("region", region).write(folder.path());
    let out = folder.path().join("out");
    shared().begin(&out);
    let said = supine(&[
        &"run",
        &case,
        &"--out",
        &out,
        &"--set",
        &"table={ap=40,lat=30}",
        &"--set",
        &"tissue.young=0.3",
        &"--set",
        &"mesh={tetrahedra=500}",
        &"--json",
    ]);
    let summary: Value = serde_json::from_str(&said.stdout).expect("stdout is JSON");
    assert_eq!(summary["case"]["table"]["lat"], 30.0, "{}", said.stderr);
    let warnings = summary["warnings"].as_array().expect("warnings are listed");
    let found = |code: &str| warnings.iter().find(|warning| warning["code"] == code);
    let fade = found("fade-squeezes").or(found("wide-fade")).expect("it moves far at the cut");
    assert!(fade["values"]["displacement_mm"].as_f64().is_some_and(|mm| mm > 5.0), "{fade}");
}
