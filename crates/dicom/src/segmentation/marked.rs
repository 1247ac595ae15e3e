//! What is written of a segmentation.

use supine_space::Grid;

/// The voxels of segments on the grid of a CT.
pub(super) struct Marked<'a> {
    pub(super) grid: &'a Grid,
    /// How many segmentations were carried along before this one; none of labels made here.
    pub(super) carried: Option<usize>,
    /// Names of the segments.
    pub(super) names: Vec<String>,
    /// Whether a segment, counted from 0, holds a voxel.
    pub(super) holds: &'a (dyn Fn(usize, usize) -> bool + Sync),
}
