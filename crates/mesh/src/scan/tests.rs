//! A made-up torso in every state that scanners leave one in.

use super::*;
use std::f64::consts::TAU;

const AROUND: usize = 60;
const ALONG: usize = 40;

/// The front three quarters of a torso with a breast: points, true normals, triangles from outside.
fn torso() -> (Vec<Point>, Vec<Vector>, Vec<[u32; 3]>) {
    let place = |u: f64, v: f64| {
        let turn = TAU * (0.125 + 0.75 * u);
        let bump = 35.0 * (-((u - 0.35).powi(2) + (v - 0.5).powi(2)) / 0.01).exp();
        let (x, y) = ((170.0 + bump) * turn.sin(), (110.0 + bump) * turn.cos());
        Point::new(x, y, 450.0 * v)
    };
    let (mut points, mut normals, mut triangles) = (vec![], vec![], vec![]);
    for n in 0..AROUND * ALONG {
        let (i, j) = (n % AROUND, n / AROUND);
        // Not on a grid, as no scanner leaves them.
        let shift = 0.3 * (1.7 * n as f64).sin();
        let (u, v) = ((i as f64 + shift) / AROUND as f64, (j as f64 - shift) / ALONG as f64);
        let (along_u, along_v) =
            (place(u + 1e-6, v) - place(u - 1e-6, v), place(u, v + 1e-6) - place(u, v - 1e-6));
        points.push(place(u, v));
        normals.push(along_v.cross(&along_u).normalize());
        if i + 1 < AROUND && j + 1 < ALONG {
            let [a, b, c, d] = [n, n + 1, n + 1 + AROUND, n + AROUND].map(|p| p as u32);
            triangles.extend([[a, c, b], [a, d, c]]);
        }
    }
    (points, normals, triangles)
}

/// The largest angle between normals, degrees, beside a share of the worst.
fn angle_deg(found: &[Vector], known: &[Vector], beside: f64) -> f64 {
    let angle = |(a, b): (&Vector, &Vector)| a.angle(b).to_degrees();
    let mut all: Vec<f64> = found.iter().zip(known).map(angle).collect();
    all.sort_by(f64::total_cmp);
    all[((1.0 - beside) * (all.len() - 1) as f64) as usize]
}

#[test]
fn given_normals_are_kept_and_mended() {
    let (points, mut normals, triangles) = torso();
    let known = normals.clone();
    normals.iter_mut().for_each(|n| *n *= 3.0);
    normals[7] = Vector::zeros();
    normals[1200].y = f64::NAN;
    let (scan, info) = Scan::new(points.clone(), Some(normals), triangles.clone()).unwrap();
    assert_eq!((info.normals, info.mended, info.turned), (NormalSource::Given, 2, false));
    assert!(info.outwards > 0.9 && info.warnings.is_empty(), "{info:?}");
    assert_eq!((scan.points(), scan.triangles()), (&points[..], &triangles[..]));
    assert!(angle_deg(scan.normals(), &known, 0.0) < 12.0);
    assert!(angle_deg(scan.normals(), &known, 0.001) < 1e-5);
}

#[test]
fn normals_come_from_triangles_or_else_from_neighbours() {
    let (points, known, triangles) = torso();
    let (scan, info) = Scan::new(points.clone(), None, triangles.clone()).unwrap();
    assert_eq!(info.normals, NormalSource::Triangles);
    assert!(angle_deg(scan.normals(), &known, 0.01) < 8.0);
    let (scan, info) = Scan::new(points.clone(), None, vec![]).unwrap();
    assert_eq!((info.normals, info.turned), (NormalSource::Neighbours, false));
    assert!(angle_deg(scan.normals(), &known, 0.0) < 50.0, "none points inwards");
    assert!(angle_deg(scan.normals(), &known, 0.05) < 16.0);
    // Triangles that wind at random, and normals that nobody computed.
    let mut mixed = triangles;
    mixed.iter_mut().step_by(2).for_each(|t| t.swap(0, 1));
    let alike = Some(vec![Vector::z(); points.len()]);
    let (same, info) = Scan::new(points, alike, mixed).unwrap();
    assert_eq!(info.normals, NormalSource::Neighbours);
    assert_eq!(info.warnings[0].code(), "scan-normals-unusable");
    assert_eq!(same.normals(), scan.normals());
}

#[test]
fn noise_does_not_tilt_normals_of_a_dense_scan() {
    let (coarse, known, _) = torso();
    // 25 points around each, 0.4 mm apart, 0.3 mm off the plane.
    let dense = |n: usize| {
        let (at, normal) = (coarse[n / 25], known[n / 25]);
        let (side, up) = (normal.cross(&Vector::z()).normalize(), Vector::z());
        let (a, b) = ((n % 5) as f64 - 2.0, (n / 5 % 5) as f64 - 2.0);
        at + side * (0.4 * a) + up * (0.4 * b) + normal * (0.3 * (7.3 * n as f64).sin())
    };
    let points = (0..25 * coarse.len()).map(dense).collect();
    let wanted: Vec<Vector> = known.iter().flat_map(|n| [*n; 25]).collect();
    let (scan, _) = Scan::new(points, None, vec![]).unwrap();
    assert!(angle_deg(scan.normals(), &wanted, 0.0) < 60.0);
    assert!(angle_deg(scan.normals(), &wanted, 0.05) < 20.0);
}

#[test]
fn a_scan_that_is_inside_out_is_turned() {
    let (points, known, triangles) = torso();
    let inwards = Some(known.iter().map(|n| -n).collect());
    let mut turned = triangles.clone();
    turned.iter_mut().for_each(|t| t.swap(1, 2));
    for normals in [inwards, None] {
        let (scan, info) = Scan::new(points.clone(), normals, turned.clone()).unwrap();
        assert!(info.turned && info.outwards < 0.1, "{info:?}");
        assert_eq!(info.warnings[0].code(), "scan-turned");
        assert!(angle_deg(scan.normals(), &known, 0.01) < 8.0);
        assert_eq!(scan.triangles(), triangles);
    }
}

#[test]
fn holes_duplicates_and_islands_are_left_out_and_counted() {
    let (mut points, mut normals, mut triangles) = torso();
    let body = points.len();
    points.extend([Point::new(f64::NAN, 0.0, 0.0), Point::new(0.0, f64::INFINITY, 9.0)]);
    points.extend([points[3], points[4]]);
    points.extend((0..9).map(|n| Point::new(0.0, 400.0, 3.0 * f64::from(n))));
    points.push(Point::new(-1e30, 0.0, 0.0));
    normals.resize(points.len(), Vector::x());
    for with_triangles in [false, true] {
        let given = if with_triangles { triangles.clone() } else { vec![] };
        let (scan, info) = Scan::new(points.clone(), Some(normals.clone()), given).unwrap();
        assert_eq!((info.not_finite, info.duplicates, info.islands), (2, 2, 10), "{info:?}");
        assert_eq!((scan.points(), info.points), (&points[..body], body + 14));
        let codes: Vec<&str> = info.warnings.iter().map(|w| w.code()).collect();
        assert_eq!(codes, ["scan-not-finite", "scan-islands"]);
        assert_eq!(info.pieces, if with_triangles { 10 } else { 2 });
    }
    // Triangles of one patch only do not make the rest an island.
    triangles.truncate(400);
    let (scan, _) = Scan::new(points.clone(), None, triangles).unwrap();
    assert_eq!((scan.points().len(), scan.triangles().len()), (body, 400));
}

#[test]
fn a_soup_of_triangles_is_the_same_scan() {
    let (points, known, triangles) = torso();
    let soup: Vec<Point> = triangles.iter().flatten().map(|&p| points[p as usize]).collect();
    let corners = (0..triangles.len() as u32).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
    let (scan, info) = Scan::new(soup, None, corners).unwrap();
    assert_eq!((scan.points().len(), info.duplicates), (points.len(), info.points - points.len()));
    assert_eq!(scan.triangles().len(), triangles.len());
    let nearest = PointTreeOf::new(&points);
    let wanted: Vec<Vector> = scan.points().iter().map(|p| known[nearest.at(p)]).collect();
    assert!(angle_deg(scan.normals(), &wanted, 0.01) < 8.0);
}

struct PointTreeOf(crate::PointTree);

impl PointTreeOf {
    fn new(points: &[Point]) -> Self {
        Self(crate::PointTree::new(points))
    }

    fn at(&self, p: &Point) -> usize {
        self.0.nearest(p, 1e-9).unwrap().0
    }
}

#[test]
fn what_is_no_scan_is_refused() {
    let (points, normals, triangles) = torso();
    let refused = |p: &[Point], n, t| Scan::new(p.to_vec(), n, t).unwrap_err();
    assert!(matches!(refused(&points[..499], None, vec![]), ScanError::TooFew { found: 499, .. }));
    assert!(matches!(refused(&[], None, vec![]), ScanError::TooFew { found: 0, .. }));
    let short = Some(normals[1..].to_vec());
    assert!(matches!(refused(&points, short, vec![]), ScanError::Normals { .. }));
    let last = points.len() as u32;
    let beyond = vec![triangles[0], [0, 1, last]];
    assert!(matches!(refused(&points, None, beyond), ScanError::Index { triangle: 1, .. }));
    let line: Vec<Point> = (0..900).map(|n| Point::new(f64::from(n), 0.0, 0.0)).collect();
    assert!(matches!(refused(&line, None, vec![]), ScanError::Line));
    let far: Vec<Point> = points.iter().map(|p| p * 1e4).collect();
    assert!(matches!(refused(&far, None, triangles), ScanError::TooLarge { .. }));
    let huge: Vec<Point> = points.iter().map(|p| p * 1e200).collect();
    assert!(Scan::new(huge, None, vec![]).is_err());
}

#[test]
fn a_scan_can_be_thinned_cut_and_moved() {
    let (points, normals, triangles) = torso();
    let (scan, _) = Scan::new(points, Some(normals), triangles).unwrap();
    let thin = scan.thinned(30.0);
    assert!(thin.points().len() * 4 < scan.points().len() && thin.triangles().is_empty());
    let nearest = PointTreeOf::new(scan.points());
    let kept: Vec<usize> = thin.points().iter().map(|p| nearest.at(p)).collect();
    assert!(kept.is_sorted(), "the order stays");
    assert!(kept.iter().zip(thin.normals()).all(|(&n, normal)| scan.normals()[n] == *normal));
    let tree = crate::PointTree::new(thin.points());
    assert!(scan.points().iter().all(|p| tree.nearest(p, 30.0 * 3f64.sqrt()).is_some()));
    for all in [0.0, f64::NAN, 1e-9] {
        assert!(scan.thinned(all).points() == scan.points(), "{all}");
    }
    let upper = scan.without(|n| scan.points()[n].z < 200.0).unwrap();
    assert!(upper.bounds().0.z >= 200.0 && !upper.triangles().is_empty());
    assert!(upper.triangles().iter().flatten().all(|&p| (p as usize) < upper.points().len()));
    assert!(scan.without(|_| true).is_none());
    let pose = Pose::new(Vector::new(1.0, 2.0, 3.0), Vector::z() * TAU / 4.0);
    let moved = scan.moved(&pose);
    assert!((moved.points()[0] - pose * scan.points()[0]).norm() < 1e-12);
    assert!((moved.moved(&pose.inverse()).normals()[9] - scan.normals()[9]).norm() < 1e-12);
}
