//! MetaImage: a CT, maps of labels, painted seeds. The samples follow the header: there is no file
//! beside it.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| supine_fuzz::read_volume("volume.mha", input));
