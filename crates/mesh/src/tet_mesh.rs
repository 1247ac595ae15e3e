//! The tetrahedral mesh.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use supine_space::{Failure, Point, Vector};

/// What a boundary face is part of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum BoundaryTag {
    /// Soft tissue against air: free.
    Skin,
    /// Soft tissue against the rigid chest wall: held.
    ChestWall,
    /// The sphere that bounds the region, within the soft tissue.
    Cut,
}

impl BoundaryTag {
    /// All tags in order of their number in files.
    pub const ALL: [Self; 3] = [Self::Skin, Self::ChestWall, Self::Cut];

    /// Number in files: 1 skin, 2 chest wall, 3 cut.
    pub fn number(self) -> u8 {
        match self {
            Self::Skin => 1,
            Self::ChestWall => 2,
            Self::Cut => 3,
        }
    }

    /// The tag of a number in files.
    pub fn from_number(number: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|t| t.number() == number)
    }

    /// Name in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Skin => "skin",
            Self::ChestWall => "chest_wall",
            Self::Cut => "cut",
        }
    }
}

/// A triangle of the boundary; counter-clockwise seen from outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoundaryFace {
    /// Points, as indices into the mesh.
    pub points: [u32; 3],
    /// What it is part of.
    pub tag: BoundaryTag,
}

/// The faces of a positive tetrahedron, each counter-clockwise seen from outside; face f lies
/// opposite corner f.
pub const TET_FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// Tetrahedra with a closed, tagged boundary; points in LPS, mm.
///
/// Every tetrahedron has positive volume, every point is used, and the boundary faces are exactly
/// the faces that belong to one tetrahedron.
#[derive(Clone, Debug, PartialEq)]
pub struct TetMesh {
    points: Vec<Point>,
    tets: Vec<[u32; 4]>,
    boundary: Vec<BoundaryFace>,
    id: MeshId,
}

/// Which mesh something belongs to: equal for the same points and tetrahedra in the same order,
/// whatever the boundary faces are part of. Only for comparisons within a process.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MeshId(u64);

impl MeshId {
    fn of(points: &[Point], tets: &[[u32; 4]]) -> Self {
        let mut hasher = DefaultHasher::new();
        points.len().hash(&mut hasher);
        // Adding 0 makes -0 the same as 0, as in comparisons of points.
        let bits = points.iter().flat_map(|p| p.coords.iter().map(|c| (c + 0.0).to_bits()));
        bits.for_each(|bits| hasher.write_u64(bits));
        tets.as_flattened().hash(&mut hasher);
        Self(hasher.finish())
    }
}

/// Why a mesh cannot be.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// No tetrahedra.
    #[error("the mesh has no tetrahedra")]
    Empty,
    /// A coordinate is not finite.
    #[error("point {0} of the mesh is not finite")]
    Point(usize),
    /// A point is in no tetrahedron.
    #[error("point {0} of the mesh belongs to no tetrahedron")]
    Unused(usize),
    /// An index leads nowhere.
    #[error("{what} {at} of the mesh names point {point}, but there are only {points}")]
    Index {
        /// `tetrahedron` or `boundary face`.
        what: &'static str,
        /// Which one.
        at: usize,
        /// The index.
        point: u32,
        /// Number of points.
        points: usize,
    },
    /// A tetrahedron is flat or inverted.
    #[error("tetrahedron {tet} of the mesh is flat or inverted (volume {volume:.1e} mm³)")]
    Volume {
        /// Which one.
        tet: usize,
        /// Signed volume, mm³.
        volume: f64,
    },
    /// A face belongs to more than two tetrahedra.
    #[error("the face {0:?} of the mesh belongs to more than two tetrahedra")]
    Shared([u32; 3]),
    /// The tagged faces are not the boundary.
    #[error(
        "the boundary faces of the mesh do not match its tetrahedra: {untagged} faces without a \
         tag, {foreign} tagged faces that are not on the boundary"
    )]
    Boundary {
        /// Boundary faces without a tag.
        untagged: usize,
        /// Tagged faces that are not on the boundary.
        foreign: usize,
    },
}

impl MeshError {
    /// What kind of failure this is.
    pub fn kind(&self) -> Failure {
        Failure::Input
    }
}

/// Sorted points of a face: its name whatever its orientation.
fn face_key(mut face: [u32; 3]) -> [u32; 3] {
    face.sort_unstable();
    face
}

impl TetMesh {
    /// A mesh from its points (LPS, mm), tetrahedra (positive) and tagged boundary faces (any
    /// orientation; they are turned outwards).
    ///
    /// # Errors
    /// When one of the invariants of the type does not hold; the error names the first offender.
    pub fn new(
        points: Vec<Point>,
        tets: Vec<[u32; 4]>,
        boundary: Vec<BoundaryFace>,
    ) -> Result<Self, MeshError> {
        if tets.is_empty() {
            return Err(MeshError::Empty);
        }
        if let Some(n) = points.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
            return Err(MeshError::Point(n));
        }
        check_indices("tetrahedron", tets.iter().map(|t| &t[..]), points.len())?;
        check_indices("boundary face", boundary.iter().map(|f| &f.points[..]), points.len())?;
        let id = MeshId::of(&points, &tets);
        let mut mesh = Self { points, tets, boundary, id };
        let mut used = vec![false; mesh.points.len()];
        for (tet, corners) in mesh.tets.iter().enumerate() {
            let volume = mesh.volume(tet);
            if volume.is_nan() || volume <= 0.0 {
                return Err(MeshError::Volume { tet, volume });
            }
            corners.iter().for_each(|&p| used[p as usize] = true);
        }
        if let Some(n) = used.iter().position(|&u| !u) {
            return Err(MeshError::Unused(n));
        }
        mesh.match_boundary()?;
        Ok(mesh)
    }

    /// Checks the tagged faces against the tetrahedra and turns them outwards.
    fn match_boundary(&mut self) -> Result<(), MeshError> {
        let mut open = self.open_faces(|_| true)?;
        let mut foreign = 0;
        for face in &mut self.boundary {
            match open.remove(&face_key(face.points)) {
                Some(outward) => face.points = outward,
                None => foreign += 1,
            }
        }
        if open.is_empty() && foreign == 0 {
            Ok(())
        } else {
            Err(MeshError::Boundary { untagged: open.len(), foreign })
        }
    }

    /// The faces of exactly one of some tetrahedra, outwards, by sorted points.
    ///
    /// # Errors
    /// When a face is of more than two.
    pub fn open_faces(
        &self,
        of: impl Fn(usize) -> bool,
    ) -> Result<BTreeMap<[u32; 3], [u32; 3]>, MeshError> {
        let mut faces: Vec<([u32; 3], [u32; 3])> = Vec::with_capacity(4 * self.tets.len());
        for (_, tet) in self.tets.iter().enumerate().filter(|(t, _)| of(*t)) {
            for face in TET_FACES {
                let outward = face.map(|c| tet[c]);
                faces.push((face_key(outward), outward));
            }
        }
        faces.sort_unstable();
        let mut open = BTreeMap::new();
        for same in faces.chunk_by(|a, b| a.0 == b.0) {
            match same {
                [(key, outward)] => {
                    open.insert(*key, *outward);
                }
                [_, _] => {}
                more => return Err(MeshError::Shared(more[0].0)),
            }
        }
        Ok(open)
    }

    /// The same mesh with the boundary faces tagged anew: the tag of each from its middle (LPS, mm)
    /// and its tag so far.
    #[must_use]
    pub fn tagged(mut self, tag: impl Fn(&Point, BoundaryTag) -> BoundaryTag) -> Self {
        let points = &self.points;
        for face in &mut self.boundary {
            let [a, b, c] = face.points.map(|p| points[p as usize].coords);
            face.tag = tag(&Point::from((a + b + c) / 3.0), face.tag);
        }
        self
    }

    /// Which mesh this is, for what belongs to it.
    pub fn id(&self) -> MeshId {
        self.id
    }

    /// Points, LPS, mm.
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// Tetrahedra, as indices of four points.
    pub fn tets(&self) -> &[[u32; 4]] {
        &self.tets
    }

    /// Boundary faces, outwards, in the order they were given.
    pub fn boundary(&self) -> &[BoundaryFace] {
        &self.boundary
    }

    /// The four corners of a tetrahedron, LPS, mm.
    pub fn corners(&self, tet: usize) -> [Point; 4] {
        self.tets[tet].map(|p| self.points[p as usize])
    }

    /// The points of the boundary faces with a tag, in rising order.
    pub fn points_on(&self, tag: BoundaryTag) -> Vec<u32> {
        let faces = self.boundary.iter().filter(|f| f.tag == tag);
        let mut points: Vec<u32> = faces.flat_map(|f| f.points).collect();
        points.sort_unstable();
        points.dedup();
        points
    }

    /// Lower and upper corner of the axis-aligned box, LPS, mm.
    pub fn bounds(&self) -> (Point, Point) {
        let start = (self.points[0], self.points[0]);
        self.points.iter().fold(start, |(low, high), p| (low.inf(p), high.sup(p)))
    }

    /// Gradients of the four barycentric coordinates of a tetrahedron, 1/mm.
    pub fn slopes(&self, tet: usize) -> [Vector; 4] {
        let [a, b, c, d] = self.corners(tet);
        let (u, v, w) = (b - a, c - a, d - a);
        let volume = u.dot(&v.cross(&w));
        let (sb, sc, sd) = (v.cross(&w) / volume, w.cross(&u) / volume, u.cross(&v) / volume);
        [-(sb + sc + sd), sb, sc, sd]
    }

    /// Volume of a tetrahedron, mm³.
    pub fn volume(&self, tet: usize) -> f64 {
        signed_volume(&self.corners(tet))
    }

    /// Volume of the whole mesh, mm³.
    pub fn total_volume(&self) -> f64 {
        (0..self.tets.len()).map(|t| self.volume(t)).sum()
    }

    /// Area of the boundary with a tag, mm².
    pub fn area(&self, tag: BoundaryTag) -> f64 {
        let faces = self.boundary.iter().filter(|f| f.tag == tag);
        faces
            .map(|f| {
                let [a, b, c] = f.points.map(|p| self.points[p as usize]);
                0.5 * (b - a).cross(&(c - a)).norm()
            })
            .sum()
    }
}

/// Signed volume of a tetrahedron, mm³: (b - a) · ((c - a) × (d - a)) / 6.
pub(crate) fn signed_volume([a, b, c, d]: &[Point; 4]) -> f64 {
    (b - a).dot(&(c - a).cross(&(d - a))) / 6.0
}

fn check_indices<'a>(
    what: &'static str,
    items: impl Iterator<Item = &'a [u32]>,
    points: usize,
) -> Result<(), MeshError> {
    for (at, item) in items.enumerate() {
        if let Some(&point) = item.iter().find(|&&p| p as usize >= points) {
            return Err(MeshError::Index { what, at, point, points });
        }
    }
    Ok(())
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A cube of side 2 cut into 6 tetrahedra along its diagonal.
    pub(crate) fn cube() -> TetMesh {
        let points: Vec<Point> = (0..8)
            .map(|n| {
                Point::new(f64::from(n & 1), f64::from(n >> 1 & 1), f64::from(n >> 2 & 1)) * 2.0
            })
            .collect();
        let tets = vec![
            [0, 1, 3, 7],
            [0, 3, 2, 7],
            [0, 2, 6, 7],
            [0, 6, 4, 7],
            [0, 4, 5, 7],
            [0, 5, 1, 7],
        ];
        let mesh = TetMesh { id: MeshId::of(&points, &tets), points, tets, boundary: vec![] };
        let boundary = mesh.open_faces(|_| true).unwrap().into_values();
        let boundary =
            boundary.map(|points| BoundaryFace { points, tag: BoundaryTag::Skin }).collect();
        TetMesh::new(mesh.points, mesh.tets, boundary).unwrap()
    }

    #[test]
    fn a_cube_is_whole() {
        let mesh = cube();
        assert!((mesh.total_volume() - 8.0).abs() < 1e-14);
        assert!((mesh.area(BoundaryTag::Skin) - 24.0).abs() < 1e-14);
        let out: f64 = mesh
            .boundary()
            .iter()
            .map(|f| {
                let [a, b, c] = f.points.map(|p| mesh.points()[p as usize].coords);
                a.dot(&b.cross(&c)) / 6.0
            })
            .sum();
        assert!((out - 8.0).abs() < 1e-14, "faces point outwards: {out}");
    }

    #[test]
    fn faces_are_tagged_anew_by_their_place() {
        let cube = cube();
        let low = cube.points().iter().map(|p| p.x).fold(f64::INFINITY, f64::min);
        let cut = |p: &Point, tag| if p.x < low + 1e-9 { BoundaryTag::Cut } else { tag };
        let mesh = cube.clone().tagged(cut);
        assert!((mesh.area(BoundaryTag::Cut) - 4.0).abs() < 1e-14);
        assert!((mesh.area(BoundaryTag::Skin) - 20.0).abs() < 1e-14);
        assert_eq!(mesh.id(), cube.id());
    }

    #[test]
    fn a_mesh_is_known_by_its_points_and_tetrahedra() {
        let mesh = cube();
        let (points, tets) = (mesh.points().to_vec(), mesh.tets().to_vec());
        let mut boundary = mesh.boundary().to_vec();
        boundary[0].tag = BoundaryTag::Cut;
        let tagged = TetMesh::new(points.clone(), tets.clone(), boundary.clone()).unwrap();
        assert_eq!(tagged.id(), mesh.id());
        let mut moved = points;
        moved[3].x += 1e-9;
        assert_ne!(TetMesh::new(moved, tets, boundary).unwrap().id(), mesh.id());
    }

    #[test]
    fn broken_meshes_are_refused() {
        let good = cube();
        let (p, t, b) = (good.points.clone(), good.tets.clone(), good.boundary.clone());
        let refuse = |p: &[Point], t: &[[u32; 4]], b: &[BoundaryFace]| {
            TetMesh::new(p.to_vec(), t.to_vec(), b.to_vec()).unwrap_err()
        };
        let mut flipped = t.clone();
        flipped[2].swap(0, 1);
        assert!(matches!(refuse(&p, &flipped, &b), MeshError::Volume { tet: 2, .. }));
        assert!(matches!(refuse(&p, &t[1..], &b), MeshError::Boundary { .. }));
        assert!(matches!(refuse(&p, &t, &b[1..]), MeshError::Boundary { untagged: 1, foreign: 0 }));
        assert!(matches!(refuse(&p, &[], &b), MeshError::Empty));
        assert!(matches!(refuse(&p[..7], &t, &b), MeshError::Index { point: 7, .. }));
        let mut spare = p.clone();
        spare.push(Point::origin());
        assert!(matches!(refuse(&spare, &t, &b), MeshError::Unused(8)));
    }
}
