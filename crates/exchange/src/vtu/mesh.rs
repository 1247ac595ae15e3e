//! From the arrays of a VTU file to a mesh with its displacement.

use super::{
    cell,
    document::{Document, Section},
};
use crate::{Problem, elements::Elements};
use supine_mesh::{BoundaryTag, Displacement, Order, TetMesh};
use supine_space::{Point, Vector};

/// The mesh at the CT shape and its displacement.
pub(super) fn assemble(file: &Document<'_>) -> Result<(TetMesh, Option<Displacement>), Problem> {
    let array = file.required(Section::Points, "Points")?;
    let flat = file.floats(array, file.points.saturating_mul(3))?;
    let nodes: Vec<Point> = flat.as_chunks::<3>().0.iter().map(|&xyz| xyz.into()).collect();
    let elements = elements(file)?;
    let Some(array) = file.find(Section::PointData, "displacement") else {
        return elements.assemble(&nodes, None);
    };
    if array.components != 3 {
        let reason = format!("has {} components instead of 3", array.components);
        return Err(Problem::field("displacement", reason));
    }
    let flat = file.floats(array, file.points.saturating_mul(3))?;
    let vectors: Vec<Vector> = flat.as_chunks::<3>().0.iter().map(|&v| v.into()).collect();
    elements.assemble(&nodes, Some(&vectors))
}

/// Tetrahedra and tagged triangles, their nodes checked.
fn elements(file: &Document<'_>) -> Result<Elements, Problem> {
    let whole = |name: &str| -> Result<Vec<i64>, Problem> {
        file.counted_integers(file.required(Section::Cells, name)?, file.cells)
    };
    let (types, offsets) = (whole("types")?, whole("offsets")?);
    let connectivity = file.integers(file.required(Section::Cells, "connectivity")?)?;
    let boundary = file.required(Section::CellData, "boundary")?;
    let boundary = file.counted_integers(boundary, file.cells)?;

    let mut cells = Elements::default();
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
        cells.push_tet(order, nodes)?;
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
