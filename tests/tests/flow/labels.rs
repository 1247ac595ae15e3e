//! Supplied labels, from other programs and from our own, and labels as DICOM.

use crate::shared::{scratch, shared};
use std::path::{Path, PathBuf};
use supine_tests::{Case, Outcome, readers_python, root, source, supine, tool};

/// The labels that the shared run found.
fn found() -> PathBuf {
    shared().out.join("labels.seg.nrrd")
}

/// Runs the small case with labels up to the segmentation.
fn segmented(labels: &str, folder: &Path) -> Outcome {
    let case = Case::small().with("labels", labels).write(folder);
    supine(&[
        &"run",
        &case,
        &"--out",
        &folder.join("out"),
        &"--until",
        &"segment",
        &"--no-progress",
    ])
}

fn assert_same_labels(folder: &Path) {
    let labels = folder.join("out/labels.seg.nrrd");
    readers_python("same_labels.py", [found(), labels]).success("same_labels.py");
}

#[test]
fn highdicom_sees_our_labels() {
    let arguments = [source(), shared().out.join("labels.dcm"), found()];
    readers_python("segmentation.py", arguments).success("segmentation.py");
}

#[test]
fn dciodvfy_and_dcentvfy_find_no_error_in_the_labels() {
    let file = shared().out.join("labels.dcm");
    let said = tool("dciodvfy", ["-new".as_ref(), file.as_os_str()]);
    let text = said.stdout + &said.stderr;
    let errors: Vec<&str> =
        text.lines().filter(|l| l.starts_with("Error") || l.contains("Assertion")).collect();
    assert!(errors.is_empty(), "{}", errors.join("\n"));
    assert!(text.contains("Segmentation"), "dciodvfy took it for a segmentation:\n{text}");
    let slices = std::fs::read_dir(source()).expect("the source can be listed");
    let slices = slices.map(|slice| slice.expect("the source can be listed").path());
    let said = tool("dcentvfy", slices.chain([file.clone()]));
    let text = said.stdout + &said.stderr;
    assert!(!text.lines().any(|line| line.starts_with("Error")), "{text}");
    tool("dcmftest", [file]).success("dcmftest");
}

#[test]
fn our_own_dicom_labels_come_back_equal() {
    let folder = scratch();
    // Content tells what a file is, not its name.
    let renamed = folder.path().join("labels");
    std::fs::copy(shared().out.join("labels.dcm"), &renamed).expect("it can be copied");
    segmented("'labels'", folder.path()).success("supine run");
    assert_same_labels(folder.path());
}

#[test]
fn segmentations_and_contours_of_others_give_the_labels_they_were_made_from() {
    let folder = scratch();
    readers_python("regions.py", [source(), found(), folder.path().to_owned()])
        .success("regions.py");
    for labels in [
        "'seg.dcm'",
        "'rtss.dcm'",
        "{ file = 'rtss.dcm', body = 'patient outline', chest_wall = ['CHEST_WALL'] }",
    ] {
        segmented(labels, folder.path()).success(labels);
        assert_same_labels(folder.path());
    }
    let said = segmented("{ file = 'rtss.dcm', chest_wall = 'Heart' }", folder.path());
    assert_eq!(said.code, Some(1), "{}", said.stderr);
    assert!(said.stderr.contains("Heart") && said.stderr.contains("no contour"), "{}", said.stderr);
}

/// The labels that the shared run found, with the segments called otherwise.
fn renamed(folder: &Path) -> PathBuf {
    let mut bytes = std::fs::read(found()).expect("the labels can be read");
    for (old, new) in [("soft tissue", "Breast (left)"), ("chest wall", "Cage & muscle")] {
        let old = format!("_Name:={old}\n").into_bytes();
        let at = bytes.windows(old.len()).position(|w| w == old).expect("the segment has a name");
        bytes.splice(at..at + old.len(), format!("_Name:={new}\n").into_bytes());
    }
    let path = folder.join("renamed.seg.nrrd");
    std::fs::write(&path, bytes).expect("the labels can be written");
    path
}

#[test]
fn segments_of_slicer_are_named_in_the_case() {
    let folder = scratch();
    renamed(folder.path());
    let named = |parts: &str| format!("{{ file = 'renamed.seg.nrrd'{parts} }}");
    let parts = ", soft_tissue = 'breast (LEFT)', chest_wall = ['Cage & muscle']";
    segmented(&named(parts), folder.path()).success(parts);
    assert_same_labels(folder.path());
    for parts in ["", ", chest_wall = 'Wall', soft_tissue = 'Breast (left)'"] {
        let said = segmented(&named(parts), folder.path());
        assert_eq!(said.code, Some(1), "{}", said.stderr);
        for name in ["\"Breast (left)\"", "\"Cage & muscle\""] {
            assert!(said.stderr.contains(name), "{parts}: {}", said.stderr);
        }
    }
    // Numbers without names cannot be named.
    let numbers = folder.path().join("numbers.nii.gz");
    readers_python("mirror.py", [found(), numbers, "".into()]).success("mirror.py");
    let said = segmented("{ file = 'numbers.nii.gz', chest_wall = 'Wall' }", folder.path());
    assert_eq!(said.code, Some(1), "{}", said.stderr);
    assert!(said.stderr.contains("have no names"), "{}", said.stderr);
}

#[test]
fn masks_of_totalsegmentator_are_seeds_as_a_folder_and_as_one_file() {
    let folder = scratch();
    let truth = root().join("fixtures/patient/truth/labels.nrrd");
    readers_python("masks.py", [truth, folder.path().to_owned()]).success("masks.py");
    let labels = |seeds: &str| {
        let out = folder.path().join("labels.seg.nrrd");
        let seeds = folder.path().join(seeds);
        let said = supine(&[
            &"segment",
            &"--ct",
            &source(),
            &"--seeds",
            &seeds,
            &"--out",
            &out,
            &"--overwrite",
        ]);
        said.success(&seeds.display().to_string());
        std::fs::read(&out).expect("the labels")
    };
    let (folder_of_masks, one_file) = (labels("segmentations"), labels("ml.nii.gz"));
    assert!(folder_of_masks == one_file, "the same masks, the same labels");
    let arguments = [found(), folder.path().join("labels.seg.nrrd"), "0.99".into()];
    readers_python("near_labels.py", arguments).success("near_labels.py");
}

#[test]
fn supine_segment_writes_dicom_for_a_dicom_ct_only() {
    let folder = scratch();
    let labels = folder.path().join("labels.dcm");
    supine(&[&"segment", &"--ct", &source(), &"--out", &labels]).success("supine segment");
    let by_the_run = std::fs::read(shared().out.join("labels.dcm")).expect("the run's labels");
    assert!(
        std::fs::read(&labels).expect("the labels") == by_the_run,
        "the same bytes as the run's"
    );
    std::fs::remove_file(&labels).expect("the labels can go");
    let nifti = folder.path().join("ct.nii.gz");
    readers_python("convert.py", [source(), nifti.clone()]).success("convert.py");
    let said = supine(&[&"segment", &"--ct", &nifti, &"--out", &labels]);
    assert_eq!(said.code, Some(2), "{}", said.stderr);
    assert!(said.stderr.contains("DICOM") && !labels.exists(), "{}", said.stderr);
}

#[test]
fn labels_of_a_nifti_ct_are_checked_like_all_others() {
    let folder = scratch();
    let nifti = folder.path().join("ct.nii.gz");
    readers_python("convert.py", [source(), nifti.clone()]).success("convert.py");
    for (turned, words) in [("", ""), ("x", "left and right"), ("z", "head and feet")] {
        let labels = folder.path().join(format!("labels{turned}.nii.gz"));
        let arguments = [found(), labels.clone(), turned.into()];
        readers_python("mirror.py", arguments).success("mirror.py");
        let case = Case::small().with_ct(&nifti);
        let case = case.with("labels", &format!("'{}'", labels.display())).write(folder.path());
        let out = folder.path().join(format!("out{turned}"));
        let said =
            supine(&[&"run", &case, &"--out", &out, &"--until", &"segment", &"--no-progress"]);
        if turned.is_empty() {
            said.success("supine run");
            assert!(!out.join("labels.dcm").exists(), "no DICOM comes from a CT without a patient");
        } else {
            assert_eq!(said.code, Some(1), "{}", said.stderr);
            assert!(
                said.stderr.contains("mirrored") && said.stderr.contains(words),
                "{}",
                said.stderr
            );
        }
    }
}
