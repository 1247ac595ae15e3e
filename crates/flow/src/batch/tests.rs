//! Which cases there are, and what becomes of those that fail before any work.

use super::*;
use std::fs;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

/// Sees how cases ended.
#[derive(Default)]
struct Seen {
    ended: Mutex<Vec<String>>,
    stops: AtomicBool,
}

impl BatchObserver for Seen {
    fn end(&self, name: &str, status: &RunStatus, _: bool) {
        let told = format!("{name} {}", status.status.word());
        self.ended.lock().unwrap().push(told);
    }

    fn go_on(&self) -> bool {
        !self.stops.load(Ordering::SeqCst)
    }
}

fn given(cases: Vec<PathBuf>, out: &Path) -> Batch {
    Batch {
        cases,
        out: out.into(),
        jobs: Some(2),
        memory: None,
        cores: 2,
        changes: vec![],
        anonymise: false,
        worst: Colour::Amber,
        options: Options::default(),
        start: None,
    }
}

/// A batch whose cases run in this process.
fn here(given: &Batch, seen: &Seen) -> Result<BatchDone, Error> {
    batch(given, &|one, observer| Ok(run_one(given, one, observer)), seen)
}

#[test]
fn two_cases_of_one_name_are_refused_before_anything_is_made() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    for name in ["a/p1", "b/P1"] {
        fs::create_dir_all(dir.path().join(name)).unwrap();
    }
    let cases = vec![dir.path().join("a/p1"), dir.path().join("b/P1/case.toml")];
    let error = here(&given(cases, &out), &Seen::default()).unwrap_err();
    let text = error.to_string();
    assert!(text.contains("two cases are called") && text.contains("rename one"), "{text}");
    assert!(!out.exists());
}

#[test]
fn cases_that_cannot_be_read_are_failed_lines_each_with_its_reason() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    fs::write(dir.path().join("typo.toml"), "brest = 'left'\n").unwrap();
    let table = "name,breast,ct\nr1,lft,ct\nr2,left,nowhere\n";
    fs::write(dir.path().join("cases.csv"), table).unwrap();
    let cases = ["typo.toml", "gone.toml", "cases.csv"].map(|name| dir.path().join(name));
    let seen = Seen::default();
    let done = here(&given(cases.into(), &out), &seen).unwrap();
    let mut ended = seen.ended.lock().unwrap().clone();
    ended.sort();
    assert_eq!(ended, ["gone failed", "r1 failed", "r2 failed", "typo failed"]);
    let codes: Vec<String> =
        done.ended.iter().map(|status| status.error.clone().unwrap().code).collect();
    let told = ["case-unreadable", "case-value", "case-key-missing", "case-key-unknown"];
    assert_eq!(codes, told);
    assert_eq!(done.failure(), Some(Failure::Method));
    let place = done.ended[1].error.clone().unwrap().place;
    assert_eq!(place.file, Some(dir.path().join("cases.csv")));
    assert_eq!(place.key.as_deref(), Some("breast"));
    let page = fs::read_to_string(&done.page).unwrap();
    assert!(page.contains("did you mean `breast`?") && done.patients == 4);
    // The same again changes nothing that is kept.
    let status = out.join("status/r1.json");
    let before = (fs::read_to_string(&status).unwrap(), fs::read_to_string(&done.table).unwrap());
    here(&given(done_cases(dir.path()), &out), &Seen::default()).unwrap();
    let after = (fs::read_to_string(&status).unwrap(), fs::read_to_string(&done.table).unwrap());
    assert_eq!(before, after);
}

fn done_cases(dir: &Path) -> Vec<PathBuf> {
    ["typo.toml", "gone.toml", "cases.csv"].map(|name| dir.join(name)).into()
}

#[test]
fn stopped_before_it_began_nothing_is_told_of_the_cases() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let seen = Seen::default();
    seen.stops.store(true, Ordering::SeqCst);
    let done = here(&given(vec![dir.path().join("p1.toml")], &out), &seen).unwrap();
    assert_eq!((done.left, done.failure()), (1, Some(Failure::Stopped)));
    assert!(!out.join("status/p1.json").exists() && done.patients == 0);
}

#[test]
fn the_worst_case_has_the_exit_code() {
    let status = |ended: Ended, exit: u8| {
        let text = r#"{"schema":"supine-status/1","case":"x","exit":0,"status":"usable","colour":null,"reasons":[],
            "warnings":0,"error":null,"seconds":1.0,"peak_memory_mb":null,"voxels":null,"threads":1,"tumour":null,"version":"0"}"#;
        RunStatus { status: ended, exit, ..RunStatus::read(text).unwrap() }
    };
    let failure = |ended: &[(Ended, u8)], stopped: bool| {
        let ended = ended.iter().map(|(ended, exit)| status(*ended, *exit)).collect();
        let (table, page) = (PathBuf::new(), PathBuf::new());
        BatchDone { ended, left: 0, stopped, table, page, patients: 0, others: vec![] }.failure()
    };
    let (usable, red) = ((Ended::Usable, 0), (Ended::NotUsable, 4));
    let (input, retry) = ((Ended::Failed, 1), (Ended::Failed, 75));
    assert_eq!(failure(&[usable, (Ended::Flagged, 0)], false), None);
    assert_eq!(failure(&[usable, (Ended::Flagged, 4)], false), Some(Failure::Check));
    assert_eq!(failure(&[usable, red], false), Some(Failure::Check));
    assert_eq!(failure(&[red, input, retry], false), Some(Failure::Method));
    assert_eq!(failure(&[red, retry], false), Some(Failure::Retry));
    assert_eq!(failure(&[usable, input], true), Some(Failure::Stopped));
}

#[test]
fn states_that_others_left_are_collected_and_no_folder_is_none() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    assert!(matches!(collect(&out, Colour::Amber), Err(Error::Unread { .. })));
    here(&given(vec![dir.path().join("gone.toml")], &out), &Seen::default()).unwrap();
    fs::remove_file(out.join("index.html")).unwrap();
    fs::write(out.join("status/half.json"), r#"{"schema":"supine-status/1"}"#).unwrap();
    let done = collect(&out, Colour::Amber).unwrap();
    // One of whom nothing whole is told was stopped.
    assert_eq!((done.patients, done.count(Ended::Stopped)), (2, 1));
    assert_eq!(done.failure(), Some(Failure::Method));
    assert!(out.join("index.html").is_file());
}

#[test]
fn a_case_whose_process_is_lost_is_failed_and_the_others_run() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let table = "name,breast,ct\na,left,nowhere\nb,left,nowhere\nc,left,nowhere\n";
    fs::write(dir.path().join("cases.csv"), table).unwrap();
    let given = given(vec![dir.path().join("cases.csv")], &out);
    let run = |one: &OneCase, observer: &dyn BatchObserver| {
        // As another process has it.
        let row = one.row().unwrap();
        let same = OneCase::new(one.name().into(), one.file(), Some(&row), 1).unwrap();
        match one.name() {
            "a" => Err(Lost::Ended),
            "b" => Err(Lost::NotStarted("no more processes".into())),
            _ => Ok(run_one(&given, &same, observer)),
        }
    };
    let done = batch(&given, &run, &Seen::default()).unwrap();
    let codes: Vec<(String, u8)> =
        done.ended.iter().map(|s| (s.error.clone().unwrap().code, s.exit)).collect();
    let told = [("not-ended", 75), ("not-started", 75), ("case-key-missing", 1)];
    assert_eq!(codes, told.map(|(code, exit)| (code.into(), exit)));
    assert!(fs::read_to_string(&done.page).unwrap().contains("no more processes"));
}
