//! What independent readers see in the results.

use crate::shared::{run_until, scratch, shared};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use supine_tests::{Case, files_below, python, readers_python, root, source, supine, tool};

/// The files of a series, whole paths.
fn series(folder: &Path) -> Vec<PathBuf> {
    files_below(folder).into_iter().map(|file| folder.join(file)).collect()
}

#[test]
fn three_readers_see_the_same_series_and_the_volume_we_meant() {
    let scratch = scratch();
    let volume = scratch.path().join("warped.nrrd");
    let mesh = shared().out.join("mesh/deformed.vtu");
    supine(&[&"warp", &"--ct", &source(), &"--mesh", &mesh, &"--out", &volume, &"--no-progress"])
        .success("supine warp");
    readers_python("series.py", [source(), shared().out.join("ct"), volume]).success("series.py");
}

#[test]
fn a_warp_goes_onto_other_voxels_and_says_how() {
    let scratch = scratch();
    let volume = scratch.path().join("warped.nrrd");
    let mesh = shared().out.join("mesh/deformed.vtu");
    let given = [source(), mesh];
    let warp = |out: &Path| {
        let words: [&dyn AsRef<OsStr>; 11] = [
            &"warp",
            &"--ct",
            &given[0],
            &"--mesh",
            &given[1],
            &"--interpolation",
            &"lanczos3",
            &"--spacing",
            &"2,2,2",
            &"--out",
            &out,
        ];
        supine(&words)
    };
    warp(&volume).success("supine warp --spacing");
    let bytes = std::fs::read(&volume).expect("the volume is there");
    let header = String::from_utf8_lossy(&bytes[..bytes.len().min(4096)]).into_owned();
    assert!(header.contains("lanczos3") && header.contains("DERIVED"), "{header}");
    assert!(header.contains("(2,0,0)") || header.contains("(2.0,0.0,0.0)"), "{header}");
    let said = warp(&scratch.path().join("series"));
    assert_eq!(said.code, Some(2), "a series keeps its grid: {}", said.stderr);
}

#[test]
fn a_warp_of_the_region_or_of_some_slices_has_the_values_of_the_whole() {
    let scratch = scratch();
    let mesh = shared().out.join("mesh/deformed.vtu");
    let given = [source(), mesh];
    let part = |name: &str, more: &[&str]| {
        let out = scratch.path().join(name);
        let mut words: Vec<&OsStr> = ["warp", "--ct"].map(OsStr::new).to_vec();
        words.extend([given[0].as_os_str(), OsStr::new("--mesh"), given[1].as_os_str()]);
        words.extend(more.iter().map(OsStr::new));
        words.extend([OsStr::new("--out"), out.as_os_str()]);
        let words: Vec<&dyn AsRef<OsStr>> = words.iter().map(|w| w as &dyn AsRef<OsStr>).collect();
        supine(&words).success("supine warp");
        out
    };
    let whole = part("whole.nrrd", &[]);
    let parts = [
        part("around.nrrd", &["--around", "10"]),
        part("axial.nrrd", &["--axial", "-620,-560"]),
        part("beyond.nrrd", &["--axial=-560,-400"]),
        part("fine.nrrd", &["--around", "5", "--spacing", "1,1,1"]),
    ];
    let arguments = std::iter::once(whole).chain(parts);
    readers_python("part_of.py", arguments).success("part_of.py");
}

#[test]
fn the_same_ct_as_nifti_gives_the_same_volume() {
    let scratch = scratch();
    let nifti = scratch.path().join("ct.nii.gz");
    readers_python("convert.py", [source(), nifti.clone()]).success("convert.py");
    let case = Case::small().with_ct(&nifti).write(scratch.path());
    let out = scratch.path().join("out");
    run_until("export", &case, &out).success("supine run on NIfTI");
    assert!(!out.join("ct").exists(), "no DICOM comes from a CT without a patient");
    let volume = out.join("ct.nrrd");
    readers_python("series.py", [source(), shared().out.join("ct"), volume]).success("series.py");
}

#[test]
fn labels_are_read_and_meet_the_truth() {
    let truth = root().join("fixtures/patient/truth/labels.nrrd");
    let labels = shared().out.join("labels.seg.nrrd");
    readers_python("labels.py", [source(), labels, truth]).success("labels.py");
}

#[test]
fn fields_explain_the_warped_volume() {
    readers_python("fields.py", [source(), shared().out.clone()]).success("fields.py");
}

#[test]
fn meshes_of_both_orders_are_read_whole() {
    let rest = shared().out.join("mesh/rest.vtu");
    let linear = shared().out.join("mesh/deformed.vtu");
    readers_python("meshes.py", [&rest, &linear]).success("meshes.py, linear");
    let scratch = scratch();
    let quadratic = scratch.path().join("quadratic.vtu");
    supine(&[
        &"solve", &"--mesh", &rest, &"--table", &"7,5", &"--order", &"2", &"--out", &quadratic,
    ])
    .success("supine solve --order 2");
    readers_python("meshes.py", [&rest, &quadratic]).success("meshes.py, quadratic");
}

#[test]
fn dciodvfy_finds_no_error() {
    let files = series(&shared().out.join("ct"));
    assert_eq!(files.len(), series(&source()).len(), "one file per slice of the source");
    for file in files {
        let said = tool("dciodvfy", ["-new".as_ref(), file.as_os_str()]);
        let text = said.stdout + &said.stderr;
        let errors: Vec<&str> =
            text.lines().filter(|l| l.starts_with("Error") || l.contains("Assertion")).collect();
        assert!(errors.is_empty(), "{}:\n{}", file.display(), errors.join("\n"));
        assert!(text.contains("CTImage"), "dciodvfy took it for a CT:\n{text}");
    }
}

#[test]
fn dcentvfy_finds_no_conflict_with_the_source() {
    let files = [series(&source()), series(&shared().out.join("ct"))].concat();
    let said = tool("dcentvfy", files);
    let text = said.stdout + &said.stderr;
    assert!(!text.lines().any(|line| line.starts_with("Error")), "{text}");
}

#[test]
fn dcmftest_takes_every_file() {
    tool("dcmftest", series(&shared().out.join("ct"))).success("dcmftest");
}

/// The rules collected with the reference measurements, where these lie beside the repository.
#[test]
fn the_reference_rules_pass() {
    let rules = root().join("../shared/reference/dicom/check_export.py");
    if !rules.is_file() {
        println!("left out: there is no {}", rules.display());
        return;
    }
    // The rules read uncompressed pixels; the fixture's are run-length encoded.
    let scratch = scratch();
    let plain = scratch.path().join("source");
    readers_python("decompress.py", [source(), plain.clone()]).success("decompress.py");
    let arguments = [shared().out.join("ct").into_os_string(), "--source".into(), plain.into()];
    let said = python(&rules, arguments).success("check_export.py");
    println!("{}", said.stdout.lines().last().unwrap_or_default());
}
