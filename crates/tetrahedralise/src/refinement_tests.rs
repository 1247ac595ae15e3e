//! Tests of meshes that are finer in some places.

use crate::tests::{dome, labelled, sphere};
use crate::{Domain, Error, Near, Params, Refinement, coarsen};
use nalgebra::Rotation3;
use std::sync::Arc;
use supine_mesh::{Order, TET_EDGES, TetMesh};
use supine_space::{Grid, Matrix, Point, Progress, Sphere, Vector};
use supine_volume::{Region, Volume};

const TETRAHEDRA: usize = 4000;

fn place() -> Sphere {
    Sphere::new(sphere().centre() + Vector::new(8.0, -4.0, 6.0), 4.0).unwrap()
}

fn domain(direction: Matrix) -> Domain {
    let labels = labelled(direction, dome);
    let region = Region::new(Arc::new(labels.clone()), sphere()).unwrap();
    Domain::new(&region, &Params::default(), Progress::none()).unwrap()
}

fn refined(direction: Matrix, refinement: Refinement) -> TetMesh {
    let domain = domain(direction).refined(refinement).unwrap();
    let (mesh, info) = domain.mesh(TETRAHEDRA, Progress::none()).unwrap();
    assert_eq!(mesh.tets().len(), TETRAHEDRA);
    assert!(info.quality.min_dihedral_deg > 25.0, "{:?}", info.quality);
    mesh
}

/// Mean edge of the tetrahedra whose middle lies within `reach` mm of the place, and of the others.
fn edges(mesh: &TetMesh, reach: f64) -> [f64; 2] {
    let (mut sum, mut count) = ([0.0; 2], [0.0; 2]);
    for tet in 0..mesh.tets().len() {
        let corners = mesh.corners(tet);
        let middle = Point::from(corners.iter().map(|c| c.coords).sum::<Vector>() / 4.0);
        let side = usize::from(place().signed_distance(&middle) > reach);
        sum[side] += TET_EDGES.iter().map(|[a, b]| (corners[*a] - corners[*b]).norm()).sum::<f64>();
        count[side] += 6.0;
    }
    [sum[0] / count[0], sum[1] / count[1]]
}

#[test]
fn edges_are_short_in_the_place_and_longer_elsewhere() {
    for direction in [Matrix::identity(), *Rotation3::from_euler_angles(0.4, -0.8, 1.9).matrix()] {
        let [usual_in, usual_out] = edges(&refined(direction, Refinement::None), 0.0);
        let near = Near { place: place(), edge_mm: 1.5, growth: 0.8 };
        let [inside, outside] = edges(&refined(direction, Refinement::Near(near)), 0.0);
        assert!((1.2..1.8).contains(&inside), "{inside}, without {usual_in}");
        assert!(outside > 1.02 * usual_out, "{outside}, without {usual_out}");
    }
}

/// Edges that are longest on a grid, here around the place, bind a mesh that is made of another
/// one, too.
#[test]
fn a_coarser_mesh_is_fine_where_it_is_asked_for() {
    let fine = refined(Matrix::identity(), Refinement::None);
    let start = place().centre() - Vector::repeat(12.0);
    let grid = Grid::new([25; 3], Vector::repeat(1.0), start, Matrix::identity()).unwrap();
    let longest = |voxel| 1.6 + 0.8 * place().signed_distance(&grid.centre(voxel)).max(0.0) as f32;
    let longest = Refinement::Longest(Volume::from_fn(grid.clone(), longest));
    let made = |refinement| coarsen(&fine, 2500, refinement, Progress::none()).unwrap().0;
    let (plain, drawn) = (made(&Refinement::None), made(&longest));
    assert_eq!([plain.tets().len(), drawn.tets().len()], [2500; 2]);
    let ([usual_in, usual_out], [inside, outside]) = (edges(&plain, 0.0), edges(&drawn, 0.0));
    assert!(inside < 1.9 && inside < 0.8 * usual_in, "{inside}, without {usual_in}");
    assert!(outside > usual_out, "{outside}, without {usual_out}");
}

#[test]
fn a_place_that_takes_too_many_is_refused_with_a_number_that_does() {
    let near = Near { place: place(), edge_mm: 0.6, growth: 0.1 };
    let domain = domain(Matrix::identity()).refined(Refinement::Near(near)).unwrap();
    let Err(Error::TooFine { asked: 1000, needed }) = domain.mesh(1000, Progress::none()) else {
        panic!("made");
    };
    assert!(needed > 1000);
    // What counts: the next step of the advice is not refused for the same reason.
    let coarse = Near { place: place(), edge_mm: 2.0, growth: 0.2 };
    let domain = domain.refined(Refinement::Near(coarse)).unwrap();
    if let Err(Error::TooFine { needed, .. }) = domain.mesh(500, Progress::none()) {
        let (mesh, _) = domain.mesh(needed, Progress::none()).unwrap();
        assert_eq!(mesh.tets().len(), needed);
    }
}

#[test]
fn numbers_out_of_range_are_refused() {
    for (edge_mm, growth) in [(0.0, 0.5), (f64::NAN, 0.5), (2.0, 0.0), (2.0, f64::INFINITY)] {
        let near = Refinement::Near(Near { place: place(), edge_mm, growth });
        let refused = domain(Matrix::identity()).refined(near);
        assert!(matches!(refused, Err(Error::Setting { .. })), "{edge_mm} {growth}");
    }
}

/// Shares that fall off from the place draw the tetrahedra there; the mesh made of equal shares for
/// its sizes is left as it is.
#[test]
fn tetrahedra_go_where_the_shares_are() {
    let usual = refined(Matrix::identity(), Refinement::None);
    let middle =
        |t: usize| Point::from(usual.corners(t).iter().map(|c| c.coords).sum::<Vector>() / 4.0);
    let all = 0..usual.tets().len();
    let near = |t: usize| (-place().signed_distance(&middle(t)).max(0.0) / 6.0).exp();
    let shares: Vec<f64> = all.clone().map(|t| usual.volume(t).powf(5.0 / 3.0) * near(t)).collect();
    let drawn = Refinement::balanced(&usual, &shares, Order::Linear).unwrap();
    let [inside, outside] = edges(&refined(Matrix::identity(), drawn), 5.0);
    let [usual_in, usual_out] = edges(&usual, 5.0);
    assert!(inside < 0.85 * usual_in && outside > usual_out, "{inside} {outside}");
}
