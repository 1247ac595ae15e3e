//! NRRD: a CT, maps of labels, segmentations of 3D Slicer, painted seeds.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| supine_fuzz::read_volume("volume.seg.nrrd", input));
