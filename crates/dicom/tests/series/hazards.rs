//! Hazards of reading that no other file here plants.

use crate::support::{folder, place, position, put, put_samples, read, refusal, six, stored};
use dicom_core::value::DataSetSequence;
use dicom_core::{DataElement, VR};
use dicom_dictionary_std::tags;
use dicom_object::InMemDicomObject;
use std::os::unix::fs::symlink;

#[test]
fn a_file_without_preamble_is_read_with_a_warning() {
    let dir = folder(&six());
    let plain = read(dir.path()).unwrap().0;
    let path = dir.path().join("3.dcm");
    let whole = std::fs::read(&path).unwrap();
    std::fs::write(&path, &whole[128..]).unwrap();
    let (ct, _, info) = read(dir.path()).unwrap();
    assert_eq!(ct, plain);
    let told =
        info.warnings.iter().any(|w| w.to_string().starts_with("1 file(s) lack the preamble"));
    assert!(told, "{:?}", info.warnings);
}

#[test]
fn pixel_data_that_is_too_long_is_read_with_a_warning() {
    let mut slices = six();
    let plain = read(folder(&slices).path()).unwrap().0;
    let values = stored(&slices);
    for (slice, values) in slices.iter_mut().zip(values) {
        put_samples(slice, values.into_iter().chain([7; 40]).collect());
    }
    let (ct, _, info) = read(folder(&slices).path()).unwrap();
    assert_eq!(ct, plain);
    assert!(
        info.warnings.iter().any(|w| w.to_string().contains("longer than the images")),
        "{info:?}"
    );
}

#[test]
fn positions_far_from_the_origin_are_a_warning() {
    let mut slices = six();
    for slice in &mut slices {
        let [x, y, z] = position(slice);
        place(slice, [x + 2e4, y, z]);
    }
    let (ct, _, info) = read(folder(&slices).path()).unwrap();
    assert!((ct.grid().origin().x - position(&six()[0])[0] - 2e4).abs() < 1e-9);
    assert!(
        info.warnings.iter().any(|w| w.to_string().contains("10 m from the origin")),
        "{info:?}"
    );
}

#[test]
fn loss_is_told_and_a_modality_lut_refused() {
    let mut slices = six();
    put(&mut slices[2], tags::LOSSY_IMAGE_COMPRESSION, VR::CS, "01");
    let (.., info) = read(folder(&slices).path()).unwrap();
    assert!(
        info.warnings.iter().any(|w| w.to_string().contains("compressed with loss")),
        "{info:?}"
    );

    let table = DataSetSequence::from(vec![InMemDicomObject::new_empty()]);
    slices[4].put(DataElement::new(tags::MODALITY_LUT_SEQUENCE, VR::SQ, table));
    let message = refusal(&slices);
    assert!(message.starts_with("4.dcm: Modality LUT Sequence is not read"), "{message}");
}

#[test]
fn links_and_deep_folders_lead_nowhere() {
    let dir = folder(&six());
    let plain = read(dir.path()).unwrap().0;
    symlink(dir.path(), dir.path().join("round")).unwrap();
    symlink("/dev/zero", dir.path().join("endless")).unwrap();
    symlink(dir.path().join("nowhere"), dir.path().join("broken")).unwrap();
    let deep = (0..10).fold(dir.path().to_owned(), |path, n| path.join(n.to_string()));
    std::fs::create_dir_all(&deep).unwrap();
    std::fs::write(deep.join("file"), "too deep to be looked at").unwrap();
    let (ct, _, info) = read(dir.path()).unwrap();
    assert!(ct == plain, "the slices are those of the folder itself");
    // A link to a folder may have been meant: it is told.
    let told: Vec<(&str, String)> =
        info.left_out.iter().map(|left| (left.file.as_str(), left.reason.to_string())).collect();
    assert!(told.len() == 1 && told[0].0 == "round", "{told:?}");
    assert!(told[0].1.contains("a link to a folder, which is not followed"), "{told:?}");
}
