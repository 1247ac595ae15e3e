//! Distance from a closed surface.

use crate::TriSurface;
use parry3d_f64::math::Vec3;
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::TriMesh;
use supine_space::Point;

/// A closed surface, prepared to tell distances.
#[derive(Clone, Debug)]
pub struct SurfaceDistance {
    surface: TriSurface,
    /// `None` only without triangles, which no surface is.
    faces: Option<TriMesh>,
}

impl SurfaceDistance {
    /// Prepares a surface.
    pub fn new(surface: TriSurface) -> Self {
        let points = surface.points().iter().map(|p| Vec3::new(p.x, p.y, p.z)).collect();
        let faces = TriMesh::new(points, surface.triangles().to_vec()).ok();
        Self { surface, faces }
    }

    /// The surface.
    pub fn surface(&self) -> &TriSurface {
        &self.surface
    }

    /// Distance (mm) of a place (LPS, mm) from the surface, negative where the surface goes round
    /// it.
    pub fn at(&self, place: &Point) -> f64 {
        let Some(faces) = &self.faces else { return f64::INFINITY };
        let here = Vec3::new(place.x, place.y, place.z);
        let distance = faces.distance_to_local_point(here, false).abs();
        if self.turns(place) > 0.5 { -distance } else { distance }
    }

    /// How often the surface goes round a place: the solid angles of its triangles over 4π.
    ///
    /// Source: van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30, 1983.
    fn turns(&self, place: &Point) -> f64 {
        let angle = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|p| self.surface.points()[p as usize] - place);
            let [x, y, z] = [a, b, c].map(|v| v.norm());
            let down = x * y * z + a.dot(&b) * z + b.dot(&c) * x + c.dot(&a) * y;
            2.0 * a.dot(&b.cross(&c)).atan2(down)
        };
        self.surface.triangles().iter().map(angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A box of half sides 10, 20 and 30 mm around the origin.
    fn cuboid() -> SurfaceDistance {
        let corner = |n: usize| {
            let side = |bit: usize, half: f64| if n >> bit & 1 == 1 { half } else { -half };
            Point::new(side(0, 10.0), side(1, 20.0), side(2, 30.0))
        };
        let quads =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
        let surface = TriSurface::new((0..8).map(corner).collect(), triangles.collect()).unwrap();
        SurfaceDistance::new(surface)
    }

    proptest! {
        #[test]
        fn a_box_has_the_known_distance(x in -40.0..40.0f64, y in -40.0..40.0f64, z in -40.0..40.0f64) {
            let out = [x.abs() - 10.0, y.abs() - 20.0, z.abs() - 30.0];
            let outside = out.iter().map(|d| d.max(0.0).powi(2)).sum::<f64>().sqrt();
            let inside = out.into_iter().fold(f64::NEG_INFINITY, f64::max).min(0.0);
            let found = cuboid().at(&Point::new(x, y, z));
            prop_assert!((found - outside - inside).abs() < 1e-9, "{found}");
        }
    }
}
