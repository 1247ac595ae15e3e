//! DICOM RT objects: the phantom of the bead and the shared run, as independent readers see them.

use crate::shared::{scratch, shared, summary};
use serde_json::Value;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use supine_tests::{Case, readers_python, source, supine, tool};

/// `supine carry FROM WHAT --out OUT --json`; what it says.
fn carry(from: &Path, what: &Path, out: &Path) -> Value {
    let said = supine(&[&"carry", &from, &what, &"--out", &out, &"--json"]);
    let said = said.success("supine carry");
    serde_json::from_str(&said.stdout).expect("stdout is JSON and nothing else")
}

/// dciodvfy knows the object and has no Error for it.
fn valid(file: &Path, kind: &str) {
    let said = tool("dciodvfy", ["-new".as_ref(), file.as_os_str()]);
    let text = said.stdout + &said.stderr;
    let fault = |l: &&str| l.starts_with("Error") || l.starts_with("Abort") || l.contains("Assert");
    let faults: Vec<&str> = text.lines().filter(fault).collect();
    assert!(faults.is_empty(), "{}:\n{}", file.display(), faults.join("\n"));
    assert!(text.lines().any(|l| l == kind), "dciodvfy took it for another kind:\n{text}");
}

#[test]
fn the_bead_is_where_its_mesh_moved_it_in_every_object() {
    let scratch = scratch();
    let folder = scratch.path();
    readers_python("bead.py", [folder]).success("bead.py");
    let run = folder.join("run");
    let path = |name: &str| run.join(name);
    let mesh = path("mesh/deformed.vtu");
    let words: [&dyn AsRef<OsStr>; 12] = [
        &"warp",
        &"--ct",
        &folder.join("ct"),
        &"--mesh",
        &mesh,
        &"--breast",
        &"left",
        &"--registration",
        &path("registration"),
        &"--out",
        &path("ct"),
        &"--json",
    ];
    let said = supine(&words).success("supine warp --registration");
    let facts: Value = serde_json::from_str(&said.stdout).expect("stdout is JSON and nothing else");
    let off = |key: &str| facts["registration"][key].as_f64().expect("a length");
    assert!(off("mean_mm") < 0.05 && off("p99_mm") < 0.3 && off("max_mm") < 0.6, "{facts}");
    let dose = carry(&run, &folder.join("dose.dcm"), &path("dose.dcm"));
    assert_eq!(dose["dicom"]["summation"], "PLAN");
    // Half a step of 32 bits and the rounding of single precision.
    assert!(dose["dicom"]["read_back_error_gy"].as_f64().expect("a dose") < 2e-6, "{dose}");
    let structures = carry(&run, &folder.join("structures.dcm"), &path("structures.dcm"));
    assert_eq!(structures["warnings"], serde_json::json!([]));
    readers_python("bead_found.py", [folder]).success("bead_found.py");
    valid(&path("dose16.dcm"), "RTDose");
    valid(&path("structures.dcm"), "RTStructureSet");
    valid(&path("registration/deformable.dcm"), "DeformableSpatialRegistration");
    valid(&path("registration/chest-wall.dcm"), "SpatialRegistration");

    // The same again has the same bytes; another ending is no DICOM object.
    for (given, name) in [("dose.dcm", "again-dose.dcm"), ("structures.dcm", "again-rs.dcm")] {
        carry(&run, &folder.join(given), &path(name));
        let bytes = |name: &str| std::fs::read(path(name)).expect("the object is there");
        assert!(bytes(given) == bytes(name), "{given} differs from run to run");
    }
    let plain = carry(&run, &folder.join("dose.dcm"), &path("dose.nrrd"));
    assert_eq!((&plain["dicom"], &plain["max_gy"]), (&Value::Null, &dose["max_gy"]));
}

#[test]
fn what_belongs_elsewhere_is_refused_before_anything_is_written() {
    let scratch = scratch();
    let folder = scratch.path();
    readers_python("bead.py", [folder]).success("bead.py");
    let out = folder.join("out.dcm");
    let refused = |from: &Path, what: &Path, code: i32, word: &str| {
        let said = supine(&[&"carry", &from, &what, &"--out", &out]);
        assert_eq!(said.code, Some(code), "{}", said.stderr);
        assert!(said.stderr.contains(word), "{word}: {}", said.stderr);
        assert!(!out.exists());
    };
    // A dose and structures of another scan.
    let run = &shared().out;
    refused(run, &folder.join("dose.dcm"), 1, "another frame of reference");
    refused(run, &folder.join("structures.dcm"), 1, "another frame of reference");
    // A mesh alone has no exported CT.
    let mesh = folder.join("run/mesh/deformed.vtu");
    refused(&mesh, &folder.join("dose.dcm"), 2, "exported CT");
    let contours = folder.join("c.csv");
    std::fs::write(&contours, "structure,contour,x,y,z\nA,1,0,0,0\n").expect("it is written");
    refused(run, &contours, 2, "are written as .csv or .json");
    // A case is told so before the work begins.
    let dose = folder.join("dose.dcm");
    let carry = format!("{{ dose = ['{}'] }}", dose.display());
    let case = Case::small().with("carry", &carry).write(folder);
    let said = crate::shared::run(&case, &folder.join("out"), 2);
    assert_eq!(said.code, Some(1), "{}", said.stderr);
    assert!(said.stderr.contains("another frame of reference"), "{}", said.stderr);
    assert!(!said.stderr.contains("segment"), "{}", said.stderr);
}

#[test]
fn an_object_of_another_patient_is_refused_and_one_without_a_frame_is_told() {
    let scratch = scratch();
    let folder = scratch.path();
    readers_python("bead.py", [folder]).success("bead.py");
    let dose = std::fs::read(folder.join("dose.dcm")).expect("a dose");
    let at = |wanted: &[u8]| {
        dose.windows(wanted.len()).position(|w| w == wanted).expect("the element is there")
    };
    let [patient, frame] = [at(b"\x10\0\x20\0LO"), at(b"\x20\0\x52\0UI")];
    let carried = |name: &str, change: &dyn Fn(&mut [u8])| {
        let (file, out) = (folder.join(name), folder.join("o.nrrd"));
        let mut bytes = dose.clone();
        change(&mut bytes);
        std::fs::write(&file, bytes).expect("it is written");
        let (mesh, ct) = (folder.join("run/mesh/deformed.vtu"), folder.join("ct"));
        supine(&[&"carry", &mesh, &file, &"--ct", &ct, &"--out", &out, &"--overwrite"])
    };
    carried("own.dcm", &|_| {}).success("her own dose");
    // SYN-001 becomes SYN-002.
    let said = carried("other.dcm", &|bytes| bytes[patient + 14] = b'2');
    assert_eq!(said.code, Some(1), "{}", said.stderr);
    assert!(said.stderr.contains("of another patient than the CT"), "{}", said.stderr);
    let no_value = |bytes: &mut [u8], element: usize, filler: u8| {
        let length = usize::from(bytes[element + 6]);
        bytes[element + 8..element + 8 + length].fill(filler);
    };
    let said = carried("no-frame.dcm", &|bytes| no_value(bytes, frame, 0));
    assert!(said.stderr.contains("names no frame of reference"), "{}", said.stderr);
    assert_eq!(said.code, Some(0), "{}", said.stderr);
    let said = carried("no-id.dcm", &|bytes| no_value(bytes, patient, b' '));
    assert!(said.stderr.contains("bears no Patient ID"), "{}", said.stderr);
    assert_eq!(said.code, Some(0), "{}", said.stderr);
    // With neither, it may be of anyone.
    let said = carried("nobody.dcm", &|bytes| {
        no_value(bytes, frame, 0);
        no_value(bytes, patient, b' ');
    });
    assert_eq!(said.code, Some(1), "{}", said.stderr);
    assert!(said.stderr.contains("nothing says that it belongs to this CT"), "{}", said.stderr);
    // The number of one patient under the name of another.
    let name = at(b"\x10\0\x10\0PN");
    let said = carried("other-name.dcm", &|bytes| bytes[name + 8] = b'Q');
    assert!(
        said.stderr.contains("bears the Patient ID of the CT and another name"),
        "{}",
        said.stderr
    );
}

#[test]
fn a_run_leaves_registrations_that_are_valid_and_says_how_far_they_are_off() {
    let out = &shared().out;
    valid(&out.join("registration/deformable.dcm"), "DeformableSpatialRegistration");
    valid(&out.join("registration/chest-wall.dcm"), "SpatialRegistration");
    let summary = summary(out);
    let facts = &summary["export"]["registration"];
    let mm = |key: &str| facts[key].as_f64().expect("a length");
    println!("{facts}");
    assert!(mm("mean_mm") < 0.05 && mm("p99_mm") < 0.3, "{facts}");
    readers_python("registration.py", [source(), out.clone()]).success("registration.py");
}

#[test]
fn a_segmentation_is_carried_as_the_label_map_of_the_same_labels_but_for_their_boundary() {
    let scratch = scratch();
    let [seg, map] = ["seg.dcm", "map.seg.nrrd"].map(|name| scratch.path().join(name));
    let run = &shared().out;
    let facts = carry(run, &run.join("labels.dcm"), &seg);
    assert_eq!((&facts["kind"], &facts["warnings"]), (&"segments".into(), &serde_json::json!([])));
    let labels = run.join("labels.seg.nrrd");
    let said = supine(&[&"carry", run, &labels, &"--grid", &"ct", &"--out", &map, &"--json"]);
    let said: Value = serde_json::from_str(&said.success("supine carry").stdout).expect("JSON");
    for (segment, label) in [0, 1].map(|n| (&facts["segments"][n], &said["labels"][n])) {
        assert_eq!(segment["before_ml"], label["before_ml"], "{facts}\n{said}");
    }
    // highdicom sees the same voxels in the slices of the exported CT. The label map has the
    // nearest label, each segment its own shape and volume: they part at the boundary. That no
    // voxel of what was carried is lost on the way, the exact volumes say.
    let ml = [0, 1].map(|n| facts["segments"][n]["after_ml"].as_f64().expect("a volume"));
    let ml = format!("{},{}", ml[0], ml[1]);
    readers_python(
        "segmentation.py",
        [run.join("ct"), seg.clone(), map, "0.003".into(), ml.into()],
    )
    .success("segmentation.py");
    valid(&seg, "Segmentation");
    let out = scratch.path().join("out.nrrd");
    let said = supine(&[&"carry", run, &run.join("labels.dcm"), &"--out", &out]);
    assert_eq!(said.code, Some(2), "{}", said.stderr);
}

/// Structures of a real patient, where these lie beside the repository: regions in and out.
#[test]
fn structures_of_a_real_patient_go_in_and_out() {
    let packed = supine_tests::root().join("../shared/real/breast-rt/breast-rt.tar.zst");
    if !packed.is_file() {
        println!("left out: there is no {}", packed.display());
        return;
    }
    let scratch = scratch();
    let folder = scratch.path();
    let unpack = [PathBuf::from("-xf"), packed, "-C".into(), folder.into()];
    tool("tar", unpack).success("tar");
    let script = |mode: &str| {
        readers_python("real_structures.py", [Path::new(mode), folder])
            .success("real_structures.py")
    };
    script("make");
    let (run, mesh) = (folder.join("run"), folder.join("run/mesh/deformed.vtu"));
    let words: [&dyn AsRef<OsStr>; 11] = [
        &"warp",
        &"--ct",
        &folder.join("ct"),
        &"--mesh",
        &mesh,
        &"--breast",
        &"left",
        &"--registration",
        &run.join("registration"),
        &"--out",
        &run.join("ct"),
    ];
    supine(&words).success("supine warp --registration");
    let facts = carry(&run, &folder.join("rtss.dcm"), &run.join("structures.dcm"));
    println!("{facts}\n{}", script("check").stdout);
    valid(&run.join("structures.dcm"), "RTStructureSet");
}
