//! Abaqus input, as Abaqus and CalculiX read it: a static problem, solver-ready.
//!
//! Node sets and surfaces `skin`, `chest_wall`, `cut`; elements `soft_tissue`. Their neo-Hookean
//! law is C10 (J^(-2/3) tr C − 3) + (J − 1)² / D1 with C10 = μ/2, D1 = 2/K: at small strain that of
//! this program. Springs act between nodes and the ground (SPRING1) and between nodes (SPRING2).
//! Format: Abaqus Keywords Reference; CalculiX CrunchiX User's Manual.

use crate::{Error, Spring, Statics, file, nodes::Nodes};
use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::Path;
use supine_mesh::{BoundaryTag, TET_FACES, TetMesh};
use supine_space::Vector;

/// Name in Abaqus of the face opposite each corner of a tetrahedron.
const FACE_NAMES: [u8; 4] = [3, 4, 2, 1];
/// Numbers in a line of a set.
const IN_LINE: usize = 16;

/// Writes a mesh (LPS, mm) as a problem.
pub(crate) fn write(
    mesh: &TetMesh,
    statics: &Statics,
    springs: &[Spring],
    path: &Path,
) -> Result<(), Error> {
    let nodes = Nodes::new(mesh, statics.order);
    file::write(path, |out| {
        geometry(out, mesh, &nodes)?;
        put_springs(out, mesh.tets().len(), springs)?;
        problem(out, mesh, statics)
    })
}

fn geometry(out: &mut impl Write, mesh: &TetMesh, nodes: &Nodes<'_>) -> io::Result<()> {
    write!(
        out,
        "*HEADING\nSoft tissue of the breast at its stress-free shape\n\
         ** Patient coordinates LPS (x left, y back, z head). Units mm, kg, s, mN, kPa.\n\
         *NODE, NSET=all\n"
    )?;
    for (n, p) in nodes.positions().iter().enumerate() {
        // CalculiX reads 20 characters of a number.
        writeln!(out, "{}, {:.10}, {:.10}, {:.10}", n + 1, p.x, p.y, p.z)?;
    }
    let kind = if nodes.quadratic() { "C3D10" } else { "C3D4" };
    writeln!(out, "*ELEMENT, TYPE={kind}, ELSET=soft_tissue")?;
    for n in 0..mesh.tets().len() {
        write!(out, "{}", n + 1)?;
        nodes.tet(n).iter().try_for_each(|node| write!(out, ", {}", node + 1))?;
        writeln!(out)?;
    }
    let faces = sides(mesh);
    for tag in there(mesh) {
        writeln!(out, "*NSET, NSET={}", tag.name())?;
        set(out, &nodes.on(tag))?;
        let mut surface = Vec::new();
        for (face, name) in FACE_NAMES.iter().enumerate() {
            let of: Vec<u32> = faces[face].iter().filter(|f| f.1 == tag).map(|f| f.0).collect();
            if !of.is_empty() {
                writeln!(out, "*ELSET, ELSET={}_s{name}", tag.name())?;
                set(out, &of)?;
                surface.push(format!("{0}_s{name}, S{name}\n", tag.name()));
            }
        }
        write!(out, "*SURFACE, NAME={}, TYPE=ELEMENT\n{}", tag.name(), surface.concat())?;
    }
    Ok(())
}

/// Springs in each direction; elements numbered behind those of the tissue.
fn put_springs(out: &mut impl Write, before: usize, springs: &[Spring]) -> io::Result<()> {
    if !springs.is_empty() {
        writeln!(out, "** Springs at the cut in place of the tissue beyond it, mN/mm")?;
    }
    for (n, Spring { nodes: (a, b), stiffness }) in springs.iter().enumerate() {
        for axis in 1..=3 {
            let number = before + 3 * n + axis;
            let (kind, ends, axes) = match b {
                None => ("SPRING1", format!("{}", a + 1), format!("{axis}")),
                Some(b) => ("SPRING2", format!("{}, {}", a + 1, b + 1), format!("{axis}, {axis}")),
            };
            write!(
                out,
                "*ELEMENT, TYPE={kind}, ELSET=spring_{number}\n{number}, {ends}\n\
                 *SPRING, ELSET=spring_{number}\n{axes}\n{stiffness:.10e}\n"
            )?;
        }
    }
    Ok(())
}

/// The tags that have faces.
fn there(mesh: &TetMesh) -> impl Iterator<Item = BoundaryTag> {
    let on = |tag: &BoundaryTag| mesh.boundary().iter().any(|f| f.tag == *tag);
    BoundaryTag::ALL.into_iter().filter(on)
}

/// The tetrahedra with their tag at the boundary, by which of their faces lies there.
fn sides(mesh: &TetMesh) -> [Vec<(u32, BoundaryTag)>; 4] {
    let key = |mut points: [u32; 3]| {
        points.sort_unstable();
        points
    };
    let tags: BTreeMap<_, _> = mesh.boundary().iter().map(|f| (key(f.points), f.tag)).collect();
    TET_FACES.map(|face| {
        let tag = |tet: &[u32; 4]| tags.get(&key(face.map(|c| tet[c]))).copied();
        let tets = mesh.tets().iter().zip(0u32..);
        tets.filter_map(|(tet, n)| tag(tet).map(|tag| (n, tag))).collect()
    })
}

/// Numbers from 1.
fn set(out: &mut impl Write, numbers: &[u32]) -> io::Result<()> {
    numbers.chunks(IN_LINE).try_for_each(|line| {
        let line: Vec<String> = line.iter().map(|n| (n + 1).to_string()).collect();
        writeln!(out, "{}", line.join(", "))
    })
}

fn problem(out: &mut impl Write, mesh: &TetMesh, statics: &Statics) -> io::Result<()> {
    let (young, poisson) = (statics.young_kpa, statics.poisson);
    let (shear, bulk) = (young / (2.0 * (1.0 + poisson)), young / (3.0 * (1.0 - 2.0 * poisson)));
    write!(
        out,
        "*MATERIAL, NAME=soft_tissue\n\
         ** E = {young} kPa, nu = {poisson}: C10, D1\n\
         *HYPERELASTIC, NEO HOOKE\n{:.10e}, {:.10e}\n*DENSITY\n{:.10e}\n\
         *SOLID SECTION, ELSET=soft_tissue, MATERIAL=soft_tissue\n\n\
         *BOUNDARY\n",
        shear / 2.0,
        2.0 / bulk,
        statics.density_kg_mm3()
    )?;
    for tag in there(mesh) {
        if tag == BoundaryTag::ChestWall || (tag == BoundaryTag::Cut && statics.cut_held) {
            writeln!(out, "{}, 1, 3", tag.name())?;
        }
    }
    let force = statics.acceleration_mm_s2();
    let towards = force.try_normalize(0.0).unwrap_or(Vector::y());
    write!(
        out,
        "*STEP, NLGEOM, INC=1000\n*STATIC\n0.1, 1.0, 1e-6, 0.1\n\
         ** Force per mass, mm/s², and where to\n\
         *DLOAD\nsoft_tissue, GRAV, {:.8}, {:.12}, {:.12}, {:.12}\n\
         *NODE FILE\nU\n*END STEP\n",
        force.norm(),
        towards.x,
        towards.y,
        towards.z
    )
}
