//! Values in memory beside what a folder keeps.

use crate::support::{finished_patient, results};
use supine_flow::{Request, RunFolder, Session, Spec};

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
    assert!(kept.fields.ct_to_deformed() == made.fields.ct_to_deformed());
    assert!(kept.fields.jacobian() == made.fields.jacobian());
    assert!(results(&out) == before);
}
