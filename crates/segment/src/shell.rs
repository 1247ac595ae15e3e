//! The rib shell: a closed surface through the outer edges of ribs, cartilage, sternum and spine,
//! carried across the gaps between them by smoothness and by what cannot lie inside or outside of
//! it.

use crate::Error;
use crate::aggregate::{Costs, Jump, Jumps, aggregate, cheapest};
use crate::below_ribs;
use crate::frame::Frame;
use crate::levels::Levels;
use crate::radial_map::{RADII, RAYS, RadialMap, Rays, START_MM};
use crate::rib_evidence::{BARRED, EDGE, Profile};
use crate::scan::Scan;
use crate::smoothing::{SMOOTH_MM, smoothed};
use supine_space::Progress;

// Costs and reaches of docs/SEGMENTATION.md, step 4, unless another source is named.
/// Cost per mm of jump between rays 1 degree apart, and mm allowed (this chosen, not measured).
const JUMP: f32 = 0.5;
const JUMP_MM: f32 = 4.0;
/// In front: cost per mm of lying deeper than the slack inside the hull of the first solution.
/// Needed where a bright heart lies behind a wall with little bone (docs/SEGMENTATION.md, step 5
/// and Traps).
const HULL: f32 = 1.0;
const HULL_SLACK_MM: f32 = 6.0;
/// Slices with ribs that are needed (docs/SEGMENTATION.md, How doubt is found: proposed there, not
/// measured).
const RIB_SLICES: usize = 6;

/// Where no ribs are: cost per mm of departure from the expected shell, up to a cap. Chosen, not
/// measured.
const EXPECTED: f32 = 0.5;
const EXPECTED_CAP_MM: f32 = 40.0;

/// The rib shell.
#[derive(Clone)]
pub(crate) struct Shell {
    /// Radius per (slice, ray), mm.
    pub(crate) radius: RadialMap,
    /// Slices below the ribs: the shell is carried on there at its last distance under the skin.
    pub(crate) ribless: Vec<bool>,
    /// 1 on the rays that have no rib near them below the lungs, 0 elsewhere.
    pub(crate) below_ribs: RadialMap,
}

/// Finds the shell.
pub(crate) fn shell(
    scan: Scan<'_>,
    levels: Levels,
    progress: Progress<'_>,
) -> Result<Shell, Error> {
    let (frame, rays) = (scan.frame, scan.rays);
    let slices = frame.size[2];
    let mut costs = Costs::new(slices, RADII, |k, out| {
        let image = smoothed(scan.ct, frame, k, SMOOTH_MM);
        let mut profile = Profile::default();
        for (p, out) in out.chunks_exact_mut(RADII).enumerate() {
            profile.sample(scan, &image, k, p);
            profile.costs(levels, out);
        }
    });
    progress.at(0.3)?;
    let jumps = jumps(frame);
    let first = radii(&aggregate(&costs, jumps));
    progress.at(0.6)?;
    let hull = hull(&first, rays).median(((12.5 / frame.spacing[2]) as usize).max(1), 0);
    add_hull(&mut costs, &hull, rays);
    let mut radius = radii(&aggregate(&costs, jumps));
    progress.at(0.8)?;
    let expected = below_ribs::expected(scan, &radius, &on_bone(&costs, &radius));
    let ribless = below_ribs::ribless(&expected, rays);
    let seen = ribless.iter().filter(|&&r| !r).count();
    if seen < RIB_SLICES {
        return Err(Error::NoRibs { slices: seen, needed: RIB_SLICES });
    }
    if expected.values.iter().any(|e| !e.is_nan()) {
        carry_on(&mut costs, &expected);
        add_hull(&mut costs, &hull, rays);
        radius = radii(&aggregate(&costs, jumps));
    }
    progress.at(1.0)?;
    let sigma = (2.5 / frame.spacing[2], 2.0 * RAYS as f32 / 360.0);
    let below_ribs =
        RadialMap { values: expected.values.iter().map(|e| f32::from(!e.is_nan())).collect() };
    Ok(Shell { radius: radius.median(1, 2).smooth(sigma.0, sigma.1), ribless, below_ribs })
}

/// 1 where the shell ends on the outer edge of a bone.
fn on_bone(costs: &Costs, shell: &RadialMap) -> RadialMap {
    RadialMap::from_fn(shell.slices(), |k, p| {
        let level = (shell.at(k, p) - START_MM) as usize;
        let near = &costs.ray(k, p)[level.saturating_sub(2)..(level + 3).min(RADII)];
        f32::from(near.iter().any(|&c| c < -0.5 * EDGE))
    })
}

/// Where there are no ribs: drops the evidence of bones (spine, contrast in kidneys) and asks for
/// the expected radius instead.
fn carry_on(costs: &mut Costs, expected: &RadialMap) {
    for (ray, &goal) in costs.values.chunks_exact_mut(RADII).zip(&expected.values) {
        if goal.is_nan() {
            continue;
        }
        for (i, cost) in ray.iter_mut().enumerate() {
            let barred = if *cost > 0.6 * BARRED { BARRED } else { 0.0 };
            let off = (START_MM + i as f32 - goal).abs();
            *cost = barred + EXPECTED * off.min(EXPECTED_CAP_MM);
        }
    }
}

fn jumps(frame: &Frame) -> Jumps {
    let (dz, dp) = (frame.spacing[2] / 2.5, 360.0 / RAYS as f32);
    Jumps {
        ray: Jump { cost: JUMP / dp, reach: (JUMP_MM * dp).ceil() as usize },
        slice: Jump { cost: 0.7 * JUMP / dz, reach: ((JUMP_MM * dz) as usize).max(2) },
    }
}

fn radii(sum: &Costs) -> RadialMap {
    RadialMap { values: cheapest(sum).into_iter().map(|n| START_MM + n as f32).collect() }
}

fn add_hull(costs: &mut Costs, hull: &RadialMap, rays: &Rays) {
    for (n, ray) in costs.values.chunks_exact_mut(RADII).enumerate() {
        if rays.to_back[n % RAYS] < 0.2 {
            for (i, cost) in ray.iter_mut().enumerate() {
                let inside = hull.values[n] - HULL_SLACK_MM - (START_MM + i as f32);
                *cost += HULL * inside.max(0.0);
            }
        }
    }
}

/// Radius of the convex hull of each slice's ring.
fn hull(ring: &RadialMap, rays: &Rays) -> RadialMap {
    let mut out = RadialMap::new(ring.slices(), 0.0);
    for k in 0..ring.slices() {
        let points: Vec<[f32; 2]> =
            (0..RAYS).map(|p| rays.directions[p].map(|c| c * ring.at(k, p))).collect();
        let mut corners = convex_corners(&points);
        corners.sort_unstable();
        for (n, &a) in corners.iter().enumerate() {
            let b = corners[(n + 1) % corners.len()];
            let gap = (b + RAYS - a - 1) % RAYS + 1;
            for step in 0..gap {
                let p = (a + step) % RAYS;
                out.values[k * RAYS + p] = crossing(points[a], points[b], rays.directions[p]);
            }
        }
    }
    out
}

/// Distance from the origin along `d` to the line through a and b.
fn crossing(a: [f32; 2], b: [f32; 2], d: [f32; 2]) -> f32 {
    let e = [b[0] - a[0], b[1] - a[1]];
    let slope = d[0] * e[1] - d[1] * e[0];
    if slope.abs() < 1e-6 {
        return a[0].hypot(a[1]);
    }
    (a[0] * e[1] - a[1] * e[0]) / slope
}

/// Indices of the corners of the convex hull (Andrew's monotone chain).
fn convex_corners(points: &[[f32; 2]]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| {
        points[a][0].total_cmp(&points[b][0]).then(points[a][1].total_cmp(&points[b][1]))
    });
    let turn = |a: usize, b: usize, c: usize| {
        let (p, q, r) = (points[a], points[b], points[c]);
        (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
    };
    let mut corners = Vec::new();
    for pass in 0..2 {
        let first = corners.len();
        for &n in &order {
            while corners.len() >= first + 2
                && turn(corners[corners.len() - 2], corners[corners.len() - 1], n) <= 0.0
            {
                corners.pop();
            }
            corners.push(n);
        }
        corners.pop();
        if pass == 0 {
            order.reverse();
        }
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Grid, Matrix, Point, Vector};

    #[test]
    fn the_hull_bridges_a_dent_and_keeps_the_rest() {
        let grid =
            Grid::new([100, 100, 40], Vector::repeat(4.0), Point::origin(), Matrix::identity());
        let frame = Frame::new(&grid.unwrap()).unwrap();
        let rays = Rays::new(&frame, vec![[0.0; 2]; 3]);
        let ring = RadialMap::from_fn(3, |_, p| if (80..100).contains(&p) { 40.0 } else { 100.0 });
        let hull = hull(&ring, &rays);
        assert!((hull.at(1, 0) - 100.0).abs() < 0.1);
        let chord = 100.0 * (10.5f32).to_radians().cos();
        assert!((hull.at(1, 90) - chord).abs() < 0.5, "{} {chord}", hull.at(1, 90));
    }
}
