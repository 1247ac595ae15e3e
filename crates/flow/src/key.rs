//! By what a result is known.

/// A hash, hexadecimal: of what a result was made from, or, after `value `, of what it is.
pub(crate) type Key = String;
