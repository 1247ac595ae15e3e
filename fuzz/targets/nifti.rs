//! NIfTI-1: a CT, maps of labels, painted seeds.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| supine_fuzz::read_volume("volume.nii", input));
