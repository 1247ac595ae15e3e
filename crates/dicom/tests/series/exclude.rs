//! Files that the user leaves out.

use crate::support::{folder, place, position, put, read, rename, six};
use dicom_core::VR;
use dicom_dictionary_std::tags;
use supine_dicom::{ReadParams, read_series};
use supine_space::Progress;

fn without(path: &std::path::Path, names: &[&str]) -> Result<(usize, Vec<String>), String> {
    let exclude = names.iter().map(|name| (*name).to_owned()).collect();
    let params = ReadParams { exclude, ..ReadParams::default() };
    let read = read_series(path, &params, Progress::none()).map_err(|e| e.to_string())?;
    let left = read.2.left_out.iter().map(|l| format!("{}: {}", l.file, l.reason)).collect();
    Ok((read.0.grid().size()[2], left))
}

#[test]
fn a_file_that_is_left_out_is_no_slice_and_is_told() {
    let ct = folder(&six());
    assert_eq!(read(ct.path()).unwrap().0.grid().size()[2], 6);
    let mut names: Vec<String> = std::fs::read_dir(ct.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    let (slices, left) = without(ct.path(), &[&names[5]]).unwrap();
    assert_eq!(slices, 5);
    assert!(left.contains(&format!("{}: left out as asked", names[5])), "{left:?}");
    let error = without(ct.path(), &["nothing.dcm"]).unwrap_err();
    assert!(error.contains("nothing.dcm") && error.contains("exclude"), "{error}");
    let error = without(ct.path(), &[&names[2]]).unwrap_err();
    assert!(error.contains("a slice is missing"), "{error}");
}

#[test]
fn a_copy_of_a_slice_says_how_to_leave_it_out() {
    let ct = folder(&six());
    let first = std::fs::read_dir(ct.path()).unwrap().next().unwrap().unwrap().path();
    std::fs::copy(&first, ct.path().join("zz-copy.dcm")).unwrap();
    let error = read(ct.path()).unwrap_err().to_string();
    assert!(error.contains("remove one copy"), "{error}");
    assert!(error.contains("exclude = ["), "{error}");
    assert_eq!(without(ct.path(), &["zz-copy.dcm"]).unwrap().0, 6);
}

/// Two scans of one series, the feet as the second, that meet at 2.dcm; `apart` mm above it lies
/// one more of the second.
fn joined(apart: f64) -> Vec<crate::support::Slice> {
    let mut slices = six();
    let [x, y, z] = position(&slices[2]);
    let mut again = six().remove(2);
    rename(&mut again, "2.25.8");
    place(&mut again, [x, y, z + apart]);
    slices.push(again);
    for (n, slice) in slices.iter_mut().enumerate() {
        let scan = if matches!(n, 0 | 1 | 6) { "2" } else { "1" };
        put(slice, tags::ACQUISITION_NUMBER, VR::IS, scan);
    }
    slices
}

#[test]
fn scans_that_share_a_place_where_they_meet_say_which_file_to_leave_out() {
    for apart in [0.005, 0.0] {
        let ct = folder(&joined(apart));
        let error = read(ct.path()).unwrap_err().to_string();
        assert!(error.contains(&format!("{apart:.3} mm apart, 2.dcm and 6.dcm")), "{error}");
        assert!(error.contains("several acquisitions (Acquisition Number"), "{error}");
        assert!(error.contains("exclude = [\"6.dcm\"]"), "{error}");
        assert_eq!(without(ct.path(), &["6.dcm"]).unwrap().0, 6);
    }
    // More such places than joins: phases that lie almost on each other.
    let mut slices = six();
    for n in [1, 3, 5] {
        let [x, y, z] = position(&slices[n - 1]);
        place(&mut slices[n], [x, y, z + 0.005]);
        put(&mut slices[n], tags::ACQUISITION_NUMBER, VR::IS, "2");
        put(&mut slices[n - 1], tags::ACQUISITION_NUMBER, VR::IS, "1");
    }
    let error = read(folder(&slices).path()).unwrap_err().to_string();
    assert!(error.contains("whose slices alternate"), "{error}");
}
