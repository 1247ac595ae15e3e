//! A CT series of which one file is the input: what it holds, its pixels, its volume.
#![no_main]

use supine_dicom::{Accept, Depth, ReadParams, inspect, read_series};
use supine_space::Progress;

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    let folder = supine_fuzz::series(input);
    let first = folder.join("1.dcm");
    let _ = inspect(&folder, Depth::Pixels, Accept::default(), Progress::none());
    let _ = read_series(&folder, &ReadParams::default(), Progress::none());
    let accept = Accept { assume_hu: true, equalise_steps: true };
    let _ = read_series(&folder, &ReadParams { accept, ..ReadParams::default() }, Progress::none());
    // Alone as well: a file that belongs to another series, or is a whole volume itself.
    let _ = read_series(&first, &ReadParams::default(), Progress::none());
});
