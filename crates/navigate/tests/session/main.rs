//! Whole sessions over loopback: a block of tissue, peers that behave and peers that do not.

#![expect(clippy::disallowed_methods, clippy::unwrap_used, reason = "tests of an edge crate")]

mod cases;
mod cavity;
mod ends;
mod hostile;
mod live;
mod memory;
mod newest;
mod queries;
mod raw;
mod recordings;
mod servers;
mod slow_readers;
mod states;
mod support;
mod trackers;
mod versions;
