//! What must not be used is not done quietly, and does not leave by habit.

use crate::shared::{held, run, scratch, shared, summary};
use serde_json::Value;
use std::path::Path;
use supine_tests::{Case, readers_python, source, supine};

#[test]
fn a_tumour_held_by_the_chest_wall_ends_with_4_and_is_not_sent() {
    let folder = scratch();
    let case = Case::held().write(folder.path());
    let out = folder.path().join("out");
    held().copy_to(&out);
    let ended = run(&case, &out, 2);
    assert_eq!(ended.code, Some(4), "{}", ended.stderr);
    assert!(ended.stderr.contains("RED: do not use"), "{}", ended.stderr);
    let told = summary(&out);
    assert!(told["tumour_interval"].is_null(), "what does not move has no interval");
    let verdict = &told["verdict"];
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
fn what_is_carried_from_a_run_that_must_not_be_used_is_not_sent_from_anywhere() {
    let folder = scratch();
    let given = folder.path().join("rtss");
    let drawn = [source(), given.clone(), "91.37,-248.09,-594.5".into(), "12".into()];
    readers_python("draw.py", drawn).success("draw.py");
    let out = folder.path().join("elsewhere/carried.dcm");
    std::fs::create_dir(folder.path().join("elsewhere")).expect("the folder can be made");
    let carried = supine(&[&"carry", &held().out, &given, &"--out", &out]);
    assert_eq!(carried.code, Some(0), "{}", carried.stderr);
    assert!(carried.stderr.contains("must not be used"), "{}", carried.stderr);
    for path in [out.clone(), folder.path().join("elsewhere")] {
        let sent = supine(&[&"send", &path, &"--to", &"PACS@127.0.0.1:9"]);
        assert_eq!(sent.code, Some(4), "{}", sent.stderr);
        assert!(sent.stderr.contains("carried.dcm must not be used"), "{}", sent.stderr);
    }
    // From a run that may be used it leaves; the archive is not there.
    let carried = supine(&[&"carry", &shared().out, &given, &"--out", &out, &"--overwrite"]);
    assert_eq!(carried.code, Some(0), "{}", carried.stderr);
    let sent = supine(&[&"send", &out, &"--to", &"PACS@127.0.0.1:9"]);
    assert_ne!(sent.code, Some(4), "{}", sent.stderr);
}

#[test]
fn a_guess_is_amber_and_only_denied_when_asked() {
    let folder = scratch();
    let out = folder.path().join("out");
    shared().copy_to(&out);
    let first = summary(&out);
    assert_eq!(first["verdict"]["colour"], "amber");
    let [low, high] = [0, 1].map(|k| first["tumour_interval"]["length_mm"][k].as_f64().unwrap());
    let moves = first["tumour"]["distance_mm"].as_f64().unwrap();
    assert!(low < moves && moves < high, "{low} {moves} {high}");
    let again = supine(&[&"run", &shared().case, &"--out", &out, &"--deny-warnings"]);
    assert_eq!(again.code, Some(4), "{}", again.stderr);
    assert!(again.stderr.contains("95 %"), "{}", again.stderr);
}

#[test]
fn a_modulus_that_is_none_of_the_possible_ones_ends_with_4() {
    let folder = scratch();
    let case = Case::small().with("tissue", "{ young = 6.0 }").write(folder.path());
    let out = folder.path().join("out");
    shared().begin(&out);
    let ended = run(&case, &out, 2);
    assert_eq!(ended.code, Some(4), "{}", ended.stderr);
    let verdict = &summary(&out)["verdict"];
    assert_eq!(
        (&verdict["colour"], &verdict["reasons"][0]["code"]),
        (&"red".into(), &"outside-interval".into())
    );
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
    let looked = supine(&[&"inspect", &shared().out.join("ct")]);
    assert_eq!(looked.code, Some(1), "{}", looked.stdout);
    assert!(
        looked.stdout.contains("NOT usable: it is a CT that was deformed"),
        "{}",
        looked.stdout
    );
    no_case_of(&shared().out.join("ct"), folder.path());
}

/// `supine init` writes no case for a CT that was deformed.
fn no_case_of(ct: &Path, folder: &Path) {
    let out = folder.join("begun.toml");
    let begun = supine(&[&"init", &ct, &"--out", &out]);
    assert_eq!(begun.code, Some(1), "{}", begun.stderr);
    assert!(begun.stderr.contains("deformed by this program already"), "{}", begun.stderr);
    assert!(!out.exists());
}

#[test]
fn a_deformed_ct_is_none_in_any_format() {
    let folder = scratch();
    let mesh = shared().out.join("mesh/deformed.vtu");
    for name in ["ours.nrrd", "ours.nii.gz", "ours.nii", "ours.mha"] {
        let ours = folder.path().join(name);
        supine(&[&"warp", &"--ct", &source(), &"--mesh", &mesh, &"--out", &ours])
            .success("supine warp");
        let case = Case::small().with_ct(&ours).write(folder.path());
        let checked = supine(&[&"check", &case]);
        assert_eq!(checked.code, Some(1), "{name}: {}", checked.stderr);
        assert!(checked.stderr.contains("deformed by this program already"), "{}", checked.stderr);
        no_case_of(&ours, folder.path());
    }
    let again = folder.path().join("again.nrrd");
    let ours = folder.path().join("ours.mha");
    let warped = supine(&[&"warp", &"--ct", &ours, &"--mesh", &mesh, &"--out", &again]);
    assert_eq!(warped.code, Some(1), "{}", warped.stderr);
    assert!(warped.stderr.contains("deformed by this program already"), "{}", warped.stderr);
}
