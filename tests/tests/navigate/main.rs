//! `supine navigate` and `supine replay` as peers and people use them: other programs' OpenIGTLink,
//! a whole simulated motion, its replay, and wrong use.
//!
//! One run of the small case is made for all; a session has it for itself, so each test takes a
//! copy.
#![expect(
    clippy::disallowed_methods,
    reason = "the tests read what a session leaves, speak with it and wait for it"
)]

mod peers;
mod session;
mod simulated;
mod wrong_use;
