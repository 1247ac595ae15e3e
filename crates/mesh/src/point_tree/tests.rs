//! Against looking at every point.

use super::*;
use proptest::prelude::*;

/// The nearest points, by looking at all.
fn by_hand(points: &[Point], place: &Point, count: usize, within: f64) -> Vec<(usize, f64)> {
    let squared_to = |p: &Point| squared([0, 1, 2].map(|axis| p[axis] - place[axis]));
    let mut all: Vec<(f64, usize)> = points.iter().map(squared_to).zip(0..).collect();
    all.retain(|(d, _)| *d <= within * within);
    all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    all.into_iter().take(count).map(|(d, n)| (n, d.sqrt())).collect()
}

fn check(points: &[Point], place: &Point, count: usize, within: f64) {
    let tree = PointTree::new(points);
    assert_eq!(tree.nearest_few(place, count, within), by_hand(points, place, count, within));
    assert_eq!(tree.nearest(place, within), by_hand(points, place, 1, within).first().copied());
}

/// Whole coordinates make points equally near, others do not.
fn cloud() -> impl Strategy<Value = Vec<Point>> {
    let coordinate = prop_oneof![(-3..3i32).prop_map(f64::from), -3.0..3.0f64];
    prop::collection::vec(prop::array::uniform3(coordinate).prop_map(Point::from), 0..300)
}

proptest! {
    #[test]
    fn the_nearest_are_those_that_looking_at_all_finds(
        points in cloud(),
        place in prop::array::uniform3(prop_oneof![(-4..4i32).prop_map(f64::from), -4.0..4.0f64]),
        count in 0usize..40,
        within in prop_oneof![0.0..4.0f64, (0..4u8).prop_map(f64::from), Just(f64::INFINITY)],
    ) {
        check(&points, &place.into(), count, within);
    }
}

#[test]
fn many_points_on_a_sphere_are_found_on_any_number_of_threads() {
    let on_sphere = |n: usize| {
        let (turn, up) = (2.4 * n as f64, 1.0 - 2.0 * (n as f64 + 0.5) / 20_000.0);
        let around = (1.0 - up * up).sqrt();
        Point::new(around * turn.cos(), around * turn.sin(), up) * 200.0
    };
    let points: Vec<Point> = (0..20_000).map(on_sphere).collect();
    for n in 0..40 {
        check(&points, &(points[499 * n] * 1.01), 17, f64::INFINITY);
    }
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(one.install(|| PointTree::new(&points)).indices, PointTree::new(&points).indices);
}

#[test]
fn what_is_not_finite_is_never_found() {
    let mut points = vec![Point::new(f64::NAN, 0.0, 0.0); 30];
    points.extend(vec![Point::new(0.0, f64::INFINITY, 0.0); 30]);
    points.insert(20, Point::new(1.0, 2.0, 3.0));
    let tree = PointTree::new(&points);
    assert_eq!(tree.len(), 61);
    let place = Point::new(1.0, 2.0, 4.0);
    assert_eq!(tree.nearest_few(&place, 9, 1e300), [(20, 1.0)]);
    assert_eq!((tree.nearest(&place, 0.9), tree.nearest(&place, 1.0)), (None, Some((20, 1.0))));
    for within in [f64::NAN, -1.0] {
        assert_eq!(tree.nearest(&place, within), None);
    }
    assert_eq!(tree.nearest(&Point::new(f64::NAN, 0.0, 0.0), 1e300), None);
    assert!(PointTree::new(&[]).is_empty());
    assert_eq!(PointTree::new(&[]).nearest(&place, f64::INFINITY), None);
}
