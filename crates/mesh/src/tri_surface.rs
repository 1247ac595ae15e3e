//! Closed surfaces of triangles.

use crate::merge::merged;
use supine_space::{Failure, Point};

/// A closed surface of triangles that wind counter-clockwise seen from outside; points in LPS, mm.
///
/// Every edge is walked as often one way as the other, so that how many times the surface goes
/// round a place is a whole number everywhere. It may cross or touch itself and consist of several
/// pieces.
#[derive(Clone, Debug, PartialEq)]
pub struct TriSurface {
    points: Vec<Point>,
    triangles: Vec<[u32; 3]>,
    turned: bool,
}

/// Why a surface cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// No triangles, or only such without area.
    #[error("the surface has no triangles")]
    Empty,
    /// A coordinate is not finite.
    #[error("point {0} of the surface is not finite")]
    Point(usize),
    /// An index leads nowhere.
    #[error("triangle {triangle} of the surface names point {point}, but there are only {points}")]
    Index {
        /// Which one.
        triangle: usize,
        /// The index.
        point: u32,
        /// Number of points.
        points: usize,
    },
    /// Edges that belong to one triangle only.
    #[error(
        "the surface is open: {edges} edges belong to one triangle only, one of them at {at:.2?} mm; \
         close its holes"
    )]
    Open {
        /// How many.
        edges: usize,
        /// Middle of the first, LPS, mm.
        at: [f64; 3],
    },
    /// Edges that belong to an odd number of triangles, three or more.
    #[error(
        "the surface is not manifold: {edges} edges belong to three triangles or another odd number, \
         one of them at {at:.2?} mm; repair it"
    )]
    Odd {
        /// How many.
        edges: usize,
        /// Middle of the first, LPS, mm.
        at: [f64; 3],
    },
    /// Edges whose triangles disagree about which side is outside.
    #[error(
        "the triangles of the surface do not agree which side is outside: {edges} edges lie between \
         opposite ones, one of them at {at:.2?} mm; let the normals be repaired"
    )]
    Winding {
        /// How many.
        edges: usize,
        /// Middle of the first, LPS, mm.
        at: [f64; 3],
    },
}

impl SurfaceError {
    /// What kind of failure this is.
    pub fn kind(&self) -> Failure {
        Failure::Input
    }
}

impl TriSurface {
    /// A surface from points (LPS, mm) and triangles.
    ///
    /// Points at the same place become one, triangles with two corners at one place are left out,
    /// and a surface that is inside out as a whole is turned ([`Self::was_inside_out`]).
    ///
    /// # Errors
    /// When the surface is open, triangles disagree which side is outside, or a number makes no
    /// sense; the error counts the edges and tells the place of one.
    pub fn new(points: Vec<Point>, triangles: Vec<[u32; 3]>) -> Result<Self, SurfaceError> {
        if let Some(n) = points.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
            return Err(SurfaceError::Point(n));
        }
        for (triangle, corners) in triangles.iter().enumerate() {
            if let Some(&point) = corners.iter().find(|&&p| p as usize >= points.len()) {
                return Err(SurfaceError::Index { triangle, point, points: points.len() });
            }
        }
        let (points, place) = merged(&points);
        let mut triangles: Vec<[u32; 3]> =
            triangles.into_iter().map(|t| t.map(|p| place[p as usize])).collect();
        triangles.retain(|[a, b, c]| a != b && b != c && c != a);
        if triangles.is_empty() {
            return Err(SurfaceError::Empty);
        }
        let mut surface = Self { points, triangles, turned: false };
        surface.check_edges()?;
        if surface.volume() < 0.0 {
            surface.triangles.iter_mut().for_each(|t| t.swap(1, 2));
            surface.turned = true;
        }
        Ok(surface)
    }

    fn check_edges(&self) -> Result<(), SurfaceError> {
        let mut edges: Vec<([u32; 2], bool)> = Vec::with_capacity(3 * self.triangles.len());
        for &[a, b, c] in &self.triangles {
            edges.extend([(a, b), (b, c), (c, a)].map(|(p, q)| ([p.min(q), p.max(q)], p < q)));
        }
        edges.sort_unstable();
        let (mut counts, mut first) = ([0; 3], [[0.0; 3]; 3]);
        for same in edges.chunk_by(|a, b| a.0 == b.0) {
            let forwards = same.iter().filter(|e| e.1).count();
            let kind = match same.len() {
                n if n == 2 * forwards => continue,
                1 => 0,
                n if n % 2 == 1 => 1,
                _ => 2,
            };
            if counts[kind] == 0 {
                let [a, b] = same[0].0.map(|p| self.points[p as usize]);
                first[kind] = (a + (b - a) * 0.5).coords.into();
            }
            counts[kind] += 1;
        }
        match counts {
            [0, 0, 0] => Ok(()),
            [0, 0, edges] => Err(SurfaceError::Winding { edges, at: first[2] }),
            [0, edges, _] => Err(SurfaceError::Odd { edges, at: first[1] }),
            [edges, ..] => Err(SurfaceError::Open { edges, at: first[0] }),
        }
    }

    /// Points, LPS, mm.
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// Triangles, as indices of three points, counter-clockwise seen from outside.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Whether the triangles were given clockwise.
    pub fn was_inside_out(&self) -> bool {
        self.turned
    }

    /// Volume enclosed, mm³; what the surface encloses twice counts twice.
    pub fn volume(&self) -> f64 {
        let origin = self.points[0];
        let part = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|p| self.points[p as usize] - origin);
            a.dot(&b.cross(&c)) / 6.0
        };
        self.triangles.iter().map(part).sum()
    }

    /// Lower and upper corner of the axis-aligned box, LPS, mm.
    pub fn bounds(&self) -> (Point, Point) {
        let start = (self.points[0], self.points[0]);
        self.points.iter().fold(start, |(low, high), p| (low.inf(p), high.sup(p)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The faces of a tetrahedron, as a soup of points.
    fn soup() -> (Vec<Point>, Vec<[u32; 3]>) {
        let corners = [[0.0; 3], [3.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, -0.0, 3.0]];
        let faces = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];
        let points = faces.iter().flat_map(|f| f.map(|c: usize| Point::from(corners[c])));
        (points.collect(), (0..4).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect())
    }

    #[test]
    fn a_soup_of_triangles_becomes_one_surface() {
        let (points, mut triangles) = soup();
        triangles.push([0, 0, 1]);
        let surface = TriSurface::new(points.clone(), triangles.clone()).unwrap();
        assert_eq!((surface.points().len(), surface.triangles().len()), (4, 4));
        assert!((surface.volume() - 4.5).abs() < 1e-12 && !surface.was_inside_out());
        assert_eq!(surface.bounds(), ([0.0; 3].into(), [3.0; 3].into()));
        triangles.iter_mut().for_each(|t| t.reverse());
        let turned = TriSurface::new(points, triangles).unwrap();
        assert!((turned.volume() - 4.5).abs() < 1e-12 && turned.was_inside_out());
    }

    #[test]
    fn what_bounds_nothing_is_refused_with_its_place() {
        let (points, triangles) = soup();
        let refused = |t: Vec<[u32; 3]>| TriSurface::new(points.clone(), t).unwrap_err();
        let open = refused(triangles[1..].to_vec());
        assert!(matches!(open, SurfaceError::Open { edges: 3, .. }), "{open}");
        assert!(open.to_string().contains("[1.50, 1.50, 0.00] mm"), "{open}");
        let mut fin = triangles.clone();
        fin.push(triangles[0]);
        assert!(matches!(refused(fin), SurfaceError::Odd { edges: 3, .. }));
        let mut against = triangles.clone();
        against[2].swap(0, 1);
        assert!(matches!(refused(against), SurfaceError::Winding { edges: 3, .. }));
        assert!(matches!(refused(vec![]), SurfaceError::Empty));
        assert!(matches!(refused(vec![[0, 1, 12]]), SurfaceError::Index { point: 12, .. }));
        let nan = TriSurface::new(vec![Point::new(f64::NAN, 0.0, 0.0)], vec![]).unwrap_err();
        assert!(matches!(nan, SurfaceError::Point(0)));
    }
}
