//! One choice of features for the crates of others, whichever packages cargo is asked for.
//!
//! Cargo gives a foreign crate the features that the *selected* packages ask of it. `cargo build
//! --workspace`, `cargo build --package supine-python` (the wheel) and `cargo test --package
//! supine-fem` would thus each compile serde, rustix, syn and all that rests on them once more.
//! Every package of the workspace depends on this one, whose manifest asks for the union; nothing
//! of it is linked. The test `house::features` compares the choices and names what to add.
