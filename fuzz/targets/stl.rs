//! A closed surface, and a scan, as STL.
#![no_main]

use supine_exchange::{LengthUnit, SurfaceFrame, read_scan, read_surface};

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    let path = supine_fuzz::file("surface.stl", input);
    let _ = read_surface(&path, SurfaceFrame::Ras);
    let _ = read_scan(&path, None);
    let _ = read_scan(&path, Some(LengthUnit::Inch));
});
