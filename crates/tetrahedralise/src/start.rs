//! The first mesh: a body-centred cubic lattice cut by the level functions.
//!
//! The lattice is cut by one function after the other with nothing but edge bisection: every edge
//! whose ends differ in sign is split near the root, then the tetrahedra on the positive side are
//! dropped and the faces they leave are tagged. That conforms by construction, makes rims edges of
//! the mesh, and keeps sheets thinner than the lattice, since their two sides are zero sets of
//! different functions.

use crate::boundary::{Boundary, CUT, SKIN, WALL};
use crate::complex::Complex;
use crate::fields::Fields;
use crate::patches::classify;
use crate::shape::det;
use supine_space::{Progress, Stopped, Vector};

/// Roots nearer to an end of an edge than this share are moved, so that no sliver is cut off.
const ROOT_MARGIN: f64 = 0.12;
/// The lattice is shifted by these shares of a cell, so that symmetric shapes hit no node.
const SHIFT: [f64; 3] = [0.137, 0.271, 0.413];
/// A level of exactly 0 at a node becomes this, mm.
const NUDGE_MM: f64 = 1e-6;

/// Tetrahedra of the soft tissue inside the sphere from a lattice with cells of `cell` mm, tagged,
/// largest face-connected part only. `None` when nothing is left. Returns also the number and
/// volume (mm³) of the parts left out.
pub(crate) fn start(
    fields: &Fields,
    cell: f64,
    progress: Progress<'_>,
) -> Result<Option<(Complex, usize, f64)>, Stopped> {
    let (mut mesh, mut levels) = lattice(fields, cell);
    for (n, field) in [CUT, WALL, SKIN].into_iter().enumerate() {
        progress.at(0.25 * (n + 1) as f64)?;
        cut(&mut mesh, &mut levels, fields, field);
    }
    progress.at(0.9)?;
    let (parts, lost) = keep_largest(&mut mesh);
    if mesh.count() == 0 {
        return Ok(None);
    }
    tag_left_over(&mut mesh, fields);
    classify(&mut mesh);
    Ok(Some((mesh.compact(), parts, lost)))
}

/// Nodes of the lattice: corners and centres of cubic cells.
struct Nodes {
    low: Vector,
    cell: f64,
    n: usize,
}

impl Nodes {
    fn corner(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * (self.n + 1) + j) * (self.n + 1) + i
    }

    fn centre(&self, [i, j, k]: [usize; 3]) -> usize {
        (self.n + 1).pow(3) + (k * self.n + j) * self.n + i
    }

    fn position(&self, node: usize) -> Vector {
        let corners = (self.n + 1).pow(3);
        let (n, node, half) =
            if node < corners { (self.n + 1, node, 0.0) } else { (self.n, node - corners, 0.5) };
        let at = [node % n, node / n % n, node / (n * n)];
        self.low + Vector::from_fn(|a, _| (at[a] as f64 + half) * self.cell)
    }
}

/// The tetrahedra of the lattice that may hold soft tissue inside the sphere, and the levels at
/// their vertices.
///
/// A tetrahedron joins two neighbouring cell centres with an edge of the face between the cells.
fn lattice(fields: &Fields, cell: f64) -> (Complex, Vec<[f64; 3]>) {
    let n = (2.0 * fields.radius() / cell).ceil() as usize + 4;
    let low = Vector::from_fn(|a, _| -0.5 * n as f64 * cell + (SHIFT[a] - 0.5) * cell);
    let nodes = Nodes { low, cell, n };
    let total = (n + 1).pow(3) + n.pow(3);
    let mut known: Vec<Option<[f64; 3]>> = vec![None; total];
    let mut number = vec![u32::MAX; total];
    let mut mesh = Complex::default();
    let mut levels = Vec::new();
    let mut level = |node: usize| {
        *known[node].get_or_insert_with(|| {
            fields.levels(&nodes.position(node)).map(|l| if l == 0.0 { NUDGE_MM } else { l })
        })
    };
    for c in 0..n.pow(3) {
        let at = [c % n, c / n % n, c / (n * n)];
        for axis in (0..3).filter(|&a| at[a] + 1 < n) {
            let mut next = at;
            next[axis] += 1;
            let centres = [nodes.centre(at), nodes.centre(next)];
            if centres.iter().all(|&c| level(c)[CUT] > cell) {
                continue;
            }
            let face = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[u, v]| {
                let mut corner = next;
                corner[(axis + 1) % 3] += u;
                corner[(axis + 2) % 3] += v;
                nodes.corner(corner)
            });
            for q in 0..4 {
                let tet = [centres[0], centres[1], face[q], face[(q + 1) % 4]];
                let at = tet.map(&mut level);
                if (0..3).any(|f| at.iter().all(|l| l[f] > 0.0)) {
                    continue;
                }
                let mut corners = tet.map(|node| {
                    if number[node] == u32::MAX {
                        number[node] = mesh.add_vertex(nodes.position(node), 0);
                        levels.push(level(node));
                    }
                    number[node]
                });
                if det(&mesh.corners(corners)) < 0.0 {
                    corners.swap(2, 3);
                }
                mesh.add(corners, [0; 4]);
            }
        }
    }
    (mesh, levels)
}

/// Splits every edge that crosses the zero set of a field, drops what lies outside and tags the
/// faces it leaves.
fn cut(mesh: &mut Complex, levels: &mut Vec<[f64; 3]>, fields: &Fields, field: usize) {
    for [a, b] in mesh.edges() {
        let (la, lb) = (levels[a as usize], levels[b as usize]);
        if la[field] * lb[field] >= 0.0 {
            continue;
        }
        let (pa, pb) = (mesh.points[a as usize], mesh.points[b as usize]);
        let t = root(la[field], lb[field], |t| fields.level(field, &(pa + (pb - pa) * t)));
        let p = pa + (pb - pa) * t;
        let mut level = fields.levels(&p);
        for f in 0..3 {
            if f == field || (la[f] == 0.0 && lb[f] == 0.0) {
                level[f] = 0.0;
            } else if la[f] > 0.0 && lb[f] > 0.0 {
                // Tetrahedra that lie outside at all corners may be gone already: a vertex on
                // one of their edges must not say otherwise.
                level[f] = level[f].max(NUDGE_MM);
            } else if level[f] == 0.0 {
                level[f] = NUDGE_MM;
            }
        }
        mesh.bisect([a, b], p, 0);
        levels.push(level);
    }
    let outside: Vec<u32> = mesh
        .ids()
        .filter(|&id| {
            let at = mesh.tets[id as usize].map(|v| levels[v as usize][field]);
            at.iter().any(|&l| l > 0.0) || at.iter().all(|&l| l == 0.0)
        })
        .collect();
    let mut drop = vec![false; mesh.tets.len()];
    outside.iter().for_each(|&id| drop[id as usize] = true);
    for &id in &outside {
        for corner in 0..4 {
            let Some(other) = mesh.across(id, corner).filter(|&o| !drop[o as usize]) else {
                continue;
            };
            let [a, b, c] = mesh.face(id, corner);
            let far = mesh.tets[other as usize].iter().position(|v| ![a, b, c].contains(v));
            if let Some(far) = far {
                mesh.tags[other as usize][far] = field as u8 + 1;
            }
        }
    }
    outside.into_iter().for_each(|id| mesh.remove(id));
}

/// Where along an edge a level vanishes, given its levels at the ends (of different sign), kept
/// away from the ends.
fn root(from: f64, to: f64, level: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    let mut t = (from / (from - to)).clamp(0.02, 0.98);
    for _ in 0..8 {
        let here = level(t);
        if here.abs() < 1e-2 {
            break;
        }
        if here * from > 0.0 {
            low = t
        } else {
            high = t
        }
        t = 0.5 * (low + high);
    }
    t.clamp(ROOT_MARGIN, 1.0 - ROOT_MARGIN)
}

/// Drops all but the largest part by volume; returns how many parts and what volume went.
pub(crate) fn keep_largest(mesh: &mut Complex) -> (usize, f64) {
    let mut part = vec![u32::MAX; mesh.tets.len()];
    let mut volumes: Vec<f64> = Vec::new();
    let ids: Vec<u32> = mesh.ids().collect();
    for &seed in &ids {
        if part[seed as usize] != u32::MAX {
            continue;
        }
        let number = volumes.len() as u32;
        let mut volume = 0.0;
        let mut stack = vec![seed];
        part[seed as usize] = number;
        while let Some(id) = stack.pop() {
            volume += det(&mesh.corners(mesh.tets[id as usize])) / 6.0;
            for corner in 0..4 {
                if let Some(next) = mesh.across(id, corner)
                    && part[next as usize] == u32::MAX
                {
                    part[next as usize] = number;
                    stack.push(next);
                }
            }
        }
        volumes.push(volume);
    }
    let kept = (0..volumes.len()).max_by(|&a, &b| volumes[a].total_cmp(&volumes[b]));
    let Some(kept) = kept else { return (0, 0.0) };
    for id in ids {
        if part[id as usize] as usize != kept {
            mesh.remove(id);
        }
    }
    (volumes.len() - 1, volumes.iter().sum::<f64>() - volumes[kept])
}

/// Tags boundary faces that no cut has tagged by the field whose zero set is nearest.
fn tag_left_over(mesh: &mut Complex, fields: &Fields) {
    let ids: Vec<u32> = mesh.ids().collect();
    for id in ids {
        for corner in 0..4 {
            if mesh.tags[id as usize][corner] != 0 || mesh.across(id, corner).is_some() {
                continue;
            }
            let face = mesh.face(id, corner).map(|v| mesh.points[v as usize]);
            let level = fields.levels(&(face.iter().sum::<Vector>() / 3.0)).map(f64::abs);
            let nearest = (0..3).min_by(|&a, &b| level[a].total_cmp(&level[b]));
            mesh.tags[id as usize][corner] = nearest.unwrap_or(CUT) as u8 + 1;
        }
    }
}
