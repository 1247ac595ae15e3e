//! The page in a browser: the whole job by mouse and keyboard, and what the command line makes of
//! the same case.
#![expect(clippy::disallowed_methods, reason = "tests of files")]

use serde_json::Value;
use std::ffi::OsString;
use std::path::Path;
use supine_tests::{copy_series, readers_python, supine, supine_command, target};

#[test]
fn the_whole_job_by_mouse_and_keyboard_leaves_what_the_command_line_leaves() {
    let scratch = tempfile::tempdir().expect("a folder");
    let folder = scratch.path().join("patient");
    std::fs::create_dir(&folder).expect("a folder of the patient");
    let (_, slices) = copy_series(&folder);
    // The breast lies in the middle ones.
    for slice in slices[..26].iter().chain(&slices[70..]) {
        std::fs::remove_file(slice).expect("a slice can be left out");
    }
    let objects = folder.join("rt");
    std::fs::create_dir(&objects).expect("a folder of dose and structures");
    let words: [OsString; 3] =
        [folder.join("ct").into(), objects.into(), "91.37,-248.09,-594.5".into()];
    readers_python("own_objects.py", words).success("dose and structures");
    let pictures = target().join("page");
    std::fs::create_dir_all(&pictures).expect("a folder for pictures");
    let command = supine_command();
    // Both write the time that the tests' runs have.
    let time = command.get_envs().find(|(name, _)| *name == "SOURCE_DATE_EPOCH");
    let time: OsString = time.and_then(|(_, value)| value).expect("a time").into();
    let binary = command.get_program().to_os_string();
    let words = [binary, folder.clone().into(), pictures.into(), time];
    readers_python("page.py", words).success("the job in the page");
    let (result, again) = (folder.join("result"), folder.join("again"));
    supine(&[&"run", &folder.join("case.toml"), &"--out", &again, &"--quiet"])
        .success("the same case by the command line");
    supine(&[&"verify-export", &result.join("ct"), &"--source", &folder.join("ct")])
        .success("verify-export");
    let [page, line] = [&result, &again].map(|out| summary(out));
    assert!(page == line, "{page}\n{line}");
}

/// Head or feet first, flipped rows, other orientations of the slices, a tilted one, and 600
/// slices.
#[test]
fn the_planes_of_grids_of_all_kinds_are_shown_voxel_by_voxel() {
    let scratch = tempfile::tempdir().expect("a folder");
    let binary = supine_command().get_program().to_os_string();
    let words = [binary, scratch.path().into()];
    readers_python("page_grids.py", words).success("planes of unusual grids");
}

/// The summary, which names every file with its hash, without times.
fn summary(out: &Path) -> Value {
    let text = std::fs::read_to_string(out.join("summary.json")).expect("a summary");
    let mut summary: Value = serde_json::from_str(&text).expect("JSON");
    summary.as_object_mut().expect("an object").remove("run");
    summary
}
