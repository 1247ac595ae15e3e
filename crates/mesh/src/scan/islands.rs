//! Pieces by themselves: dust, cables, what hangs in the air.

use super::cells::{after, cells, representatives};
use super::{Scan, ScanInfo};
use crate::PointTree;
use supine_space::Point;

/// A piece of this share of the points is part of the scan.
const PIECE: f64 = 0.01;
/// Triangles that would leave out more than this share of the points do not tell what hangs
/// together.
const TORN: f64 = 0.1;
/// Points this near belong together, mm, and the same in spacings of the scan.
const NEAR_MM: f64 = 8.0;
const NEAR_SPACINGS: f64 = 4.0;
/// Distances to the next point are told among points this far apart, mm, and from so many of them.
const SPARSE_MM: f64 = 2.0;
const SAMPLE: usize = 1000;

/// Leaves out small pieces: those of the triangles, or of points near each other.
pub(super) fn drop(scan: &mut Scan, info: &mut ScanInfo) {
    if scan.points.is_empty() {
        return;
    }
    let torn = |kept: &(Vec<bool>, usize)| {
        let dropped = kept.0.iter().filter(|k| !**k).count();
        dropped as f64 > TORN * kept.0.len() as f64
    };
    let joined = (!scan.triangles.is_empty()).then(|| by_triangles(scan));
    let (kept, pieces) =
        joined.filter(|kept| !torn(kept)).unwrap_or_else(|| by_distance(&scan.points));
    if pieces == 0 {
        return;
    }
    info.pieces = pieces;
    info.islands = kept.iter().filter(|k| !**k).count();
    scan.retain(&kept);
    let text = format!(
        "{} points of the scan lie in {pieces} small pieces by themselves: left out",
        info.islands
    );
    info.warn("scan-islands", text, ("points", info.islands as f64));
}

/// The points in large pieces, and the number of small ones.
fn by_triangles(scan: &Scan) -> (Vec<bool>, usize) {
    let mut groups = Groups::new(scan.points.len());
    for &[a, b, c] in &scan.triangles {
        groups.join(a, b);
        groups.join(b, c);
    }
    groups.large(&vec![1; scan.points.len()])
}

/// As [`by_triangles`], by cells of a grid that touch each other.
fn by_distance(points: &[Point]) -> (Vec<bool>, usize) {
    let near = NEAR_MM.max(NEAR_SPACINGS * spacing_mm(points));
    let cells = cells(points, near);
    let shares: Vec<&[(u64, u32)]> = cells.chunk_by(|a, b| a.0 == b.0).collect();
    let mut groups = Groups::new(shares.len());
    for (n, share) in shares.iter().enumerate() {
        for cell in after(share[0].0) {
            if let Ok(other) = shares.binary_search_by_key(&cell, |s| s[0].0) {
                groups.join(n as u32, other as u32);
            }
        }
    }
    let sizes: Vec<usize> = shares.iter().map(|s| s.len()).collect();
    let (large, pieces) = groups.large(&sizes);
    let mut kept = vec![true; points.len()];
    for (share, _) in shares.iter().zip(large).filter(|(_, large)| !large) {
        share.iter().for_each(|s| kept[s.1 as usize] = false);
    }
    (kept, pieces)
}

/// The usual distance from a point to the next one, mm.
fn spacing_mm(points: &[Point]) -> f64 {
    let sparse: Vec<Point> =
        representatives(points, SPARSE_MM).into_iter().map(|n| points[n as usize]).collect();
    let tree = PointTree::new(&sparse);
    let next = |p: &Point| tree.nearest_few(p, 2, f64::INFINITY).get(1).map(|found| found.1);
    let step = sparse.len().div_ceil(SAMPLE).max(1);
    let mut all: Vec<f64> = sparse.iter().step_by(step).filter_map(next).collect();
    all.sort_unstable_by(f64::total_cmp);
    all.get(all.len() / 2).copied().unwrap_or(0.0)
}

/// What hangs together: each is led to another of its group, or to itself.
struct Groups(Vec<u32>);

impl Groups {
    fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    fn find(&mut self, mut n: u32) -> u32 {
        while self.0[n as usize] != n {
            let above = self.0[self.0[n as usize] as usize];
            self.0[n as usize] = above;
            n = above;
        }
        n
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.0[a.max(b) as usize] = a.min(b);
    }

    /// Which belong to a large group, by what each weighs, and how many groups are small.
    fn large(mut self, weights: &[usize]) -> (Vec<bool>, usize) {
        let mut sums = vec![0; self.0.len()];
        for (n, weight) in weights.iter().enumerate() {
            sums[self.find(n as u32) as usize] += weight;
        }
        let least = PIECE * weights.iter().sum::<usize>() as f64;
        let large = |sum: usize| sum as f64 >= least;
        let small = sums.iter().filter(|&&sum| sum > 0 && !large(sum)).count();
        let of = (0..sums.len() as u32).map(|n| large(sums[self.find(n) as usize]));
        (of.collect(), small)
    }
}
