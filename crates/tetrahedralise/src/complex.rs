//! Tetrahedra that can be changed one by one, with undo.

use crate::shape::{det, shape};
use supine_space::Vector;

/// The tags a vertex or edge touches, one bit each: 1 skin, 2 chest wall, 4 cut.
///
/// No bit: interior. One: on a surface. Two: on a rim. Three: a corner.
pub(crate) type Class = u8;

/// Corners of the edges of a tetrahedron.
pub(crate) const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// One undoable change.
#[derive(Clone, Debug)]
enum Change {
    Vertex,
    Add(u32),
    Remove { id: u32, tet: [u32; 4], tags: [u8; 4], quality: f64 },
    Move { vertex: u32, from: Vector },
    Quality { id: u32, was: f64 },
}

/// Tetrahedra with positive volume, the tags of their boundary faces, and the tetrahedra at each
/// vertex. Removed tetrahedra and vertices leave holes in the arrays.
#[derive(Clone, Debug, Default)]
pub(crate) struct Complex {
    /// Positions, mm, in the mesher's frame.
    pub points: Vec<Vector>,
    /// Tags at each vertex.
    pub class: Vec<Class>,
    /// Level of each field (skin, wall, sphere) at which a boundary vertex lies, mm.
    pub level: Vec<[f64; 3]>,
    /// Tetrahedra at each vertex; empty when the vertex is gone.
    pub star: Vec<Vec<u32>>,
    /// Corners.
    pub tets: Vec<[u32; 4]>,
    /// Tag of the face opposite each corner: 0 inside, else 1 skin, 2 chest wall, 3 cut.
    pub tags: Vec<[u8; 4]>,
    /// Whether the tetrahedron is there.
    pub live: Vec<bool>,
    /// [`shape`] of each tetrahedron.
    pub quality: Vec<f64>,
    free: Vec<u32>,
    count: usize,
    recording: bool,
    changes: Vec<Change>,
    /// Transaction in which each tetrahedron was last made or changed.
    touched: Vec<u64>,
    transaction: u64,
    before: f64,
}

impl Complex {
    /// Number of tetrahedra.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// A new vertex without tetrahedra.
    pub(crate) fn add_vertex(&mut self, at: Vector, class: Class) -> u32 {
        self.points.push(at);
        self.class.push(class);
        self.level.push([0.0; 3]);
        self.star.push(Vec::new());
        if self.recording {
            self.changes.push(Change::Vertex);
        }
        (self.points.len() - 1) as u32
    }

    /// Positions of a tetrahedron's corners.
    #[inline]
    pub(crate) fn corners(&self, tet: [u32; 4]) -> [Vector; 4] {
        tet.map(|v| self.points[v as usize])
    }

    /// Adds a tetrahedron and returns its number.
    pub(crate) fn add(&mut self, tet: [u32; 4], tags: [u8; 4]) -> u32 {
        let quality = shape(&self.corners(tet));
        let id = self.place(tet, tags, quality);
        if self.recording {
            self.touched[id as usize] = self.transaction;
            self.changes.push(Change::Add(id));
        }
        id
    }

    fn place(&mut self, tet: [u32; 4], tags: [u8; 4], quality: f64) -> u32 {
        let id = match self.free.pop() {
            Some(id) => {
                let n = id as usize;
                (self.tets[n], self.tags[n]) = (tet, tags);
                (self.quality[n], self.live[n]) = (quality, true);
                id
            }
            None => {
                self.tets.push(tet);
                self.tags.push(tags);
                self.quality.push(quality);
                self.live.push(true);
                self.touched.push(0);
                (self.tets.len() - 1) as u32
            }
        };
        for v in tet {
            self.star[v as usize].push(id);
        }
        self.count += 1;
        id
    }

    /// Removes a tetrahedron.
    pub(crate) fn remove(&mut self, id: u32) {
        let n = id as usize;
        if self.recording {
            self.note(n);
            let (tet, tags, quality) = (self.tets[n], self.tags[n], self.quality[n]);
            self.changes.push(Change::Remove { id, tet, tags, quality });
        }
        self.take(id);
    }

    fn take(&mut self, id: u32) {
        let n = id as usize;
        self.live[n] = false;
        self.free.push(id);
        self.count -= 1;
        for v in self.tets[n] {
            let star = &mut self.star[v as usize];
            if let Some(at) = star.iter().position(|&t| t == id) {
                star.swap_remove(at);
            }
        }
    }

    /// Remembers the quality of a tetrahedron that a transaction changes for the first time.
    fn note(&mut self, n: usize) {
        if self.touched[n] != self.transaction {
            self.touched[n] = self.transaction;
            self.before = self.before.min(self.quality[n]);
        }
    }

    /// Moves a vertex.
    pub(crate) fn move_vertex(&mut self, vertex: u32, to: Vector) {
        let v = vertex as usize;
        if self.recording {
            self.changes.push(Change::Move { vertex, from: self.points[v] });
        }
        self.points[v] = to;
        for at in 0..self.star[v].len() {
            let id = self.star[v][at];
            let n = id as usize;
            let quality = shape(&self.corners(self.tets[n]));
            if self.recording {
                self.note(n);
                self.changes.push(Change::Quality { id, was: self.quality[n] });
            }
            self.quality[n] = quality;
        }
    }

    /// Sets the tag of a face.
    pub(crate) fn set_tag(&mut self, id: u32, corner: usize, tag: u8) {
        if self.tags[id as usize][corner] != tag {
            let (tet, mut tags) = (self.tets[id as usize], self.tags[id as usize]);
            tags[corner] = tag;
            self.remove(id);
            self.add(tet, tags);
        }
    }

    /// Splits the edge ab at `p`, whatever comes of it, and returns the new vertex.
    pub(crate) fn bisect(&mut self, [a, b]: [u32; 2], p: Vector, class: Class) -> u32 {
        let ring = self.ring(a, b);
        let v = self.add_vertex(p, class);
        for id in ring {
            let (tet, tags) = (self.tets[id as usize], self.tags[id as usize]);
            self.remove(id);
            for (gone, kept) in [(a, b), (b, a)] {
                let part = tet.map(|w| if w == gone { v } else { w });
                // The face opposite the kept end becomes the inner one between the two parts.
                self.add(part, std::array::from_fn(|c| if tet[c] == kept { 0 } else { tags[c] }));
            }
        }
        v
    }

    /// Starts recording, so that all that follows can be undone.
    pub(crate) fn begin(&mut self) {
        self.transaction += 1;
        self.recording = true;
        self.changes.clear();
        self.before = f64::INFINITY;
    }

    /// Keeps what was done since [`Complex::begin`].
    pub(crate) fn commit(&mut self) {
        self.recording = false;
        self.changes.clear();
    }

    /// Undoes what was done since [`Complex::begin`].
    pub(crate) fn rollback(&mut self) {
        self.recording = false;
        while let Some(change) = self.changes.pop() {
            match change {
                Change::Vertex => {
                    self.points.pop();
                    self.class.pop();
                    self.level.pop();
                    self.star.pop();
                }
                Change::Add(id) => self.take(id),
                Change::Remove { id, tet, tags, quality } => {
                    let again = self.place(tet, tags, quality);
                    debug_assert_eq!(again, id);
                }
                Change::Move { vertex, from } => self.points[vertex as usize] = from,
                Change::Quality { id, was } => self.quality[id as usize] = was,
            }
        }
    }

    /// Worst quality, before and after, of what the running transaction changed.
    pub(crate) fn effect(&self) -> (f64, f64) {
        let quality = |id: u32| self.quality[id as usize];
        (self.before, self.changed().map(quality).fold(f64::INFINITY, f64::min))
    }

    /// The tetrahedra that the running transaction made or changed, some more than once.
    pub(crate) fn changed(&self) -> impl Iterator<Item = u32> + '_ {
        self.changes.iter().filter_map(|change| match *change {
            Change::Add(id) | Change::Quality { id, .. } if self.live[id as usize] => Some(id),
            _ => None,
        })
    }

    /// Tetrahedra at the edge ab.
    pub(crate) fn ring(&self, a: u32, b: u32) -> Vec<u32> {
        let star = &self.star[a as usize];
        star.iter().copied().filter(|&t| self.tets[t as usize].contains(&b)).collect()
    }

    /// Tags of the boundary faces at the edge ab with its tetrahedra `ring`, and their number.
    pub(crate) fn edge_class(&self, ring: &[u32], a: u32, b: u32) -> (Class, usize) {
        let (mut class, mut faces) = (0, 0);
        for &t in ring {
            for (v, tag) in self.tets[t as usize].iter().zip(self.tags[t as usize]) {
                if tag != 0 && *v != a && *v != b {
                    class |= 1 << (tag - 1);
                    faces += 1;
                }
            }
        }
        (class, faces)
    }

    /// Vertices joined to `v`, sorted.
    pub(crate) fn neighbours(&self, v: u32) -> Vec<u32> {
        let tets = self.star[v as usize].iter().flat_map(|&t| self.tets[t as usize]);
        sorted(tets.filter(|&w| w != v).collect())
    }

    /// Vertices joined to `v` by a boundary edge, sorted.
    pub(crate) fn boundary_neighbours(&self, v: u32) -> Vec<u32> {
        let mut neighbours = Vec::new();
        for (tet, face) in self.boundary_faces(v) {
            let corners = self.tets[tet as usize];
            let others = (0..4).filter(|&c| c != face).map(|c| corners[c]);
            neighbours.extend(others.filter(|&w| w != v));
        }
        sorted(neighbours)
    }

    /// Boundary faces at `v`: tetrahedron, and the corner opposite the face.
    pub(crate) fn boundary_faces(&self, v: u32) -> impl Iterator<Item = (u32, usize)> + '_ {
        self.star[v as usize].iter().flat_map(move |&t| {
            (0..4).filter_map(move |c| {
                let n = t as usize;
                (self.tags[n][c] != 0 && self.tets[n][c] != v).then_some((t, c))
            })
        })
    }

    /// The tetrahedron across the face opposite corner `corner`.
    pub(crate) fn across(&self, id: u32, corner: usize) -> Option<u32> {
        let [a, b, c] = self.face(id, corner);
        self.star[a as usize].iter().copied().find(|&t| {
            let tet = &self.tets[t as usize];
            t != id && tet.contains(&b) && tet.contains(&c)
        })
    }

    /// Corners of the face opposite `corner`, outwards.
    pub(crate) fn face(&self, id: u32, corner: usize) -> [u32; 3] {
        supine_mesh::TET_FACES[corner].map(|c| self.tets[id as usize][c])
    }

    /// Which corner of a tetrahedron a vertex is.
    pub(crate) fn corner_of(&self, id: u32, v: u32) -> usize {
        self.tets[id as usize].iter().position(|&w| w == v).unwrap_or(0)
    }

    /// Volume of all, mm³.
    pub(crate) fn volume(&self) -> f64 {
        self.ids().map(|t| det(&self.corners(self.tets[t as usize])) / 6.0).sum()
    }

    /// Worst quality among the tetrahedra.
    pub(crate) fn worst_of(&self, tets: &[u32]) -> f64 {
        tets.iter().map(|&t| self.quality[t as usize]).fold(f64::INFINITY, f64::min)
    }

    /// Worst quality of all.
    pub(crate) fn worst(&self) -> f64 {
        self.ids().map(|t| self.quality[t as usize]).fold(f64::INFINITY, f64::min)
    }

    /// The tetrahedra that are there.
    pub(crate) fn ids(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.tets.len() as u32).filter(|&t| self.live[t as usize])
    }

    /// All edges, lower vertex first, sorted.
    pub(crate) fn edges(&self) -> Vec<[u32; 2]> {
        let mut edges: Vec<[u32; 2]> = Vec::with_capacity(6 * self.count);
        for id in self.ids() {
            let tet = self.tets[id as usize];
            edges.extend(EDGES.map(|[a, b]| [tet[a].min(tet[b]), tet[a].max(tet[b])]));
        }
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    /// Length of an edge, mm.
    pub(crate) fn length(&self, [a, b]: [u32; 2]) -> f64 {
        (self.points[a as usize] - self.points[b as usize]).norm()
    }

    /// Middle of an edge, mm.
    pub(crate) fn middle(&self, [a, b]: [u32; 2]) -> Vector {
        (self.points[a as usize] + self.points[b as usize]) * 0.5
    }

    /// The same tetrahedra without holes in the arrays.
    pub(crate) fn compact(&self) -> Self {
        let mut number = vec![u32::MAX; self.points.len()];
        let mut whole = Self::default();
        for v in (0..self.points.len()).filter(|&v| !self.star[v].is_empty()) {
            number[v] = whole.add_vertex(self.points[v], self.class[v]);
            whole.level[number[v] as usize] = self.level[v];
        }
        for id in self.ids() {
            let n = id as usize;
            whole.add(self.tets[n].map(|v| number[v as usize]), self.tags[n]);
        }
        whole
    }
}

fn sorted(mut vertices: Vec<u32>) -> Vec<u32> {
    vertices.sort_unstable();
    vertices.dedup();
    vertices
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rollback_restores_everything() {
        let mut c = Complex::default();
        for p in [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [1., 1., 1.]] {
            c.add_vertex(Vector::from(p), 1);
        }
        let first = c.add([0, 1, 2, 3], [0, 1, 1, 1]);
        c.add([1, 4, 2, 3], [1, 0, 1, 1]);
        let (tets, quality) = (c.tets.clone(), c.quality.clone());
        c.begin();
        c.remove(first);
        let v = c.add_vertex(Vector::new(0.1, 0.1, 0.1), 0);
        let low = c.add([v, 1, 2, 3], [0; 4]);
        c.add([0, 1, 2, v], [0; 4]);
        c.move_vertex(v, Vector::new(0.2, 0.2, 0.2));
        c.move_vertex(4, Vector::new(2.0, 1.0, 1.0));
        c.remove(low);
        let (before, after) = c.effect();
        assert!((before - quality[0].min(quality[1])).abs() < 1e-15);
        assert!(after.is_finite());
        c.rollback();
        assert_eq!(&c.tets[..2], &tets[..]);
        assert_eq!(&c.quality[..2], &quality[..]);
        assert_eq!((c.count(), c.points.len()), (2, 5));
        let mut star = c.star[1].clone();
        star.sort_unstable();
        assert_eq!(star, vec![0, 1]);
    }
}
