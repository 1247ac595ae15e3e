//! Contours of a ball under maps that are known in closed form.

use super::fixture::{lattice, moved, still};
use crate::{Error, Params, carry_contours};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;
use supine_mesh::{BoundaryTag, Deformation, Order, TetMesh};
use supine_space::{Grid, Matrix, Point, Progress, Vector};
use supine_volume::{ContourError, Rule};

const CENTRE: [f64; 3] = [1.0, -2.0, 3.0];
const RADIUS: f64 = 15.0;

fn block() -> Arc<TetMesh> {
    lattice([8, 6, 6], 10.0, Point::new(-40.0, -30.0, -30.0), |_| BoundaryTag::Skin)
}

fn params() -> Params {
    Params { fade_mm: Some(0.0), ..Params::default() }
}

/// Slices 2 mm apart; of either hand, and turned about the head's axis.
fn slices(mirrored: bool) -> Grid {
    let (s, c) = 0.2f64.sin_cos();
    let sign = if mirrored { -1.0 } else { 1.0 };
    let axes = Matrix::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, sign);
    let low = axes * Vector::new(-60.0, -60.0, -60.3);
    Grid::new([100, 100, 61], Vector::new(1.2, 1.2, 2.0), Point::from(low), axes).unwrap()
}

/// The ball as drawn on each of the slices that meet it, or on every `each`th.
fn ball(grid: &Grid, each: usize) -> Vec<Vec<Point>> {
    let centre = Point::from(CENTRE);
    (0..grid.size()[2])
        .step_by(each)
        .filter_map(|k| {
            let off = grid.centre([0, 0, k]).z - centre.z;
            let radius = (RADIUS * RADIUS - off * off).sqrt();
            let at = |n: i32| (f64::from(n) * TAU / 90.0).sin_cos();
            (radius > 0.5).then(|| {
                let corner = |n| centre + Vector::new(radius * at(n).1, radius * at(n).0, off);
                (0..90).map(corner).collect()
            })
        })
        .collect()
}

/// F and shift of an affine map that mixes all axes.
fn affine() -> (Matrix, Vector) {
    let f = Matrix::new(1.08, 0.05, -0.03, 0.02, 0.92, 0.06, 0.04, -0.05, 1.03);
    (f, Vector::new(2.0, -3.0, 1.3))
}

fn displaced(mesh: &Arc<TetMesh>) -> Deformation {
    let (f, shift) = affine();
    moved(mesh, Order::Linear, |p| f * p.coords + shift - p.coords)
}

/// How far a point lies from the image of the ball, mm, to first order.
fn off(p: Point) -> f64 {
    let (f, shift) = affine();
    let back = f.try_inverse().unwrap();
    let source = back * (p.coords - shift) - Vector::from(CENTRE);
    let slope = back.transpose() * source / source.norm();
    (source.norm() - RADIUS) / slope.norm()
}

#[test]
fn a_ball_under_an_affine_map_keeps_its_share_of_volume_and_its_shape() {
    let mesh = block();
    let u = displaced(&mesh);
    for mirrored in [false, true] {
        let grid = slices(mirrored);
        let carried =
            carry_contours(&ball(&grid, 1), Rule::Joined, &grid, &u, &params(), Progress::none());
        let (contours, carried) = carried.unwrap();
        let [before, after] = carried.volume_ml;
        let exact = 4.0 / 3.0 * PI * RADIUS.powi(3) / 1000.0;
        assert!((before / exact - 1.0).abs() < 0.01, "{before} ml for {exact}");
        let det = affine().0.determinant();
        assert!((after / before / det - 1.0).abs() < 1e-6, "{after} of {before}, det {det}");
        assert!(carried.moved_points > 0 && carried.max_displacement_mm > 3.0);
        // All lies in slices, and on the image of the ball but for its blunt ends.
        let mut area = 0.0;
        for contour in &contours {
            let k = grid.index_from_patient(&contour[0])[2].round();
            let fan = contour.windows(2).map(|w| (w[0] - contour[0]).cross(&(w[1] - contour[0])));
            area += 0.5 * fan.sum::<Vector>().norm();
            for p in contour {
                assert!((grid.index_from_patient(p)[2] - k).abs() < 1e-9, "{p}");
                let back = affine().0.try_inverse().unwrap() * (p.coords - affine().1);
                if (back.z - CENTRE[2]).abs() < RADIUS - 2.0 {
                    assert!(off(*p).abs() < 0.5, "{p}: {:.2} mm", off(*p));
                }
            }
        }
        // What a planning system will count, slice by slice.
        let counted = area * grid.spacing().z / 1000.0;
        assert!((counted / (exact * det) - 1.0).abs() < 0.01, "{counted} ml for {}", exact * det);
    }
}

#[test]
fn missing_slices_are_bridged_and_a_hole_stays_one() {
    let mesh = block();
    let u = displaced(&mesh);
    let grid = slices(false);
    let det = affine().0.determinant();
    let carry = |given: &[Vec<Point>]| {
        carry_contours(given, Rule::Joined, &grid, &u, &params(), Progress::none()).unwrap().1
    };
    let thin = carry(&ball(&grid, 2)).volume_ml;
    let exact = 4.0 / 3.0 * PI * RADIUS.powi(3) / 1000.0;
    assert!((thin[1] / (exact * det) - 1.0).abs() < 0.03, "{thin:?} for {}", exact * det);
    let mut hollow = ball(&grid, 1);
    let centre = Point::from(CENTRE);
    let holes: Vec<Vec<Point>> =
        hollow.iter().map(|c| c.iter().map(|p| centre + (p - centre) * 0.5).collect()).collect();
    // The hole keeps the slices of the ball.
    hollow.extend(holes.into_iter().zip(ball(&grid, 1)).map(|(hole, outer)| {
        hole.into_iter().map(|p: Point| Point::new(p.x, p.y, outer[0].z)).collect()
    }));
    let whole = carry(&ball(&grid, 1)).volume_ml[1];
    let left = carry(&hollow).volume_ml[1];
    assert!((left / whole - 0.75).abs() < 0.01, "{left} of {whole}");
}

#[test]
fn contours_drawn_twice_are_carried_once() {
    let mesh = block();
    let (u, grid) = (displaced(&mesh), slices(false));
    let once = ball(&grid, 1);
    let twice = [once.clone(), once[3..8].to_vec()].concat();
    let carry = |given: &[Vec<Point>]| {
        carry_contours(given, Rule::Joined, &grid, &u, &params(), Progress::none()).unwrap()
    };
    let [(alone, one), (double, two)] = [&once, &twice].map(|given| carry(given));
    let [one, two] = [one, two].map(|facts| facts.volume_ml);
    for (one, two) in one.iter().zip(two) {
        assert!((two / one - 1.0).abs() < 1e-3, "{one} ml, {two} ml");
    }
    assert_eq!(alone.len(), double.len());
}

#[test]
fn contours_that_lie_nowhere_are_refused() {
    let mesh = block();
    let (u, grid) = (displaced(&mesh), slices(false));
    for value in [1e9, -244_262.0, 1e30, -2442.0] {
        let mut given = ball(&grid, 1);
        given[4][7].y = value;
        let refused = carry_contours(&given, Rule::Joined, &grid, &u, &params(), Progress::none());
        let found = matches!(
            &refused,
            Err(Error::Contours(ContourError::Beyond(b))) if b.number == 5 && b.at[1] == value
        );
        assert!(found, "{refused:?}");
    }
}

#[test]
fn what_does_not_move_is_given_back_and_what_cannot_be_is_refused() {
    let mesh = block();
    let grid = slices(false);
    let still = still(&mesh);
    let given = ball(&grid, 1);
    let carry = |given: &[Vec<Point>]| {
        carry_contours(given, Rule::Joined, &grid, &still, &params(), Progress::none())
    };
    let (contours, carried) = carry(&given).unwrap();
    assert_eq!(carried.moved_points, 0);
    assert_eq!(contours, given);
    assert!(matches!(carry(&[]), Err(Error::Contours(ContourError::Empty))));
    let mut tilted = given;
    tilted[1][0].z += 0.5;
    let refused = carry(&tilted);
    let number = 2;
    assert!(
        matches!(&refused, Err(Error::Contours(ContourError::NotParallel { number: n, .. })) if *n == number),
        "{refused:?}"
    );
}

#[test]
fn a_thin_band_that_slants_is_still_there_between_its_planes() {
    let mesh = block();
    let grid = slices(false);
    // 2.4 mm wide and 14 mm long, from slice to slice 7 mm on along itself and 1 mm across; carried
    // by nearly half a step.
    let axes = *grid.direction();
    let band = |n: usize| -> Vec<Point> {
        let on = n as f64 - 2.0;
        let middle = Vector::new(7.0 * on, on, 0.0);
        let corner = |[x, y]: [f64; 2]| {
            let centre = grid.centre([0, 0, 28 + n]);
            let flat = axes * (middle + Vector::new(7.0 * x, 1.2 * y, 0.0));
            Point::new(flat.x, flat.y, centre.z)
        };
        [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(corner).to_vec()
    };
    let given: Vec<Vec<Point>> = (0..5).map(band).collect();
    let u = moved(&mesh, Order::Linear, |_| Vector::new(0.0, 0.0, 0.8));
    let (contours, _) =
        carry_contours(&given, Rule::Joined, &grid, &u, &params(), Progress::none()).unwrap();
    let area = |contours: &[Vec<Point>]| -> f64 {
        let one = |c: &Vec<Point>| {
            let fan = c.windows(2).map(|w| (w[0] - c[0]).cross(&(w[1] - c[0])));
            0.5 * fan.sum::<Vector>().norm()
        };
        contours.iter().map(one).sum()
    };
    let share = area(&contours) / area(&given);
    assert!((0.9..1.05).contains(&share), "{share} of the area is left");
}

/// A displacement that ends in a plane: what lies below stays as it was drawn, to the last digit.
#[test]
fn slices_that_do_not_move_keep_what_was_drawn_in_them() {
    let (mesh, grid) = (block(), slices(false));
    let lift = |z: f64| ((z - 3.0) / 15.0).max(0.0);
    let deformation = moved(&mesh, Order::Linear, |p| Vector::new(3.0 * lift(p.z), 0.0, 0.0));
    let given = ball(&grid, 1);
    let (carried, facts) =
        carry_contours(&given, Rule::Joined, &grid, &deformation, &params(), Progress::none())
            .unwrap();
    assert!(facts.moved_points > 0);
    let level = |c: &Vec<Point>| c[0].z;
    let below = |all: &[Vec<Point>]| -> Vec<Vec<Point>> {
        all.iter().filter(|c| level(c) < -2.5).cloned().collect()
    };
    assert!(below(&given).len() > 3, "{}", below(&given).len());
    assert_eq!(below(&carried), below(&given));
    // One contour a slice: no specks.
    let mut levels: Vec<i64> = carried.iter().map(|c| (level(c) * 1e3).round() as i64).collect();
    levels.dedup();
    assert_eq!(levels.len(), carried.len());
}
