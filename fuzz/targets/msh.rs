//! A mesh as Gmsh MSH.
#![no_main]

use supine_exchange::read_mesh;

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    let _ = read_mesh(&supine_fuzz::file("mesh.msh", input));
});
