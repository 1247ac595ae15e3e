//! What the pictures show.

use supine_mesh::{Displacement, TetMesh};
use supine_space::{Point, Side, Sphere};
use supine_volume::{Ct, LabelMap, Volume};

/// The products of a run that the pictures show; all positions LPS, mm.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// The CT as it was read, HU.
    pub ct: &'a Ct,
    /// The CT on the operating table, HU; its grid may be another than the CT's.
    pub deformed: &'a Ct,
    /// The segmentation.
    pub labels: &'a LabelMap,
    /// How far the boundary of the chest wall may be wrong, tenths of mm on the voxels near it and 0
    /// elsewhere, on the grid of the labels; `None` when it is not known.
    pub doubt: Option<&'a Volume<u8>>,
    /// The finer labels, on the grid of the labels; `None` when the case did not ask for them.
    pub tissues: Option<&'a LabelMap>,
    /// The mesh in the CT shape.
    pub mesh: &'a TetMesh,
    /// Displacement from the CT shape to the operating position, as the CT was carried: with its fade
    /// towards the cut.
    pub displacement: &'a Displacement,
    /// The region.
    pub sphere: Sphere,
    /// The tumour in the CT.
    pub tumour: Option<Sphere>,
    /// The tumour's centre on the operating table.
    pub tumour_after: Option<Point>,
    /// The nipple in the CT.
    pub nipple: Option<Point>,
    /// The side of the breast.
    pub side: Side,
}
