//! Trials of a folder: a run that is killed wherever it is, several runs at once, a disk that
//! fills. Nothing under a final name is ever half-written, and the run that comes to its end leaves
//! the bytes of one that nothing befell.

use crate::interrupt::PATIENCE;
use crate::repeat::assert_same_bytes;
use crate::shared::{run, scratch, shared};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use supine_tests::{Outcome, files_below, forgotten, results, supine_command};

/// A run of the small case in a folder, at work.
fn start(out: &Path) -> Child {
    let mut command = supine_command();
    command.arg("run").arg(&shared().case).arg("--out").arg(out);
    command.args(["--no-progress", "--threads", "2"]);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().expect("supine can be started")
}

/// Files in a folder that is being written, those under passing names too.
fn count(folder: &Path) -> usize {
    let Ok(entries) = std::fs::read_dir(folder) else { return 0 };
    let paths = entries.flatten().map(|entry| entry.path());
    paths.map(|path| if path.is_dir() { count(&path) } else { 1 }).sum()
}

/// Fails unless what has its final name has the bytes of the whole run. What was being written may
/// be left under passing names.
fn assert_nothing_is_half_written(out: &Path) {
    let passing = forgotten(out);
    for path in results(out).iter().filter(|path| !passing.contains(path)) {
        let [ours, whole] = [out, &shared().out].map(|from| std::fs::read(from.join(path)));
        let whole = whole.unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        assert!(ours.expect("it is read") == whole, "{} is not whole", path.display());
    }
}

/// Waits until the folder holds so many files or the program has ended; whether it is still at
/// work.
fn wait_for(files: usize, out: &Path, child: &mut Child) -> bool {
    let begun = Instant::now();
    while child.try_wait().expect("it can be asked").is_none() {
        if count(out) >= files {
            return true;
        }
        assert!(begun.elapsed() < PATIENCE, "{} of {files} files are there", count(out));
        std::thread::sleep(Duration::from_millis(1));
    }
    false
}

#[cfg(unix)]
#[test]
fn a_run_that_is_killed_wherever_it_is_goes_on_to_the_same_bytes() {
    let folder = scratch();
    let out = folder.path().join("out");
    let whole = files_below(&shared().out).len();
    // A kill as soon as some more files are there, wherever in the writing of them that is.
    let mut kills = 0;
    for more in [1, 2, 3, 1, 5, 8, 13, 2, 21, 34, 3, 8, 1, 2] {
        let mut child = start(&out);
        let before = count(&out);
        if wait_for((before + more).min(whole), &out, &mut child) {
            child.kill().expect("it can be killed");
            kills += 1;
        }
        child.wait().expect("it ends");
        assert_nothing_is_half_written(&out);
    }
    assert!(kills >= 10, "{kills} runs were killed before they ended");
    run(&shared().case, &out, 2).success("the run after all kills");
    assert_eq!(results(&out), results(&shared().out));
    assert_same_bytes(&out, &shared().out);
    assert!(forgotten(&out).is_empty(), "{:?}", forgotten(&out));
}

#[test]
fn of_three_runs_in_one_folder_one_works_and_the_others_say_so() {
    let folder = scratch();
    let out = folder.path().join("out");
    let mut first = start(&out);
    assert!(wait_for(1, &out, &mut first), "the first run is at work");
    for _ in 0..2 {
        let said = run(&shared().case, &out, 1);
        assert_eq!(said.code, Some(75), "{}", said.stderr);
        assert!(said.stderr.contains("another run is at work in"), "{}", said.stderr);
    }
    let ended = first.wait_with_output().expect("it ends");
    assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
    assert_eq!(results(&out), results(&shared().out));
    assert_same_bytes(&out, &shared().out);
}

/// The program runs on a disk that is too small, then on larger ones; what it left is copied out
/// each time with what it said.
#[cfg(target_os = "linux")]
const FILLS: &str = r#"
mount -t tmpfs -o size=1m tmpfs "$1" || exit 99
for size in 1 6 14 24 33 200; do
    mount -o remount,size=${size}m "$1" || exit 99
    "$3" run "$4" --out "$1/out" --no-progress --threads 2 --status "$2/$size.json" 2> "$2/$size.txt"
    echo $? > "$2/$size.code"
    cp -r "$1/out" "$2/$size" || exit 98
done
"#;

#[cfg(target_os = "linux")]
#[test]
fn a_disk_that_fills_anywhere_costs_nothing_but_the_rest_of_the_run() {
    let folder = scratch();
    let (disk, left) = (folder.path().join("disk"), folder.path().join("left"));
    for made in [&disk, &left] {
        std::fs::create_dir(made).expect("it can be made");
    }
    let mut command = Command::new("unshare");
    command.args(["--mount", "--map-root-user", "sh", "-c", FILLS, "sh"]).arg(&disk).arg(&left);
    let program = supine_command();
    // Its clock and all else by which runs of the tests are alike.
    let set = program.get_envs().filter_map(|(name, value)| Some((name, value?)));
    command.envs(set).arg(program.get_program()).arg(&shared().case);
    let said = Outcome::of(&mut command);
    if said.code == Some(1) && said.stderr.contains("unshare failed") || said.code == Some(99) {
        println!("left out: this system lets nobody mount: {}", said.stderr);
        return;
    }
    assert_eq!(said.code, Some(0), "{}", said.stderr);
    let text = |name: String| std::fs::read_to_string(left.join(name)).expect("it was written");
    for size in ["1", "6", "14", "24", "33"] {
        let (code, said) = (text(format!("{size}.code")), text(format!("{size}.txt")));
        assert_eq!(code.trim(), "75", "{size} MB: {said}");
        assert!(said.contains("No space left on device"), "{size} MB: {said}");
        assert!(text(format!("{size}.json")).contains("\"exit\": 75"), "{size} MB: its status");
        let out = left.join(size);
        assert!(!out.join("summary.json").exists(), "{size} MB: the run did not end");
        assert!(forgotten(&out).is_empty(), "{size} MB: {:?}", forgotten(&out));
        assert_same_bytes(&out, &shared().out);
    }
    assert_eq!(text("200.code".into()).trim(), "0", "{}", text("200.txt".into()));
    assert_eq!(results(&left.join("200")), results(&shared().out));
    assert_same_bytes(&left.join("200"), &shared().out);
}
