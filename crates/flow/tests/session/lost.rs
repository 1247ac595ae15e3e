//! Nothing is lost: neither a result, nor what a user keeps beside it, and no result is taken for
//! that of another patient.

use crate::support::{
    assert_same, finished_patient, patient, read_all, run, value as dicom_value, write_all,
};
use std::fs;
use std::path::{Path, PathBuf};
use supine_flow::batch::{Batch, BatchObserver, batch, run_one};
use supine_flow::commands::Colour;
use supine_flow::commands::run::Run;
use supine_flow::commands::usable::unusable;
use supine_flow::{Error, Options, RunFolder, Session, Spec, Unwatched};

/// A finished run of the patient, in a folder of its own.
struct Done {
    dir: tempfile::TempDir,
    case: String,
}

impl Done {
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        Self { case: finished_patient(dir.path()), dir }
    }

    fn at(&self, path: &str) -> PathBuf {
        self.dir.path().join(path)
    }

    fn out(&self) -> PathBuf {
        self.at("out")
    }

    /// Runs another case into its folder.
    fn run(&self, case: &str) -> Result<(), String> {
        run(case, self.dir.path(), &self.out()).map(drop)
    }
}

/// The CT of another woman: the same slices under other UIDs, brighter.
fn another_ct(done: &Done) {
    let files = read_all(&done.at("ct"));
    let other = files.into_iter().map(|(name, mut file)| {
        for tag in [0x0020_000d, 0x0020_000e] {
            let uid = dicom_value(&mut file, tag, b"UI");
            let last = uid.iter().rposition(u8::is_ascii_digit).unwrap();
            uid[last] = if uid[last] == b'1' { b'2' } else { b'1' };
        }
        dicom_value(&mut file, 0x0028_1052, b"DS").copy_from_slice(b"-1023 ");
        (name, file)
    });
    write_all(&done.at("other"), &other.collect());
}

#[test]
fn a_file_that_any_key_names_is_not_written_over() {
    let done = Done::new();
    // Not what the key stands for: it is refused before it is read.
    for (line, name) in [
        ("scans = { intraop = \"NAME\" }", "report/mine.ply"),
        ("scans = { sitting = \"s.ply\", landmarks = \"NAME\" }", "report/mine.json"),
        ("carry = { points = \"NAME\" }", "mesh/mine.csv"),
        ("seeds = { file = \"NAME\" }", "ct/mine.csv"),
    ] {
        fs::write(done.out().join(name), "mine").unwrap();
        let line = line.replace("NAME", &format!("out/{name}"));
        let said = done.run(&format!("{}{line}\n", done.case)).unwrap_err();
        assert!(said.contains("would be lost"), "{line}: {said}");
        assert_eq!(fs::read(done.out().join(name)).unwrap(), b"mine", "{line}");
    }
}

#[test]
fn a_finished_result_stays_when_another_case_is_run_into_its_folder() {
    let done = Done::new();
    let before = read_all(&done.out());
    another_ct(&done);
    for other in ["ct = \"other\"", "ct = \"nowhere\"", "ct = \"case.toml\""] {
        fs::write(done.at("case.toml"), "no CT").unwrap();
        let said = done.run(&done.case.replace("ct = \"ct\"", other)).unwrap_err();
        assert!(said.contains("--overwrite") && said.contains("/ct"), "{other}: {said}");
        assert!(read_all(&done.out()) == before, "{other}: nothing was touched");
    }
    // The same place, where another woman's CT lies now.
    let slices = read_all(&done.at("other"));
    write_all(&done.at("ct"), &slices);
    assert!(done.run(&done.case).unwrap_err().contains("--overwrite"));
    assert!(read_all(&done.out()) == before);
}

#[test]
fn a_result_without_its_summary_stays_too() {
    let done = Done::new();
    another_ct(&done);
    let other = done.case.replace("ct = \"ct\"", "ct = \"other\"");
    assert!(other != done.case, "{other}");
    fs::remove_file(done.out().join("summary.json")).unwrap();
    let before = read_all(&done.out().join("ct"));
    let said = done.run(&other).unwrap_err();
    assert!(said.contains("the finished result of another CT"), "{said}");
    assert_eq!(read_all(&done.out().join("ct")), before);
    done.run(&done.case).unwrap();
    assert!(done.out().join("summary.json").exists(), "its own case makes it whole");
    // Nor does another run go among its results.
    let within = run(&other, done.dir.path(), &done.out().join("ct")).map(drop).unwrap_err();
    assert!(within.contains("lies among the results of another run"), "{within}");
    assert_eq!(read_all(&done.out().join("ct")), before);
}

#[test]
fn a_result_that_may_be_replaced_is_kept_until_another_is_finished() {
    let done = Done::new();
    let before = read_all(&done.out());
    // The tumour lies in air: the run fails after all that rests on it was begun anew.
    let fails = done.case.replace("91.37", "191.37");
    done.run(&fails).unwrap_err();
    assert!(!done.out().join("summary.json").exists(), "what is there is of no case that was run");
    let kept = read_all(&done.out().join("previous"));
    let shown = |name: &&String| !name.starts_with('.') && *name != "log.jsonl";
    let lost: Vec<_> =
        before.keys().filter(shown).filter(|name| kept.get(*name) != before.get(*name)).collect();
    assert!(lost.is_empty(), "lost: {lost:?}");
    // Another woman's CT does not take the place of what was set aside.
    another_ct(&done);
    let said = done.run(&done.case.replace("ct = \"ct\"", "ct = \"other\"")).unwrap_err();
    assert!(said.contains("--overwrite"), "{said}");
    assert!(read_all(&done.out().join("previous")) == kept, "nothing was touched");
    done.run(&done.case.replace("ap = 7.0", "ap = 6.0")).unwrap();
    assert!(!done.out().join("previous").exists(), "another is finished");
}

#[test]
fn what_lies_among_results_and_what_was_changed_in_them_is_set_aside() {
    let done = Done::new();
    fs::write(done.out().join("report/note.txt"), "mine").unwrap();
    fs::write(done.out().join("field/.hidden"), "mine").unwrap();
    fs::write(done.out().join("points.csv"), "changed by me").unwrap();
    done.run(&done.case.replace("ap = 7.0", "ap = 6.0")).unwrap();
    let aside = done.out().join("set-aside");
    assert_eq!(fs::read(aside.join("report/note.txt")).unwrap(), b"mine");
    assert_eq!(fs::read(aside.join("points.csv")).unwrap(), b"changed by me");
    let cold = done.at("cold");
    fs::remove_dir_all(&aside).unwrap();
    run(&done.case.replace("ap = 7.0", "ap = 6.0"), done.dir.path(), &cold).unwrap();
    let hidden = done.out().join("field/.hidden");
    // Beside files that stayed it stays too.
    if hidden.exists() {
        fs::remove_file(hidden).unwrap();
    }
    assert_same("with files of a user's among them", &done.out(), &cold);
}

#[test]
fn a_summary_is_not_repeated_with_another_ct() {
    let done = Done::new();
    let summary = done.out().join("summary.json");
    let text = fs::read_to_string(&summary).unwrap();
    assert!(text.contains("\"case_folder\""), "it says where its paths lead from");
    // By the folder that it says, whatever the working folder is.
    let here = done.at("here");
    let moved = text.replace(
        &serde_json::from_str::<serde_json::Value>(&text).unwrap()["run"]["case_folder"]
            .to_string(),
        &serde_json::Value::from(done.dir.path().to_str().unwrap()).to_string(),
    );
    fs::create_dir(&here).unwrap();
    fs::write(here.join("summary.json"), moved).unwrap();
    let spec = Spec::read(&here.join("summary.json")).unwrap();
    Session::new(spec.clone(), 1).unwrap();
    another_ct(&done);
    let slices = read_all(&done.at("other"));
    write_all(&done.at("ct"), &slices);
    let refused = Session::new(spec.clone(), 1).unwrap_err();
    assert!(matches!(refused, Error::InputsChanged { key: "ct", .. }), "{refused}");
    assert!(refused.to_string().contains("--inputs-changed"), "{refused}");
    Session::new(spec.clone().with_inputs_changed(), 1).unwrap();
    // Another CT that is asked for is no repetition.
    let mut other = spec;
    other.set("ct", &serde_json::json!("other")).unwrap();
    Session::new(other, 1).unwrap();
}

#[test]
fn a_number_that_was_changed_in_a_record_is_no_result() {
    let done = Done::new();
    let record = done.out().join(".stages/interval.json");
    let text = fs::read_to_string(&record).unwrap();
    let digit = text.rfind(|c: char| ('1'..='8').contains(&c)).unwrap();
    let changed = format!("{}9{}", &text[..digit], &text[digit + 1..]);
    fs::write(&record, changed).unwrap();
    let made = run(&done.case, done.dir.path(), &done.out()).unwrap();
    assert!(made.contains(&supine_flow::NodeId::Interval), "{made:?}");
}

#[test]
fn the_result_before_a_run_that_failed_does_not_pass_for_what_the_case_asks() {
    let done = Done::new();
    let (out, case) = (done.out(), done.at("case.toml"));
    let run = || {
        let given = Run {
            case: case.clone(),
            changes: vec![],
            anonymise: false,
            out: out.clone(),
            options: Options::default(),
            start: None,
        };
        supine_flow::commands::run::run(&given, &Unwatched)
    };
    let why = || unusable(std::slice::from_ref(&out)).unwrap().pop().map(|found| found.why);
    for (wrong, code) in [("brest = 'left'\n", "case-key-unknown"), ("ct = 'no'\n", "case-key")] {
        fs::write(&case, wrong).unwrap();
        run().unwrap_err();
        let why = why().unwrap();
        assert!(why.contains("a later run into this folder failed") && why.contains(code), "{why}");
        assert!(out.join("summary.json").is_file(), "what is finished stays");
    }
    fs::write(&case, &done.case).unwrap();
    run().unwrap();
    assert_eq!(why(), None);
    // A batch finds it finished, and runs nothing.
    let cohort = done.at("cohort");
    let kept = cohort.join("runs/p1");
    fs::create_dir_all(cohort.join("runs")).unwrap();
    fs::rename(&out, &kept).unwrap();
    let again = |text: &str| {
        fs::write(done.at("p1.toml"), text).unwrap();
        let given = Batch {
            cases: vec![done.at("p1.toml")],
            out: cohort.clone(),
            jobs: Some(1),
            memory: None,
            cores: 1,
            changes: vec![],
            anonymise: false,
            worst: Colour::Amber,
            options: Options::default(),
            start: None,
        };
        batch(&given, &|one, observer| Ok(run_one(&given, one, observer)), &Silent).unwrap();
        unusable(std::slice::from_ref(&kept)).unwrap().pop().map(|found| found.why)
    };
    assert!(again("brest = 'left'\n").unwrap().contains("case-key-unknown"));
    assert_eq!(again(&done.case), None);
}

struct Silent;

impl BatchObserver for Silent {}

#[test]
fn what_was_changed_in_a_result_does_not_leave() {
    let why = |change: &dyn Fn(&Path)| {
        let done = Done::new();
        change(&done.out());
        let found = unusable(&[done.out()]).unwrap();
        found.first().map(|found| (found.changed, found.why.clone()))
    };
    let first = |out: &Path| {
        let mut slices: Vec<_> = read_all(&out.join("ct")).into_keys().collect();
        slices.sort();
        out.join("ct").join(&slices[0])
    };
    assert_eq!(why(&|_| {}), None);
    let slice = why(&|out| {
        let path = first(out);
        let mut bytes = fs::read(&path).unwrap();
        *bytes.last_mut().unwrap() ^= 1;
        fs::write(path, bytes).unwrap();
    });
    assert!(
        slice.as_ref().is_some_and(|(changed, why)| *changed && why.starts_with("ct is not")),
        "{slice:?}"
    );
    let deleted = why(&|out| fs::remove_file(first(out)).unwrap());
    assert!(deleted.is_some_and(|(changed, _)| changed));
    let carried = why(&|out| {
        fs::copy(first(out), out.join("carried.dcm")).unwrap();
    });
    assert!(carried.is_some_and(|(_, why)| why.starts_with("carried.dcm lies")));
    let verdict = why(&|out| {
        let path = out.join("summary.json");
        let text = fs::read_to_string(&path).unwrap();
        let mut summary: serde_json::Value = serde_json::from_str(&text).unwrap();
        let own = summary["verdict"]["colour"].as_str().unwrap().to_owned();
        summary["verdict"]["colour"] = if own == "green" { "amber" } else { "green" }.into();
        fs::write(path, summary.to_string()).unwrap();
    });
    assert!(verdict.is_some_and(|(changed, why)| changed && why.contains("verdict")));
    let running = why(&|out| {
        let path = out.join("summary.json");
        let text = fs::read_to_string(&path).unwrap();
        fs::write(path, text.replacen("\"status\": \"done\"", "\"status\": \"running\"", 1))
            .unwrap();
    });
    assert!(running.is_some_and(|(_, why)| why.contains("unfinished")));
}

#[test]
fn overwriting_is_asked_for() {
    let done = Done::new();
    another_ct(&done);
    let case = done.case.replace("ct = \"ct\"", "ct = \"other\"");
    let session = Session::new(Spec::from_text(&case, done.dir.path()).unwrap(), 2).unwrap();
    let folder = RunFolder::open(&done.out()).unwrap().overwriting(true);
    let session = session.with_folder(folder).unwrap();
    supine_flow::run(&session, Options::default(), &Unwatched).unwrap();
    assert!(!done.out().join("previous").exists());
}

#[test]
fn a_patient_who_lay_prone_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let case = patient(dir.path());
    let prone = read_all(&dir.path().join("ct")).into_iter().map(|(name, mut file)| {
        dicom_value(&mut file, 0x0018_5100, b"CS").copy_from_slice(b"HFP ");
        (name, file)
    });
    write_all(&dir.path().join("ct"), &prone.collect());
    let said = run(&case, dir.path(), &dir.path().join("out")).unwrap_err();
    assert!(said.contains("HFP: the patient lay prone"), "{said}");
    assert!(said.contains("say position = \"prone\""), "{said}");
    // Said so it is read, and no longer as of one who lies on her back.
    let said = run(&format!("position = 'prone'\n{case}"), dir.path(), &dir.path().join("out"));
    assert!(!said.is_err_and(|said| said.contains("HFP")));
}
