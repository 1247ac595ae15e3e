//! The spherical region that is meshed.

use crate::{LabelMap, Surfaces, label};
use std::sync::Arc;
use supine_space::{Failure, Point, Sphere};

/// The uncropped labels and the sphere inside which the soft tissue is modelled; cheap to clone.
#[derive(Clone, Debug)]
pub struct Region {
    labels: Arc<LabelMap>,
    surfaces: Option<Arc<Surfaces>>,
    sphere: Sphere,
}

/// Why a region cannot be modelled.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RegionError {
    /// The sphere reaches beyond the volume, into what is not known.
    #[error(
        "the region (centre {centre:.1?} mm, radius {radius:.1} mm) reaches {missing:.1} mm beyond the \
         {side} end of the volume's {axis} axis; move it, or give it a radius of at most {fits:.1} mm"
    )]
    OutsideVolume {
        /// Centre, LPS, mm.
        centre: [f64; 3],
        /// Radius, mm.
        radius: f64,
        /// Millimetres that are missing.
        missing: f64,
        /// `lower` or `upper`.
        side: &'static str,
        /// i, j or k.
        axis: char,
        /// The largest radius about this centre that stays within the volume, mm, rounded down.
        fits: f64,
    },
    /// No soft tissue inside.
    #[error("the region (centre {centre:.1?} mm, radius {radius:.1} mm) holds no soft tissue")]
    NoSoftTissue {
        /// Centre, LPS, mm.
        centre: [f64; 3],
        /// Radius, mm.
        radius: f64,
    },
    /// No chest wall inside: nothing would hold the breast.
    #[error(
        "the region (centre {centre:.1?} mm, radius {radius:.1} mm) holds no chest wall: nothing would \
         hold the breast; move or enlarge it"
    )]
    NoChestWall {
        /// Centre, LPS, mm.
        centre: [f64; 3],
        /// Radius, mm.
        radius: f64,
    },
    /// The surfaces are not those of the labels.
    #[error(
        "the surfaces lie on a grid of {surfaces:?} voxels, the labels on one of {labels:?}, or at \
         another place: make both in one segmentation"
    )]
    OtherGrid {
        /// Voxels of the surfaces.
        surfaces: [usize; 3],
        /// Voxels of the labels.
        labels: [usize; 3],
    },
}

impl RegionError {
    /// The kind of failure: the region, its labels or surfaces cannot be used.
    pub fn kind(&self) -> Failure {
        Failure::Input
    }
}

impl Region {
    /// The region of a sphere in a label map.
    ///
    /// # Errors
    /// When soft tissue inside the sphere is cut by the end of the volume, or no soft tissue
    /// lies inside the sphere.
    pub fn new(labels: Arc<LabelMap>, sphere: Sphere) -> Result<Self, RegionError> {
        let (centre, radius) = (sphere.centre().coords.into(), sphere.radius());
        let grid = labels.grid();
        let index = grid.index_from_patient(&sphere.centre());
        for a in 0..3 {
            let reach = radius / grid.spacing()[a];
            let last = (grid.size()[a] - 1) as f64;
            let below = (reach - index[a]) * grid.spacing()[a];
            let above = (index[a] + reach - last) * grid.spacing()[a];
            for (missing, side) in [(below, "lower"), (above, "upper")] {
                if missing > 0.0 && touches_end(&labels, sphere, a, side == "upper") {
                    let axis = ['i', 'j', 'k'][a];
                    let fits = largest_radius(&labels, sphere.centre()).unwrap_or(radius);
                    return Err(RegionError::OutsideVolume {
                        centre,
                        radius,
                        missing,
                        side,
                        axis,
                        fits,
                    });
                }
            }
        }
        let region = Self { labels, surfaces: None, sphere };
        if region.holds(label::is_soft_tissue) {
            Ok(region)
        } else {
            Err(RegionError::NoSoftTissue { centre, radius })
        }
    }

    /// Checks that there is chest wall to hold the soft tissue, as its mechanics need.
    ///
    /// # Errors
    /// [`RegionError::NoChestWall`].
    pub fn check_held(&self) -> Result<(), RegionError> {
        if self.holds(label::is_chest_wall) {
            return Ok(());
        }
        let (centre, radius) = (self.sphere.centre().coords.into(), self.sphere.radius());
        Err(RegionError::NoChestWall { centre, radius })
    }

    /// Whether a voxel within the sphere has such a label.
    fn holds(&self, test: fn(u8) -> bool) -> bool {
        let Some((start, part)) = self.labels.grid().around(&self.sphere) else { return false };
        (0..part.len()).map(|n| part.voxel(n)).any(|voxel| {
            let whole = [0, 1, 2].map(|a| voxel[a] + start[a]);
            test(self.labels.at(whole)) && self.sphere.contains(&self.labels.grid().centre(whole))
        })
    }

    /// The region with the surfaces of its labels where they are known between the voxels.
    ///
    /// # Errors
    /// When they lie on another grid than the labels.
    pub fn with_surfaces(
        self,
        surfaces: impl Into<Option<Arc<Surfaces>>>,
    ) -> Result<Self, RegionError> {
        let Some(surfaces) = surfaces.into() else { return Ok(self) };
        let labels = self.labels.grid();
        for grid in [surfaces.skin.grid(), surfaces.chest_wall.grid()] {
            if !grid.is_same(labels) {
                let (surfaces, labels) = (grid.size(), labels.size());
                return Err(RegionError::OtherGrid { surfaces, labels });
            }
        }
        Ok(Self { surfaces: Some(surfaces), ..self })
    }

    /// The surfaces of the labels, where they are known between the voxels.
    pub fn surfaces(&self) -> Option<&Arc<Surfaces>> {
        self.surfaces.as_ref()
    }

    /// The uncropped labels.
    pub fn labels(&self) -> &Arc<LabelMap> {
        &self.labels
    }

    /// The sphere.
    pub fn sphere(&self) -> Sphere {
        self.sphere
    }
}

/// The largest radius of a sphere about a place in which no soft tissue is cut by the end of the
/// volume, mm, rounded down to a tenth; none where no soft tissue lies at any end.
pub fn largest_radius(labels: &LabelMap, centre: Point) -> Option<f64> {
    let grid = labels.grid();
    let size = grid.size();
    let mut nearest = f64::INFINITY;
    for axis in 0..3 {
        let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
        for end in [0, size[axis] - 1] {
            for (x, y) in (0..size[b]).flat_map(|x| (0..size[c]).map(move |y| (x, y))) {
                let mut voxel = [0; 3];
                (voxel[axis], voxel[b], voxel[c]) = (end, x, y);
                if label::is_soft_tissue(labels.at(voxel)) {
                    nearest = nearest.min((grid.centre(voxel) - centre).norm());
                }
            }
        }
    }
    nearest.is_finite().then(|| (10.0 * nearest - 1e-3).floor().max(0.0) / 10.0)
}

/// Whether soft tissue lies inside the sphere in the last layer of voxels at one end of an axis.
fn touches_end(labels: &LabelMap, sphere: Sphere, axis: usize, upper: bool) -> bool {
    let grid = labels.grid();
    let size = grid.size();
    let end = if upper { size[axis] - 1 } else { 0 };
    let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
    (0..size[b]).any(|x| {
        (0..size[c]).any(|y| {
            let mut voxel = [0; 3];
            (voxel[axis], voxel[b], voxel[c]) = (end, x, y);
            label::is_soft_tissue(labels.at(voxel)) && sphere.contains(&grid.centre(voxel))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Volume;
    use supine_space::{Grid, Matrix, Vector};

    /// Air below y = 10 mm, soft tissue up to 30 mm, chest wall above.
    fn labels() -> Arc<LabelMap> {
        let grid = Grid::new([41; 3], Vector::repeat(1.0), Point::origin(), Matrix::identity());
        Arc::new(Volume::from_fn(grid.unwrap(), |[_, j, _]| match j {
            0..10 => label::OUTSIDE,
            10..30 => label::SOFT_TISSUE,
            _ => label::CHEST_WALL,
        }))
    }

    fn sphere(y: f64, radius: f64) -> Sphere {
        Sphere::new(Point::new(20.0, y, 20.0), radius).unwrap()
    }

    /// A server keeps it.
    const _: fn() = || {
        fn keeps<T: Clone + Send + Sync + 'static>() {}
        keeps::<Region>();
    };

    #[test]
    fn a_region_has_soft_tissue_and_is_told_when_nothing_holds_it() {
        let labels = labels();
        assert!(Region::new(labels.clone(), sphere(25.0, 8.0)).unwrap().check_held().is_ok());
        let free = Region::new(labels.clone(), sphere(15.0, 8.0)).unwrap();
        assert!(matches!(free.check_held(), Err(RegionError::NoChestWall { .. })));
        let air = Region::new(labels.clone(), sphere(4.0, 3.0));
        assert!(matches!(air, Err(RegionError::NoSoftTissue { .. })));
        let cut =
            Region::new(labels.clone(), sphere(18.0, 21.0)).map(|_| ()).unwrap_err().to_string();
        assert!(cut.contains("reaches 1.0 mm beyond"), "{cut}");
        // The nearest soft tissue at an end lies straight ahead, 20 mm away.
        assert!(cut.contains("a radius of at most 19.9 mm"), "{cut}");
        assert_eq!(largest_radius(&labels, Point::new(20.0, 18.0, 15.0)), Some(14.9));
        assert!(Region::new(labels.clone(), sphere(18.0, 19.9)).is_ok());
        let exact = Sphere::new(Point::new(20.0, 4.123_456_789, 20.0), 3.0 + 1e-9).unwrap();
        let told = Region::new(labels, exact).unwrap_err().to_string();
        assert!(told.contains("[20.0, 4.1, 20.0] mm, radius 3.0 mm"), "{told}");
    }
}
