//! What the page draws, as bytes and lines; knows nothing of what is open.

pub(crate) mod body;
pub(crate) mod contours;
pub(crate) mod cut;
pub(crate) mod lines;
pub(crate) mod planes;
pub(crate) mod surface;
pub(crate) mod voxels;
