//! Contours of structures as CSV.
#![no_main]

use supine_exchange::{is_contours, read_contours};

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    let path = supine_fuzz::file("contours.csv", input);
    let _ = is_contours(&path);
    let _ = read_contours(&path);
});
