//! Meshes in the formats of other programs.

use crate::{Error, feb, file, inp, msh, read_vtu, vtu};
use std::path::Path;
use supine_mesh::{Displacement, Order, TetMesh};
use supine_space::Vector;

/// A static problem on a mesh at its stress-free shape: what a solver needs beside the mesh.
///
/// Tissue: homogeneous, neo-Hookean. The chest wall is held. Files that hold a problem are in mm,
/// kg, s, and so in mN and kPa.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statics {
    /// Young's modulus at small strain, kPa.
    pub young_kpa: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Density, kg/m³.
    pub density_kg_m3: f64,
    /// Force per mass on all of the tissue, m/s², LPS: gravity.
    pub acceleration_m_s2: Vector,
    /// Order of the elements.
    pub order: Order,
    /// Whether the cut is held too.
    pub cut_held: bool,
}

impl Statics {
    /// Density, kg/mm³.
    pub(crate) fn density_kg_mm3(&self) -> f64 {
        self.density_kg_m3 / 1e9
    }

    /// Force per mass, mm/s², LPS.
    pub(crate) fn acceleration_mm_s2(&self) -> Vector {
        self.acceleration_m_s2 * 1000.0
    }
}

/// A linear spring between the same direction of two nodes, in each direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// Its ends, from 0: points of the mesh, then for quadratic elements its edges in the order of
    /// [`supine_mesh::Edges`]; none for the ground.
    pub nodes: (u32, Option<u32>),
    /// Stiffness, mN/mm.
    pub stiffness: f64,
}

/// What a file of a mesh can hold beside it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFile {
    /// A displacement: `.vtu`, `.msh`.
    Result,
    /// A problem to be solved: `.feb`, `.inp`.
    Problem,
}

impl MeshFile {
    /// What a file of that name holds.
    ///
    /// # Errors
    /// [`Error::Unwritable`] when the name ends in none of `.vtu`, `.msh`, `.feb`, `.inp`.
    pub fn of(path: &Path) -> Result<Self, Error> {
        let ends = |endings: [&str; 2]| endings.iter().any(|e| file::has_suffix(path, e));
        if ends([".vtu", ".msh"]) {
            Ok(Self::Result)
        } else if ends([".feb", ".inp"]) {
            Ok(Self::Problem)
        } else {
            let reason = "the name of a mesh ends in .vtu, .msh (Gmsh 4.1), .feb (FEBio 4) or \
                          .inp (Abaqus, CalculiX)";
            Err(Error::Unwritable { path: path.into(), reason: reason.into() })
        }
    }
}

/// Reads a mesh at the CT shape (LPS, mm) and, if the file holds one, its displacement (mm): `.msh`
/// as Gmsh 4.1, text, with the boundary in physical groups `skin`, `chest_wall` and `cut`; all else
/// as [`read_vtu`] does.
///
/// # Errors
/// As [`read_vtu`].
pub fn read_mesh(path: &Path) -> Result<(TetMesh, Option<Displacement>), Error> {
    if file::has_suffix(path, ".msh") {
        msh::parse(&file::read(path)?).map_err(|p| p.of(path))
    } else {
        read_vtu(path)
    }
}

/// Writes a mesh at the CT shape (LPS, mm) with its boundary and, if given, its displacement (mm):
/// `.vtu` as [`crate::write_vtu`] does, `.msh` as Gmsh 4.1.
///
/// # Errors
/// When the name ends otherwise, the displacement is of another mesh or the file cannot be written.
pub fn write_mesh(
    mesh: &TetMesh,
    displacement: Option<&Displacement>,
    path: &Path,
) -> Result<(), Error> {
    let fields: Vec<_> = displacement.map(|u| ("displacement", u)).into_iter().collect();
    write_mesh_fields(mesh, &fields, path)
}

/// As [`write_mesh`], with named vector fields of one order at the nodes; only one called
/// `displacement` is read back.
///
/// # Errors
/// When the name ends otherwise, a field is of another mesh or order, or the file cannot be
/// written.
pub fn write_mesh_fields(
    mesh: &TetMesh,
    fields: &[(&str, &Displacement)],
    path: &Path,
) -> Result<(), Error> {
    if file::has_suffix(path, ".msh") {
        msh::write(mesh, fields, path)
    } else {
        vtu::write(mesh, fields, path)
    }
}

/// Writes a mesh (LPS, mm) as a problem that a solver takes as it is: `.feb` for FEBio 4, `.inp`
/// for Abaqus and CalculiX.
///
/// FEBio solves the same energy as this program. Abaqus and CalculiX have a neo-Hookean law of
/// their own, with the same moduli at small strain and another resistance to a large change of
/// volume.
///
/// `springs` act beside the tissue.
///
/// # Errors
/// When the name ends otherwise, the file cannot be written, or springs are to go into a `.feb`,
/// whose springs act along a line between two nodes.
pub fn write_problem(
    mesh: &TetMesh,
    statics: &Statics,
    springs: &[Spring],
    path: &Path,
) -> Result<(), Error> {
    if file::has_suffix(path, ".feb") {
        if !springs.is_empty() {
            let reason = "a .feb file holds no springs that hold nodes to the ground: write .inp, or add --cut free or \
                          --cut fixed";
            return Err(Error::Unwritable { path: path.into(), reason: reason.into() });
        }
        feb::write(mesh, statics, path)
    } else if file::has_suffix(path, ".inp") {
        inp::write(mesh, statics, springs, path)
    } else {
        let reason = "the name of a problem ends in .feb (FEBio 4) or .inp (Abaqus, CalculiX)";
        Err(Error::Unwritable { path: path.into(), reason: reason.into() })
    }
}
