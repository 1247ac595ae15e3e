//! The page is part of the program: it is built anew when a file of it changes.

fn main() {
    println!("cargo::rerun-if-changed=page");
}
