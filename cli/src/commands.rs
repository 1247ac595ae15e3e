//! One file per command that has much to print; the others stand here.

pub(crate) mod batch;
pub(crate) mod batch_case;
pub(crate) mod carry;
pub(crate) mod demo;
pub(crate) mod fetch;
pub(crate) mod init;
pub(crate) mod inspect;
pub(crate) mod manual;
pub(crate) mod navigate;
pub(crate) mod open;
pub(crate) mod run;
pub(crate) mod send;
pub(crate) mod stages;
