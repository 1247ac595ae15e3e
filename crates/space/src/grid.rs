//! A regular grid of voxel centres in patient space.

use crate::{Failure, Matrix, Point, Sphere, Vector};

/// Size, spacing, origin and direction of a voxel grid.
///
/// The centre of voxel (i, j, k) lies at `origin + direction * diag(spacing) * (i, j, k)`, LPS, mm.
/// In memory i is fastest. The direction matrix is orthonormal, of either handedness; nobody may
/// assume that it is the identity.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    size: [usize; 3],
    spacing: Vector,
    origin: Point,
    direction: Matrix,
}

/// Why a grid cannot be.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GridError {
    /// A dimension is 0 or the number of voxels overflows.
    #[error("the grid size {0:?} is not usable: each dimension must be 1 or more, 2^40 in all")]
    Size([usize; 3]),
    /// A spacing is not above 0 or not finite.
    #[error("the voxel spacing {0:?} mm is not usable: it must be finite and above 0")]
    Spacing([f64; 3]),
    /// The origin is not finite.
    #[error("the grid origin {0:?} mm is not finite")]
    Origin([f64; 3]),
    /// The axes are not unit vectors at right angles.
    #[error("the grid axes are not orthonormal: largest deviation {0:.2e}, allowed 1e-4")]
    Direction(f64),
}

impl GridError {
    /// The kind of failure: the geometry that was given cannot be used.
    pub fn kind(&self) -> Failure {
        Failure::Input
    }
}

/// Largest entry of |DᵀD - I| that is still taken as orthonormal (DICOM DS rounding gives 1e-13).
const ORTHONORMAL_TOLERANCE: f64 = 1e-4;

/// Two grids are the same when no corner voxels lie farther apart than this, mm.
///
/// Files round geometry: a spacing written with five decimals moves the last of 512 voxels by 0.003
/// mm, a direction in single precision that of a 500 mm axis by 0.0001 mm. Both must pass; 0.01 mm
/// is still a fiftieth of the smallest voxels of a CT, so that no voxel is taken for its neighbour.
/// Chosen from these figures, not measured.
const SAME_GRID_MM: f64 = 0.01;

impl Grid {
    /// A grid from its size (voxels along i, j, k), spacing (mm), origin (LPS, mm) and direction
    /// (columns: the i, j and k axes in LPS).
    ///
    /// # Errors
    /// When a size is 0, a spacing is not above 0, a number is not finite or the axes are not
    /// orthonormal to 1e-4.
    pub fn new(
        size: [usize; 3],
        spacing: Vector,
        origin: Point,
        direction: Matrix,
    ) -> Result<Self, GridError> {
        let voxels = size.iter().try_fold(1usize, |n, &s| n.checked_mul(s));
        if size.contains(&0) || voxels.is_none_or(|n| n > 1 << 40) {
            return Err(GridError::Size(size));
        }
        if !spacing.iter().all(|s| s.is_finite() && *s > 0.0) {
            return Err(GridError::Spacing(spacing.into()));
        }
        if !origin.iter().all(|c| c.is_finite()) {
            return Err(GridError::Origin(origin.coords.into()));
        }
        let deviation = (direction.transpose() * direction - Matrix::identity()).abs().max();
        if deviation.is_nan() || deviation > ORTHONORMAL_TOLERANCE {
            return Err(GridError::Direction(deviation));
        }
        Ok(Self { size, spacing, origin, direction })
    }

    /// Voxels along i, j, k.
    pub fn size(&self) -> [usize; 3] {
        self.size
    }

    /// Distance of voxel centres along i, j, k, mm.
    pub fn spacing(&self) -> Vector {
        self.spacing
    }

    /// Centre of voxel (0, 0, 0), LPS, mm.
    pub fn origin(&self) -> Point {
        self.origin
    }

    /// Columns: the unit vectors of the i, j and k axes in LPS.
    pub fn direction(&self) -> &Matrix {
        &self.direction
    }

    /// Number of voxels.
    pub fn len(&self) -> usize {
        self.size.iter().product()
    }

    /// Never: a grid has at least one voxel.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// Volume of a voxel, mm³.
    pub fn voxel_volume(&self) -> f64 {
        self.spacing.product()
    }

    /// Position of a continuous index (voxel centres at integers), LPS, mm.
    pub fn patient_from_index(&self, index: [f64; 3]) -> Point {
        self.origin + self.direction * Vector::from(index).component_mul(&self.spacing)
    }

    /// Continuous index of a position: `(Dᵀ (p - origin)) / spacing`, in this order of operations,
    /// which the exact rasteriser relies on.
    #[inline]
    pub fn index_from_patient(&self, p: &Point) -> [f64; 3] {
        (self.direction.tr_mul(&(p - self.origin))).component_div(&self.spacing).into()
    }

    /// The voxel whose cell holds the position, if it lies within the grid.
    pub fn voxel_at(&self, p: &Point) -> Option<[usize; 3]> {
        let index = self.index_from_patient(p);
        let mut voxel = [0; 3];
        for a in 0..3 {
            let r = index[a].round();
            if !(r >= 0.0 && r < self.size[a] as f64) {
                return None;
            }
            voxel[a] = r as usize;
        }
        Some(voxel)
    }

    /// Whether the other grid has the same voxels at the same places, but for the rounding of
    /// files: as many along each axis, no two of them farther apart than 0.01 mm.
    pub fn is_same(&self, other: &Self) -> bool {
        self.offset_mm(other).is_some_and(|mm| mm <= SAME_GRID_MM)
    }

    /// Largest distance of corresponding voxel centres, mm; `None` when the sizes differ.
    pub fn offset_mm(&self, other: &Self) -> Option<f64> {
        if self.size != other.size {
            return None;
        }
        // Both are linear in the index: no voxel lies farther off than the farthest corner.
        let last = self.size.map(|n| n - 1);
        let off = |corner: usize| {
            let voxel = [0, 1, 2].map(|a| last[a] * (corner >> a & 1));
            (self.centre(voxel) - other.centre(voxel)).norm()
        };
        Some((0..8).map(off).fold(0.0, f64::max))
    }

    /// Centre of a voxel, LPS, mm.
    pub fn centre(&self, voxel: [usize; 3]) -> Point {
        self.patient_from_index(voxel.map(|v| v as f64))
    }

    /// Place of voxel (i, j, k) in memory.
    #[inline]
    pub fn offset(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.size[1] + j) * self.size[0] + i
    }

    /// Voxel (i, j, k) at a place in memory.
    #[inline]
    pub fn voxel(&self, offset: usize) -> [usize; 3] {
        let [ni, nj, _] = self.size;
        [offset % ni, offset / ni % nj, offset / (ni * nj)]
    }

    /// The part of the grid that starts at voxel `start` and has `size` voxels.
    ///
    /// # Errors
    /// [`GridError::Size`] when the part does not lie within the grid or is empty.
    pub fn crop(&self, start: [usize; 3], size: [usize; 3]) -> Result<Self, GridError> {
        if (0..3).any(|a| start[a].saturating_add(size[a]) > self.size[a]) {
            return Err(GridError::Size(size));
        }
        Self::new(size, self.spacing, self.centre(start), self.direction)
    }

    /// The smallest part of the grid that holds its share of the sphere, and the voxel where it
    /// starts; `None` when the sphere's box lies beside the grid.
    pub fn around(&self, sphere: &Sphere) -> Option<([usize; 3], Self)> {
        let centre = self.index_from_patient(&sphere.centre());
        let (mut start, mut size) = ([0; 3], [0; 3]);
        for a in 0..3 {
            let reach = sphere.radius() / self.spacing[a];
            let first = (centre[a] - reach).floor().max(0.0);
            let last = (centre[a] + reach).ceil().min((self.size[a] - 1) as f64);
            if first > last {
                return None;
            }
            start[a] = first as usize;
            size[a] = (last - first) as usize + 1;
        }
        self.crop(start, size).ok().map(|part| (start, part))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    fn oblique() -> Grid {
        let d = Rotation3::from_euler_angles(0.3, -0.2, 0.5).into_inner();
        Grid::new([5, 6, 7], Vector::new(0.7, 1.1, 2.5), Point::new(-20.0, 5.0, 100.0), d).unwrap()
    }

    #[test]
    fn index_and_patient_round_trip() {
        let g = oblique();
        for n in 0..g.len() {
            let v = g.voxel(n);
            assert_eq!(g.offset(v), n);
            assert_eq!(g.voxel_at(&g.centre(v)), Some(v));
            let back = g.index_from_patient(&g.centre(v));
            assert!((0..3).all(|a| (back[a] - v[a] as f64).abs() < 1e-12), "{back:?} {v:?}");
        }
    }

    #[test]
    fn crop_keeps_positions() {
        let g = oblique();
        let c = g.crop([1, 2, 3], [2, 3, 4]).unwrap();
        assert!((c.centre([1, 1, 1]) - g.centre([2, 3, 4])).norm() < 1e-12);
        assert!(g.crop([4, 0, 0], [2, 1, 1]).is_err());
    }

    #[test]
    fn the_part_around_a_sphere_holds_its_share_of_it() {
        let g = oblique();
        for (index, radius) in [([2.0, 3.0, 3.0], 1.3), ([0.2, 5.4, 6.0], 3.0), ([2.0; 3], 90.0)] {
            let sphere = Sphere::new(g.patient_from_index(index), radius).unwrap();
            let (start, part) = g.around(&sphere).unwrap();
            let held =
                |g: &Grid| (0..g.len()).filter(|&n| sphere.contains(&g.centre(g.voxel(n)))).count();
            assert_eq!(held(&part), held(&g));
            assert!((part.origin() - g.centre(start)).norm() < 1e-12);
        }
        let beside = Sphere::new(g.patient_from_index([2.0, 3.0, -3.0]), 2.0).unwrap();
        assert!(g.around(&beside).is_none());
    }

    #[test]
    fn rounded_grids_are_the_same_and_shifted_ones_are_not() {
        let g = oblique();
        let with = |spacing: Vector, origin: Point| {
            Grid::new(g.size(), spacing, origin, *g.direction()).unwrap()
        };
        let rounded = with(g.spacing() * (1.0 + 1e-6), g.origin() + Vector::new(4e-3, 0.0, 4e-3));
        assert!(g.is_same(&g) && g.is_same(&rounded) && g != rounded);
        let shifted = with(g.spacing(), g.origin() + Vector::new(0.0, 0.03, 0.04));
        assert!(!g.is_same(&shifted));
        assert!((g.offset_mm(&shifted).unwrap() - 0.05).abs() < 1e-12);
        // The first voxel lies at its place, the last one does not.
        assert!(!g.is_same(&with(g.spacing() * 1.01, g.origin())));
        assert_eq!(g.offset_mm(&g.crop([0; 3], [4, 6, 7]).unwrap()), None);
    }

    #[test]
    fn unusable_grids_are_refused() {
        let (s, o, d) = (Vector::repeat(1.0), Point::origin(), Matrix::identity());
        assert!(matches!(Grid::new([0, 1, 1], s, o, d), Err(GridError::Size(_))));
        assert!(matches!(Grid::new([usize::MAX, 2, 2], s, o, d), Err(GridError::Size(_))));
        assert!(matches!(Grid::new([1; 3], s * 0.0, o, d), Err(GridError::Spacing(_))));
        assert!(matches!(Grid::new([1; 3], s, o, d * 1.1), Err(GridError::Direction(_))));
        let nan = Point::new(f64::NAN, 0.0, 0.0);
        assert!(matches!(Grid::new([1; 3], s, nan, d), Err(GridError::Origin(_))));
    }
}
