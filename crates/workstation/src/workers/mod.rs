//! The threads that work: each gets what it needs, and reports what becomes of it.

pub(crate) mod carry;
pub(crate) mod edit;
pub(crate) mod file_watch;
pub(crate) mod jobs;
pub(crate) mod live;
pub(crate) mod objects;
pub(crate) mod open;
pub(crate) mod patient;
pub(crate) mod picture;
pub(crate) mod reporter;
pub(crate) mod run;
pub(crate) mod send;
pub(crate) mod tilt;
