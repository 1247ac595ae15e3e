//! The rules of the house: layers, licences, tidiness.
#![expect(clippy::disallowed_methods, reason = "the rules are about files")]

mod circles;
mod features;
mod layers;
mod licences;
mod tidy;
