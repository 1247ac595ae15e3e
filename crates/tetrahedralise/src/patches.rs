//! Patches of one tag that are too small for the elements.
//!
//! Where the sphere just grazes the skin, or a rib just shows, the cut leaves patches smaller than
//! one face of the mesh, whose rims could be kept only with splinters. They join their neighbour.

use crate::complex::Complex;
use crate::mesher::Mesher;
use supine_space::Vector;

/// Patches smaller than this share of the squared wanted edge length join their neighbour.
const SMALL: f64 = 0.5;
/// Joining may leave patches small in turn; so often is looked again.
const PASSES: usize = 3;

/// A connected piece of the boundary with one tag.
#[derive(Clone, Debug, Default)]
struct Patch {
    tag: u8,
    area: f64,
    /// Area-weighted middle, times the area.
    moment: Vector,
    /// Length of its border with each tag.
    border: [f64; 4],
}

impl Mesher<'_> {
    /// Lets small patches join the neighbour with which they share the longest rim. Returns how
    /// many did.
    pub(crate) fn join_small_patches(&mut self) -> usize {
        let mut joined = 0;
        for _ in 0..PASSES {
            let faces: Vec<(u32, usize)> = boundary(&self.mesh);
            let (of_face, patches) = patches(&self.mesh, &faces);
            let becomes: Vec<u8> = patches.iter().map(|p| self.becomes(p)).collect();
            let small = patches.iter().zip(&becomes).filter(|(p, b)| p.tag != **b).count();
            if small == 0 {
                break;
            }
            joined += small;
            for (&(id, corner), patch) in faces.iter().zip(of_face) {
                self.mesh.tags[id as usize][corner] = becomes[patch];
            }
            classify(&mut self.mesh);
        }
        joined
    }

    /// The tag a patch takes: its own, or when it is small the one along its longest border.
    fn becomes(&self, patch: &Patch) -> u8 {
        let size = self.sizing.at(&(patch.moment / patch.area.max(1e-12))).max(self.sizing.base);
        let longest = (1..4).max_by(|&a, &b| patch.border[a].total_cmp(&patch.border[b]));
        match longest {
            Some(tag) if patch.area < SMALL * size * size && patch.border[tag] > 0.0 => tag as u8,
            _ => patch.tag,
        }
    }
}

fn boundary(mesh: &Complex) -> Vec<(u32, usize)> {
    let tagged = |id: u32| (0..4).filter(move |&c| mesh.tags[id as usize][c] != 0);
    mesh.ids().flat_map(|id| tagged(id).map(move |c| (id, c))).collect()
}

/// The patch of each face, and the patches.
fn patches(mesh: &Complex, faces: &[(u32, usize)]) -> (Vec<usize>, Vec<Patch>) {
    let mut sides: Vec<([u32; 2], usize)> = Vec::with_capacity(3 * faces.len());
    for (n, &(id, corner)) in faces.iter().enumerate() {
        let [a, b, c] = mesh.face(id, corner);
        sides.extend([[a, b], [b, c], [a, c]].map(|[p, q]| ([p.min(q), p.max(q)], n)));
    }
    sides.sort_unstable();
    let pairs: Vec<([u32; 2], usize, usize)> =
        sides.windows(2).filter(|w| w[0].0 == w[1].0).map(|w| (w[0].0, w[0].1, w[1].1)).collect();
    let tag = |n: usize| mesh.tags[faces[n].0 as usize][faces[n].1];
    let mut parent: Vec<usize> = (0..faces.len()).collect();
    for &(_, m, n) in pairs.iter().filter(|p| tag(p.1) == tag(p.2)) {
        let (m, n) = (find(&mut parent, m), find(&mut parent, n));
        parent[m.max(n)] = m.min(n);
    }
    let roots: Vec<usize> = (0..faces.len()).map(|n| find(&mut parent, n)).collect();
    let mut number = vec![usize::MAX; faces.len()];
    let mut patches: Vec<Patch> = Vec::new();
    for (n, &root) in roots.iter().enumerate() {
        if number[root] == usize::MAX {
            number[root] = patches.len();
            patches.push(Patch { tag: tag(n), ..Patch::default() });
        }
        let patch = &mut patches[number[root]];
        let [a, b, c] = mesh.face(faces[n].0, faces[n].1).map(|v| mesh.points[v as usize]);
        let area = 0.5 * (b - a).cross(&(c - a)).norm();
        patch.area += area;
        patch.moment += (a + b + c) / 3.0 * area;
    }
    let of_face: Vec<usize> = roots.iter().map(|&r| number[r]).collect();
    for (edge, m, n) in pairs {
        if tag(m) != tag(n) {
            let length = mesh.length(edge);
            patches[of_face[m]].border[usize::from(tag(n))] += length;
            patches[of_face[n]].border[usize::from(tag(m))] += length;
        }
    }
    (of_face, patches)
}

/// The representative of a set, with the path to it halved.
fn find(parent: &mut [usize], mut n: usize) -> usize {
    while parent[n] != n {
        parent[n] = parent[parent[n]];
        n = parent[n];
    }
    n
}

/// Gives each vertex the tags of its boundary faces.
pub(crate) fn classify(mesh: &mut Complex) {
    mesh.class.fill(0);
    for (id, corner) in boundary(mesh) {
        let tag = mesh.tags[id as usize][corner];
        for v in mesh.face(id, corner) {
            mesh.class[v as usize] |= 1 << (tag - 1);
        }
    }
}
