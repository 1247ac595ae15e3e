//! Input that cannot be used: one clear message that names the file, slice or key, the exit code of
//! docs/CONVENTIONS.md, and nothing under a final name that is not whole.
#![expect(clippy::disallowed_methods, reason = "the tests spoil files")]

use std::path::{Path, PathBuf};
use supine_tests::{Case, Outcome, copy_series, forgotten, leftovers, supine, supine_command};

/// The input cannot be used.
const INPUT: i32 = 1;
/// Wrong usage.
const USAGE: i32 = 2;
/// An output cannot be written.
const OUTPUT: i32 = 5;

/// Longest message, lines: one statement and what to do.
const LONGEST_MESSAGE: usize = 6;

fn scratch() -> tempfile::TempDir {
    tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).expect("a scratch folder can be made")
}

/// Fails unless the program answered with this code and one message that names all of `names`.
fn assert_refused(said: &Outcome, code: i32, names: &[&str]) {
    let all = format!("stdout:\n{}\nstderr:\n{}", said.stdout, said.stderr);
    assert_eq!(said.code, Some(code), "{all}");
    assert!(said.stdout.is_empty(), "stdout is data\n{all}");
    let lines = said.stderr.lines().filter(|line| !line.trim().is_empty()).count();
    assert!((1..=LONGEST_MESSAGE).contains(&lines), "one message, not {lines} lines\n{all}");
    for bad in ["panicked", "RUST_BACKTRACE", "Caused by", "Error {", "Some("] {
        assert!(!said.stderr.contains(bad), "{bad} is no word for people\n{all}");
    }
    for name in names {
        assert!(said.stderr.contains(name), "the message does not name {name}\n{all}");
    }
}

/// Runs a case in `folder` and fails unless it is refused with nothing but `left` written.
fn assert_run_refused(case: &Case, folder: &Path, code: i32, names: &[&str], left: &[&str]) {
    let out = folder.join("out");
    let said = supine(&[&"run", &case.write(folder), &"--out", &out, &"--quiet"]);
    assert_refused(&said, code, names);
    if out.exists() {
        let found: Vec<_> = leftovers(&out).into_iter().filter(|n| !left.contains(n)).collect();
        assert!(found.is_empty(), "left under final names: {found:?}");
        assert!(forgotten(&out).is_empty(), "forgotten: {:?}", forgotten(&out));
    }
}

/// The name of a file without the way to it.
fn name(path: &Path) -> String {
    path.file_name().expect("a file has a name").to_string_lossy().into_owned()
}

#[test]
fn a_folder_without_ct() {
    let folder = scratch();
    let empty = folder.path().join("letters");
    std::fs::create_dir(&empty).unwrap();
    std::fs::write(empty.join("readme.txt"), "no picture here\n").unwrap();
    let case = Case::small().with_ct(&empty);
    assert_run_refused(&case, folder.path(), INPUT, &["letters"], &[]);
    let said = supine(&[&"inspect", &empty]);
    assert_eq!(said.code, Some(INPUT), "{}\n{}", said.stdout, said.stderr);
}

#[test]
fn a_folder_that_is_not_there() {
    let folder = scratch();
    let case = Case::small().with_ct(&folder.path().join("elsewhere"));
    assert_run_refused(&case, folder.path(), INPUT, &["elsewhere"], &[]);
}

#[test]
fn a_status_or_profile_takes_the_place_of_no_other_file() {
    let folder = scratch();
    let case = Case::small().write(folder.path());
    let before = std::fs::read(&case).unwrap();
    let out = folder.path().join("out");
    for option in ["--status", "--profile"] {
        let asked = ["--until", "import", option];
        let mut command = supine_command();
        command.arg("run").arg(&case).arg("--out").arg(&out).args(asked).arg(&case);
        assert_refused(&Outcome::of(&mut command), USAGE, &[option, &name(&case)]);
        assert_eq!(std::fs::read(&case).unwrap(), before, "{option}");
        // Its own file of before is written anew.
        let own = folder.path().join("own.json");
        for _ in 0..2 {
            let mut command = supine_command();
            command.arg("run").arg(&case).arg("--out").arg(&out).args(asked).arg(&own);
            assert_eq!(Outcome::of(&mut command).code, Some(0), "{option}");
        }
        std::fs::remove_file(own).unwrap();
    }
}

#[test]
fn a_missing_slice() {
    let folder = scratch();
    let (ct, files) = copy_series(folder.path());
    std::fs::remove_file(&files[30]).unwrap();
    // The gap lies between these two; the step is 3 mm and the gap 6 mm.
    let (before, after) = (name(&files[29]), name(&files[31]));
    let names = [before.as_str(), after.as_str(), "6.0", "3.0"];
    assert_run_refused(&Case::small().with_ct(&ct), folder.path(), INPUT, &names, &[]);
}

#[test]
fn a_truncated_file() {
    let folder = scratch();
    let (ct, files) = copy_series(folder.path());
    let bytes = std::fs::read(&files[50]).unwrap();
    std::fs::write(&files[50], &bytes[..bytes.len() / 2]).unwrap();
    let names = [name(&files[50])];
    assert_run_refused(&Case::small().with_ct(&ct), folder.path(), INPUT, &[&names[0]], &[]);
}

#[test]
fn an_empty_file_named_as_a_slice() {
    let folder = scratch();
    let (ct, files) = copy_series(folder.path());
    std::fs::write(&files[10], b"").unwrap();
    let names = [name(&files[10])];
    assert_run_refused(&Case::small().with_ct(&ct), folder.path(), INPUT, &[&names[0]], &[]);
}

/// Image Position (Patient), written as decimal strings, explicit VR little endian.
const IMAGE_POSITION: [u8; 6] = [0x20, 0x00, 0x32, 0x00, b'D', b'S'];

/// Rewrites the position of a slice, LPS, mm.
fn move_slice(file: &Path, change: impl Fn([f64; 3]) -> [f64; 3]) {
    let bytes = std::fs::read(file).expect("the slice is read");
    let tag = bytes
        .windows(IMAGE_POSITION.len())
        .position(|window| window == IMAGE_POSITION)
        .expect("the slice has a position");
    let length = tag + IMAGE_POSITION.len();
    let value = length + 2;
    let end = value + usize::from(u16::from_le_bytes([bytes[length], bytes[length + 1]]));
    let text = std::str::from_utf8(&bytes[value..end]).expect("it is text");
    let mut numbers = text.split('\\').map(|n| n.trim().parse::<f64>().expect("a number"));
    let mut text = change([(); 3].map(|()| numbers.next().expect("three numbers")))
        .map(|number| format!("{number:.4}"))
        .join("\\");
    if text.len() % 2 == 1 {
        text.push(' ');
    }
    let size = u16::try_from(text.len()).expect("it is short").to_le_bytes();
    let spoiled = [&bytes[..length], &size, text.as_bytes(), &bytes[end..]].concat();
    std::fs::write(file, spoiled).expect("the slice is written");
}

#[test]
fn gantry_tilt() {
    let folder = scratch();
    let (ct, files) = copy_series(folder.path());
    for file in &files {
        // 10 degrees: each slice lies further back than the one below.
        move_slice(file, |[x, y, z]| [x, y + z * 10f64.to_radians().tan(), z]);
    }
    assert_run_refused(&Case::small().with_ct(&ct), folder.path(), INPUT, &["tilt"], &[]);
}

#[test]
fn two_slices_at_one_place() {
    let folder = scratch();
    let (ct, files) = copy_series(folder.path());
    move_slice(&files[41], |[x, y, z]| [x, y, z - 3.0]);
    let names = [name(&files[40]), name(&files[41])];
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    assert_run_refused(&Case::small().with_ct(&ct), folder.path(), INPUT, &names, &[]);
}

#[test]
fn a_tumour_outside_the_region() {
    let folder = scratch();
    let case = Case::small().with("tumour", "{ centre = [-91.37, -248.09, -594.5], radius = 9.0 }");
    assert_run_refused(
        &case,
        folder.path(),
        INPUT,
        &["tumour"],
        &["labels.seg.nrrd", "labels.dcm", "labels-uncertainty.nrrd"],
    );
}

#[test]
fn a_region_outside_the_body() {
    let folder = scratch();
    let case = Case::small().with("region", "{ centre = [99.0, -900.0, -612.5], radius = 60.0 }");
    assert_run_refused(
        &case,
        folder.path(),
        INPUT,
        &["region"],
        &["labels.seg.nrrd", "labels.dcm", "labels-uncertainty.nrrd"],
    );
}

#[test]
fn values_that_cannot_be() {
    for (key, value, named) in [
        ("mesh", "{ tetrahedra = 0 }", "mesh.tetrahedra"),
        ("mesh", "{ tetrahedra = -5 }", "mesh.tetrahedra"),
        ("mesh", "{ tetrahedra = 1000, order = 7 }", "mesh.order"),
        ("tumour", "{ centre = [91.37, -248.09, -594.5], radius = -1.0 }", "tumour"),
        ("tumour", "{ centre = [91.37, -248.09, -594.5], radius = 60.0 }", "from 0.5 to 50 mm"),
        ("tumour", "{ centre = [91.37, nan, -594.5], radius = 9.0 }", "tumour"),
        ("table", "{ ap = inf, lat = 5.0 }", "table"),
        ("tissue", "{ young = 0.0 }", "`tissue.young`: 0 is not a number from 0.001"),
        ("tissue", "{ poisson = 0.5 }", "`tissue.poisson`"),
        ("breast", "\"middle\"", "breast"),
        ("export", "{ frame = \"source\" }", "although the breast has moved in it"),
        ("export", "{ study = \"mine\" }", "export.study"),
    ] {
        let folder = scratch();
        let case = Case::small().with(key, value);
        assert_run_refused(&case, folder.path(), INPUT, &[named], &[]);
    }
}

#[test]
fn a_volume_that_holds_no_hounsfield_units_is_refused_by_check_too() {
    let folder = scratch();
    let head = "NRRD0004\ntype: short\ndimension: 3\nsizes: 20 20 20\nspace: left-posterior-superior\n\
                space directions: (9,0,0) (0,9,0) (0,0,9)\nspace origin: (0,-300,-700)\n\
                encoding: raw\nendian: little\n\n";
    for (air, code) in [(-1000i16, None), (24, Some(INPUT))] {
        let hu = (0..8000).map(|n| if n % 20 < 9 { air } else { air + 1040 });
        let bytes: Vec<u8> = head.bytes().chain(hu.flat_map(i16::to_le_bytes)).collect();
        std::fs::write(folder.path().join("ct.nrrd"), bytes).expect("it is written");
        let case = Case::small().with("ct", "\"ct.nrrd\"").write(folder.path());
        let said = supine(&[&"check", &case]);
        let refused = said.stderr.contains("cannot be Hounsfield units");
        assert_eq!(refused, code.is_some(), "{}", said.stderr);
        assert!(code.is_none() || said.code == code, "{}", said.stderr);
    }
}

#[test]
fn an_unknown_key_names_the_nearest_known_one() {
    for (key, value, names) in [
        ("tumor", "{ radius = 9.0 }", ["tumor", "`tumour`"]),
        ("mesh", "{ tetrahedrons = 1000 }", ["tetrahedrons", "`mesh.tetrahedra`"]),
        ("tisue", "{ young = 0.6 }", ["tisue", "`tissue`"]),
    ] {
        let folder = scratch();
        let case = Case::small().with(key, value);
        assert_run_refused(&case, folder.path(), INPUT, &names, &[]);
    }
}

#[test]
fn a_case_file_that_is_not_there_or_no_case_file() {
    let folder = scratch();
    let out = folder.path().join("out");
    let run = |case: PathBuf| supine(&[&"run", &case, &"--out", &out]);
    assert_refused(&run(folder.path().join("nothing.toml")), INPUT, &["nothing.toml"]);
    let broken = folder.path().join("broken.toml");
    std::fs::write(&broken, "ct = 'ct'\nbreast = \n").unwrap();
    assert_refused(&run(broken), INPUT, &["broken.toml", "2"]);
    assert!(!out.exists(), "nothing was begun");
}

#[test]
fn an_output_that_cannot_be_written() {
    // A path below a regular file fails for every user, root too.
    let folder = scratch();
    let file = folder.path().join("file");
    std::fs::write(&file, "in the way").unwrap();
    let case = Case::small().write(folder.path());
    let below = file.join("out");
    let said = supine(&[&"run", &case, &"--out", &below, &"--quiet"]);
    let named = below.display().to_string();
    assert_refused(&said, OUTPUT, &[&named]);
    assert_eq!(std::fs::read(&file).unwrap(), b"in the way");
}

#[test]
fn results_among_the_slices_are_refused_and_leave_no_folder() {
    let folder = scratch();
    let (ct, files) = copy_series(folder.path());
    let out = ct.join("result");
    let case = Case::small().with_ct(&ct).write(folder.path());
    let said = supine(&[&"run", &case, &"--out", &out, &"--quiet"]);
    assert_refused(&said, INPUT, &["`ct`", "--out"]);
    assert!(!out.exists(), "the folder was left");
    assert_eq!(std::fs::read_dir(&ct).unwrap().count(), files.len());
}

#[test]
fn files_of_the_single_stages() {
    let folder = scratch();
    let (missing, out) = (folder.path().join("missing"), folder.path().join("out.vtu"));
    let not_a_mesh = folder.path().join("mesh.vtu");
    std::fs::write(&not_a_mesh, "<VTKFile type=\"Unstru").unwrap();
    let solve =
        |mesh: &Path| supine(&[&"solve", &"--mesh", &mesh, &"--table", &"7,5", &"--out", &out]);
    assert_refused(&solve(&missing), INPUT, &["missing"]);
    assert_refused(&solve(&not_a_mesh), INPUT, &["mesh.vtu"]);
    let said = Outcome::of(
        supine_command()
            .args(["mesh", "--centre", "0,0,0", "--radius", "90", "--tetrahedra", "1000"])
            .arg("--labels")
            .arg(&missing)
            .arg("--out")
            .arg(&out),
    );
    assert_refused(&said, INPUT, &["missing"]);
    let said = supine(&[
        &"warp",
        &"--ct",
        &missing,
        &"--mesh",
        &missing,
        &"--out",
        &out.with_extension("nrrd"),
    ]);
    assert_refused(&said, INPUT, &["missing"]);
    let said = supine(&[&"carry", &"--run", &missing, &"--points", &missing, &"--out", &out]);
    assert_refused(&said, INPUT, &["missing"]);
    let said = supine(&[&"verify-export", &missing, &"--source", &missing]);
    assert_refused(&said, INPUT, &["missing"]);
    assert!(!out.exists(), "nothing was written");
}

#[test]
fn a_file_that_is_there_is_replaced_only_when_told_to() {
    let folder = scratch();
    let file = |name: &str| {
        let file = folder.path().join(name);
        std::fs::write(&file, "mine").unwrap();
        file
    };
    let [mesh, csv, nrrd] = ["m.vtu", "p.csv", "v.nrrd"].map(file);
    let fields = folder.path().join("fields");
    std::fs::create_dir(&fields).unwrap();
    let jacobian = file("fields/jacobian.nrrd");
    let [ct, given] = ["ct", "given.vtu"].map(|name| folder.path().join(name));
    let refused: [&[&dyn AsRef<std::ffi::OsStr>]; 7] = [
        &[&"segment", &"--ct", &ct, &"--out", &nrrd],
        &[&"segment", &"--ct", &ct, &"--out", &"l.nrrd", &"--uncertainty", &nrrd],
        &[&"coarsen", &given, &"--tetrahedra", &"10", &"--out", &mesh],
        &[&"solve", &"--mesh", &given, &"--sitting", &"--out", &mesh],
        &[&"warp", &"--ct", &ct, &"--mesh", &given, &"--out", &nrrd],
        &[&"warp", &"--ct", &ct, &"--mesh", &given, &"--out", &"w.nrrd", &"--fields", &fields],
        &[&"carry", &given, &"points.csv", &"--out", &csv],
    ];
    for words in refused {
        let said = supine(words);
        assert_refused(&said, USAGE, &["is there already", "--overwrite"]);
    }
    for file in [&mesh, &csv, &nrrd, &jacobian] {
        assert_eq!(std::fs::read(file).unwrap(), b"mine", "{}", file.display());
    }
    // Told to, it goes on to what is missing.
    let said = supine(&[&"carry", &given, &"points.csv", &"--out", &csv, &"--overwrite"]);
    assert_refused(&said, INPUT, &["given.vtu"]);
}

#[test]
fn wrong_usage() {
    let folder = scratch();
    let case = Case::small().write(folder.path());
    let case = case.to_str().unwrap();
    for words in [
        &["run"][..],
        &["fly"],
        &["solve", "--mesh", "m.vtu", "--out", "d.vtu"],
        &["solve", "--mesh", "m.vtu", "--table", "7", "--out", "d.vtu"],
        &["solve", "--mesh", "m.vtu", "--table", "7,5", "--sitting", "--out", "d.vtu"],
        &["solve", "--mesh", "m.vtu", "--sitting", "--young-interval", "2", "--out", "d.vtu"],
        &["mesh", "--labels", "l.nrrd", "--centre", "1,2", "--radius", "9", "--tetrahedra", "9"],
        &["run", "case.toml", "--out", "out", "--until", "lunch"],
        &["run", "case.toml", "--out", "out", "--threads", "many"],
        &["run", case, "--out", "out", "--set", "bed.ap=5", "--set", "table.ap=6"],
    ] {
        let said = Outcome::of(supine_command().args(words));
        assert_eq!(said.code, Some(USAGE), "{words:?}\n{}\n{}", said.stdout, said.stderr);
        assert!(said.stdout.is_empty() && !said.stderr.is_empty(), "{words:?}: {said:?}");
    }
}

#[test]
fn nobody_listening_ends_no_run() {
    let folder = scratch();
    let case = Case::small().write(folder.path());
    let mut command = supine_command();
    command.arg("run").arg(&case).arg("--out").arg(folder.path().join("out"));
    command.args(["--until", "mesh", "--no-progress"]).stdin(std::process::Stdio::null());
    let mut run = command.stderr(std::process::Stdio::piped()).spawn().unwrap();
    drop(run.stderr.take());
    assert!(run.wait().unwrap().success());
    assert!(folder.path().join("out/mesh/rest.vtu").is_file());
}

/// Its slices are not written while another one reads them.
#[test]
fn a_demo_does_not_touch_the_folder_of_one_that_is_at_work() {
    let folder = scratch();
    let out = folder.path().join("out");
    std::fs::create_dir_all(out.join(".stages")).expect("a folder can be made");
    let held = std::fs::File::create(out.join(".stages/lock")).expect("a file can be made");
    held.lock().expect("nobody else holds it");
    let said = supine(&[&"demo", &"--out", &out]);
    assert!(said.stderr.contains("another run is at work"), "{}", said.stderr);
    assert!(!out.join("case").exists());
}
