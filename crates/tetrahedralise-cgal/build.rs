//! Compiles the C++ side when the feature `cgal` is on.

fn main() {
    println!("cargo::rerun-if-changed=cpp");
    println!("cargo::rerun-if-changed=src/bridge.rs");
    #[cfg(feature = "cgal")]
    cgal();
}

#[cfg(feature = "cgal")]
fn cgal() {
    if !std::path::Path::new("/usr/include/CGAL/make_mesh_3.h").is_file()
        && std::env::var_os("CPLUS_INCLUDE_PATH").is_none()
    {
        println!(
            "cargo::error=CGAL is not installed: apt-get install libcgal-dev, or name its headers \
             in CPLUS_INCLUDE_PATH, or build without the feature `cgal`"
        );
        return;
    }
    let mut build = cxx_build::bridge("src/bridge.rs");
    build.file("cpp/mesh.cpp").include("cpp").std("c++17").warnings(false);
    // Its geometry is slow beyond use without optimisation, whatever the profile says;
    // -frounding-math is what its interval arithmetic rests on.
    build.opt_level(2).define("NDEBUG", None).flag("-frounding-math").compile("supine-cgal");
    println!("cargo::rustc-link-lib=gmp");
    println!("cargo::rustc-link-lib=mpfr");
}
