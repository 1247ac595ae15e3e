//! The map as straight pieces: the mesh itself, or a conforming subdivision of it that
//! follows a quadratic displacement to a tolerance.

use crate::slid::on_slid_wall;
use rayon::prelude::*;
use std::cmp::Ordering;
use supine_mesh::{BoundaryTag, Displacement, Edges, Order, TET_EDGES, TetMesh};
use supine_space::{Point, Progress, Stopped, Vector};

/// Where a piece lies: its tetrahedron, and the barycentric coordinates of its corners therein
/// (multiples of powers of a half, exact in f32).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Parent {
    pub(crate) tet: u32,
    pub(crate) corners: [[f32; 4]; 4],
}

const WHOLE: [[f32; 4]; 4] =
    [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];

/// Tetrahedra that are straight in the CT and after deformation.
#[derive(Clone, Debug)]
pub(crate) struct Pieces {
    /// Vertices in the CT, LPS, mm.
    pub(crate) rest: Vec<Point>,
    /// Their displacement, mm.
    pub(crate) displacement: Vec<Vector>,
    pub(crate) tets: Vec<[u32; 4]>,
    pub(crate) parents: Vec<Parent>,
    /// Skin faces, outwards.
    pub(crate) skin: Vec<[u32; 3]>,
    /// Whether what a tetrahedron of the mesh leaves stays as it is: see [`crate::slid`].
    pub(crate) stays: Option<Vec<bool>>,
    /// The tolerance that was kept (mm), when the one asked for would have taken too many pieces.
    pub(crate) missed_mm: Option<f64>,
}

/// The position error within a tetrahedron is at most this times the largest bulge of its edges:
/// the error is Σ 4 l_a l_b bulge_ab, six terms of which each is largest at l = 1/4.
const ERROR_PER_BULGE: f64 = 1.5;
/// More pieces are not made: about 200 MB.
pub(crate) const MAX_PIECES: usize = 1_000_000;
/// Halvings of an edge; each divides the bulge by 4, so that metres become micrometres.
const MAX_ROUNDS: usize = 10;

impl Pieces {
    /// The map of a mesh under its displacement, in pieces that miss it by `tolerance_mm` at most.
    ///
    /// Every edge whose middle strays too far from its chord is halved, together with all
    /// tetrahedra around it, longest edges first. The choice is made once per edge, so that two
    /// tetrahedra always agree on the face they share and no crack opens. Where there would be too
    /// many pieces the tolerance is doubled until they fit.
    pub(crate) fn new(
        curve: &Curve<'_>,
        tolerance_mm: f64,
        progress: Progress<'_>,
    ) -> Result<Self, Stopped> {
        Self::at_most(MAX_PIECES, curve, tolerance_mm, progress)
    }

    pub(crate) fn at_most(
        max_pieces: usize,
        curve: &Curve<'_>,
        tolerance_mm: f64,
        progress: Progress<'_>,
    ) -> Result<Self, Stopped> {
        let mut pieces = Self::whole(curve);
        pieces.refine(max_pieces, curve, tolerance_mm, |_| true, progress)?;
        Ok(pieces)
    }

    /// The tetrahedra as they are.
    fn whole(curve: &Curve<'_>) -> Self {
        let Curve { mesh, displacement, .. } = curve;
        let points = mesh.points().len();
        let skin = mesh.boundary().iter().filter(|f| f.tag == BoundaryTag::Skin);
        Self {
            rest: mesh.points().to_vec(),
            displacement: displacement.values()[..points].to_vec(),
            tets: mesh.tets().to_vec(),
            parents: (0..mesh.tets().len())
                .map(|tet| Parent { tet: tet as u32, corners: WHOLE })
                .collect(),
            skin: skin.map(|f| f.points).collect(),
            stays: on_slid_wall(mesh, displacement),
            missed_mm: None,
        }
    }

    /// Gives all vertices the displacement of another curve of the same mesh.
    pub(crate) fn take(&mut self, curve: &Curve<'_>) {
        let Curve { mesh, edges, displacement } = curve;
        let mut due = vec![true; self.rest.len()];
        for (corners, parent) in self.tets.iter().zip(&self.parents) {
            for (vertex, place) in corners.iter().zip(&parent.corners) {
                let vertex = *vertex as usize;
                if std::mem::take(&mut due[vertex]) {
                    let place = place.map(f64::from);
                    self.displacement[vertex] =
                        displacement.at(mesh, edges, parent.tet as usize, place);
                }
            }
        }
    }

    /// Halves edges until the pieces of the tetrahedra that `matter` miss the displacement, which
    /// they have, by `tolerance_mm` at most; whether any was halved.
    pub(crate) fn refine(
        &mut self,
        max_pieces: usize,
        curve: &Curve<'_>,
        tolerance_mm: f64,
        matter: impl Fn(usize) -> bool + Sync,
        progress: Progress<'_>,
    ) -> Result<bool, Stopped> {
        if curve.displacement.order() == Order::Linear {
            return Ok(false);
        }
        let (mut fresh, mut tolerance) = (0, tolerance_mm);
        for round in 0..MAX_ROUNDS {
            progress.at(round as f64 / MAX_ROUNDS as f64)?;
            let (mut ids, mut halvings) = self.marked(curve, tolerance, &matter, fresh);
            while children(&ids) > max_pieces {
                tolerance *= 2.0;
                self.missed_mm = Some(tolerance);
                (ids, halvings) = self.marked(curve, tolerance, &matter, fresh);
            }
            if halvings.is_empty() {
                return Ok(round > 0);
            }
            fresh = self.rest.len() as u32;
            self.halve(&ids, &halvings);
        }
        Ok(true)
    }

    /// The edges that bulge too much, among those with a vertex of `fresh` or higher: all others
    /// were looked at before and stay as they were judged. Returns for the six edges of each
    /// tetrahedron their places in the list of halvings (or `NONE`), and the halvings.
    fn marked(
        &self,
        curve: &Curve<'_>,
        tolerance_mm: f64,
        matter: impl Fn(usize) -> bool + Sync,
        fresh: u32,
    ) -> (Vec<u32>, Vec<Halving>) {
        let of_tet = |(tet, corners): (usize, &[u32; 4])| {
            let corners = *corners;
            TET_EDGES.into_iter().enumerate().filter_map(move |(edge, [a, b])| {
                let (a, b) = (corners[a], corners[b]);
                let key = u64::from(a.min(b)) << 32 | u64::from(a.max(b));
                (a.max(b) >= fresh).then_some((key, (6 * tet + edge) as u32))
            })
        };
        let mut edges: Vec<(u64, u32)> =
            self.tets.par_iter().enumerate().flat_map_iter(of_tet).collect();
        edges.par_sort_unstable();
        let halving = |same: &[(u64, u32)]| {
            let (key, first) = same[0];
            let ends = [(key >> 32) as u32, key as u32];
            let parent = &self.parents[first as usize / 6];
            if !same.iter().any(|(_, at)| matter(self.parents[*at as usize / 6].tet as usize)) {
                return None;
            }
            let [a, b] = TET_EDGES[first as usize % 6].map(|c| parent.corners[c]);
            let bulge = curve.bulge(parent.tet as usize, difference(a, b));
            if curve.error_mm(&bulge) <= tolerance_mm {
                return None;
            }
            let [p, q] = ends.map(|v| v as usize);
            let chord = self.rest[q] - self.rest[p];
            Some(Halving {
                ends,
                middle: self.rest[p] + chord * 0.5,
                displacement: (self.displacement[p] + self.displacement[q]) * 0.5 + bulge,
                length: chord.norm(),
                vertex: NONE,
            })
        };
        let halvings: Vec<(Halving, &[(u64, u32)])> = edges
            .par_chunk_by(|x, y| x.0 == y.0)
            .filter_map(|same| Some((halving(same)?, same)))
            .collect();
        let mut ids = vec![NONE; 6 * self.tets.len()];
        for (n, (_, same)) in halvings.iter().enumerate() {
            same.iter().for_each(|(_, at)| ids[*at as usize] = n as u32);
        }
        (ids, halvings.into_iter().map(|(halving, _)| halving).collect())
    }

    /// Halves edges and all that hangs on them.
    fn halve(&mut self, ids: &[u32], halvings: &[Halving]) {
        let mut halvings = halvings.to_vec();
        for halving in &mut halvings {
            halving.vertex = self.rest.len() as u32;
            self.rest.push(halving.middle);
            self.displacement.push(halving.displacement);
        }
        let split = |(tet, corners): (usize, &[u32; 4])| {
            let here = ids[6 * tet..6 * tet + 6].iter().filter(|&&id| id != NONE);
            let mut here: Vec<Halving> = here.map(|&id| halvings[id as usize]).collect();
            here.sort_by(Halving::order);
            let (parent, mut own) = (self.parents[tet], Vec::with_capacity(8));
            split_tet(*corners, parent.corners, &here, &mut |corners, place| {
                own.push((corners, Parent { tet: parent.tet, corners: place }));
            });
            own
        };
        let (tets, parents) = self.tets.par_iter().enumerate().flat_map_iter(split).unzip();
        let mut skin = Vec::new();
        for face in &self.skin {
            let edges = [(0, 1), (1, 2), (2, 0)].map(|(a, b)| (face[a], face[b]));
            let find = |(a, b): (u32, u32)| {
                let key = [a.min(b), a.max(b)];
                halvings.binary_search_by(|h| h.ends.cmp(&key)).ok().map(|n| halvings[n])
            };
            let mut here: Vec<Halving> = edges.into_iter().filter_map(find).collect();
            here.sort_by(Halving::order);
            split_face(*face, &here, &mut skin);
        }
        (self.tets, self.parents, self.skin) = (tets, parents, skin);
    }
}

/// a - b, exact: multiples of powers of a half.
pub(crate) fn difference(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    [0, 1, 2, 3].map(|c| a[c] - b[c])
}

const NONE: u32 = u32::MAX;

/// At most so many tetrahedra come of the marked edges: 2 of one, 4 of two, 8 of more.
fn children(ids: &[u32]) -> usize {
    let marks = ids.chunks_exact(6).map(|tet| tet.iter().filter(|&&id| id != NONE).count());
    marks.map(|n| 1 << n.min(3)).sum()
}

/// An edge to be halved.
#[derive(Clone, Copy, Debug)]
struct Halving {
    ends: [u32; 2],
    middle: Point,
    displacement: Vector,
    length: f64,
    vertex: u32,
}

impl Halving {
    /// Longest first; the same order for all tetrahedra around an edge.
    fn order(&self, other: &Self) -> Ordering {
        other.length.total_cmp(&self.length).then(self.ends.cmp(&other.ends))
    }

    fn place<const N: usize>(&self, corners: [u32; N]) -> Option<[usize; 2]> {
        let at = |v: u32| corners.iter().position(|&c| c == v);
        Some([at(self.ends[0])?, at(self.ends[1])?])
    }
}

/// Halves a tetrahedron at the first halving that concerns it, and its halves at the others.
fn split_tet(
    corners: [u32; 4],
    place: [[f32; 4]; 4],
    halvings: &[Halving],
    keep: &mut impl FnMut([u32; 4], [[f32; 4]; 4]),
) {
    let halving = halvings.iter().enumerate().find_map(|(n, h)| Some((n, h.place(corners)?)));
    let Some((n, [a, b])) = halving else { return keep(corners, place) };
    let middle = [0, 1, 2, 3].map(|c| 0.5 * (place[a][c] + place[b][c]));
    for end in [b, a] {
        let (mut corners, mut place) = (corners, place);
        corners[end] = halvings[n].vertex;
        place[end] = middle;
        split_tet(corners, place, &halvings[n + 1..], keep);
    }
}

/// As [`split_tet`], for a face.
fn split_face(corners: [u32; 3], halvings: &[Halving], keep: &mut Vec<[u32; 3]>) {
    let halving = halvings.iter().enumerate().find_map(|(n, h)| Some((n, h.place(corners)?)));
    let Some((n, ends)) = halving else { return keep.push(corners) };
    for end in [ends[1], ends[0]] {
        let mut corners = corners;
        corners[end] = halvings[n].vertex;
        split_face(corners, &halvings[n + 1..], keep);
    }
}

/// A mesh and its displacement, to be followed by pieces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Curve<'a> {
    pub(crate) mesh: &'a TetMesh,
    pub(crate) edges: &'a Edges,
    pub(crate) displacement: &'a Displacement,
}

impl Curve<'_> {
    /// The position error within a piece whose edges bulge by this at most, mm.
    pub(crate) fn error_mm(&self, bulge: &Vector) -> f64 {
        ERROR_PER_BULGE * bulge.norm()
    }

    /// u(middle) - (u(a) + u(b)) / 2 of a straight edge in tetrahedron `tet`, mm.
    ///
    /// The second difference of the quadratic along d = a - b in barycentric coordinates:
    /// -(½ Σ d_c² u_c + Σ d_c d_e u_ce) over corners c and edges ce.
    pub(crate) fn bulge(&self, tet: usize, d: [f32; 4]) -> Vector {
        let d = d.map(f64::from);
        let values = self.displacement.values();
        let points = self.mesh.points().len();
        let mut sum = Vector::zeros();
        for (c, point) in self.mesh.tets()[tet].into_iter().enumerate() {
            sum += values[point as usize] * (0.5 * d[c] * d[c]);
        }
        for ([c, e], side) in TET_EDGES.into_iter().zip(self.edges.of_tets()[tet]) {
            sum += values[points + side as usize] * (d[c] * d[e]);
        }
        -sum
    }
}
