//! What a fit leaves on the breast beyond noise.
//!
//! The noise of a scanner is another one at each point; what a wrong law leaves is alike over
//! centimetres. The mean product of residuals at points that lie near to each other is the square
//! of the second alone (a variogram's nugget left out).

use std::collections::BTreeMap;
use supine_mesh::PointTree;
use supine_record::OffPlace;
use supine_space::{Point, Vector};

/// Points this near to each other are compared, mm.
const NEAR_MM: f64 = 3.0;
/// Points that are compared with their nearest neighbour, at most.
const COMPARED: usize = 4000;
/// Width of a piece of skin, mm, and its fewest points.
const PIECE_MM: f64 = 25.0;
const FEWEST: usize = 20;

/// The part of residuals (place, mm) that is alike at neighbouring points, mm rms.
pub(super) fn structured_mm(residuals: &[(Point, f64)]) -> f64 {
    let mut products = (0.0, 0usize);
    // Every other point is looked up among the rest.
    let (own, others): (Vec<_>, Vec<_>) =
        residuals.iter().enumerate().partition(|(n, _)| n % 2 == 0);
    let places: Vec<Point> = others.iter().map(|(_, (place, _))| *place).collect();
    let tree = PointTree::new(&places);
    let every = own.len().div_ceil(COMPARED).max(1);
    for (_, (place, off)) in own.into_iter().step_by(every) {
        let Some((n, _)) = tree.nearest(place, NEAR_MM) else { continue };
        products.0 += off * others[n].1.1;
        products.1 += 1;
    }
    (products.0 / products.1.max(1) as f64).max(0.0).sqrt()
}

/// The piece of skin whose residuals (place, mm) have the largest mean; `None` without points.
pub(super) fn farthest(residuals: &[(Point, f64)]) -> Option<OffPlace> {
    let mut pieces: BTreeMap<[i64; 3], Vec<(Point, f64)>> = BTreeMap::new();
    for (place, off) in residuals {
        let cell = [0, 1, 2].map(|k| (place[k] / PIECE_MM).floor() as i64);
        pieces.entry(cell).or_default().push((*place, *off));
    }
    let off = |points: &[(Point, f64)]| {
        let count = points.len() as f64;
        let middle = points.iter().map(|(place, _)| place.coords).sum::<Vector>() / count;
        let off_mm = points.iter().map(|(_, off)| off).sum::<f64>() / count;
        OffPlace { place_mm: middle.into(), off_mm }
    };
    let whole = pieces.values().filter(|points| points.len() >= FEWEST).map(|points| off(points));
    whole.max_by(|a, b| a.off_mm.abs().total_cmp(&b.off_mm.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plane of points 2 mm apart.
    fn plane(off: impl Fn(usize, &Point) -> f64) -> Vec<(Point, f64)> {
        let at = |n: usize| Point::new(2.0 * (n % 60) as f64, 2.0 * (n / 60) as f64, 0.0);
        (0..3600).map(|n| (at(n), off(n, &at(n)))).collect()
    }

    /// Evenly from -0.4 to 0.4: a hash (splitmix).
    fn noise(n: usize) -> f64 {
        let mut h = (n as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        h = (h ^ (h >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        h = (h ^ (h >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((h >> 40) as f64 / (1u64 << 24) as f64 - 0.5) * 0.8
    }

    #[test]
    fn noise_alone_has_no_structure_and_a_bulge_has_its_own() {
        assert!(structured_mm(&plane(|n, _| noise(n))) < 0.08);
        let bulge =
            |p: &Point| 1.2 * (-((p.x - 87.0).powi(2) + (p.y - 37.0).powi(2)) / 400.0).exp();
        let exact = plane(|_, p| bulge(p));
        let size = (exact.iter().map(|(_, off)| off * off).sum::<f64>() / 3600.0).sqrt();
        let found = plane(|n, p| bulge(p) + noise(n));
        assert!((structured_mm(&found) / size - 1.0).abs() < 0.15, "{size}");
        let far = farthest(&found).unwrap();
        assert!(far.off_mm > 0.8 && (far.place_mm[0] - 87.0).abs() < 10.0, "{far:?}");
        assert!((far.place_mm[1] - 37.0).abs() < 10.0, "{far:?}");
        assert_eq!((structured_mm(&[]), farthest(&[])), (0.0, None));
    }
}
