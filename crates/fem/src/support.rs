//! What is held.

use crate::sliding_wall::slides;
use crate::{Cut, Error, SlidingArea};
use supine_mesh::{BoundaryTag, Edges, TetMesh};

/// Whether each node is held: chest wall, but for where it slides, and the cut when it is fixed.
///
/// A mid-side is held when its edge belongs to a held face; an edge that only joins two held points
/// stays free.
pub(crate) fn held_nodes(
    mesh: &TetMesh,
    edges: &Edges,
    nodes: usize,
    (cut, sliding): (Cut, Option<&SlidingArea>),
) -> Vec<bool> {
    let points = mesh.points().len();
    let mut held = vec![false; nodes];
    for face in mesh.boundary() {
        let holds = match face.tag {
            BoundaryTag::ChestWall => {
                let corners = face.points.map(|p| mesh.points()[p as usize]);
                !sliding.is_some_and(|sliding| slides(sliding, corners))
            }
            BoundaryTag::Cut => cut == Cut::Fixed,
            BoundaryTag::Skin => false,
        };
        if !holds {
            continue;
        }
        let [a, b, c] = face.points;
        face.points.into_iter().for_each(|p| held[p as usize] = true);
        if nodes > points {
            for (a, b) in [(a, b), (b, c), (a, c)] {
                if let Some(edge) = edges.between(a, b) {
                    held[points + edge as usize] = true;
                }
            }
        }
    }
    held
}

/// Checks that every part of the mesh hangs on at least three points that are held, or that slide
/// on the chest wall and are brought back by friction there or by springs at the cut.
///
/// # Errors
/// [`Error::NoSupport`], or [`Error::NothingFree`] when no node is left to move.
pub(crate) fn check_support(
    mesh: &TetMesh,
    held: &[bool],
    (cut, sliding): (Cut, Option<&SlidingArea>),
) -> Result<(), Error> {
    let part = parts(mesh);
    let mut hung = held.to_vec();
    if let Some(sliding) = sliding
        && (sliding.stiffness_kpa_mm > 0.0 || cut == Cut::Spring)
    {
        let wall = mesh.boundary().iter().filter(|face| face.tag == BoundaryTag::ChestWall);
        wall.flat_map(|face| face.points).for_each(|p| hung[p as usize] = true);
    }
    let mut holds = vec![0; mesh.points().len()];
    for (point, &root) in part.iter().enumerate() {
        holds[root] += usize::from(hung[point]);
    }
    let loose: Vec<usize> =
        (0..mesh.tets().len()).filter(|&t| holds[part[mesh.tets()[t][0] as usize]] < 3).collect();
    if let Some(&tet) = loose.first() {
        return Err(Error::NoSupport { tets: loose.len(), of: mesh.tets().len(), tet });
    }
    if held.iter().all(|&h| h) { Err(Error::NothingFree) } else { Ok(()) }
}

/// The connected part of each point, named by its lowest point.
fn parts(mesh: &TetMesh) -> Vec<usize> {
    fn root(parent: &mut [usize], mut p: usize) -> usize {
        while parent[p] != p {
            parent[p] = parent[parent[p]];
            p = parent[p];
        }
        p
    }
    let mut parent: Vec<usize> = (0..mesh.points().len()).collect();
    for [first, rest @ ..] in mesh.tets() {
        for other in rest {
            let (a, b) = (root(&mut parent, *first as usize), root(&mut parent, *other as usize));
            let (low, high) = (a.min(b), a.max(b));
            parent[high] = low;
        }
    }
    (0..parent.len()).map(|p| root(&mut parent, p)).collect()
}
