//! NRRD: a CT, maps of labels, segmentations of 3D Slicer, painted seeds.
#![no_main]

use supine_exchange::{read_any_volume, read_brought_labels, read_ct, read_labels, read_seeds};
use supine_exchange::{BroughtLabels, read_signed_distance, read_tenths};
use supine_space::Progress;

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    let path = supine_fuzz::file("volume.seg.nrrd", input);
    let _ = read_ct(&path, Progress::none());
    let _ = read_tenths(&path, Progress::none());
    let _ = read_signed_distance(&path, Progress::none());
    let _ = read_labels(&path, Progress::none());
    let _ = read_seeds(&path, Progress::none());
    let _ = read_any_volume(&path, None, Progress::none());
    if let Ok(BroughtLabels::Segments(found)) = read_brought_labels(&path, Progress::none()) {
        for place in 0..found.names().count() {
            let _ = found.mask(place);
        }
    }
});
