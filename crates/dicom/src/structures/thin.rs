//! Contours with fewer corners.

use supine_space::Point;

/// The contour without corners that lie within `tolerance` (mm) of the line between those that stay
/// (Douglas and Peucker, Cartographica 10, 1973), in two halves since it is closed.
pub(super) fn thinned(contour: &[Point], tolerance: f64) -> Vec<Point> {
    let half = contour.len() / 2;
    let mut keep = vec![false; contour.len() + 1];
    let at = |n: usize| contour[n % contour.len()];
    let mut open = vec![(0, half), (half, contour.len())];
    while let Some((a, b)) = open.pop() {
        (keep[a], keep[b]) = (true, true);
        let line = at(b) - at(a);
        let off = |n: usize| {
            let from = at(n) - at(a);
            let along = if line.norm_squared() > 0.0 {
                (from.dot(&line) / line.norm_squared()).clamp(0.0, 1.0)
            } else {
                0.0
            };
            (from - line * along).norm()
        };
        let farthest = (a + 1..b).max_by(|&x, &y| off(x).total_cmp(&off(y)));
        if let Some(n) = farthest.filter(|&n| off(n) > tolerance) {
            open.extend([(a, n), (n, b)]);
        }
    }
    (0..contour.len()).filter(|&n| keep[n]).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thinned_contour_stays_within_the_tolerance() {
        let corner = |n: usize| {
            let (s, c) = (n as f64 * std::f64::consts::TAU / 5000.0).sin_cos();
            Point::new(80.0 * c, 50.0 * s, 1.0)
        };
        let given: Vec<Point> = (0..5000).map(corner).collect();
        let thin = thinned(&given, 0.02);
        assert!((100..400).contains(&thin.len()), "{}", thin.len());
        let off = |p: &Point| {
            let ends = (0..thin.len()).map(|n| (thin[n], thin[(n + 1) % thin.len()]));
            let to = |(a, b): (Point, Point)| {
                let t = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
                (a + (b - a) * t - p).norm()
            };
            ends.map(to).fold(f64::INFINITY, f64::min)
        };
        assert!(given.iter().map(off).fold(0.0, f64::max) <= 0.02);
    }
}
