//! A navigation that runs elsewhere: what it says, and the thread that follows it.

pub(crate) mod follow;
pub(crate) mod messages;
pub(crate) mod region;
