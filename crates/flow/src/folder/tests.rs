//! What the folder keeps and refuses.

use super::*;
use serde_json::json;

fn record(key: &str) -> Record {
    let (files, facts, warnings) = (vec![], json!(5), vec![]);
    Record { key: key.into(), method: 1, parents: vec![], files, facts, warnings }
}

fn folder(dir: &Path) -> RunFolder {
    RunFolder::open(dir).unwrap()
}

#[test]
fn a_result_is_there_until_its_key_or_a_file_changes() {
    let dir = tempfile::tempdir().unwrap();
    let f = folder(dir.path());
    let there = |key: &str| f.result(NodeId::Mesh, &key.to_owned()).is_some();
    let file = f.shelf(NodeId::Mesh).place("mesh").unwrap();
    fs::write(&file, "mesh").unwrap();
    f.keep(NodeId::Mesh, record("k1")).unwrap();
    assert!(there("k1") && !there("k2"));
    fs::write(&file, "mesh").unwrap();
    assert!(there("k1"), "written again with the same content");
    fs::write(&file, "mush").unwrap();
    assert!(!there("k1"));
    fs::write(&file, "mesh").unwrap();
    fs::remove_file(&file).unwrap();
    assert!(!there("k1"));
}

#[test]
fn hidden_files_count_as_those_that_are_seen() {
    let dir = tempfile::tempdir().unwrap();
    let f = folder(dir.path());
    let curved = f.shelf(NodeId::Mesh).place("curved").unwrap();
    fs::write(&curved, "offsets").unwrap();
    f.keep(NodeId::Mesh, record("k")).unwrap();
    assert!(f.result(NodeId::Mesh, &"k".into()).is_some());
    fs::remove_file(&curved).unwrap();
    assert!(f.result(NodeId::Mesh, &"k".into()).is_none());
}

#[test]
fn clearing_a_node_takes_its_files_and_the_result_is_kept_until_another_is_finished() {
    let dir = tempfile::tempdir().unwrap();
    let f = folder(dir.path());
    for node in [NodeId::Mesh, NodeId::Solve] {
        let name = names::ARTIFACTS.iter().find(|(n, ..)| *n == node).unwrap().1;
        fs::write(f.shelf(node).place(name).unwrap(), "x").unwrap();
        f.keep(node, record("k")).unwrap();
    }
    let summary = r#"{"tool": {"name": "supine"}, "outputs": []}"#;
    fs::write(dir.path().join(names::SUMMARY), summary).unwrap();
    f.retire(&[NodeId::Solve].into()).unwrap();
    assert_eq!(f.clear(NodeId::Solve).unwrap(), Vec::<PathBuf>::new());
    let kept = dir.path().join(names::PREVIOUS);
    for name in [names::SUMMARY, "mesh/deformed.vtu", "mesh/rest.vtu"] {
        assert!(kept.join(name).exists(), "{name}");
    }
    assert!(f.result(NodeId::Mesh, &"k".into()).is_some());
    assert!(f.result(NodeId::Solve, &"k".into()).is_none());
    assert!(!dir.path().join("mesh/deformed.vtu").exists());
    assert!(!dir.path().join(names::SUMMARY).exists());
}

#[test]
fn what_no_run_made_is_not_touched() {
    let dir = tempfile::tempdir().unwrap();
    let mine = dir.path().join("ct/IM0001");
    fs::create_dir(dir.path().join("ct")).unwrap();
    fs::write(&mine, "a patient").unwrap();
    assert!(matches!(RunFolder::open(dir.path()), Err(Error::Foreign { .. })));
    assert!(mine.exists() && !dir.path().join(names::RECORDS).exists());
}

#[test]
fn results_of_the_version_before_are_set_aside_and_that_is_said() {
    let dir = tempfile::tempdir().unwrap();
    for old in ["labels-doubt.nrrd", ".stages/warped.nrrd", ".stages/mesh.json", "ct/1.dcm"] {
        let path = dir.path().join(old);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, "old").unwrap();
    }
    let opened = folder(dir.path());
    assert!(opened.is_former() && dir.path().join("ct").exists(), "nothing is lost by looking");
    opened.renew().unwrap();
    drop(opened);
    assert!(!dir.path().join("ct").exists() && !dir.path().join("labels-doubt.nrrd").exists());
    assert!(dir.path().join("set-aside/ct/1.dcm").exists());
    assert!(dir.path().join("set-aside/labels-doubt.nrrd").exists());
    assert!(!folder(dir.path()).is_former());
}

#[test]
fn inputs_where_the_run_writes_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let labels = dir.path().join("labels.seg.nrrd");
    fs::write(&labels, "edited by hand").unwrap();
    let beside = dir.path().join("mine.seg.nrrd");
    fs::write(&beside, "edited by hand").unwrap();
    let out = dir.path();
    let refused = refuse_overlap(out, "labels.file", &labels);
    assert!(matches!(refused, Err(Error::Overlap { key: "labels.file", .. })));
    assert!(refuse_overlap(out, "labels.file", &beside).is_ok());
    assert!(refuse_overlap(out, "ct", out).is_err(), "results among the input's files");
    assert!(refuse_overlap(&out.join("new"), "ct", out).is_err(), "out is yet to be made");
    assert!(refuse_overlap(out, "ct", Path::new("/nowhere")).is_ok());
}

/// A slice of hers may lie among what others wrote.
#[test]
fn what_was_set_aside_leaves_the_folder_of_a_de_identified_run() {
    let dir = tempfile::tempdir().unwrap();
    let root = dir.path().join("out");
    let f = folder(&root);
    for _ in 0..2 {
        fs::create_dir_all(root.join("ct")).unwrap();
        fs::write(root.join("ct/Thumbs.db"), "a viewer's").unwrap();
        assert_eq!(f.clear(NodeId::Export).unwrap(), [root.join("set-aside/ct")]);
        f.keep_case(&json!({})).unwrap();
        assert!(!root.join("set-aside").exists());
    }
    for kept in ["set-aside-1", "set-aside-2"] {
        assert!(dir.path().join("out-reidentification").join(kept).join("ct/Thumbs.db").exists());
    }
}

/// By what was sent from the result before, archives find the patient.
#[test]
fn what_was_sent_under_her_name_leaves_the_folder_of_a_de_identified_run() {
    for (anonymise, leaves) in [(false, true), (true, false)] {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path().join("out");
        let f = folder(&root);
        let case = json!({ "export": { "anonymise": anonymise } });
        let summary = json!({ "tool": { "name": "supine" }, "case": case });
        fs::write(root.join(names::SUMMARY), summary.to_string()).unwrap();
        fs::write(root.join(".supine-sent"), "PACS\t1.2.3\t5\t2026-01-01\n").unwrap();
        f.keep_case(&json!({})).unwrap();
        assert_eq!(root.join(".supine-sent").exists(), !leaves);
        let kept = dir.path().join("out-reidentification/.supine-sent");
        assert_eq!(kept.exists(), leaves);
    }
}

#[test]
fn a_folder_in_use_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let _first = folder(dir.path());
    assert!(matches!(RunFolder::open(dir.path()), Err(Error::Busy { .. })));
}

/// A run that is killed may have written a result and not yet its record: nobody knows then whose
/// it is.
#[test]
fn what_was_set_aside_goes_when_the_same_is_made_again() {
    for (again, stays) in [("mesh", false), ("mush", true)] {
        let dir = tempfile::tempdir().unwrap();
        let f = folder(dir.path());
        fs::write(f.shelf(NodeId::Mesh).place("mesh").unwrap(), "mesh").unwrap();
        let aside = f.clear(NodeId::Mesh).unwrap();
        assert_eq!(aside, [dir.path().join("set-aside/mesh/rest.vtu")]);
        assert!(aside[0].exists());
        fs::write(f.shelf(NodeId::Mesh).place("mesh").unwrap(), again).unwrap();
        f.keep(NodeId::Mesh, record("k")).unwrap();
        assert_eq!(aside[0].exists(), stays, "{again}");
        assert_eq!(dir.path().join("set-aside").exists(), stays, "an empty folder is left");
        assert!(dir.path().join("mesh/rest.vtu").exists());
    }
}

/// A run that is killed while it fills a folder leaves nothing under the folder's name, and what it
/// left under another goes when the next one begins.
#[test]
fn a_folder_is_there_with_all_its_files_or_not_at_all() {
    let dir = tempfile::tempdir().unwrap();
    let folder = RunFolder::open(dir.path()).unwrap();
    let shelf = folder.shelf(NodeId::Registration);
    let there = || dir.path().join("registration").exists();
    let stopped = shelf.fill("registrations", |passing| {
        fs::write(passing.join("deformable.dcm"), "half").unwrap();
        assert!(!there());
        Err::<(), _>(Error::NoFolder)
    });
    assert!(stopped.is_err() && !there());
    // As a kill leaves it.
    let begun = dir.path().join(".supine-aB3dE6");
    fs::create_dir(&begun).unwrap();
    fs::write(begun.join(".supine-Xy12Zw.part"), "half").unwrap();
    drop(folder);
    let folder = RunFolder::open(dir.path()).unwrap();
    assert!(!begun.exists());
    let write = |passing: &Path| {
        for name in ["deformable.dcm", "chest-wall.dcm"] {
            fs::write(passing.join(name), name).unwrap();
        }
        Ok(())
    };
    folder.shelf(NodeId::Registration).fill("registrations", write).unwrap();
    let left = fs::read_dir(dir.path().join("registration")).unwrap().count();
    assert!(left == 2 && !dir.path().join("set-aside").exists());
}
