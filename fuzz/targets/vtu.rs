//! A mesh as a VTK XML unstructured grid.
#![no_main]

use supine_exchange::read_vtu;

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    let _ = read_vtu(&supine_fuzz::file("mesh.vtu", input));
});
