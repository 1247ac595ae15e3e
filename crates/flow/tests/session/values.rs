//! Values in memory beside what a folder keeps.

use crate::support::{finished_patient, patient, results};
use std::fs;
use supine_dicom::ReadParams;
use supine_flow::{Request, RunFolder, Session, Spec, read_ct};
use supine_space::Progress;

#[test]
fn fields_that_a_folder_keeps_are_made_for_memory_and_the_folder_stays_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let case = finished_patient(folder.path());
    let out = folder.path().join("out");
    let before = results(&out);
    let session = || Session::new(Spec::from_text(&case, folder.path()).unwrap(), 2).unwrap();
    let kept = session().with_folder(RunFolder::open(&out).unwrap()).unwrap();
    let [kept, made] = [kept, session()].map(|of| of.fields(&Request::default()).unwrap());
    assert!(kept.resampling == made.resampling);
    assert!(kept.points == made.points);
    assert!(kept.fields.jacobian() == made.fields.jacobian());
    assert!(results(&out) == before);
}

#[test]
fn a_slice_may_have_any_ending_and_what_is_none_is_told_by_its_own() {
    let folder = tempfile::tempdir().unwrap();
    patient(folder.path());
    let ct = folder.path().join("ct");
    // As some archives name slices, and as an image of two files ends.
    let mut first = None;
    for entry in fs::read_dir(&ct).unwrap() {
        let path = entry.unwrap().path();
        let named = path.with_extension("img");
        fs::rename(&path, &named).unwrap();
        first = first.or(Some(named));
    }
    let read = |path: &std::path::Path| read_ct(path, &ReadParams::default(), Progress::none());
    assert!(read(&first.unwrap()).unwrap().dicom.is_some());
    for (name, words) in [("mri.img", "two files (.hdr and .img)"), ("all.zip", "unpack it")] {
        fs::write(ct.join(name), "no slice").unwrap();
        let error = read(&ct.join(name)).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}
