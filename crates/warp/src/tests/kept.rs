//! Pieces that are kept from one displacement to the next.

use super::fixture::{lattice, moved};
use crate::kept::Kept;
use crate::pieces::{Curve, Pieces};
use std::collections::BTreeMap;
use supine_mesh::{BoundaryTag, Edges, Order, TET_FACES};
use supine_space::{Grid, Matrix, Point, Progress, Vector};

const TOLERANCE_MM: f64 = 0.1;

/// 32 x 24 x 24 mm, bent the more the farther from the ground, along and across.
fn bent(p: Point) -> Vector {
    let hang = (24.0 - p.y) / 24.0;
    Vector::new(6.0, 2.0, -5.0) * (hang * hang) + Vector::new(0.0, p.x * p.z / 100.0, 0.0)
}

/// The farthest that the pieces of tetrahedra that reach into the grid miss the displacement, at
/// places within them, mm.
fn missed_mm(pieces: &Pieces, curve: &Curve<'_>, grid: &Grid) -> f64 {
    let shares = [[0.25; 4], [0.5, 0.5, 0.0, 0.0], [0.0, 0.0, 0.5, 0.5], [0.1, 0.2, 0.6, 0.1]];
    let mut missed = 0.0f64;
    for (tet, parent) in pieces.tets.iter().zip(&pieces.parents) {
        for share in shares {
            let mut place = [0.0; 4];
            let (mut at, mut u) = (Vector::zeros(), Vector::zeros());
            for (n, corner) in tet.iter().enumerate() {
                at += pieces.rest[*corner as usize].coords * share[n];
                u += pieces.displacement[*corner as usize] * share[n];
                (0..4).for_each(|c| place[c] += share[n] * f64::from(parent.corners[n][c]));
            }
            let right = curve.displacement.at(curve.mesh, curve.edges, parent.tet as usize, place);
            let index = grid.index_from_patient(&Point::from(at + right));
            let size = grid.size();
            if (0..3).all(|a| index[a] >= 0.0 && index[a] <= (size[a] - 1) as f64) {
                missed = missed.max((right - u).norm());
            }
        }
    }
    missed
}

/// Faces of one piece alone; none lies within the box: there is no crack.
fn open_within(pieces: &Pieces) -> usize {
    let mut faces: BTreeMap<[u32; 3], usize> = BTreeMap::new();
    for tet in &pieces.tets {
        for face in TET_FACES {
            let mut key = face.map(|corner| tet[corner]);
            key.sort_unstable();
            *faces.entry(key).or_default() += 1;
        }
    }
    assert!(faces.values().all(|of| *of <= 2));
    let sides = |face: &[u32; 3]| {
        let on = |axis: usize, at: f64| {
            face.iter().all(|p| (pieces.rest[*p as usize][axis] - at).abs() < 1e-9)
        };
        [32.0, 24.0, 24.0].into_iter().enumerate().any(|(axis, end)| on(axis, 0.0) || on(axis, end))
    };
    faces.iter().filter(|(face, of)| **of == 1 && !sides(face)).count()
}

#[test]
fn they_follow_whatever_comes_where_they_are_seen() {
    let mesh = lattice([4, 3, 3], 8.0, Point::origin(), |_| BoundaryTag::Skin);
    let edges = Edges::new(&mesh);
    let corner =
        Grid::new([12; 3], Vector::repeat(1.0), Point::origin(), Matrix::identity()).unwrap();
    let zero = moved(&mesh, Order::Linear, |_| Vector::zeros());
    let curve = Curve { mesh: &mesh, edges: &edges, displacement: zero.displacement() };
    let mut pieces = Pieces::new(&curve, TOLERANCE_MM, Progress::none()).unwrap();
    let mut kept = Kept::new(corner.clone(), &pieces);
    let mut counts = vec![];
    let mut stayed = vec![];
    for share in [0.0, 0.1, 0.5, 1.0, 0.3, 1.0, -1.0] {
        let u = moved(&mesh, Order::Quadratic, |p| bent(p) * share);
        let curve = Curve { mesh: &mesh, edges: &edges, displacement: u.displacement() };
        stayed.push(kept.follow(&mut pieces, &curve, TOLERANCE_MM).unwrap());
        let missed = missed_mm(&pieces, &curve, &corner);
        assert!(missed <= TOLERANCE_MM, "{share}: {missed} mm");
        assert_eq!(open_within(&pieces), 0, "{share}");
        counts.push(pieces.tets.len());
        let all = Pieces::new(&curve, 0.5 * TOLERANCE_MM, Progress::none()).unwrap();
        assert!(share < 1.0 || pieces.tets.len() < all.tets.len(), "all are halved: {counts:?}");
    }
    assert!(counts.is_sorted() && counts[0] < counts[3], "{counts:?}");
    // What was followed once is followed by the same pieces.
    assert_eq!((stayed[1], stayed[2], stayed[4], stayed[5]), (true, false, true, true));
    // A linear one needs no others either.
    let u = moved(&mesh, Order::Linear, bent);
    let curve = Curve { mesh: &mesh, edges: &edges, displacement: u.displacement() };
    assert!(kept.follow(&mut pieces, &curve, TOLERANCE_MM).unwrap());
    assert!(missed_mm(&pieces, &curve, &corner) < 1e-9);
}
