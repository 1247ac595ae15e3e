//! The smooth level functions whose zero sets bound the mesh.
//!
//! Everything here is in the mesher's frame: millimetres along the axes of the voxel grid, origin
//! at the centre of the sphere. The sphere is a sphere in it, whatever the grid's direction.

use crate::boundary::{Boundary, CUT, SKIN, WALL};
use crate::complex::Class;
use crate::frame::Frame;
use crate::labels::Kind;
use crate::levels::{BAND_MM, flat_mm, known_levels, smoothed_levels};
use crate::refinement::Refinement;
use crate::samples::Samples;
use supine_space::{Grid, GridError, Matrix, Sphere, Vector};
use supine_volume::{Surfaces, Volume, distance_mm};

/// A point that has to move further than this (mm) to a surface does not belong to it.
pub(crate) const REACH_MM: f64 = 8.0;
/// A point this near (mm) to its level counts as on it.
const ON_LEVEL_MM: f64 = 5e-4;
/// About this far apart is the depth sampled, mm.
const DEPTH_STEP_MM: f64 = 2.4;

/// How the surfaces between the voxels are had.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Smoothing<'a> {
    /// By smoothing the labels: standard deviation, mm.
    Labels(f64),
    /// They are known; lightly smoothed: standard deviation, mm.
    Known(&'a Surfaces, f64),
}

/// Level functions (mm, negative inside the soft tissue) of skin, chest wall and sphere.
///
/// Skin and chest wall come from two masks that do not know each other (body against outside air,
/// chest wall against the rest), so that thin sheets between them keep their thickness. Each mask
/// is smoothed by a Gaussian and turned into d = sigma sqrt2 erfinv(2g - 1), which is the exact
/// distance for a plane, up to about 4 sigma. Where the surfaces are known between the voxels the
/// level is the distance to them; where the voxels' kinds depart from them, the kinds win.
#[derive(Debug)]
pub(crate) struct Fields {
    /// Skin and plain chest wall.
    levels: Samples<2>,
    /// Distance to the nearest voxel that is not soft tissue, mm.
    depth: Samples<1>,
    radius: f64,
    thickness: f64,
    flat: f64,
    /// Patient position of the frame's origin, mm, and the grid's direction.
    frame: Frame,
    /// Volume of the soft tissue inside the sphere by voxels, mm³.
    pub(crate) volume: f64,
    /// Where the mesh is finer than the surfaces ask for.
    pub(crate) refinement: Refinement,
}

impl Fields {
    /// The fields of voxels of known kind. `thickness`: soft tissue thinner than this (mm) between
    /// chest wall and skin counts as chest wall.
    pub(crate) fn new(
        kinds: &Volume<Kind>,
        sphere: Sphere,
        smoothing: Smoothing<'_>,
        thickness: f64,
    ) -> Result<Self, GridError> {
        let grid = kinds.grid();
        let ([air, wall], flat) = match smoothing {
            Smoothing::Labels(sigma) => (smoothed_levels(kinds, sigma)?, flat_mm(sigma)),
            Smoothing::Known(surfaces, sigma) => (known_levels(kinds, surfaces, sigma)?, BAND_MM),
        };
        let place = |grid: &Grid| grid.direction().tr_mul(&(grid.origin() - sphere.centre()));
        let (points, air) = air.into_parts();
        let levels = air.into_iter().zip(wall.into_parts().1).map(|(s, c)| [s, c]).collect();
        Ok(Self {
            levels: Samples::new(points.size(), points.spacing(), place(&points), levels),
            depth: depth(kinds, place(grid))?,
            radius: sphere.radius(),
            thickness,
            flat,
            frame: Frame { origin: sphere.centre(), axes: *grid.direction() },
            volume: soft_volume(kinds, place(grid), sphere.radius()),
            refinement: Refinement::None,
        })
    }

    /// Radius of the sphere, mm.
    pub(crate) fn radius(&self) -> f64 {
        self.radius
    }

    /// The frame: patient position of its origin (LPS, mm) and the directions of its axes.
    pub(crate) fn frame(&self) -> &Frame {
        &self.frame
    }

    /// What the chest wall gains towards the skin, and its slope.
    ///
    /// Within `thickness` of the skin the wall's level becomes wall + skin + thickness, which is
    /// thickness minus the tissue's own: wedges end in a face of that height square to both
    /// sides, and no film is left where skin and chest wall coincide. The bend is rounded.
    fn blunt(&self, skin: f64) -> (f64, f64) {
        let bend = 0.3 * self.thickness;
        let x = skin.min(2.0) + self.thickness;
        let flat = if skin < 2.0 { 1.0 } else { 0.0 };
        if x <= -bend {
            (0.0, 0.0)
        } else if x < bend {
            ((x + bend).powi(2) / (4.0 * bend), (x + bend) / (2.0 * bend))
        } else {
            (x, flat)
        }
    }

    fn project_one(&self, field: usize, mut p: Vector, level: f64) -> Option<Vector> {
        let from = p;
        for _ in 0..10 {
            let (value, slope) = self.level_gradient(field, &p);
            let excess = value - level;
            if excess.abs() < ON_LEVEL_MM {
                return Some(p);
            }
            let steep = slope.norm_squared();
            if steep < 0.01 {
                return None;
            }
            p -= slope * (excess / steep);
            if (p - from).norm() > REACH_MM {
                return None;
            }
        }
        None
    }
}

impl Boundary for Fields {
    /// Level of one field at `p`, mm, and its gradient.
    fn level_gradient(&self, field: usize, p: &Vector) -> (f64, Vector) {
        if field == CUT {
            let r = p.norm();
            return (r - self.radius, if r > 0.0 { p / r } else { Vector::x() });
        }
        let (skin, skin_slope) = self.levels.value_gradient(SKIN, p);
        if field == SKIN {
            return (skin, skin_slope);
        }
        let (wall, wall_slope) = self.levels.value_gradient(WALL, p);
        let (add, slope) = self.blunt(skin);
        (wall + add, wall_slope + skin_slope * slope)
    }

    /// Level of one field at `p`, mm.
    fn level(&self, field: usize, p: &Vector) -> f64 {
        match field {
            CUT => p.norm() - self.radius,
            SKIN => self.levels.value(SKIN, p),
            _ => self.levels.value(WALL, p) + self.blunt(self.levels.value(SKIN, p)).0,
        }
    }

    /// Levels of all three fields at `p`, mm.
    fn levels(&self, p: &Vector) -> [f64; 3] {
        let (skin, wall) = (self.levels.value(SKIN, p), self.levels.value(WALL, p));
        [skin, wall + self.blunt(skin).0, p.norm() - self.radius]
    }

    /// Thickness of the soft tissue between skin and chest wall at `p`, mm, where it is thin; at
    /// least the distance to which the fields reach where it is not.
    fn thickness(&self, p: &Vector) -> f64 {
        -self.levels.value(SKIN, p) - self.levels.value(WALL, p)
    }

    /// Distance from `p` to the boundary of the soft tissue in the sphere, mm; 0 outside.
    fn depth(&self, p: &Vector) -> f64 {
        self.depth.value(0, p).min(self.radius - p.norm()).max(0.0)
    }

    /// Distance from `p` to the nearest rim, mm, up to the reach of the fields.
    fn rim_distance(&self, p: &Vector) -> f64 {
        let mut d = self.levels(p).map(f64::abs);
        d.sort_by(f64::total_cmp);
        if d[1] >= self.flat { f64::INFINITY } else { d[0].hypot(d[1]) }
    }

    fn refined(&self, usual: f64, p: &Vector) -> f64 {
        self.refinement.length(usual, || self.frame.to_patient(p))
    }

    /// The point near `p` that lies at `level` (mm) of each field of `class`; `None` when there
    /// is none near. Newton steps along the gradients.
    fn project(&self, class: Class, p: Vector, level: &[f64; 3]) -> Option<Vector> {
        let from = p;
        let mut p = p;
        let fields: Vec<usize> = (0..3).filter(|f| class >> f & 1 == 1).collect();
        if let [field] = fields[..] {
            return self.project_one(field, p, level[field]);
        }
        for _ in 0..10 {
            let mut gram = Matrix::identity();
            let mut excess = Vector::zeros();
            let mut slopes = [Vector::zeros(); 3];
            for (row, &f) in fields.iter().enumerate() {
                let (value, slope) = self.level_gradient(f, &p);
                (excess[row], slopes[row]) = (value - level[f], slope);
            }
            if excess.amax() < ON_LEVEL_MM {
                return Some(p);
            }
            for a in 0..fields.len() {
                for b in 0..fields.len() {
                    gram[(a, b)] = slopes[a].dot(&slopes[b]);
                }
            }
            // Fields that run nearly along each other have no stable common line.
            if gram.determinant() < 1e-3 {
                return None;
            }
            let weights = gram.try_inverse()? * excess;
            for a in 0..fields.len() {
                p -= slopes[a] * weights[a];
            }
            if (p - from).norm() > REACH_MM {
                return None;
            }
        }
        None
    }
}

/// Distance to the nearest voxel that is not soft tissue, mm, at points about [`DEPTH_STEP_MM`]
/// apart; `low`: where the first voxel lies in the mesher's frame.
fn depth(kinds: &Volume<Kind>, low: Vector) -> Result<Samples<1>, GridError> {
    let grid = kinds.grid();
    let step = [0, 1, 2].map(|a| ((DEPTH_STEP_MM / grid.spacing()[a]).round() as usize).max(1));
    let size = [0, 1, 2].map(|a| (grid.size()[a] - 1) / step[a] + 1);
    let spacing = Vector::from_fn(|a, _| grid.spacing()[a] * step[a] as f64);
    let coarse = Grid::new(size, spacing, grid.origin(), *grid.direction())?;
    let outside = |v: [usize; 3]| kinds.at([0, 1, 2].map(|a| v[a] * step[a])) != Kind::Soft;
    let (_, depth) = distance_mm(&Volume::from_fn(coarse, outside)).into_parts();
    Ok(Samples::new(size, spacing, low, depth.into_iter().map(|d| [d]).collect()))
}

/// Volume of the soft voxels whose centre lies inside the sphere, mm³.
fn soft_volume(kinds: &Volume<Kind>, low: Vector, radius: f64) -> f64 {
    let (grid, [ni, nj, nk]) = (kinds.grid(), kinds.grid().size());
    let s = grid.spacing();
    let mut voxels = 0usize;
    for k in 0..nk {
        for j in 0..nj {
            let (y, z) = (low.y + s.y * j as f64, low.z + s.z * k as f64);
            let rest = radius * radius - y * y - z * z;
            let row = grid.offset([0, j, k]);
            voxels += (0..ni)
                .filter(|&i| (low.x + s.x * i as f64).powi(2) <= rest)
                .filter(|&i| kinds.data()[row + i] == Kind::Soft)
                .count();
        }
    }
    voxels as f64 * grid.voxel_volume()
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::Point;

    #[test]
    fn a_plane_is_at_its_distance() {
        let s = Vector::new(0.8, 0.8, 1.5);
        let grid = Grid::new([48, 48, 24], s, Point::origin(), Matrix::identity()).unwrap();
        let n = Vector::new(0.3, -0.8, 0.4).normalize();
        let middle = grid.patient_from_index([24.0, 24.0, 12.0]);
        let kinds = Volume::from_fn(grid.clone(), |v| {
            if (grid.centre(v) - middle).dot(&n) > 0.0 { Kind::Air } else { Kind::Soft }
        });
        let sphere = Sphere::new(middle, 10.0).unwrap();
        let fields = Fields::new(&kinds, sphere, Smoothing::Labels(1.5), 1.0).unwrap();
        for d in [-3.0, -1.0, 0.0, 0.7, 2.5] {
            let (level, slope) = fields.level_gradient(SKIN, &(n * d + Vector::new(0.2, 0.1, 0.3)));
            let want = d + n.dot(&Vector::new(0.2, 0.1, 0.3));
            assert!((level - want).abs() < 0.15, "{d}: {level} {want}");
            assert!((slope - n).norm() < 0.25, "{slope}");
        }
        assert!(fields.level(WALL, &Vector::zeros()) < -4.0);
        assert!((fields.level(CUT, &Vector::new(0.0, 3.0, 4.0)) + 5.0).abs() < 1e-12);
    }
}
