//! A closed surface as OBJ.
#![no_main]

use supine_exchange::{SurfaceFrame, read_surface};

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    let path = supine_fuzz::file("surface.obj", input);
    let _ = read_surface(&path, SurfaceFrame::Ras);
});
