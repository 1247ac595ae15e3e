//! The case file.
#![no_main]

use supine_pipeline::Case;

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    let _ = Case::read(&supine_fuzz::file("case.toml", input));
});
