//! The smooth level functions whose zero sets bound the mesh.
//!
//! Everything here is in the mesher's frame: millimetres along the axes of the voxel grid, origin
//! at the centre of the sphere. The sphere is a sphere in it, whatever the grid's direction.

use crate::boundary::{Boundary, CUT, SKIN};
use crate::complex::Class;
use crate::labels::Kind;
use crate::levels::{BAND_MM, flat_mm, known_level, smoothed_level};
use crate::refinement::Refinement;
use supine_space::{Grid, GridError, Matrix, Sphere, Vector};
use supine_volume::{Surfaces, Volume, distance_mm};

/// A point that has to move further than this (mm) to a surface does not belong to it.
pub(crate) const REACH_MM: f64 = 8.0;
/// A point this near (mm) to its level counts as on it.
const ON_LEVEL_MM: f64 = 5e-4;

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
    size: [usize; 3],
    spacing: Vector,
    low: Vector,
    levels: Vec<[f32; 2]>,
    depth: Depth,
    radius: f64,
    thickness: f64,
    flat: f64,
    /// Patient position of the frame's origin, mm, and the grid's direction.
    frame: (supine_space::Point, Matrix),
    /// Volume of the soft tissue inside the sphere by voxels, mm³.
    pub(crate) volume: f64,
    /// Where the mesh is finer than the surfaces ask for.
    pub(crate) refinement: Refinement,
}

/// Distance to the nearest voxel that is not soft tissue, mm, on a coarse grid.
#[derive(Debug)]
struct Depth {
    values: Volume<f32>,
    step: [usize; 3],
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
        let (is_air, is_wall) = (|k| k == Kind::Air, |k| k == Kind::Wall);
        let ((air, wall), flat) = match smoothing {
            Smoothing::Labels(sigma) => {
                let level = |mask| smoothed_level(kinds, mask, sigma);
                ((level(is_air), level(is_wall)), flat_mm(sigma))
            }
            Smoothing::Known(surfaces, sigma) => {
                let level = |mask, surface| known_level(kinds, mask, surface, sigma);
                let both = rayon::join(
                    || level(is_air, &surfaces.skin),
                    || level(is_wall, &surfaces.chest_wall),
                );
                (both, BAND_MM)
            }
        };
        let levels = air.into_iter().zip(wall).map(|(s, c)| [s, c]).collect();
        let low = grid.direction().tr_mul(&(grid.origin() - sphere.centre()));
        Ok(Self {
            size: grid.size(),
            spacing: grid.spacing(),
            low,
            levels,
            depth: Depth::new(kinds)?,
            radius: sphere.radius(),
            thickness,
            flat,
            frame: (sphere.centre(), *grid.direction()),
            volume: soft_volume(kinds, low, sphere.radius()),
            refinement: Refinement::None,
        })
    }

    /// Radius of the sphere, mm.
    pub(crate) fn radius(&self) -> f64 {
        self.radius
    }

    /// The frame: patient position of its origin (LPS, mm) and the directions of its axes.
    pub(crate) fn frame(&self) -> &(supine_space::Point, Matrix) {
        &self.frame
    }

    /// Levels and gradients of skin and plain chest wall at `p`, trilinear.
    fn sample(&self, p: &Vector) -> ([f64; 2], [Vector; 2]) {
        let mut base = 0;
        let mut step = [0usize; 3];
        let mut t = [0f64; 3];
        let mut inside = [false; 3];
        let mut stride = 1;
        for a in 0..3 {
            let last = (self.size[a] - 1) as f64;
            let raw = (p[a] - self.low[a]) / self.spacing[a];
            let q = raw.clamp(0.0, last);
            let cell = (q as usize).min(self.size[a].saturating_sub(2));
            inside[a] = raw == q && last > 0.0;
            base += cell * stride;
            step[a] = if last > 0.0 { stride } else { 0 };
            t[a] = q - cell as f64;
            stride *= self.size[a];
        }
        let v = |n: usize| -> [f64; 2] { self.levels[n].map(f64::from) };
        let mut value = [0.0; 2];
        let mut gradient = [Vector::zeros(); 2];
        let corner =
            |x: usize, y: usize, z: usize| v(base + x * step[0] + y * step[1] + z * step[2]);
        let c: [[f64; 2]; 8] = std::array::from_fn(|n| corner(n & 1, n >> 1 & 1, n >> 2));
        for f in 0..2 {
            let x = |n: usize| c[n][f] + (c[n + 1][f] - c[n][f]) * t[0];
            let (x0, x1, x2, x3) = (x(0), x(2), x(4), x(6));
            let (y0, y1) = (x0 + (x1 - x0) * t[1], x2 + (x3 - x2) * t[1]);
            value[f] = y0 + (y1 - y0) * t[2];
            let dx = |n: usize| c[n + 1][f] - c[n][f];
            let (d0, d1) = (dx(0) + (dx(2) - dx(0)) * t[1], dx(4) + (dx(6) - dx(4)) * t[1]);
            let slope =
                [d0 + (d1 - d0) * t[2], (x1 - x0) + ((x3 - x2) - (x1 - x0)) * t[2], y1 - y0];
            for a in 0..3 {
                if inside[a] {
                    gradient[f][a] = slope[a] / self.spacing[a];
                }
            }
        }
        (value, gradient)
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
        let ([skin, wall], [skin_g, wall_g]) = self.sample(p);
        if field == SKIN {
            return (skin, skin_g);
        }
        let (add, slope) = self.blunt(skin);
        (wall + add, wall_g + skin_g * slope)
    }

    /// Levels of all three fields at `p`, mm.
    fn levels(&self, p: &Vector) -> [f64; 3] {
        let ([skin, wall], _) = self.sample(p);
        [skin, wall + self.blunt(skin).0, p.norm() - self.radius]
    }

    /// Thickness of the soft tissue between skin and chest wall at `p`, mm, where it is thin; at
    /// least the distance to which the fields reach where it is not.
    fn thickness(&self, p: &Vector) -> f64 {
        let ([skin, wall], _) = self.sample(p);
        -skin - wall
    }

    /// Distance from `p` to the boundary of the soft tissue in the sphere, mm; 0 outside.
    fn depth(&self, p: &Vector) -> f64 {
        let mut index = [0.0; 3];
        for a in 0..3 {
            index[a] = (p[a] - self.low[a]) / (self.spacing[a] * self.depth.step[a] as f64);
        }
        let depth = f64::from(supine_volume::sample_trilinear(&self.depth.values, index));
        depth.min(self.radius - p.norm()).max(0.0)
    }

    /// Distance from `p` to the nearest rim, mm, up to the reach of the fields.
    fn rim_distance(&self, p: &Vector) -> f64 {
        let mut d = self.levels(p).map(f64::abs);
        d.sort_by(f64::total_cmp);
        if d[1] >= self.flat { f64::INFINITY } else { d[0].hypot(d[1]) }
    }

    fn refined(&self, usual: f64, p: &Vector) -> f64 {
        let (origin, axes) = &self.frame;
        self.refinement.length(usual, || origin + axes * p)
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

impl Depth {
    /// About this far apart are the samples, mm.
    const STEP_MM: f64 = 2.4;

    fn new(kinds: &Volume<Kind>) -> Result<Self, GridError> {
        let grid = kinds.grid();
        let step: [usize; 3] =
            std::array::from_fn(|a| ((Self::STEP_MM / grid.spacing()[a]) as usize).max(1));
        let size: [usize; 3] = std::array::from_fn(|a| (grid.size()[a] - 1) / step[a] + 1);
        let spacing = Vector::from_fn(|a, _| grid.spacing()[a] * step[a] as f64);
        let outside = |v: [usize; 3]| {
            let fine: [usize; 3] = std::array::from_fn(|a| v[a] * step[a]);
            kinds.at(fine) != Kind::Soft
        };
        let coarse = Grid::new(size, spacing, grid.origin(), *grid.direction())?;
        Ok(Self { values: distance_mm(&Volume::from_fn(coarse, outside)), step })
    }
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
    use crate::boundary::WALL;
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
