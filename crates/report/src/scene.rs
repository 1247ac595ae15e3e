//! What the pictures show, and what is told of it.

use crate::{
    Ellipsoid, Evaluation, Mesh, Movement, Segmentation, Summary, TissueFit, VolumeChange,
};
use supine_mesh::{Deformation, Displacement, ScanDistances, TetMesh};
use supine_space::{Point, Side, Sphere, Vector};
use supine_volume::{Ct, LabelMap, Surfaces, Volume};

/// Half the side of the box that is shown, in radii of the region's sphere.
const AROUND: f64 = 1.08;

/// The products of a run that the pictures show; all positions LPS, mm.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// The CT as it was read, HU.
    pub ct: &'a Ct,
    /// The CT on the operating table, HU; its grid may be another than the CT's.
    pub deformed: &'a Ct,
    /// The segmentation.
    pub labels: &'a LabelMap,
    /// Skin and chest wall between the voxels, on the grid of the labels: the lines of all pictures.
    pub surfaces: &'a Surfaces,
    /// How far the boundary of the chest wall may be wrong, tenths of mm on the voxels near it and
    /// 0 elsewhere, on the grid of the labels; `None` when it is not known.
    pub uncertainty: Option<&'a Volume<u8>>,
    /// The finer labels, on the grid of the labels; `None` when the case did not ask for them.
    pub tissues: Option<&'a LabelMap>,
    /// The mesh in the CT shape with its displacement to the operating position, as the CT was
    /// carried: with its fade towards the cut.
    pub deformation: &'a Deformation,
    /// The displacement of the tissue itself, without that fade, of the same mesh.
    pub tissue: &'a Displacement,
    /// The region.
    pub sphere: Sphere,
    /// The tumour in the CT.
    pub tumour: Option<Sphere>,
    /// The tumour's centre on the operating table.
    pub tumour_after: Option<Point>,
    /// Where the tumour's centre may lie on the operating table.
    pub tumour_within: Option<&'a Ellipsoid>,
    /// The nipple in the CT.
    pub nipple: Option<Point>,
    /// The side of the breast.
    pub side: Side,
}

/// What the captions and tables beside the pictures tell.
#[derive(Clone, Copy, Debug)]
pub struct Shown<'a> {
    /// What was found of the chest wall and the soft tissue.
    pub segmentation: &'a Segmentation,
    /// What the mesh is like.
    pub mesh: &'a Mesh,
    /// How the volume of each structure changes: [`crate::volume_changes`].
    pub volumes: &'a [VolumeChange],
    /// The nipple before and after.
    pub nipple: Option<&'a Movement>,
    /// What was fitted to the scan of the sitting patient, and that scan.
    pub sitting: Option<(&'a TissueFit, &'a ScanDistances)>,
    /// How far the scan on the operating table lies off, and that scan.
    pub intraop: Option<(&'a Evaluation, &'a ScanDistances)>,
}

/// Whether the boundary of the chest wall at a place (LPS, mm) may be wrong by more than a limit:
/// the worst of the voxels around says so, and it lies in the region, where there is one. `map` is
/// that of [`Scene::uncertainty`].
pub fn is_uncertain(
    map: &Volume<u8>,
    region: Option<&Sphere>,
    limit_mm: f64,
    place: &Point,
) -> bool {
    let (index, size) = (map.grid().index_from_patient(place), map.grid().size());
    let at =
        |c: usize| [0, 1, 2].map(|a| (index[a].max(0.0) as usize + (c >> a & 1)).min(size[a] - 1));
    region.is_none_or(|region| region.contains(place))
        && (0..8).any(|c| f64::from(map.at(at(c))) > 10.0 * limit_mm)
}

impl<'a> Scene<'a> {
    /// Whether the boundary of the chest wall at a place (LPS, mm) is uncertain: [`is_uncertain`].
    pub(crate) fn is_uncertain(&self, limit_mm: f64, place: &Point) -> bool {
        self.uncertainty.is_some_and(|map| is_uncertain(map, Some(&self.sphere), limit_mm, place))
    }

    /// Half the side of the box that is shown of the region, mm.
    pub(crate) fn reach(&self) -> f64 {
        AROUND * self.sphere.radius()
    }

    /// Lower and upper corner of that box, LPS, mm.
    pub(crate) fn frame(&self) -> [Point; 2] {
        let around = Vector::repeat(self.reach());
        [self.sphere.centre() - around, self.sphere.centre() + around]
    }

    /// The place that planes go through (LPS, mm), and what lies there.
    pub(crate) fn focus(&self) -> (Point, &'static str) {
        match (self.tumour, self.nipple) {
            (Some(tumour), _) => (tumour.centre(), "tumour"),
            (None, Some(nipple)) => (nipple, "nipple"),
            (None, None) => (self.sphere.centre(), "centre of the region"),
        }
    }

    /// The mesh in the CT shape.
    pub(crate) fn mesh(&self) -> &'a TetMesh {
        self.deformation.mesh()
    }

    /// Displacement from the CT shape, mm.
    pub(crate) fn displacement(&self) -> &'a Displacement {
        self.deformation.displacement()
    }
}

impl<'a> From<&'a Summary> for Shown<'a> {
    fn from(summary: &'a Summary) -> Self {
        Self {
            segmentation: &summary.segmentation,
            mesh: &summary.mesh,
            volumes: &summary.volumes,
            nipple: summary.nipple.as_ref(),
            sitting: None,
            intraop: None,
        }
    }
}
