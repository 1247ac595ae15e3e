//! The curves where two surfaces meet.

use crate::complex::Class;
use crate::mesher::Mesher;
use std::collections::BTreeMap;
use supine_space::Vector;

/// The points of a rim are this far apart, mm.
const STEP_MM: f64 = 1.0;

/// The rims of a mesh as chains of points on the surfaces, in the mesher's frame. They end where
/// three tags meet; closed ones end where they begin.
pub(super) fn rims(mesher: &Mesher<'_>) -> Vec<Vec<Vector>> {
    let edges = mesher.rim_edges();
    let chains = chains(&edges, |v| mesher.mesh.class[v as usize].count_ones() > 2);
    chains.iter().map(|chain| refined(mesher, &edges, chain)).collect()
}

/// The edges as chains of vertices that end at `corner`s and where not just two edges meet.
fn chains(edges: &BTreeMap<[u32; 2], Class>, corner: impl Fn(u32) -> bool) -> Vec<Vec<u32>> {
    let mut around: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for &[a, b] in edges.keys() {
        around.entry(a).or_default().push(b);
        around.entry(b).or_default().push(a);
    }
    let end = |v: u32| around[&v].len() != 2 || corner(v);
    let (ends, others): (Vec<u32>, Vec<u32>) = around.keys().partition(|&&v| end(v));
    let mut left = edges.clone();
    let mut chains = Vec::new();
    // What no end reaches is closed.
    for from in ends.into_iter().chain(others) {
        for &next in &around[&from] {
            let mut chain = vec![from];
            let (mut here, mut to) = (from, next);
            while left.remove(&[here.min(to), here.max(to)]).is_some() {
                chain.push(to);
                let on = around[&to].iter().find(|&&v| v != here);
                let Some(&on) = on.filter(|_| !end(to)) else { break };
                (here, to) = (to, on);
            }
            if chain.len() > 1 {
                chains.push(chain);
            }
        }
    }
    chains
}

/// The points of a chain with others on the surfaces between them.
fn refined(mesher: &Mesher<'_>, edges: &BTreeMap<[u32; 2], Class>, chain: &[u32]) -> Vec<Vector> {
    let on = |class: Class, p: Vector| mesher.fields().project(class, p, &[0.0; 3]).unwrap_or(p);
    let place = |v: u32| on(mesher.mesh.class[v as usize], mesher.mesh.points[v as usize]);
    let mut points = vec![place(chain[0])];
    for pair in chain.windows(2) {
        let (from, to) = (place(pair[0]), place(pair[1]));
        let class = edges[&[pair[0].min(pair[1]), pair[0].max(pair[1])]];
        let parts = ((to - from).norm() / STEP_MM).ceil().max(1.0) as usize;
        let share = |n: usize| n as f64 / parts as f64;
        points.extend((1..parts).map(|n| on(class, from + (to - from) * share(n))));
        points.push(to);
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chained(edges: &[[u32; 2]], corners: &[u32]) -> Vec<Vec<u32>> {
        let edges = edges.iter().map(|e| (*e, 3)).collect();
        chains(&edges, |v| corners.contains(&v))
    }

    #[test]
    fn a_ring_ends_where_it_begins() {
        assert_eq!(chained(&[[0, 1], [1, 2], [0, 2]], &[]), [[0, 1, 2, 0]]);
    }

    #[test]
    fn chains_end_at_corners_and_forks() {
        let found = chained(&[[0, 1], [1, 2], [2, 3], [2, 4]], &[]);
        assert_eq!(found, [vec![0, 1, 2], vec![2, 3], vec![2, 4]]);
        let found = chained(&[[0, 1], [1, 2], [2, 3], [0, 3]], &[1, 3]);
        assert_eq!(found, [vec![1, 0, 3], vec![1, 2, 3]]);
    }
}
