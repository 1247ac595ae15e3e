//! Many cases at once, and what a workflow engine reads of one.

use crate::interrupt::{PATIENCE, interrupt};
use crate::repeat::assert_same_bytes;
use crate::shared::{held, scratch, shared};
use serde_json::Value;
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant, SystemTime};
use supine_tests::{
    Case, Outcome, files_below, forgotten, readers_python, supine, supine_command, target,
};

/// A folder with a case.
fn case(folder: &Path, name: &str, case: &Case) -> PathBuf {
    let folder = folder.join(name);
    std::fs::create_dir_all(&folder).expect("a folder for the case");
    case.write(&folder);
    folder
}

/// The same without what a case that is tried again takes.
fn timeless(mut lines: BTreeMap<String, Value>) -> BTreeMap<String, Value> {
    for status in lines.values_mut() {
        for taken in ["seconds", "peak_memory_mb", "threads"] {
            status[taken] = Value::Null;
        }
    }
    lines
}

/// The lines on stdout, by case.
fn lines(said: &Outcome) -> BTreeMap<String, Value> {
    let read = |line: &str| -> Value { serde_json::from_str(line).expect("a line is JSON") };
    let named = |status: Value| (status["case"].as_str().unwrap_or_default().to_owned(), status);
    said.stdout.lines().map(read).map(named).collect()
}

fn status(file: &Path) -> Value {
    let text = std::fs::read_to_string(file).expect("there is a status");
    let status: Value = serde_json::from_str(&text).expect("it is JSON");
    assert_eq!(status["schema"], "supine-status/1");
    for name in [
        "exit",
        "status",
        "colour",
        "reasons",
        "warnings",
        "error",
        "seconds",
        "peak_memory_mb",
        "voxels",
        "threads",
        "tumour",
        "version",
    ] {
        assert!(status.get(name).is_some(), "no {name}: {status}");
    }
    status
}

/// When each file was written last.
fn times(folder: &Path) -> BTreeMap<PathBuf, SystemTime> {
    let time = |path: &PathBuf| {
        let meta = std::fs::metadata(folder.join(path)).expect("it is there");
        meta.modified().expect("the system keeps times")
    };
    files_below(folder).into_iter().map(|path| (path.clone(), time(&path))).collect()
}

#[test]
fn a_batch_goes_on_after_a_typo_and_a_second_call_makes_nothing_anew() {
    let folder = scratch();
    let (at, out) = (folder.path(), folder.path().join("out"));
    case(at, "good", &Case::small());
    case(at, "red", &Case::held());
    // That a batch makes a whole run is seen where it is interrupted.
    shared().begin(&out.join("runs/good"));
    held().begin(&out.join("runs/red"));
    let table = at.join("more.csv");
    let rows = "name,case,breast\ntypo,good/case.toml,lft\n";
    std::fs::write(&table, rows).expect("a table");
    // By relative paths: the page, of which the guide shows a picture, then names no folder of who
    // tests.
    let batch = || {
        let words = ["batch", "good", "red", "more.csv", "--out", "out"];
        Outcome::of(supine_command().current_dir(at).args(words))
    };
    let said = batch();
    assert_eq!(said.code, Some(3), "{}", said.stderr);
    let first = lines(&said);
    let ended = |name: &str| (first[name]["status"].as_str(), first[name]["exit"].as_u64());
    assert_eq!(first.len(), 3, "{}", said.stdout);
    assert_eq!(ended("good"), (Some("flagged"), Some(0)));
    assert_eq!(ended("red"), (Some("not-usable"), Some(4)));
    assert_eq!(ended("typo"), (Some("failed"), Some(1)));
    assert_eq!(first["typo"]["error"]["place"]["key"], "breast");
    assert!(said.stderr.contains("typo: failed"), "people are told: {}", said.stderr);
    for name in ["good", "red", "typo"] {
        assert_eq!(status(&out.join(format!("status/{name}.json"))), first[name]);
    }
    // A run of a batch is a run.
    assert_same_bytes(&out.join("runs/good"), &shared().out);
    let csv = std::fs::read_to_string(out.join("cohort.csv")).expect("a table");
    assert_eq!(csv.matches("\r\n").count(), 4);
    let page = std::fs::read_to_string(out.join("index.html")).expect("a page");
    assert!(page.contains("runs/good/report/axial_after.png") && page.contains("&#34;lft&#34;"));

    let index = out.join("index.html");
    // The picture that COHORTS shows.
    let pictures = target().join("page");
    std::fs::create_dir_all(&pictures).expect("a folder for pictures");
    let picture = pictures.join("cohort.png");
    readers_python("cohort_page.py", [&index, &picture]).success("the page's filters");

    let before = times(&out);
    let again = batch();
    assert_eq!((again.code, timeless(lines(&again))), (Some(3), timeless(first)));
    let mut after = times(&out);
    // Only that somebody was at work shows.
    after.retain(|path, time| before.get(path) != Some(time));
    let made: Vec<&PathBuf> = after.keys().filter(|path| !path.ends_with(".lock")).collect();
    assert!(made.is_empty(), "made anew: {made:?}");

    std::fs::remove_file(out.join("index.html")).expect("the page goes");
    let said = supine(&[&"batch", &"--collect", &"--out", &out]).success("--collect");
    assert_eq!(lines(&said).len(), 3);
    let anew = std::fs::read_to_string(out.join("index.html")).expect("a page");
    assert_eq!(anew, page);

    // What is no case of a call any more is in neither its table nor its page, and stays.
    let words = ["batch", "good", "red", "--out", "out", "--json"];
    let said = Outcome::of(supine_command().current_dir(at).args(words));
    let document: Value = serde_json::from_str(&said.stdout).expect("one document");
    let names = document["cases"].as_array().expect("a list of cases").iter();
    let names: Vec<_> = names.map(|case| case["case"].as_str().unwrap_or_default()).collect();
    assert_eq!((names, &document["others"]), (vec!["good", "red"], &serde_json::json!(["typo"])));
    let csv = std::fs::read_to_string(out.join("cohort.csv")).expect("a table");
    let (heads, rows) = csv.split_once("\r\n").expect("a line of names");
    let heads: Vec<&str> = heads.split(',').collect();
    assert!(["version", "run_id", "ct"].iter().all(|head| heads.contains(head)), "{heads:?}");
    assert!(rows.matches("\r\n").count() == 2 && !rows.contains("typo"), "{rows}");
    let page = std::fs::read_to_string(&index).expect("a page");
    assert!(!page.contains("typo") && out.join("status/typo.json").is_file());
}

#[test]
fn ctrl_c_in_the_middle_keeps_what_is_finished() {
    let folder = scratch();
    let (at, out) = (folder.path(), folder.path().join("out"));
    let cases = ["a", "b", "c"].map(|name| case(at, name, &Case::small()));
    let mut command = supine_command();
    command.arg("batch").args(&cases).arg("--out").arg(&out).args(["--jobs", "1"]);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    // The one in the middle is made from the beginning.
    ["a", "c"].iter().for_each(|name| shared().begin(&out.join("runs").join(name)));
    let child = command.spawn().expect("supine can be started");
    let (begun, first) = (Instant::now(), out.join("status/a.json"));
    while !(first.is_file() && out.join("runs/b/.stages").is_dir()) {
        assert!(begun.elapsed() < PATIENCE, "the first case does not end");
        std::thread::sleep(Duration::from_millis(10));
    }
    let said = interrupt(child);
    let words = said.stderr;
    assert_eq!(said.code, Some(130), "{words}");
    assert_eq!(status(&first)["status"], "flagged");
    assert_eq!(status(&out.join("status/b.json"))["status"], "stopped");
    assert!(!out.join("status/c.json").exists() && words.contains("1 not begun"), "{words}");
    assert!(forgotten(&out.join("runs/b")).is_empty());
    assert!(out.join("index.html").is_file());

    let before = times(&out.join("runs/a"));
    let cases = cases.each_ref().map(|case| case as &dyn AsRef<std::ffi::OsStr>);
    let [a, b, c] = cases;
    let said = supine(&[&"batch", a, b, c, &"--out", &out]).success("the second call");
    assert!(lines(&said).values().all(|status| status["exit"] == 0), "{}", said.stdout);
    assert_eq!(times(&out.join("runs/a")), before, "what was finished stays");
    assert_same_bytes(&out.join("runs/b"), &shared().out);
}

#[test]
fn a_run_tells_how_it_ended_in_a_file_of_its_own() {
    let folder = scratch();
    let file = folder.path().join("told/run 7.json");
    let (case, out) = (&shared().case, &folder.path().join("own"));
    shared().copy_to(out);
    let run = |more: &[&dyn AsRef<std::ffi::OsStr>], out: &Path| {
        let words: [&dyn AsRef<std::ffi::OsStr>; 6] =
            [&"run", case, &"--out", &out, &"--status", &file];
        supine(&[&words[..], more].concat())
    };
    let said = run(&[], out);
    let told = status(&file);
    assert_eq!(
        (said.code, &told["status"], &told["exit"]),
        (Some(0), &"flagged".into(), &0.into())
    );
    assert_eq!((&told["colour"], &told["error"]), (&"amber".into(), &Value::Null));
    assert!(told["tumour"]["interval_mm"][0].is_number(), "{told}");
    assert_eq!(told["out"].as_str().map(Path::new), Some(out.as_path()));

    let said = run(&[&"--deny-warnings"], out);
    let told = status(&file);
    assert_eq!(
        (said.code, &told["status"], &told["exit"]),
        (Some(4), &"flagged".into(), &4.into())
    );
    assert_eq!(told["error"]["code"], "verdict-not-green");

    let other = folder.path().join("other");
    let said = run(&[&"--set", &"ct=/nowhere/Meier"], &other);
    let told = status(&file);
    assert_eq!((said.code, &told["status"]), (Some(1), &"failed".into()));
    assert_eq!(told["error"]["place"]["file"], "/nowhere/Meier");
    let said = run(&[&"--set", &"ct=/nowhere/Meier", &"--anonymise"], &other);
    let told = status(&file);
    assert_eq!((said.code, &told["case"]), (Some(1), &"run 7".into()));
    for name in ["Meier", "other", "case.toml"] {
        assert!(!told.to_string().contains(name), "{name} is in {told}");
    }
}

#[test]
fn a_run_that_the_system_ends_has_told_so_and_a_batch_tries_it_last() {
    let folder = scratch();
    let (at, file) = (folder.path(), folder.path().join("status.json"));
    let mut command = Command::new("sh");
    // Address space for the program and its threads, not for a CT.
    command.args(["-c", "ulimit -v 220000; exec \"$0\" \"$@\""]);
    command.arg(supine_command().get_program()).arg("run").arg(&shared().case);
    command.arg("--out").arg(at.join("out")).arg("--status").arg(&file).args(["--threads", "2"]);
    let said = Outcome::of(&mut command);
    assert_eq!(said.code, Some(75), "{}", said.stderr);
    assert!(said.stderr.contains("the memory does not suffice"), "{}", said.stderr);
    let told = status(&file);
    assert_eq!((&told["status"], &told["exit"]), (&"failed".into(), &75.into()));
    assert_eq!(told["error"]["code"], "not-ended");

    // Less than the threads of a batch want: that is a lack of memory too, and no mistake of the
    // program.
    let program = std::fs::metadata(supine_command().get_program()).expect("the program").len();
    for more in [6_000, 11_000] {
        let kilobytes = program / 1024 + more;
        let mut command = Command::new("sh");
        let limit = format!("ulimit -v {kilobytes}; exec \"$0\" \"$@\"");
        command.args(["-c", &limit]).arg(supine_command().get_program()).arg("batch");
        command.arg(&shared().case).args(["--jobs", "2", "--out"]).arg(at.join("lacking"));
        let said = Outcome::of(&mut command);
        assert_eq!(said.code, Some(75), "{kilobytes}: {}", said.stderr);
    }

    let out = at.join("cohort");
    let [a, b] = ["a", "b"].map(|name| case(at, name, &Case::small().with("ct", "'/nowhere'")));
    let order = || {
        let said = supine(&[&"batch", &a, &b, &"--out", &out, &"--jobs", &"1"]);
        let names = said.stdout.lines().map(|line| {
            let told: Value = serde_json::from_str(line).expect("a line of JSON");
            told["case"].as_str().unwrap_or_default().to_owned()
        });
        names.collect::<Vec<_>>()
    };
    assert_eq!(order(), ["a", "b"]);
    let kept = out.join("status/a.json");
    let text =
        std::fs::read_to_string(&kept).expect("a status").replace("input-missing", "not-ended");
    std::fs::write(&kept, text).expect("it can be written");
    assert_eq!(order(), ["b", "a"]);
}

/// The processes that another has started, by what the system tells of each.
fn children(of: u32) -> Vec<String> {
    let parent = |process: &str| -> Option<u32> {
        let told = std::fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
        // After the name, which may hold anything: the state, and the parent.
        told.rsplit_once(')')?.1.split_whitespace().nth(1)?.parse().ok()
    };
    let all = std::fs::read_dir("/proc").expect("the system tells of processes").flatten();
    let names = all.map(|entry| entry.file_name().to_string_lossy().into_owned());
    names.filter(|name| parent(name) == Some(of)).collect()
}

#[test]
fn a_case_that_the_system_ends_ends_itself_alone() {
    let folder = scratch();
    let (at, out) = (folder.path(), folder.path().join("out"));
    let cases = ["a", "b"].map(|name| case(at, name, &Case::small()));
    shared().begin(&out.join("runs/b"));
    let mut command = supine_command();
    command.arg("batch").args(&cases).arg("--out").arg(&out).args(["--jobs", "1"]);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let child = command.spawn().expect("supine can be started");
    let begun = Instant::now();
    while !out.join("runs/a/.stages").is_dir() {
        assert!(begun.elapsed() < PATIENCE, "the first case does not begin");
        std::thread::sleep(Duration::from_millis(10));
    }
    // As the system does when memory runs out. No other case can run beside the first.
    let started = children(child.id());
    assert_eq!(started.len(), 1, "a process for the case");
    let kill = Command::new("kill").arg("-KILL").args(&started).status().expect("kill");
    assert!(kill.success());
    let said = child.wait_with_output().expect("it ends");
    let text = String::from_utf8_lossy(&said.stderr);
    assert_eq!(said.status.code(), Some(75), "{text}");
    let told = status(&out.join("status/a.json"));
    assert_eq!((&told["error"]["code"], &told["exit"]), (&"not-ended".into(), &75.into()));
    assert_eq!(status(&out.join("status/b.json"))["status"], "flagged", "{text}");
    assert_same_bytes(&out.join("runs/b"), &shared().out);
}

#[test]
fn a_second_ctrl_c_leaves_how_the_run_ended() {
    let folder = scratch();
    let file = folder.path().join("status.json");
    let case = case(folder.path(), "a", &Case::small()).join("case.toml");
    let mut command = supine_command();
    command.arg("run").arg(case).arg("--out").arg(folder.path().join("out"));
    command.arg("--status").arg(&file).stdin(Stdio::null()).stdout(Stdio::null());
    let mut child = command.stderr(Stdio::piped()).spawn().expect("supine can be started");
    let begun = Instant::now();
    while !folder.path().join("out/.stages").is_dir() {
        let ended = child.try_wait().expect("it can be asked");
        assert!(ended.is_none() && begun.elapsed() < PATIENCE, "it does not begin: {ended:?}");
        std::thread::sleep(Duration::from_millis(10));
    }
    assert_eq!(status(&file)["error"]["code"], "not-ended");
    let (id, stderr) = (child.id().to_string(), child.stderr.take().expect("it is piped"));
    let interrupt = || {
        let kill = Command::new("kill").args(["-INT", &id]).output();
        kill.expect("kill can be started");
    };
    interrupt();
    let mut lines = BufReader::new(stderr).lines();
    lines.find(|line| line.as_ref().is_ok_and(|line| line.contains("Ctrl-C again")));
    interrupt();
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    let told = status(&file);
    assert_eq!((&told["status"], &told["exit"]), (&"stopped".into(), &130.into()));
}
