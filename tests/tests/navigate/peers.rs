//! Two other implementations of OpenIGTLink as trackers and viewers. Their places are compared with
//! those of the recording, which no message has a hand in.

use crate::session::{Recorded, Session, recorded, run_in, scratch};
use serde_json::Value;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use supine_tests::{Outcome, readers_python, root, source, tool};

/// The planned centre of the sphere, LPS, mm: in front of the tumour. The shaft comes from the
/// front.
const PLACE: [f64; 3] = [91.4, -277.0, -594.5];
/// Places go over the wire as single precision: 4e-5 mm at 600 mm.
const NEAR_MM: f64 = 1e-3;

/// Starts a session with a planned place and a recording, lets a peer work with it, and gives what
/// the peer printed and what was recorded.
fn session_with(
    frame: &str,
    folder: &Path,
    peer: impl FnOnce(u16, &Path) -> Outcome,
) -> (Vec<Value>, Vec<Recorded>) {
    let (run, record) = (run_in(folder), folder.join("session.jsonl"));
    let at = PLACE.map(|mm| mm.to_string()).join(",");
    // The run's own elements: the image is then that of its field.
    let words: [&dyn AsRef<std::ffi::OsStr>; 10] = [
        &"--order",
        &"1",
        &"--frame",
        &frame,
        &"--at",
        &at,
        &"--from",
        &"0,-1,0",
        &"--record",
        &record,
    ];
    let session = Session::start(&run, &words);
    let said = peer(session.port, &run).success("the peer");
    let counts = session.end();
    let recorded = recorded(&record);
    let accepted = counts["poses"]["accepted"].as_u64();
    assert!(accepted.is_some_and(|n| n >= 5), "{counts}");
    assert_eq!(counts["poses"]["received"].as_u64(), accepted, "{counts}");
    let lines = said.stdout.lines().map(|line| serde_json::from_str(line).expect("JSON"));
    (lines.collect(), recorded)
}

/// Three numbers of a JSON value.
fn numbers(value: &Value) -> [f64; 3] {
    [0, 1, 2].map(|n| value[n].as_f64().unwrap_or_else(|| panic!("{value} has no number {n}")))
}

/// The last recorded place with a stamp, to 1 us.
fn place(recorded: &[Recorded], stamp_s: f64) -> [f64; 3] {
    let found = recorded.iter().rfind(|line| (line.stamp_s - stamp_s).abs() < 1e-6);
    found.unwrap_or_else(|| panic!("nothing was recorded for {stamp_s}")).at
}

fn assert_near(found: [f64; 3], wanted: [f64; 3], what: &str) {
    let off = (0..3).map(|axis| (found[axis] - wanted[axis]).abs()).fold(0.0, f64::max);
    assert!(off < NEAR_MM, "{what}: {found:?}, recorded {wanted:?}");
}

#[test]
fn pyigtl_sends_poses_in_ras_and_reads_the_tumour_and_the_image_as_they_are() {
    let folder = scratch();
    let (answers, recorded) = session_with("ras", folder.path(), |port, run| {
        let field = run.join("field/deformed_to_ct.nrrd");
        let mut words: Vec<OsString> = vec![port.to_string().into(), source().into(), field.into()];
        words.extend(PLACE.map(|mm| mm.to_string().into()));
        readers_python("igtl_pyigtl.py", words)
    });
    assert_eq!(answers.len(), 5);
    let mut ways = vec![];
    for answer in &answers {
        let [r, a, s] = numbers(&answer["at"]);
        let stamp_s = answer["stamp"].as_f64().expect("a stamp");
        assert_near([-r, -a, s], place(&recorded, stamp_s), "POINT by pyigtl");
        ways.push([-r, -a, s]);
    }
    let moved = (0..3).map(|axis| (ways[4][axis] - ways[0][axis]).abs()).fold(0.0, f64::max);
    assert!(moved > 0.05, "the tumour does not follow the applicator: {ways:?}");
}

/// Compiles the client of the C++ library.
fn client(folder: &Path) -> PathBuf {
    let headers = "/usr/include/openigtlink";
    assert!(
        Path::new(headers).is_dir(),
        "the C++ library of OpenIGTLink is missing ({headers}): run `cargo xtask readers` once"
    );
    let (source, made) = (root().join("tests/readers/igtl_client.cxx"), folder.join("igtl_client"));
    let flags = ["-std=c++17", "-O1", "-Wall", "-Wextra", "-Werror", "-isystem", headers, "-o"];
    let mut words: Vec<OsString> = flags.map(OsString::from).to_vec();
    words.extend([made.clone().into(), source.into(), "-lOpenIGTLink".into()]);
    tool("g++", words).success("g++");
    made
}

#[test]
fn the_cpp_library_unpacks_all_that_a_viewer_asks_for_with_its_checksums() {
    let folder = scratch();
    let client = client(folder.path());
    let (told, recorded) = session_with("lps", folder.path(), |port, _| {
        let mut command = std::process::Command::new(&client);
        Outcome::of(command.arg(port.to_string()).args(PLACE.map(|mm| mm.to_string())))
    });
    let of = |kind: &str| -> Vec<&Value> { told.iter().filter(|l| l["type"] == kind).collect() };
    let points = of("POINT");
    assert_eq!(points.len(), 5, "{told:?}");
    for point in &points {
        let number = point["number"].as_f64().expect("a number");
        let wanted = place(&recorded, 1.7e9 + number / 4.0);
        assert_near(numbers(&point["at"]), wanted, "POINT by the C++ library");
        assert_eq!((&point["device"], &point["owner"]), (&"Tumour".into(), &"Region".into()));
        assert_eq!(point["diameter"], 18.0);
    }
    let [capability, status, surface, image] =
        ["CAPABILITY", "STATUS", "POLYDATA", "IMAGE"].map(|kind| *of(kind).first().expect(kind));
    for kind in ["TRANSFORM", "POINT", "POLYDATA", "IMAGE", "STATUS"] {
        let types = capability["types"].as_array().expect("types");
        assert!(types.contains(&kind.into()), "{kind} is not in {capability}");
    }
    assert_eq!(status["code"], 1, "{status}");
    assert!(status["text"].as_str().is_some_and(|text| text.contains("frame LPS")), "{status}");
    assert_surface(surface, &recorded);
    assert_image(image, &recorded);
}

fn assert_surface(surface: &Value, recorded: &[Recorded]) {
    let count = |key: &str| surface[key].as_u64().expect(key);
    let points = count("points");
    assert!(points > 100, "{surface}");
    assert_eq!((count("values"), count("largest_index")), (points, points - 1), "{surface}");
    assert_eq!(count("triangles"), count("cells"), "{surface}");
    assert_eq!(surface["attribute"], "displacement_mm");
    let (low, high) = (numbers(&surface["low"]), numbers(&surface["high"]));
    let tumour = recorded.last().expect("an answer").at;
    for axis in 0..3 {
        assert!((low[axis]..high[axis]).contains(&tumour[axis]), "{tumour:?} outside {surface}");
        assert!((50.0..250.0).contains(&(high[axis] - low[axis])), "{surface}");
    }
}

fn assert_image(image: &Value, recorded: &[Recorded]) {
    assert_eq!(numbers(&image["size"]), [128.0; 3]);
    assert_eq!((numbers(&image["spacing"]), numbers(&image["diagonal"])), ([1.0; 3], [1.0; 3]));
    // 2 stands for LPS.
    assert_eq!(image["frame"], 2);
    let (centre, tumour) = (numbers(&image["centre"]), recorded[0].at);
    for axis in 0..3 {
        // About where the tumour lies without applicator.
        assert!((centre[axis] - tumour[axis]).abs() < 2.0, "{image}, the tumour at {tumour:?}");
    }
    let hu = [0, 1].map(|n| image["hu"][n].as_f64().expect("HU"));
    assert!(hu[0] < -900.0 && hu[1] > 100.0 && hu[1] < 3100.0, "air and bone are in it: {image}");
}
