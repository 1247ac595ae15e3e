//! The binary `supine`.
fn main() {}
