//! The server as a page and others meet it: over the wire.

#![expect(clippy::disallowed_methods, clippy::unwrap_used, reason = "tests of an edge crate")]

mod client;
mod follow;
mod live;
mod paint;
mod requests;
mod unsaved;
