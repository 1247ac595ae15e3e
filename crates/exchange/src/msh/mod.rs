//! Gmsh MSH 4.1, as text: the mesh, its boundary as physical groups, its displacement.
//!
//! One entity and physical group for the tissue (volume 4, `soft_tissue`) and for each tag there is
//! (surfaces 1 `skin`, 2 `chest_wall`, 3 `cut`); all nodes belong to the volume. Numbers have as
//! many digits as it takes to read the same bits back. Format: Gmsh reference manual,
//! <https://gmsh.info/doc/texinfo/gmsh.html#MSH-file-format>.

mod read;
mod write;

pub(crate) use read::parse;
pub(crate) use write::write;

/// Number of the volume and its group.
const TISSUE: u8 = 4;
/// Where Gmsh has VTK's nodes of a quadratic tetrahedron, and the other way round.
const TET_ORDER: [usize; 10] = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8];

#[cfg(test)]
mod tests;
