//! From the arrays of a VTU file to a mesh with its displacement.

use super::{
    cell,
    document::{Document, Section},
};
use crate::Problem;
use supine_mesh::{BoundaryFace, BoundaryTag, Displacement, Edges, MeshError, Order, TetMesh};
use supine_space::{Point, Vector};

/// How far a mid-side node may lie from the middle of its edge, in lengths of the edge: files in
/// single precision round by 1e-5 of a millimetre.
const STRAIGHT: f64 = 1e-3;

/// The cells that matter, by nodes of the file.
struct Cells {
    order: Order,
    /// 4 or 10 nodes of each tetrahedron.
    tets: Vec<Vec<usize>>,
    faces: Vec<([usize; 3], BoundaryTag)>,
}

/// The mesh at the CT shape and its displacement.
pub(super) fn assemble(file: &Document<'_>) -> Result<(TetMesh, Option<Displacement>), Problem> {
    let array = file.required(Section::Points, "Points")?;
    let flat = file.floats(array, file.points.saturating_mul(3))?;
    let nodes: Vec<Point> = flat.as_chunks::<3>().0.iter().map(|&xyz| xyz.into()).collect();
    let cells = cells(file)?;

    // Corners keep their order; mid-side nodes are told by their edges.
    let mut place = vec![None; nodes.len()];
    cells.tets.iter().flat_map(|t| &t[..4]).for_each(|&n| place[n] = Some(0));
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
        cells.tets.iter().map(tet).collect(),
        cells.faces.iter().map(face).collect(),
    )
    .map_err(explain)?;

    let edges = Edges::new(&mesh);
    let mut used = corners;
    if cells.order == Order::Quadratic {
        used.extend(middles(&mesh, &edges, &cells.tets, &nodes)?);
    }
    let Some(array) = file.find(Section::PointData, "displacement") else {
        return Ok((mesh, None));
    };
    if array.components != 3 {
        let reason = format!("has {} components instead of 3", array.components);
        return Err(Problem::field("displacement", reason));
    }
    let flat = file.floats(array, file.points.saturating_mul(3))?;
    let vectors = flat.as_chunks::<3>().0;
    let values = used.iter().map(|&n| Vector::from(vectors[n])).collect();
    let displacement = Displacement::new(&mesh, &edges, values)?;
    Ok((mesh, Some(displacement)))
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

/// Tetrahedra and tagged triangles, their nodes checked.
fn cells(file: &Document<'_>) -> Result<Cells, Problem> {
    let whole = |name: &str| -> Result<Vec<i64>, Problem> {
        file.counted_integers(file.required(Section::Cells, name)?, file.cells)
    };
    let (types, offsets) = (whole("types")?, whole("offsets")?);
    let connectivity = file.integers(file.required(Section::Cells, "connectivity")?)?;
    let boundary = file.required(Section::CellData, "boundary")?;
    let boundary = file.counted_integers(boundary, file.cells)?;

    let mut cells = Cells { order: Order::Linear, tets: vec![], faces: vec![] };
    let mut start = 0;
    for (at, (&kind, &end)) in types.iter().zip(&offsets).enumerate() {
        let nodes = nodes_of(&connectivity, start, end, file.points).ok_or_else(|| {
            Problem::field("connectivity", format!("cell {at} has no such points"))
        })?;
        start = end;
        let expected = match kind {
            cell::TETRA => 4,
            cell::QUADRATIC_TETRA => 10,
            cell::TRIANGLE => 3,
            cell::QUADRATIC_TRIANGLE => 6,
            // Points, lines, polylines, quadratic edges.
            1..=4 | 21 => continue,
            other => {
                let what = format!("cell {at}, of VTK type {other},");
                let advice =
                    "the mesh must consist of tetrahedra (10 or 24) and triangles (5 or 22)";
                return Err(Problem::Unsupported { what, advice });
            }
        };
        if nodes.len() != expected {
            let reason = format!("cell {at} has {} points instead of {expected}", nodes.len());
            return Err(Problem::field("connectivity", reason));
        }
        if matches!(kind, cell::TRIANGLE | cell::QUADRATIC_TRIANGLE) {
            let number = boundary[at];
            let tag = u8::try_from(number).ok().and_then(BoundaryTag::from_number);
            let tag = tag.ok_or_else(|| {
                let known = "1 skin, 2 chest_wall, 3 cut";
                Problem::field("boundary", format!("is {number} on triangle cell {at}: {known}"))
            })?;
            cells.faces.push(([nodes[0], nodes[1], nodes[2]], tag));
            continue;
        }
        let order = if kind == cell::TETRA { Order::Linear } else { Order::Quadratic };
        if !cells.tets.is_empty() && order != cells.order {
            let what = "a mesh of linear and quadratic tetrahedra".into();
            return Err(Problem::Unsupported { what, advice: "save it with one kind" });
        }
        cells.order = order;
        cells.tets.push(nodes);
    }
    if cells.tets.is_empty() {
        return Err(Problem::field("types", "there are no tetrahedra (VTK type 10 or 24)"));
    }
    Ok(cells)
}

/// The nodes from one offset to the next, if they exist.
fn nodes_of(connectivity: &[i64], start: i64, end: i64, points: usize) -> Option<Vec<usize>> {
    let span = usize::try_from(start).ok()?..usize::try_from(end).ok()?;
    let nodes = connectivity.get(span)?.iter();
    nodes.map(|&n| usize::try_from(n).ok().filter(|&n| n < points)).collect()
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
