//! What a mesh under work must be at any time.

use crate::complex::Complex;
use crate::shape::shape;
use std::collections::BTreeMap;

/// Faults of a tagged complex: tetrahedra without volume or with a stale quality, vertices that do
/// not know their tetrahedra, faces shared by more than two, faces whose tag and place disagree,
/// and a boundary that is pinched at an edge or a vertex or lacks the classes of its tags.
pub(crate) fn faults(mesh: &Complex) -> Vec<String> {
    let mut faults = Vec::new();
    let mut faces: BTreeMap<[u32; 3], usize> = BTreeMap::new();
    let mut boundary: Vec<[u32; 3]> = Vec::new();
    for id in mesh.ids() {
        let (tet, quality) = (mesh.tets[id as usize], mesh.quality[id as usize]);
        if quality <= 0.0 || quality != shape(&mesh.corners(tet)) {
            faults
                .push(format!("tetrahedron {id} is flat, inverted or not what it was: {quality}"));
        }
        if tet.iter().any(|&v| !mesh.star[v as usize].contains(&id)) {
            faults.push(format!("a corner of tetrahedron {id} does not know it"));
        }
        for corner in 0..4 {
            let (tag, face) = (mesh.tags[id as usize][corner], mesh.face(id, corner));
            let mut key = face;
            key.sort_unstable();
            *faces.entry(key).or_default() += 1;
            if (tag != 0) == mesh.across(id, corner).is_some() {
                faults.push(format!("face {face:?} has tag {tag}"));
            }
            if tag != 0 {
                boundary.push(face);
                if face.iter().any(|&v| mesh.class[v as usize] >> (tag - 1) & 1 == 0) {
                    faults.push(format!("face {face:?} lacks the class of tag {tag}"));
                }
            }
        }
    }
    let crowded = faces.iter().filter(|(_, n)| **n > 2);
    faults.extend(crowded.map(|(face, n)| format!("face {face:?} is used {n} times")));
    let stars: usize = mesh.star.iter().map(Vec::len).sum();
    if mesh.ids().count() != mesh.count() || stars != 4 * mesh.count() {
        faults.push(format!("{} tetrahedra are counted, {stars} / 4 known", mesh.count()));
    }
    faults.extend(pinches(&boundary));
    faults
}

/// Edges of the boundary that do not have two faces, and vertices with more than one fan of them.
fn pinches(boundary: &[[u32; 3]]) -> Vec<String> {
    let mut edges: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    let mut fans: BTreeMap<u32, Vec<[u32; 2]>> = BTreeMap::new();
    for &[a, b, c] in boundary {
        for [p, q, r] in [[a, b, c], [b, c, a], [c, a, b]] {
            *edges.entry([p.min(q), p.max(q)]).or_default() += 1;
            fans.entry(r).or_default().push([p, q]);
        }
    }
    let open = edges.iter().filter(|(_, n)| **n != 2);
    let mut faults: Vec<String> = open.map(|(e, n)| format!("edge {e:?} has {n} faces")).collect();
    for (v, sides) in fans {
        // The sides opposite v, one after the other, must close in one loop over all of them.
        let (start, mut here, mut steps) = (sides[0][0], sides[0][1], 1);
        while here != start && steps <= sides.len() {
            let Some(next) = sides.iter().find(|side| side[0] == here) else { break };
            (here, steps) = (next[1], steps + 1);
        }
        if here != start || steps != sides.len() {
            faults.push(format!("the boundary is pinched at vertex {v}"));
        }
    }
    faults
}

/// Euler number of the boundary.
pub(crate) fn euler(mesh: &Complex) -> i64 {
    let (mut edges, mut points, mut faces) = (Vec::new(), Vec::new(), 0);
    for id in mesh.ids() {
        for corner in (0..4).filter(|&c| mesh.tags[id as usize][c] != 0) {
            let [a, b, c] = mesh.face(id, corner);
            edges.extend([[a, b], [b, c], [a, c]].map(|[p, q]| [p.min(q), p.max(q)]));
            points.extend([a, b, c]);
            faces += 1;
        }
    }
    edges.sort_unstable();
    edges.dedup();
    points.sort_unstable();
    points.dedup();
    points.len() as i64 - edges.len() as i64 + faces
}
