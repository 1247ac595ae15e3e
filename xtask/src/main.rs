//! Chores of the house: `cargo xtask test | verify`.
fn main() {}
