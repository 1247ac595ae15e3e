//! Archives on the network: Orthanc and dcmtk in a network name space of their own.

use crate::shared::{scratch, shared};
use std::path::Path;
use std::process::Command;
use supine_tests::{Outcome, root, source, supine_command, target};

/// How a network name space of one's own is had: as root, or as root of a user name space.
const WAYS: [&[&str]; 2] = [&["-n"], &["-r", "-n"]];

/// The words that run a command in a network name space with a loopback device; none where the
/// system does not allow it.
fn name_space() -> Option<Command> {
    let set_up = "ip link set lo up && exec \"$@\"";
    let command = |way: &[&str]| {
        let mut command = Command::new("unshare");
        command.args(way).args(["sh", "-c", set_up, "sh"]);
        command
    };
    let works = |way: &&&[&str]| {
        command(way).arg("true").output().is_ok_and(|output| output.status.success())
    };
    WAYS.iter().find(works).map(|way| command(way))
}

/// Debian puts Orthanc where only root's path looks.
fn path() -> std::ffi::OsString {
    let mut path = std::env::var_os("PATH").unwrap_or_default();
    path.push(":/usr/sbin:/sbin");
    path
}

/// Runs a script of `tests/readers` beside archives, where the system allows it; what it says.
fn beside_archives(script: &str) -> String {
    let Some(mut command) = name_space() else {
        return "left out: `unshare -n` is not permitted here, and Orthanc listens on every address"
            .into();
    };
    for program in ["Orthanc", "storescp", "findscu", "dcmqrscp", "openssl"] {
        let found = std::env::split_paths(&path()).any(|folder| folder.join(program).is_file());
        assert!(found, "`{program}` is not installed: run `cargo xtask readers` once");
    }
    let folder = scratch();
    command.arg(target().join("readers/bin/python")).arg("-B");
    command.arg(root().join("tests/readers").join(script));
    command.arg(supine_command().get_program()).arg(shared().out.join("ct")).arg(source());
    let said = Outcome::of(command.arg(folder.path()).env("PATH", path()));
    let logs = || logs(folder.path());
    assert_eq!(said.code, Some(0), "{script}\n{}\n{}\n{}", said.stdout, said.stderr, logs());
    said.stdout
}

#[test]
fn what_is_sent_to_an_archive_comes_back_and_broken_associations_lose_nothing() {
    println!("{}", beside_archives("archive.py"));
}

#[test]
fn over_tls_each_side_proves_who_it_is_and_refusals_say_what_to_do() {
    println!("{}", beside_archives("secure.py"));
}

#[test]
fn an_archive_of_implicit_vr_gets_every_element_as_it_was() {
    println!("{}", beside_archives("implicit.py"));
}

#[test]
fn all_that_a_run_leaves_comes_back_from_an_archive_to_the_byte() {
    println!("{}", beside_archives("whole.py"));
}

#[test]
fn a_study_of_two_patients_and_classes_that_are_not_listed() {
    println!("{}", beside_archives("query_retrieve.py"));
}

/// What the archives said, each in a file.
fn logs(folder: &Path) -> String {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path());
    let logs = entries.filter(|path| path.extension().is_some_and(|end| end == "log"));
    logs.map(|log| {
        let text = std::fs::read_to_string(&log).unwrap_or_default();
        format!("-- {}\n{text}\n", log.display())
    })
    .collect()
}
