//! What must not be used is not done quietly, and does not leave by habit.

use crate::shared::{run, scratch, shared};
use serde_json::Value;
use std::path::Path;
use supine_tests::{Case, supine};

fn summary(out: &Path) -> Value {
    let text = std::fs::read_to_string(out.join("summary.json")).expect("the run left a summary");
    serde_json::from_str(&text).expect("it is JSON")
}

#[test]
fn a_tumour_held_by_the_chest_wall_ends_with_4_and_is_not_sent() {
    let folder = scratch();
    let tumour = "{ centre = [81.8, -222.0, -612.5], radius = 5.0 }";
    let case = Case::small().with("tumour", tumour).write(folder.path());
    let out = folder.path().join("out");
    let ended = run(&case, &out, 2);
    assert_eq!(ended.code, Some(4), "{}", ended.stderr);
    assert!(ended.stderr.contains("RED: do not use"), "{}", ended.stderr);
    let verdict = &summary(&out)["verdict"];
    assert_eq!(verdict["colour"], "red");
    assert_eq!(verdict["reasons"][0]["code"], "tumour-in-chest-wall");
    assert_eq!(summary(&out)["status"], "not-usable");
    let said = supine(&[&"run", &case, &"--out", &out, &"--json"]);
    assert_eq!(said.code, Some(4), "{}", said.stderr);
    let document: Value = serde_json::from_str(&said.stdout).expect("stdout is JSON");
    assert_eq!(document["status"], "not-usable");
    assert_eq!(document["error"]["code"], "verdict-red");
    for path in [out.clone(), out.join("ct")] {
        let sent = supine(&[&"send", &path, &"--to", &"PACS@127.0.0.1:9"]);
        assert_eq!(sent.code, Some(4), "{}", sent.stderr);
        assert!(sent.stderr.contains("--although-not-usable"), "{}", sent.stderr);
    }
    // Told to, it goes on to the archive, which is not there.
    let words: [&dyn AsRef<std::ffi::OsStr>; 5] =
        [&"send", &out, &"--to", &"PACS@127.0.0.1:9", &"--although-not-usable"];
    let sent = supine(&words);
    assert_ne!(sent.code, Some(4), "{}", sent.stderr);
    let log = std::fs::read_to_string(out.join("log.jsonl")).expect("there is a log");
    assert!(log.contains("sent although not usable"), "{log}");
}

#[test]
fn a_guess_is_amber_and_only_denied_when_asked() {
    let first = summary(&shared().out);
    assert_eq!(first["verdict"]["colour"], "amber");
    let [low, high] = [0, 1].map(|k| first["tumour_interval"]["length_mm"][k].as_f64().unwrap());
    let moves = first["tumour"]["distance_mm"].as_f64().unwrap();
    assert!(low < moves && moves < high, "{low} {moves} {high}");
    let again = supine(&[&"run", &shared().case, &"--out", &shared().out, &"--deny-warnings"]);
    assert_eq!(again.code, Some(4), "{}", again.stderr);
    assert!(again.stderr.contains("95 %"), "{}", again.stderr);
}

#[test]
fn an_unfinished_run_is_not_sent() {
    let folder = scratch();
    let out = folder.path().join("out");
    let words: [&dyn AsRef<std::ffi::OsStr>; 6] =
        [&"run", &shared().case, &"--out", &out, &"--until", &"segment"];
    supine(&words).success("supine run --until segment");
    let sent = supine(&[&"send", &out, &"--to", &"PACS@127.0.0.1:9"]);
    assert_eq!(sent.code, Some(4), "{}", sent.stderr);
    assert!(sent.stderr.contains("unfinished"), "{}", sent.stderr);
}

#[test]
fn a_deformed_ct_is_no_ct_to_deform() {
    let folder = scratch();
    let case = Case::small().with_ct(&shared().out.join("ct")).write(folder.path());
    let ended = run(&case, &folder.path().join("out"), 2);
    assert_eq!(ended.code, Some(1), "{}", ended.stderr);
    assert!(ended.stderr.contains("deformed by this program already"), "{}", ended.stderr);
    assert!(!folder.path().join("out/ct").exists());
}
