//! DICOM objects of one file: structure sets, segmentations, doses, deformable registrations.
#![no_main]

use supine_dicom::{
    is_dose, read_deformable, read_dose, read_segmentation, read_structures, region_object,
};
use supine_space::{Grid, Matrix, Point, Vector};

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    let path = supine_fuzz::file("object.dcm", input);
    let (one, zero) = (Vector::new(1.0, 1.0, 2.0), Point::origin());
    let Ok(grid) = Grid::new([8, 8, 4], one, zero, Matrix::identity()) else { return };
    let _ = region_object(&path);
    let _ = is_dose(&path);
    let _ = read_dose(&path);
    let _ = read_deformable(&path);
    if let Ok(found) = read_segmentation(&path, &grid, None) {
        for segment in found.segments() {
            let _ = found.mask(segment.number);
        }
    }
    if let Ok(found) = read_structures(&path) {
        for roi in found.rois() {
            let _ = found.mask(roi, &grid, None);
        }
    }
});
