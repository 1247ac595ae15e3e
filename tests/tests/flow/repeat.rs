//! The same case again: on another number of threads, after Ctrl-C, in the same folder.

use crate::interrupt::{PATIENCE, interrupt};
use crate::shared::{run, scratch, shared, summary};
use serde_json::Value;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use supine_tests::{Case, Outcome, forgotten, results, supine, supine_command};

/// `summary.json` without what differs from run to run.
fn lasting_summary(out: &Path) -> Value {
    let mut summary = summary(out);
    let run = summary.as_object_mut().and_then(|s| s.remove("run"));
    assert!(run.is_some(), "the summary holds `run`, the part that may differ");
    summary
}

/// Fails unless each result in `partial` has the bytes of the same result in `whole`.
pub(crate) fn assert_same_bytes(partial: &Path, whole: &Path) {
    for path in results(partial) {
        let (a, b) = (partial.join(&path), whole.join(&path));
        assert!(b.is_file(), "{} is in one run only", path.display());
        if path == Path::new("summary.json") {
            assert_eq!(lasting_summary(partial), lasting_summary(whole));
        } else {
            let same =
                std::fs::read(&a).expect("it is read") == std::fs::read(&b).expect("it is read");
            assert!(same, "{} differs between the runs", path.display());
        }
    }
}

#[test]
fn one_thread_and_two_leave_the_same_bytes() {
    let folder = scratch();
    let out = folder.path().join("out");
    run(&shared().case, &out, 1).success("supine run --threads 1");
    assert_eq!(results(&out), results(&shared().out));
    assert_same_bytes(&out, &shared().out);
}

#[test]
fn a_run_leaves_what_it_promises_and_nothing_else() {
    for name in
        ["labels.seg.nrrd", "mesh/rest.vtu", "mesh/deformed.vtu", "report/index.html", "log.jsonl"]
            .into_iter()
            .chain([
                "field/deformed_to_ct.nrrd",
                "field/deformed_to_ct.mat",
                "field/ct_to_deformed.nrrd",
                "field/jacobian.nrrd",
                "registration/deformable.dcm",
                "registration/chest-wall.dcm",
            ])
    {
        assert!(shared().out.join(name).is_file(), "{name} is missing");
    }
    assert!(forgotten(&shared().out).is_empty(), "{:?}", forgotten(&shared().out));
    let report = std::fs::read_to_string(shared().out.join("report/index.html"))
        .expect("the report is text");
    for outside in
        ["src=\"http", "href=\"http", "url(http", "<script src", "<link rel=\"stylesheet"]
    {
        assert!(!report.contains(outside), "the report is not self-contained: {outside}");
    }
}

/// Starts a run and waits until it has left something in its folder, or has ended.
fn start(out: &Path, left: &str) -> Child {
    let mut command = supine_command();
    command.arg("run").arg(&shared().case).arg("--out").arg(out);
    command.args(["--no-progress", "--threads", "1"]);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("supine can be started");
    let begun = Instant::now();
    while !out.join(left).exists() && is_running(&mut child) {
        assert!(begun.elapsed() < PATIENCE, "the run does not come to {left}");
        std::thread::sleep(Duration::from_millis(20));
    }
    child
}

fn is_running(child: &mut Child) -> bool {
    child.try_wait().expect("the run can be asked").is_none()
}

#[test]
fn ctrl_c_leaves_nothing_half_written_and_the_next_run_completes() {
    let folder = scratch();
    let out = folder.path().join("out");
    // Early, in the middle and later: whatever the stage, the same promise.
    for left in [".stages", ".stages/segment.json", ".stages/solve.json"] {
        let mut child = start(&out, left);
        assert!(is_running(&mut child), "the run ended: nothing was interrupted after {left}");
        let said = interrupt(child);
        assert_eq!(said.code, Some(130), "{}", said.stderr);
        assert!(said.stdout.is_empty(), "stdout is data");
        assert!(!out.join("summary.json").exists() && !out.join("report").exists());
        assert!(forgotten(&out).is_empty(), "after {left}: {:?}", forgotten(&out));
        assert_same_bytes(&out, &shared().out);
    }
    run(&shared().case, &out, 2).success("the run after Ctrl-C");
    assert_eq!(results(&out), results(&shared().out));
    assert_same_bytes(&out, &shared().out);
}

#[test]
fn a_second_run_does_nothing_and_a_changed_tilt_redoes_the_end() {
    let folder = scratch();
    let out = folder.path().join("out");
    let case = Case::small().write(folder.path());
    run(&case, &out, 2).success("the first run");
    assert_same_bytes(&out, &shared().out);
    let said = supine(&[&"run", &case, &"--out", &out, &"--json"]).success("the second run");
    let result: Value = serde_json::from_str(&said.stdout).expect("stdout is JSON, nothing else");
    assert_eq!(result["tumour"], lasting_summary(&out)["tumour"]);
    assert_eq!(redone(&out), Vec::<String>::new());
    assert_same_bytes(&out, &shared().out);

    let labels = std::fs::read(out.join("labels.seg.nrrd")).expect("there are labels");
    let case = Case::small().with("table", "{ ap = 0.0, lat = -10.0 }").write(folder.path());
    run(&case, &out, 2).success("the run with another tilt");
    assert_eq!(
        redone(&out),
        [
            "solve",
            "warp",
            "points",
            "interval",
            "export",
            "fields",
            "pictures",
            "registration",
            "structures",
            "report"
        ]
    );
    assert_eq!(labels, std::fs::read(out.join("labels.seg.nrrd")).expect("there are labels"));
}

/// The stages that the last run did itself, in order, but for those whose result is kept in memory
/// only and was needed: reading the CT, what exports say of its series.
fn redone(out: &Path) -> Vec<String> {
    let summary = summary(out);
    let stages = summary["run"]["stages"].as_array().expect("`run.stages` is a list");
    assert!(!stages.is_empty(), "the run names its stages");
    let own = stages.iter().filter(|stage| stage["cached"] == Value::Bool(false));
    let names = own.map(|stage| stage["name"].as_str().expect("a stage has a name").to_owned());
    names.filter(|name| !["import", "source"].contains(&name.as_str())).collect()
}

#[cfg(target_os = "linux")]
#[test]
fn a_finished_run_on_a_disk_that_cannot_be_written_is_finished() {
    let folder = scratch();
    let out = folder.path().join("out");
    shared().copy_to(&out);
    // A view of the folder in which nobody can write, for this program alone; root could write
    // against its mode.
    let script = "mount --bind \"$1\" \"$1\" && mount -o remount,bind,ro \"$1\" || exit 99; shift; exec \"$@\"";
    let again = |more: &[&str]| {
        let mut command = Command::new("unshare");
        command.args(["--mount", "--map-root-user", "sh", "-c", script, "sh"]).arg(&out);
        command.arg(supine_command().get_program()).arg("run").arg(&shared().case);
        Outcome::of(command.arg("--out").arg(&out).args(more))
    };
    let said = again(&[]);
    if said.code == Some(1) && said.stderr.contains("unshare failed") || said.code == Some(99) {
        println!("left out: this system lets nobody mount: {}", said.stderr);
        return;
    }
    let said = said.success("the finished run");
    assert!(said.stderr.contains("42 of 42 checks"), "{}", said.stderr);
    let said = again(&["--set", "table.ap=8"]);
    assert_eq!(said.code, Some(5), "{}", said.stderr);
    assert!(said.stderr.contains("Read-only"), "{}", said.stderr);
}
