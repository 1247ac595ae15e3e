//! Meshes whose points lie on the surface of an applicator.

use crate::rigid::RigidBody;
use crate::{Body, Error, Load, Params, solve};
use std::sync::Arc;
use supine_mesh::{Edges, TetMesh};
use supine_space::{Point, Progress, Vector};

/// The points are moved, the tissue settled again, and the points moved by what they are off then:
/// a micrometre after three rounds.
const ROUNDS: usize = 3;
/// A move leaves each tetrahedron at least this share of its volume.
const MIN_VOLUME: f64 = 0.3;
/// Halvings when a surface is sought along an edge.
const HALVINGS: usize = 40;

/// The mesh of `body` with points inside the tissue moved along edges onto the surface of `rigid`,
/// where the target's gravity has it: coupled to it ([`crate::Applicator::attach`]), they hold the
/// tissue at the surface and not at the ragged set of points that happen to lie inside.
///
/// Points of the boundary stay, and so do points whose move would flatten a tetrahedron. Number and
/// order of points and tetrahedra are kept. The second value is how many points were moved.
///
/// # Errors
/// As [`solve`].
pub fn snapped(
    body: &Body,
    load: &Load,
    params: &Params,
    rigid: &dyn RigidBody,
    progress: Progress<'_>,
) -> Result<(Arc<TetMesh>, usize), Error> {
    let mut mesh = body.mesh.clone();
    let mut moved = vec![false; mesh.points().len()];
    for round in 0..ROUNDS {
        let (from, to) = (round as f64 / ROUNDS as f64, (round + 1) as f64 / ROUNDS as f64);
        let body = Body { mesh: mesh.clone(), curved: None, ..body.clone() };
        let (settled, _) = solve(&body, load, params, progress.part(from, to))?;
        let u = settled.displacement().values();
        let at: Vec<Point> = mesh.points().iter().zip(u).map(|(p, u)| p + u).collect();
        let points = moved_points(&mesh, &at, rigid, &mut moved);
        mesh = TetMesh::new(points, mesh.tets().to_vec(), mesh.boundary().to_vec())?.into();
    }
    Ok((mesh, moved.iter().filter(|m| **m).count()))
}

/// The mesh with points inside the tissue moved along edges onto the surface of `cavity`, in the CT
/// shape: cut ([`crate::Insertion::cavity`]), its wall is that surface and not the ragged one of
/// the tetrahedra that happen to lie inside.
///
/// Points of the boundary stay, and so do points whose move would flatten a tetrahedron. Number and
/// order of points and tetrahedra are kept. The second value is how many points were moved.
///
/// # Errors
/// When the moved points are no mesh.
pub fn snapped_to_cavity(
    mesh: &TetMesh,
    cavity: &dyn RigidBody,
) -> Result<(Arc<TetMesh>, usize), Error> {
    let mut moved = vec![false; mesh.points().len()];
    let points = moved_points(mesh, mesh.points(), cavity, &mut moved);
    let snapped = TetMesh::new(points, mesh.tets().to_vec(), mesh.boundary().to_vec())?;
    Ok((snapped.into(), moved.iter().filter(|m| **m).count()))
}

/// Where the points go in the CT shape, `at` where they lie when they meet the surface.
fn moved_points(
    mesh: &TetMesh,
    at: &[Point],
    rigid: &dyn RigidBody,
    moved: &mut [bool],
) -> Vec<Point> {
    let mut points = mesh.points().to_vec();
    let at = |p: u32| at[p as usize];
    let mut fixed = vec![false; points.len()];
    mesh.boundary().iter().flat_map(|f| f.points).for_each(|p| fixed[p as usize] = true);
    // The shortest way of each point along an edge to the surface.
    let mut ways: Vec<Option<(f64, u32)>> = vec![None; points.len()];
    for &[a, b] in Edges::new(mesh).ends() {
        let Some(share) = crossing(rigid, &at(a), &at(b)) else { continue };
        for (own, other, share) in [(a, b, share), (b, a, 1.0 - share)] {
            let way = &mut ways[own as usize];
            if share <= 0.5 && !fixed[own as usize] && way.is_none_or(|(best, _)| share < best) {
                *way = Some((share, other));
            }
        }
    }
    let mut around: Vec<Vec<u32>> = vec![Vec::new(); points.len()];
    for (t, tet) in mesh.tets().iter().enumerate() {
        tet.iter().for_each(|p| around[*p as usize].push(t as u32));
    }
    let volume = |points: &[Point], t: u32| {
        let [a, b, c, d] = mesh.tets()[t as usize].map(|p| points[p as usize]);
        (b - a).dot(&(c - a).cross(&(d - a)))
    };
    for p in 0..points.len() {
        let Some((share, other)) = ways[p] else { continue };
        let before = points[p];
        let old: Vec<f64> = around[p].iter().map(|t| volume(&points, *t)).collect();
        points[p] += (mesh.points()[other as usize] - mesh.points()[p]) * share;
        let kept = |(t, old): (&u32, &f64)| volume(&points, *t) >= MIN_VOLUME * old;
        if around[p].iter().zip(&old).all(kept) {
            moved[p] = true;
        } else {
            points[p] = before;
        }
    }
    points
}

/// Share of the way from `a` to `b` at which the surface lies, if one of them lies inside and one
/// outside.
fn crossing(rigid: &dyn RigidBody, a: &Point, b: &Point) -> Option<f64> {
    let inside = |p: &Point| rigid.distance(p) <= 0.0;
    let way: Vector = b - a;
    let first = inside(a);
    if first == inside(b) {
        return None;
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if inside(&(a + way * middle)) == first { low = middle } else { high = middle }
    }
    // On the inner side, so that the point counts as held.
    Some(if first { low } else { high })
}
