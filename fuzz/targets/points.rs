//! Lists of points: 3D Slicer markups and CSV, told apart by the first byte; landmarks.
#![no_main]

use supine_exchange::{read_landmarks, read_points, read_seeds};
use supine_space::Progress;

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    let json = input.trim_ascii_start().starts_with(b"{");
    let path = supine_fuzz::file(if json { "points.mrk.json" } else { "points.csv" }, input);
    let _ = read_points(&path);
    let _ = read_landmarks(&path);
    let _ = read_seeds(&path, Progress::none());
});
