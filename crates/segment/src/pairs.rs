//! Pairs of seeds that would make an uncertain place of the chest wall sure.

use crate::confidence::SURE_AROUND_MM;
use std::collections::BTreeMap;
use supine_space::{Point, Vector};

/// The seeds of a pair lie this far from the boundary on either side, mm: near enough to bind it,
/// and beyond its blur.
pub(crate) const ASIDE_MM: f64 = 2.0;
/// A place without pairs near it counts as covered when it is smaller than this share of the whole.
const REST: f64 = 0.03;
/// Pairs are placed at most this densely, mm.
const STEP_MM: f64 = 3.0;

/// No pair is put where less than this share of the boundary's normal lies within the slices: on a
/// step between two of them.
const STEEP: f64 = 0.3;

/// A place of the boundary (LPS, mm) with its faces towards the soft tissue, mm², LPS.
pub(crate) type Face = (Point, Vector);

/// Pairs on both sides of the boundary as it was found, in the chest wall and in the soft tissue,
/// so that every face has one within [`SURE_AROUND_MM`]. Each next one is put where it makes the
/// most sure; none where the boundary has no one direction within the slices, whose normal is
/// `axis`: slices may be farther apart than the seeds of a pair.
pub(crate) fn covering(faces: &[Face], axis: &Vector) -> Vec<[Point; 2]> {
    let possible: Vec<(Point, [Point; 2])> =
        candidates(faces).filter_map(|at| Some((at, pair(&at, faces, axis)?))).collect();
    let mut open: Vec<&Point> = faces.iter().map(|face| &face.0).collect();
    let (enough, mut pairs) = ((REST * faces.len() as f64) as usize, Vec::new());
    while open.len() > enough {
        let mut best = (0, None);
        for (at, pair) in &possible {
            let gain = open.iter().filter(|p| reached(at, p)).count();
            if gain > best.0 {
                best = (gain, Some((at, pair)));
            }
        }
        let Some((at, pair)) = best.1 else { break };
        open.retain(|p| !reached(at, p));
        pairs.push(*pair);
    }
    pairs
}

fn reached(from: &Point, to: &Point) -> bool {
    (to - from).norm_squared() <= SURE_AROUND_MM * SURE_AROUND_MM
}

/// One place of each small cube.
fn candidates(faces: &[Face]) -> impl Iterator<Item = Point> {
    let mut cubes = BTreeMap::new();
    for (p, _) in faces {
        let cube = [0, 1, 2].map(|a| (p[a] / STEP_MM).floor() as i64);
        cubes.entry(cube).or_insert(*p);
    }
    cubes.into_values()
}

/// The pair at a place, across the mean direction of the faces around it.
fn pair(here: &Point, faces: &[Face], axis: &Vector) -> Option<[Point; 2]> {
    let around = faces.iter().filter(|f| reached(here, &f.0));
    let across = around.fold(Vector::zeros(), |sum, f| sum + f.1);
    let normal = (across - axis * axis.dot(&across)).try_normalize(STEEP * across.norm())?;
    Some([-ASIDE_MM, ASIDE_MM].map(|mm| here + normal * mm))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A flat place of 40 mm x 20 mm.
    fn plane() -> Vec<Face> {
        let at = |i: usize, j: usize| Point::new(i as f64, 5.0, j as f64);
        let grid = (0..40).flat_map(|i| (0..20).map(move |j| (i, j)));
        grid.map(|(i, j)| (at(i, j), -Vector::y())).collect()
    }

    #[test]
    fn every_place_has_a_pair_near_it_and_few_do() {
        let faces = plane();
        let pairs = covering(&faces, &Vector::z());
        let middle = |pair: &[Point; 2]| Point::from((pair[0].coords + pair[1].coords) / 2.0);
        let far = faces.iter().filter(|f| !pairs.iter().any(|p| reached(&middle(p), &f.0)));
        assert!(far.count() <= 24, "{pairs:?}");
        let alone = 800.0 / (std::f64::consts::PI * SURE_AROUND_MM * SURE_AROUND_MM);
        assert!((pairs.len() as f64) < 2.5 * alone.ceil(), "{} {alone}", pairs.len());
        for [wall, soft] in &pairs {
            assert!((soft - wall - 2.0 * ASIDE_MM * -Vector::y()).norm() < 1e-9, "{wall} {soft}");
        }
    }
}
