//! The nodes of a mesh as files number them, from 0: its points, then the middles of its edges.

use supine_mesh::{BoundaryFace, BoundaryTag, Displacement, Edges, Order, TetMesh};
use supine_space::Point;

/// A mesh with the nodes of elements of an order.
#[derive(Debug)]
pub(crate) struct Nodes<'a> {
    mesh: &'a TetMesh,
    /// Of quadratic elements.
    edges: Option<Edges>,
}

impl<'a> Nodes<'a> {
    /// The points of the mesh, and for quadratic elements the middles of its edges in the order of
    /// [`Edges`].
    pub(crate) fn new(mesh: &'a TetMesh, order: Order) -> Self {
        Self { mesh, edges: (order == Order::Quadratic).then(|| Edges::new(mesh)) }
    }

    /// Those that carry named fields, or the points alone; `None` when one is of another mesh or
    /// the orders differ.
    pub(crate) fn carrying(mesh: &'a TetMesh, fields: &[(&str, &Displacement)]) -> Option<Self> {
        let order = fields.first().map_or(Order::Linear, |(_, field)| field.order());
        let nodes = Self::new(mesh, order);
        let fits = fields.iter().all(|(_, field)| field.values().len() == nodes.len());
        fits.then_some(nodes)
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.mesh.points().len() + self.edges.as_ref().map_or(0, |e| e.ends().len())
    }

    /// Whether the elements have mid-side nodes.
    pub(crate) fn quadratic(&self) -> bool {
        self.edges.is_some()
    }

    /// Where they are, LPS, mm.
    pub(crate) fn positions(&self) -> Vec<Point> {
        let points = self.mesh.points();
        let middle =
            |e: &[u32; 2]| nalgebra::center(&points[e[0] as usize], &points[e[1] as usize]);
        let middles = self.edges.iter().flat_map(|e| e.ends().iter().map(middle));
        points.iter().copied().chain(middles).collect()
    }

    /// The nodes of a tetrahedron: four corners, then the middles of the edges 01, 12, 02, 03, 13,
    /// 23 (the order of VTK, FEBio and Abaqus).
    pub(crate) fn tet(&self, tet: usize) -> Vec<u32> {
        let corners = self.mesh.points().len() as u32;
        let sides = self.edges.iter().flat_map(|e| e.of_tets()[tet].map(|side| corners + side));
        self.mesh.tets()[tet].into_iter().chain(sides).collect()
    }

    /// The nodes of a face: three corners, then the middles of the edges 01, 12, 20.
    pub(crate) fn face(&self, face: &BoundaryFace) -> Vec<u32> {
        let [a, b, c] = face.points;
        let corners = self.mesh.points().len() as u32;
        // A face of the boundary is a face of a tetrahedron: its edges exist.
        let side = |(p, q)| Some(corners + self.edges.as_ref()?.between(p, q)?);
        let sides = [(a, b), (b, c), (c, a)].into_iter().filter_map(side);
        face.points.into_iter().chain(sides).collect()
    }

    /// The nodes of all faces with a tag, in rising order.
    pub(crate) fn on(&self, tag: BoundaryTag) -> Vec<u32> {
        let faces = self.mesh.boundary().iter().filter(|f| f.tag == tag);
        let mut nodes: Vec<u32> = faces.flat_map(|f| self.face(f)).collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }
}
