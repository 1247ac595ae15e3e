//! One file per command.

pub(crate) mod carry;
pub(crate) mod coarsen;
pub(crate) mod demo;
pub(crate) mod fetch;
pub(crate) mod inspect;
pub(crate) mod manual;
pub(crate) mod mesh;
pub(crate) mod run;
pub(crate) mod segment;
pub(crate) mod send;
pub(crate) mod solve;
pub(crate) mod verify_export;
pub(crate) mod warp;
