//! Tetrahedra and tagged triangles of a file, by its nodes, and the mesh they make.

use crate::Problem;
use supine_mesh::{BoundaryFace, BoundaryTag, Displacement, Edges, MeshError, Order, TetMesh};
use supine_space::{Point, Vector};

/// How far a mid-side node may lie from the middle of its edge, in lengths of the edge: files in
/// single precision round by 1e-5 of a millimetre.
const STRAIGHT: f64 = 1e-3;

/// The elements that matter, by nodes of the file, which exist.
#[derive(Debug)]
pub(crate) struct Elements {
    order: Order,
    /// 4 or 10 nodes of each tetrahedron.
    pub(crate) tets: Vec<Vec<usize>>,
    pub(crate) faces: Vec<([usize; 3], BoundaryTag)>,
}

impl Default for Elements {
    fn default() -> Self {
        Self { order: Order::Linear, tets: vec![], faces: vec![] }
    }
}

impl Elements {
    /// One more tetrahedron, of the order of the others; its nodes as VTK orders them.
    pub(crate) fn push_tet(&mut self, order: Order, nodes: Vec<usize>) -> Result<(), Problem> {
        if !self.tets.is_empty() && order != self.order {
            let what = "a mesh of linear and quadratic tetrahedra".into();
            return Err(Problem::Unsupported { what, advice: "save it with one kind" });
        }
        self.order = order;
        self.tets.push(nodes);
        Ok(())
    }

    /// The mesh at the CT shape (LPS, mm) and its displacement (mm), both given by node.
    pub(crate) fn assemble(
        &self,
        nodes: &[Point],
        displacement: Option<&[Vector]>,
    ) -> Result<(TetMesh, Option<Displacement>), Problem> {
        if let Some(vectors) = displacement.filter(|vectors| vectors.len() != nodes.len()) {
            let reason = format!("has {} vectors for {} points", vectors.len(), nodes.len());
            return Err(Problem::field("displacement", reason));
        }
        // Corners keep their order; mid-side nodes are told by their edges.
        let mut place = vec![None; nodes.len()];
        self.tets.iter().flat_map(|t| &t[..4]).for_each(|&n| place[n] = Some(0));
        let corners: Vec<usize> = (0..nodes.len()).filter(|&n| place[n].is_some()).collect();
        if u32::try_from(corners.len()).is_err() {
            return Err(Problem::field("NumberOfPoints", "more points than can be numbered"));
        }
        for (at, &n) in corners.iter().enumerate() {
            place[n] = Some(at as u32);
        }
        let tet = |t: &Vec<usize>| [0, 1, 2, 3].map(|c| place[t[c]].unwrap_or(u32::MAX));
        let face = |(nodes, tag): &([usize; 3], BoundaryTag)| BoundaryFace {
            points: nodes.map(|n| place[n].unwrap_or(u32::MAX)),
            tag: *tag,
        };
        let mesh = TetMesh::new(
            corners.iter().map(|&n| nodes[n]).collect(),
            self.tets.iter().map(tet).collect(),
            self.faces.iter().map(face).collect(),
        )
        .map_err(explain)?;

        let edges = Edges::new(&mesh);
        let mut used = corners;
        if self.order == Order::Quadratic {
            used.extend(middles(&mesh, &edges, &self.tets, nodes)?);
        }
        let Some(vectors) = displacement else { return Ok((mesh, None)) };
        let values = used.iter().map(|&n| vectors[n]).collect();
        let displacement = Displacement::new(&mesh, &edges, values)?;
        Ok((mesh, Some(displacement)))
    }
}

/// Says what to do about a boundary without tags.
fn explain(error: MeshError) -> Problem {
    match error {
        MeshError::Boundary { untagged, foreign } => Problem::field(
            "boundary",
            format!(
                "{untagged} faces of the mesh's surface have no triangle, {foreign} triangles are \
                 not on the surface: every face of the surface needs one triangle cell with the \
                 cell data `boundary` (1 skin, 2 chest_wall, 3 cut)"
            ),
        ),
        other => other.into(),
    }
}

/// The mid-side node of each edge; it must lie in the middle.
fn middles(
    mesh: &TetMesh,
    edges: &Edges,
    tets: &[Vec<usize>],
    nodes: &[Point],
) -> Result<Vec<usize>, Problem> {
    let mut middles: Vec<Option<usize>> = vec![None; edges.ends().len()];
    for (tet, of) in tets.iter().zip(edges.of_tets()) {
        // `supine_mesh::TET_EDGES` is VTK's order of the mid-side nodes, 4 to 9.
        for (side, &edge) in of.iter().enumerate() {
            let node = tet[4 + side];
            let known = middles[edge as usize].get_or_insert(node);
            if *known != node {
                let reason = format!("points {known} and {node} are both the middle of one edge");
                return Err(Problem::field("connectivity", reason));
            }
        }
    }
    let middles: Vec<usize> = middles.into_iter().flatten().collect();
    for (&node, ends) in middles.iter().zip(edges.ends()) {
        let [a, b] = ends.map(|p| mesh.points()[p as usize]);
        let off = (nodes[node] - nalgebra::center(&a, &b)).norm();
        if off.is_nan() || off > STRAIGHT * (b - a).norm() {
            let reason = format!(
                "mid-side point {node} lies {off:.3} mm off the middle of its edge: points must be \
                 the undeformed CT shape with straight edges, and `displacement` lead from there"
            );
            return Err(Problem::field("Points", reason));
        }
    }
    Ok(middles)
}
