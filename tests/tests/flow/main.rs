//! Whole runs of the small case: what independent readers see in the results, the same bytes for
//! any number of threads, Ctrl-C, a second run.
//!
//! One run is shared by all tests; it stays in `target/tmp/flow` for whoever wants to look.
#![expect(clippy::disallowed_methods, reason = "the tests read what a run leaves and wait for it")]

mod anonymise;
mod apart;
mod batch;
mod by_hand;
mod carry;
mod check;
mod fit;
mod formats;
mod hazards;
mod init;
mod interrupt;
mod json;
mod labels;
mod network;
mod profile;
mod readers;
mod refine;
mod repeat;
mod report_pdf;
mod rt;
mod shared;
mod tissues;
mod tools;
mod trials;
mod tumour;
mod verdict;
