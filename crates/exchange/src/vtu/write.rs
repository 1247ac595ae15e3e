//! Writing VTU: inline base64, zlib.

use super::cell;
use crate::{Error, file, nodes::Nodes, scalar::Sample};
use base64::{Engine, engine::general_purpose::STANDARD};
use flate2::{Compression, write::ZlibEncoder};
use std::{
    io::{self, Write},
    path::Path,
};
use supine_mesh::{Displacement, TetMesh};

/// Bytes of a block that is compressed by itself; what VTK uses.
const BLOCK: usize = 1 << 15;

/// What a reader without this project at hand needs to know.
const COMMENT: &str = "Points: CT shape, patient coordinates LPS, mm. Point data displacement: from \
                       the CT shape to the deformed shape, mm. Cell data boundary: 1 skin, \
                       2 chest_wall, 3 cut, 0 tetrahedra.";

/// Writes a mesh at the CT shape (LPS, mm) with its boundary and, if given, its displacement (mm).
///
/// Points come first in the order of the mesh; a quadratic displacement adds the mid-side nodes in
/// the order of [`supine_mesh::Edges`]. Tetrahedra come before triangles.
///
/// # Errors
/// When the name does not end in `.vtu`, the displacement is of another mesh or the file cannot be
/// written.
pub fn write_vtu(
    mesh: &TetMesh,
    displacement: Option<&Displacement>,
    path: &Path,
) -> Result<(), Error> {
    let fields: Vec<_> = displacement.map(|u| ("displacement", u)).into_iter().collect();
    write(mesh, &fields, path)
}

/// As [`write_vtu`], with vector fields of one order as point data.
pub(crate) fn write(
    mesh: &TetMesh,
    fields: &[(&str, &Displacement)],
    path: &Path,
) -> Result<(), Error> {
    let refused = |reason: &str| Error::Unwritable { path: path.into(), reason: reason.into() };
    if !file::has_suffix(path, ".vtu") {
        return Err(refused("the name of a mesh ends in .vtu"));
    }
    let nodes = Nodes::carrying(mesh, fields);
    let nodes = nodes.ok_or_else(|| refused("the displacement belongs to another mesh"))?;
    file::write(path, |out| compose(out, mesh, &nodes, fields))
}

fn compose(
    out: &mut impl Write,
    mesh: &TetMesh,
    nodes: &Nodes<'_>,
    fields: &[(&str, &Displacement)],
) -> io::Result<()> {
    let (tets, faces) = (mesh.tets().len(), mesh.boundary().len());
    let (tet_type, face_type, tet_nodes, face_nodes) = if nodes.quadratic() {
        (cell::QUADRATIC_TETRA, cell::QUADRATIC_TRIANGLE, 10, 6)
    } else {
        (cell::TETRA, cell::TRIANGLE, 4, 3)
    };
    let connectivity = (0..tets).flat_map(|n| nodes.tet(n));
    let connectivity = connectivity.chain(mesh.boundary().iter().flat_map(|f| nodes.face(f)));
    let offsets = (1..=tets)
        .map(|n| n * tet_nodes)
        .chain((1..=faces).map(|n| tets * tet_nodes + n * face_nodes))
        .map(|n| n as i64);
    let types = std::iter::repeat_n(tet_type as u8, tets)
        .chain(std::iter::repeat_n(face_type as u8, faces));
    let tags = std::iter::repeat_n(0, tets).chain(mesh.boundary().iter().map(|f| f.tag.number()));

    write!(
        out,
        "<?xml version=\"1.0\"?>\n\
         <VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\n\
         <!-- {COMMENT} -->\n\
         <UnstructuredGrid>\n\
         <Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n",
        nodes.len(),
        tets + faces
    )?;
    writeln!(out, "<PointData>")?;
    for (name, field) in fields {
        let values = field.values().iter().flat_map(|v| <[f64; 3]>::from(*v));
        array(out, "Float64", name, 3, values)?;
    }
    writeln!(out, "</PointData>\n<CellData>")?;
    array(out, "UInt8", "boundary", 1, tags)?;
    writeln!(out, "</CellData>\n<Points>")?;
    array(
        out,
        "Float64",
        "Points",
        3,
        nodes.positions().iter().flat_map(|p| <[f64; 3]>::from(p.coords)),
    )?;
    writeln!(out, "</Points>\n<Cells>")?;
    array(out, "Int64", "connectivity", 1, connectivity.map(i64::from))?;
    array(out, "Int64", "offsets", 1, offsets)?;
    array(out, "UInt8", "types", 1, types)?;
    writeln!(out, "</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>")
}

/// One array: number of blocks, their size, size of a shorter last one, compressed sizes; blocks.
fn array<T: Sample>(
    out: &mut impl Write,
    kind: &str,
    name: &str,
    components: usize,
    values: impl IntoIterator<Item = T>,
) -> io::Result<()> {
    let mut bytes = Vec::new();
    values.into_iter().for_each(|v| v.push(&mut bytes));
    let blocks = bytes.len().div_ceil(BLOCK);
    let mut head = vec![blocks as u64, BLOCK as u64, (bytes.len() % BLOCK) as u64];
    let mut packed = Vec::new();
    for block in bytes.chunks(BLOCK) {
        let before = packed.len();
        let mut zlib = ZlibEncoder::new(&mut packed, Compression::default());
        zlib.write_all(block)?;
        zlib.finish()?;
        head.push((packed.len() - before) as u64);
    }
    let head: Vec<u8> = head.iter().flat_map(|n| n.to_le_bytes()).collect();
    writeln!(
        out,
        "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" \
         format=\"binary\">\n{}{}\n</DataArray>",
        STANDARD.encode(head),
        STANDARD.encode(packed)
    )
}
