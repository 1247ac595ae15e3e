//! Which side of unconnected normals is outside.

use super::centroid;
use rayon::prelude::*;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use supine_space::{Point, Vector};

/// From each point its side goes on to so many near by, and to those that it is near to.
pub(super) const LINKS: usize = 8;

/// Turns normals so that neighbours agree, most parallel ones first, and that most of each
/// connected part point away from the middle of the points. `links` lead from each point to some
/// near by.
///
/// Source: Hoppe et al., Surface reconstruction from unorganized points, SIGGRAPH 1992.
pub(super) fn orient(points: &[Point], normals: &mut [Vector], links: &[Vec<u32>]) {
    let (starts, ends) = both_ways(links);
    let middle = centroid(points);
    let mut reached = vec![false; points.len()];
    for start in 0..points.len() {
        if reached[start] {
            continue;
        }
        let mut part = vec![];
        let mut waiting = BinaryHeap::from([(u64::MAX, Reverse(start as u32), start as u32)]);
        while let Some((_, Reverse(to), from)) = waiting.pop() {
            let at = to as usize;
            if std::mem::replace(&mut reached[at], true) {
                continue;
            }
            if normals[at].dot(&normals[from as usize]) < 0.0 {
                normals[at] = -normals[at];
            }
            part.push(at);
            for &next in &ends[starts[at]..starts[at + 1]] {
                if !reached[next as usize] {
                    // Bits of numbers from 0 on are ordered as the numbers.
                    let parallel = normals[at].dot(&normals[next as usize]).abs().to_bits();
                    waiting.push((parallel, Reverse(next), to));
                }
            }
        }
        let away = |&&n: &&usize| normals[n].dot(&(points[n] - middle)) > 0.0;
        if 2 * part.iter().filter(away).count() < part.len() {
            part.iter().for_each(|&n| normals[n] = -normals[n]);
        }
    }
}

/// The links in both directions: where those of each point start, and where they lead.
fn both_ways(links: &[Vec<u32>]) -> (Vec<usize>, Vec<u32>) {
    let ways = |(n, to): (usize, &Vec<u32>)| {
        let n = n as u32;
        to.iter().flat_map(move |&to| [(n, to), (to, n)]).collect::<Vec<_>>()
    };
    let mut all: Vec<(u32, u32)> = links.iter().enumerate().flat_map(ways).collect();
    all.par_sort_unstable();
    all.dedup();
    let mut starts = vec![0; links.len() + 1];
    all.iter().for_each(|way| starts[way.0 as usize + 1] += 1);
    for n in 0..links.len() {
        starts[n + 1] += starts[n];
    }
    (starts, all.into_iter().map(|way| way.1).collect())
}
