//! The doors: who may ask, what can be asked, and what is told.

pub(crate) mod app;
pub(crate) mod browser;
pub(crate) mod doors;
pub(crate) mod guard;
pub(crate) mod link;
pub(crate) mod routes;
