//! The Python module `supine._core`: a session of the flow whose results come as numpy arrays.
//!
//! `core` is the session, `wait` lets Python go on while it works, `arrays` gives arrays without
//! copies, `carried` those of the patient's own objects, `taken` reads those that Python gives,
//! `failure` turns errors into exceptions. What users see is the Python beside it (python/supine).

mod arrays;
mod carried;
mod core;
mod failure;
mod taken;
mod wait;

/// Memory is counted as in the command line's summary.
#[global_allocator]
static ALLOCATOR: supine_flow::CountingAllocator = supine_flow::CountingAllocator;

/// The compiled part of the package `supine`.
#[pyo3::pymodule]
mod _core {
    #[pymodule_export]
    use super::core::{Core, parameters, read_deformation, read_mesh, version};
}
