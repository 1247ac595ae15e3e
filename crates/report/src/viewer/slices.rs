//! Volumes of the region's box, resampled for the viewer: axial slices of bytes, from the feet to
//! the head.

use crate::{Scene, palette};
use rayon::prelude::*;
use supine_space::{Plane, Point, Progress, Stopped, Vector, View};
use supine_volume::{SignedDistance, Volume, sample_plane};

/// Most voxels along an axis.
const MOST: usize = 160;
/// Least distance of voxels, mm.
const FINEST_MM: f64 = 1.0;
/// What a voxel deep in the chest wall has; one deep outside has 0, and the boundary lies where
/// half of it would be.
pub(super) const WHOLE: u8 = 127;
/// Is added where the boundary of the chest wall is uncertain; above `WHOLE`, so that both fit into
/// one byte.
pub(super) const UNCERTAIN: u8 = 128;
/// So far from the boundary a voxel is deep, steps: the corners of a cell that it crosses lie
/// nearer.
const DEEP: f64 = 2.0;

/// The voxels of the viewer: a cube along the axes of LPS.
#[derive(Clone, Debug)]
pub(super) struct Lattice {
    /// Centre of the voxel farthest to the right, to the front and to the feet, LPS, mm.
    pub(super) origin: Point,
    /// Distance of neighbours, mm.
    pub(super) step_mm: f64,
    /// Voxels along each axis.
    pub(super) size: usize,
}

impl Lattice {
    /// Covers the box of the region in steps of 1 mm, or in larger ones where these were too many.
    pub(super) fn new(scene: &Scene<'_>) -> Self {
        let side = 2.0 * scene.reach();
        let step_mm = FINEST_MM.max(side / (MOST - 1) as f64);
        // A step may be missing from the last voxel to the face of the box, but none is beyond it.
        let size = ((side / step_mm + 1e-9) as usize + 1).clamp(2, MOST);
        let half = 0.5 * step_mm * (size - 1) as f64;
        Self { origin: scene.sphere.centre() - Vector::repeat(half), step_mm, size }
    }

    /// The axial plane of slice `k`; its pixels are the slice's voxels.
    fn plane(&self, k: usize) -> Plane {
        let half = Vector::repeat(0.5 * self.step_mm);
        let across = Vector::repeat(self.step_mm * (self.size - 1) as f64);
        let at = self.origin + Vector::z() * (self.step_mm * k as f64);
        let frame = [self.origin - half, self.origin + across + half];
        Plane::new(View::Axial, &at, frame, self.step_mm)
    }

    /// The bytes of all slices; `slice` gives those of one plane.
    fn slices(
        &self,
        progress: Progress<'_>,
        slice: impl Fn(&Plane) -> Vec<u8>,
    ) -> Result<Vec<u8>, Stopped> {
        let mut bytes = Vec::with_capacity(self.size.pow(3));
        for k in 0..self.size {
            progress.at(k as f64 / self.size as f64)?;
            bytes.extend(slice(&self.plane(k)));
        }
        Ok(bytes)
    }

    /// A CT in the grey of the pictures; black outside its voxels.
    pub(super) fn grey(
        &self,
        ct: &Volume<i16>,
        progress: Progress<'_>,
    ) -> Result<Vec<u8>, Stopped> {
        let grey = |hu: f32| if hu.is_nan() { 0 } else { palette::grey(hu)[0] };
        self.slices(progress, |plane| sample_plane(ct, plane).into_iter().map(grey).collect())
    }

    /// How deep each voxel lies in the chest wall, 0 to [`WHOLE`], with [`UNCERTAIN`] added where
    /// its boundary may be wrong by more than `limit_mm`.
    pub(super) fn wall(
        &self,
        scene: &Scene<'_>,
        limit_mm: f64,
        progress: Progress<'_>,
    ) -> Result<Vec<u8>, Stopped> {
        let wall = scene.surfaces.chest_wall.values();
        let half = 0.5 * f64::from(WHOLE + 1);
        let per_unit = half / (DEEP * self.step_mm * SignedDistance::PER_MM);
        let voxel = |plane: &Plane, (n, distance): (usize, f32)| {
            let place = plane.patient([(n % plane.width) as f64, (n / plane.width) as f64]);
            let unsure = scene.is_uncertain(limit_mm, &place);
            // A distance that is not a number, outside the CT, becomes 0.
            let depth = half - per_unit * f64::from(distance);
            depth.clamp(0.0, f64::from(WHOLE)) as u8 + if unsure { UNCERTAIN } else { 0 }
        };
        self.slices(progress, |plane| {
            let distances = sample_plane(wall, plane);
            distances.into_par_iter().enumerate().map(|at| voxel(plane, at)).collect()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phantom::{MARKER, Phantom};
    use supine_space::Matrix;

    /// The voxel nearest to a place, LPS, mm.
    fn voxel(lattice: &Lattice, p: [f64; 3]) -> usize {
        let at = (Point::from(p) - lattice.origin) / lattice.step_mm;
        let [i, j, k] = [at.x, at.y, at.z].map(|x| x.round() as usize);
        (k * lattice.size + j) * lattice.size + i
    }

    /// Mean place of the voxels above a grey, LPS, mm.
    fn bright(lattice: &Lattice, bytes: &[u8]) -> Vector {
        let n = lattice.size;
        let inside = (0..bytes.len()).filter(|&v| bytes[v] > 190);
        let places = inside.map(|v| [v % n, v / n % n, v / (n * n)].map(|c| c as f64));
        let (sum, count) = places
            .fold((Vector::zeros(), 0.0), |(sum, count), p| (sum + Vector::from(p), count + 1.0));
        lattice.origin.coords + sum / count * lattice.step_mm
    }

    #[test]
    fn the_step_is_a_millimetre_until_there_were_too_many() {
        let phantom = Phantom::new(Matrix::identity(), Vector::zeros());
        let mut scene = phantom.scene();
        let small = Lattice::new(&scene);
        assert_eq!((small.size, small.step_mm), (104, 1.0));
        let radius = 120.0;
        scene.sphere = supine_space::Sphere::new(Point::new(3.0, 4.0, 5.0), radius).unwrap();
        let large = Lattice::new(&scene);
        assert_eq!(large.size, MOST);
        let far = large.origin + Vector::repeat(large.step_mm * (MOST - 1) as f64);
        let [low, high] = scene.frame();
        assert!((large.origin - low).norm() < 1e-9 && (far - high).norm() < 1e-9);
    }

    #[test]
    fn known_places_have_the_grey_of_the_pictures() {
        let phantom = Phantom::new(Matrix::identity(), Vector::zeros());
        let lattice = Lattice::new(&phantom.scene());
        let bytes = lattice.grey(&phantom.ct, Progress::none()).unwrap();
        assert_eq!(bytes.len(), lattice.size.pow(3));
        let at = |p: [f64; 3]| bytes[voxel(&lattice, p)];
        let grey = |hu: f32| palette::grey(hu)[0];
        assert_eq!(
            [at([0.0; 3]), at(MARKER), at([0.0, -50.0, 0.0])],
            [0.0, 1000.0, -1000.0].map(grey)
        );
        // Left, front and head are where they are in the patient.
        for axis in 0..3 {
            let mut mirrored = MARKER;
            mirrored[axis] = -MARKER[axis];
            assert_eq!(at(mirrored), grey(0.0), "axis {axis}");
        }
    }

    #[test]
    fn what_moves_is_seen_to_move() {
        let u = Vector::new(4.0, 2.0, -6.0);
        let phantom = Phantom::new(Matrix::identity(), u);
        let lattice = Lattice::new(&phantom.scene());
        let [before, after] = [&phantom.ct, &phantom.deformed]
            .map(|ct| bright(&lattice, &lattice.grey(ct, Progress::none()).unwrap()));
        // Half a voxel of the CT: the cube juts out of the body, and its rim is blurred more there.
        assert!((before - Vector::from(MARKER)).norm() < 1.0, "{before}");
        assert!((after - before - u).norm() < 0.2, "{after}");
    }

    #[test]
    fn the_wall_has_its_place_and_where_it_is_unsure() {
        let phantom = Phantom::new(Matrix::identity(), Vector::zeros());
        let scene = phantom.scene();
        let lattice = Lattice::new(&scene);
        let bytes = lattice.wall(&scene, 2.0, Progress::none()).unwrap();
        let at = |p: [f64; 3]| bytes[voxel(&lattice, p)];
        assert_eq!([at([-20.0, 20.0, 0.0]), at([-20.0, -10.0, 0.0])], [WHOLE, 0]);
        assert!(at([20.0, 5.0, 0.0]) >= UNCERTAIN && at([-20.0, 5.0, 0.0]) < UNCERTAIN);
        // The line that a viewer draws between two voxels is that of the stills, within 0.05 mm.
        let depth = |y: f64| f64::from(at([-20.0, y, 0.0])) - 0.5 * f64::from(WHOLE);
        let row = |n: usize| lattice.origin.y + lattice.step_mm * n as f64;
        let crossing = (1..lattice.size).map(|n| [row(n - 1), row(n)]);
        let found = crossing.filter(|[a, b]| (depth(*a) > 0.0) != (depth(*b) > 0.0));
        let place = |[a, b]: [f64; 2]| a + (b - a) * depth(a) / (depth(a) - depth(b));
        let places: Vec<f64> = found.map(place).collect();
        assert!((places[0] - 5.0).abs() < 0.05, "{places:?}");
    }

    #[test]
    fn it_stops_when_asked() {
        let phantom = Phantom::new(Matrix::identity(), Vector::zeros());
        let lattice = Lattice::new(&phantom.scene());
        let sink = |share: f64| share < 0.5;
        assert!(lattice.grey(&phantom.ct, Progress::new(&sink)).is_err());
    }
}
