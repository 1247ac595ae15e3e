//! Compiles the C++ side when the feature `tetgen` is on.

fn main() {
    println!("cargo::rerun-if-changed=cpp");
    println!("cargo::rerun-if-changed=src/bridge.rs");
    #[cfg(feature = "tetgen")]
    tetgen();
}

#[cfg(feature = "tetgen")]
fn tetgen() {
    if !std::path::Path::new("/usr/include/tetgen.h").is_file()
        && std::env::var_os("CPLUS_INCLUDE_PATH").is_none()
    {
        println!(
            "cargo::error=TetGen is not installed: apt-get install libtet1.5-dev, or name its \
             headers in CPLUS_INCLUDE_PATH, or build without the feature `tetgen`"
        );
        return;
    }
    let mut build = cxx_build::bridge("src/bridge.rs");
    build.file("cpp/fill.cpp").include("cpp").std("c++17").warnings(false);
    build.define("TETLIBRARY", None).compile("supine-tetgen");
    println!("cargo::rustc-link-lib=tet");
}
