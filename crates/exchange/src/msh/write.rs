//! Writing MSH.

use super::{TET_ORDER, TISSUE};
use crate::{Error, file, nodes::Nodes};
use std::io::{self, Write};
use std::path::Path;
use supine_mesh::{BoundaryTag, Displacement, TetMesh};
use supine_space::Point;

/// Writes a mesh (LPS, mm) with vector fields of one order as node data.
pub(crate) fn write(
    mesh: &TetMesh,
    fields: &[(&str, &Displacement)],
    path: &Path,
) -> Result<(), Error> {
    let nodes = Nodes::carrying(mesh, fields).ok_or_else(|| Error::Unwritable {
        path: path.into(),
        reason: "the displacement belongs to another mesh".into(),
    })?;
    file::write(path, |out| compose(out, mesh, &nodes, fields))
}

fn compose(
    out: &mut impl Write,
    mesh: &TetMesh,
    nodes: &Nodes<'_>,
    fields: &[(&str, &Displacement)],
) -> io::Result<()> {
    let on = |tag: &BoundaryTag| mesh.boundary().iter().any(|f| f.tag == *tag);
    let tags: Vec<BoundaryTag> = BoundaryTag::ALL.into_iter().filter(on).collect();
    let positions = nodes.positions();
    write!(
        out,
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n\
         $Comments\nPoints: CT shape, patient coordinates LPS, mm. Node data displacement: from the CT \
         shape to the deformed shape, mm.\n$EndComments\n"
    )?;
    writeln!(out, "$PhysicalNames\n{}", tags.len() + 1)?;
    for tag in &tags {
        writeln!(out, "2 {} \"{}\"", tag.number(), tag.name())?;
    }
    writeln!(out, "3 {TISSUE} \"soft_tissue\"\n$EndPhysicalNames")?;
    entities(out, mesh, &tags)?;

    let n = positions.len();
    writeln!(out, "$Nodes\n1 {n} 1 {n}\n3 {TISSUE} 0 {n}")?;
    (1..=n).try_for_each(|number| writeln!(out, "{number}"))?;
    positions.iter().try_for_each(|p| writeln!(out, "{:?} {:?} {:?}", p.x, p.y, p.z))?;
    writeln!(out, "$EndNodes")?;
    elements(out, mesh, nodes, &tags)?;

    for (name, field) in fields {
        writeln!(out, "$NodeData\n1\n\"{name}\"\n1\n0.0\n3\n0\n3\n{n}")?;
        for (at, v) in field.values().iter().enumerate() {
            writeln!(out, "{} {:?} {:?} {:?}", at + 1, v.x, v.y, v.z)?;
        }
        writeln!(out, "$EndNodeData")?;
    }
    Ok(())
}

/// The box of some points, as the format has it.
fn bounds<'a>(points: impl Iterator<Item = &'a Point>) -> String {
    let none = (Point::from([f64::INFINITY; 3]), Point::from([f64::NEG_INFINITY; 3]));
    let (low, high) = points.fold(none, |(low, high), p| (low.inf(p), high.sup(p)));
    let corners: Vec<String> = low.iter().chain(high.iter()).map(|c| format!("{c:?}")).collect();
    corners.join(" ")
}

/// Surfaces and volume, each with its group.
fn entities(out: &mut impl Write, mesh: &TetMesh, tags: &[BoundaryTag]) -> io::Result<()> {
    writeln!(out, "$Entities\n0 0 {} 1", tags.len())?;
    for tag in tags {
        let faces = mesh.boundary().iter().filter(|f| f.tag == *tag);
        let points = faces.flat_map(|f| f.points).map(|p| &mesh.points()[p as usize]);
        writeln!(out, "{0} {1} 1 {0} 0", tag.number(), bounds(points))?;
    }
    write!(out, "{TISSUE} {} 1 {TISSUE} {}", bounds(mesh.points().iter()), tags.len())?;
    tags.iter().try_for_each(|tag| write!(out, " {}", tag.number()))?;
    writeln!(out, "\n$EndEntities")
}

fn elements(
    out: &mut impl Write,
    mesh: &TetMesh,
    nodes: &Nodes<'_>,
    tags: &[BoundaryTag],
) -> io::Result<()> {
    // Triangle and tetrahedron of 3 and 4 nodes, or of 6 and 10.
    let (triangle, tetrahedron) = if nodes.quadratic() { (9, 11) } else { (2, 4) };
    let (faces, tets) = (mesh.boundary(), mesh.tets().len());
    let n = faces.len() + tets;
    writeln!(out, "$Elements\n{} {n} 1 {n}", tags.len() + 1)?;
    let mut number = 0;
    let mut element = |out: &mut dyn Write, nodes: &[u32]| {
        number += 1;
        write!(out, "{number}")?;
        nodes.iter().try_for_each(|n| write!(out, " {}", n + 1))?;
        writeln!(out)
    };
    for tag in tags {
        let tagged = || faces.iter().filter(|f| f.tag == *tag);
        writeln!(out, "2 {} {triangle} {}", tag.number(), tagged().count())?;
        tagged().try_for_each(|f| element(out, &nodes.face(f)))?;
    }
    writeln!(out, "3 {TISSUE} {tetrahedron} {tets}")?;
    for tet in 0..tets {
        let of = nodes.tet(tet);
        let of: Vec<u32> = TET_ORDER[..of.len()].iter().map(|&n| of[n]).collect();
        element(out, &of)?;
    }
    writeln!(out, "$EndElements")
}
