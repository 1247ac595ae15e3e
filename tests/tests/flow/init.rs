//! `supine init` writes a case file that a planner completes.

use crate::shared::scratch;
use serde_json::Value;
use std::ffi::OsStr;
use std::path::Path;
use supine_tests::{
    Drawn, Outcome, copy_series, frame_of_reference, source, supine, write_structures,
};

const GTV: Drawn = Drawn { name: "GTV", centre: [91.37, -248.09, -594.5], radius: 9.0 };

fn init(ct: &Path, out: &Path, more: &[&dyn AsRef<OsStr>]) -> Outcome {
    let words: [&dyn AsRef<OsStr>; 6] = [&"init", &ct, &"--out", &out, &"--json", &"--quiet"];
    supine(&[&words, more].concat())
}

fn told(said: &Outcome) -> Value {
    serde_json::from_str(&said.stdout).unwrap_or_else(|e| panic!("{e}: {}", said.stdout))
}

#[test]
fn a_case_from_a_region_lacks_the_tilt_alone_and_can_then_be_run() {
    let folder = scratch();
    let (rs, case) = (folder.path().join("RS.dcm"), folder.path().join("case.toml"));
    write_structures(&rs, &frame_of_reference(&source().join("IM0001")), &[GTV]);
    let more: [&dyn AsRef<OsStr>; 4] = [&"--structures", &rs, &"--tumour", &"GTV"];
    let said = init(&source(), &case, &more).success("supine init");
    let done = told(&said);
    assert_eq!(done["missing"], serde_json::json!(["table"]));
    assert_eq!(done["breast_proposed"], true);
    let text = std::fs::read_to_string(&case).expect("the case");
    assert!(text.contains("tumour = { structure = 'GTV', file = 'RS.dcm' }"), "{text}");
    assert!(
        text.contains("breast = \"left\"")
            && text.contains("# now: centre [91.37, -248.09, -594.50] mm, radius"),
        "{text}"
    );

    let said = supine(&[&"check", &case]);
    assert_eq!(said.code, Some(1));
    assert!(said.stderr.contains("table = { ap = 7.0, lat = 5.0 }"), "{}", said.stderr);
    std::fs::write(&case, text.replace("# FILL IN: table", "table"))
        .expect("the case is filled in");
    supine(&[&"check", &case]).success("supine check");

    // Never overwritten, unless that is asked.
    let said = init(&source(), &case, &[]);
    assert_eq!((said.code, told(&said)["error"]["exit"].as_u64()), (Some(5), Some(5)));
    assert!(std::fs::read_to_string(&case).expect("the case").contains("\ntable = "));
    init(&source(), &case, &[&"--overwrite"]).success("supine init --overwrite");
}

#[test]
fn every_optional_line_counts_once_its_mark_is_taken_away() {
    let folder = scratch();
    let case = folder.path().join("case.toml");
    init(&source(), &case, &[]).success("supine init");
    let text = std::fs::read_to_string(&case).expect("the case");
    let (_, optional) = text.split_once("# ----").expect("the optional part");
    let lines: Vec<&str> =
        optional.lines().filter(|l| l.contains(" = ") && !l.contains(": ")).collect();
    assert!(lines.len() > 40, "{}", lines.len());
    for line in lines {
        let line = line.trim_start_matches("# ");
        let table: toml::Table = line.parse().unwrap_or_else(|e| panic!("{line}: {e}"));
        assert_eq!(table.len(), 1, "{line}");
    }
    assert!(!text.contains("\ntable") && !text.contains("\ntumour"), "nothing is guessed");
}

#[test]
fn a_point_gives_the_centre_and_a_region_of_another_name_is_told() {
    let folder = scratch();
    let points = folder.path().join("points.csv");
    std::fs::write(&points, "name,x,y,z\nclip,1,2,3\nTumour,91.37,-248.09,-594.5\n")
        .expect("points");
    let case = folder.path().join("a.toml");
    let said = init(&source(), &case, &[&"--tumour", &points]).success("supine init");
    assert_eq!(told(&said)["missing"], serde_json::json!(["table", "tumour"]));
    let text = std::fs::read_to_string(&case).expect("the case");
    assert!(text.contains("centre = [91.37, -248.09, -594.50]"), "{text}");
    let said = init(
        &source(),
        &folder.path().join("b.toml"),
        &[&"--tumour", &points, &"--breast", &"right"],
    );
    assert_eq!(said.code, Some(1));
    let error = &told(&said)["error"];
    assert_eq!(error["code"], "tumour-on-other-side");
    assert!(said.stderr.contains("lies on the patient's left"), "{}", said.stderr);
    let said = init(&source(), &folder.path().join("b.toml"), &[&"--tumour", &"GTV"]);
    assert_eq!((said.code, &told(&said)["error"]["kind"]), (Some(2), &Value::from("usage")));
}

#[test]
fn a_folder_without_a_usable_series_says_why() {
    let folder = scratch();
    let (ct, files) = copy_series(folder.path());
    files[3..].iter().for_each(|file| std::fs::remove_file(file).expect("removed"));
    std::fs::remove_file(&files[1]).expect("removed");
    let said = init(&ct, &folder.path().join("case.toml"), &[]);
    assert_eq!(said.code, Some(1), "{}", said.stderr);
    assert!(said.stderr.contains("2 slice(s); a volume needs 3"), "{}", said.stderr);
    assert!(!folder.path().join("case.toml").exists());
}

#[test]
fn the_help_knows_every_key() {
    let said = supine(&[&"help", &"case"]).success("supine help case");
    for key in ["table.ap\n", "tumour.structure\n", "export.frame\n"] {
        assert!(said.stdout.contains(key), "{}", said.stdout);
    }
    supine(&[&"help", &"run"]).success("supine help run");
    let said = supine(&[&"help", &"lunch", &"--json"]);
    assert_eq!((said.code, &told(&said)["error"]["code"]), (Some(2), &Value::from("usage")));
}

#[test]
#[cfg(target_os = "linux")]
fn a_path_that_no_case_can_name_is_refused() {
    use std::os::unix::ffi::OsStrExt as _;
    let folder = scratch();
    let odd = folder.path().join(OsStr::from_bytes(b"n\xe9"));
    std::fs::create_dir(&odd).expect("a folder");
    std::os::unix::fs::symlink(source(), odd.join("ct")).expect("a link");
    let out = folder.path().join("case.toml");
    let said = supine(&[&"init", &odd.join("ct"), &"--out", &out]);
    assert_eq!(said.code, Some(1), "{}", said.stderr);
    assert!(said.stderr.contains("is no UTF-8") && !out.exists(), "{}", said.stderr);
}
