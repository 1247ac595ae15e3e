//! What cannot be done is said in one message, with the exit code of its kind.

use crate::session::{navigate, run_in, scratch};
use std::fmt::Write as _;
use std::net::TcpListener;
use supine_tests::Outcome;

/// The input cannot be used.
const INPUT: i32 = 1;
/// Wrong usage.
const USAGE: i32 = 2;
/// An output cannot be written.
const OUTPUT: i32 = 5;

fn assert_refused(said: &Outcome, code: i32, words: &[&str]) {
    let all = format!("stdout:\n{}\nstderr:\n{}", said.stdout, said.stderr);
    assert_eq!(said.code, Some(code), "{all}");
    assert!(said.stdout.is_empty(), "stdout is data\n{all}");
    for bad in ["panicked", "Error {", "Some(", "Caused by"] {
        assert!(!said.stderr.contains(bad), "{bad} is no word for people\n{all}");
    }
    for word in words {
        assert!(said.stderr.contains(word), "the message does not say {word}\n{all}");
    }
}

#[test]
fn a_folder_that_is_no_run_is_named() {
    let folder = scratch();
    let letters = folder.path().join("letters");
    std::fs::create_dir(&letters).unwrap();
    assert_refused(&navigate(&letters, &[]), INPUT, &["letters"]);
    assert_refused(&navigate(&folder.path().join("nowhere"), &[]), INPUT, &["nowhere"]);
}

#[test]
fn a_port_that_is_taken_and_a_file_that_is_there_are_named() {
    let folder = scratch();
    let run = run_in(folder.path());
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    assert_refused(&navigate(&run, &[&"--port", &port]), USAGE, &[&port, "--port"]);
    let record = folder.path().join("kept.jsonl");
    std::fs::write(&record, "mine\n").unwrap();
    let said = navigate(&run, &[&"--port", &"0", &"--record", &record]);
    assert_refused(&said, OUTPUT, &["kept.jsonl"]);
    assert_eq!(std::fs::read_to_string(&record).unwrap(), "mine\n");
}

#[test]
fn a_registration_that_cannot_be_read_names_its_line() {
    let folder = scratch();
    let run = run_in(folder.path());
    let table = folder.path().join("landmarks.csv");
    let head = "name,tracker_x,tracker_y,tracker_z,patient_x,patient_y,patient_z";
    // The letter O in place of a zero.
    let lines =
        ["sternum,0,0,0,10,-200,-600", "clavicle,1O0,0,0,110,-200,-600", "rib,0,90,0,10,-110,-600"];
    std::fs::write(&table, format!("{head}\n{}\n", lines.join("\n"))).unwrap();
    let words: [&dyn AsRef<std::ffi::OsStr>; 2] = [&"--registration", &table];
    assert_refused(&navigate(&run, &words), INPUT, &["line 3"]);
    std::fs::write(&table, format!("{head}\n{}\n{}\n", lines[0], lines[2])).unwrap();
    assert_refused(&navigate(&run, &words), INPUT, &["2 fiducials"]);
    let on_a_line = (0..4).fold(String::from(head), |mut text, n| {
        let _ = write!(text, "\nf{n},{},0,0,{},-200,-600", 30 * n, 30 * n);
        text
    });
    std::fs::write(&table, on_a_line + "\n").unwrap();
    assert_refused(&navigate(&run, &words), INPUT, &["lie on a line"]);
}

/// Poses of a tool whose tip, 180 mm from its marker, stays in a dent while the tool is tilted by
/// `tilt` degrees all round; each as the twelve numbers of a TRANSFORM, column by column.
fn pivot(tilt: f64, count: usize) -> String {
    let names: Vec<String> = (0..12).map(|n| format!("m{n}")).collect();
    let mut text = names.join(",");
    let (sin, cos) = tilt.to_radians().sin_cos();
    for n in 0..count {
        let (y, x) = (n as f64 / count as f64 * std::f64::consts::TAU).sin_cos();
        // A turn by the tilt about (x, y, 0).
        let columns = [
            [cos + x * x * (1.0 - cos), x * y * (1.0 - cos), -y * sin],
            [x * y * (1.0 - cos), cos + y * y * (1.0 - cos), x * sin],
            [y * sin, -x * sin, cos],
        ];
        let shift = [0, 1, 2].map(|axis| -180.0 * columns[2][axis]);
        let all: Vec<String> =
            columns.iter().chain([&shift]).flatten().map(|v| format!("{v:.9}")).collect();
        let _ = write!(text, "\n{}", all.join(","));
    }
    text + "\n"
}

#[test]
fn a_calibration_of_a_tool_that_hardly_tilted_is_refused() {
    let folder = scratch();
    let run = run_in(folder.path());
    let table = folder.path().join("pivot.csv");
    let words: [&dyn AsRef<std::ffi::OsStr>; 4] = [&"--calibration", &table, &"--port", &"0"];
    std::fs::write(&table, pivot(2.0, 40)).unwrap();
    assert_refused(&navigate(&run, &words), INPUT, &["condition", "tilted too little"]);
    // The same with a tilt of 30 degrees is taken: what is refused then is the latency.
    std::fs::write(&table, pivot(30.0, 40)).unwrap();
    let words = [&words[..], &[&"--latency=-1"]].concat();
    let said = navigate(&run, &words);
    assert_refused(&said, USAGE, &["--latency"]);
}
