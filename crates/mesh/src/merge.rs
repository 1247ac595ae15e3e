//! Points at the same place.

use supine_space::Point;

/// The points without those at the place of another, and where each of the given ones is among
/// them. The first of each place stands for it, so that the order of the points is kept.
pub(crate) fn merged(points: &[Point]) -> (Vec<Point>, Vec<u32>) {
    // Adding 0 makes -0 the same as 0.
    let key = |n: u32| points[n as usize].coords.map(|c| c + 0.0);
    // The first coordinate comes along: most often it decides.
    let mut order: Vec<(f64, u32)> = points.iter().map(|p| p.x + 0.0).zip(0..).collect();
    order.sort_unstable_by(|a, b| {
        let others = || {
            let (p, q) = (key(a.1), key(b.1));
            p.y.total_cmp(&q.y).then(p.z.total_cmp(&q.z)).then(a.1.cmp(&b.1))
        };
        a.0.total_cmp(&b.0).then_with(others)
    });
    let mut place: Vec<u32> = vec![0; points.len()];
    for same in order.chunk_by(|a, b| key(a.1) == key(b.1)) {
        same.iter().for_each(|n| place[n.1 as usize] = same[0].1);
    }
    drop(order);
    let mut kept = Vec::new();
    for n in 0..points.len() {
        if place[n] as usize == n {
            place[n] = kept.len() as u32;
            kept.push(points[n]);
        } else {
            place[n] = place[place[n] as usize];
        }
    }
    (kept, place)
}
