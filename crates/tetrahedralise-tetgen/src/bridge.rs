//! What Rust and C++ tell each other.

#[cxx::bridge(namespace = "supine_tetgen")]
pub(crate) mod ffi {
    /// A mesh in plain numbers.
    struct Raw {
        points: Vec<f64>,
        tets: Vec<u32>,
        faces: Vec<u32>,
        tags: Vec<u8>,
    }

    // SAFETY: C++ keeps none of its arguments beyond the call, takes lengths from the slices, and
    // is given one tag per face and faces whose points exist (`wire::Request::check`).
    unsafe extern "C++" {
        include!("fill.h");
        fn fill(points: &[f64], faces: &[u32], tags: &[u8], switches: &str) -> Result<Raw>;
    }
}
