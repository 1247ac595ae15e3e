//! Sessions: what is kept equals what is made anew.

#![expect(
    clippy::unwrap_used,
    clippy::disallowed_methods,
    reason = "tests work in folders of their own"
)]

mod edits;
mod field;
mod lost;
mod methods;
mod support;
mod table;
mod times;
mod values;
