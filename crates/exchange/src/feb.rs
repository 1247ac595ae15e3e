//! FEBio 4: a static problem, solver-ready.
//!
//! Sections in the order of FEBio's own programs: Module, Control, Globals, Material, Mesh,
//! MeshDomains, Boundary, Loads, LoadData, Output. Node sets and surfaces `skin`, `chest_wall`,
//! `cut`. FEBio's `neo-Hookean` is the energy of this program: μ/2 (tr C − 3) − μ ln J + λ/2 (ln
//! J)². Format: FEBio User Manual 4, "Free Format Input".

use crate::{Error, Statics, file, nodes::Nodes};
use std::io::{self, Write};
use std::path::Path;
use supine_mesh::{BoundaryTag, TetMesh};

/// Load steps of equal length to begin with; FEBio shortens and lengthens them by itself.
const STEPS: u32 = 10;

/// Writes a mesh (LPS, mm) as a problem.
pub(crate) fn write(mesh: &TetMesh, statics: &Statics, path: &Path) -> Result<(), Error> {
    let nodes = Nodes::new(mesh, statics.order);
    file::write(path, |out| {
        head(out, statics)?;
        geometry(out, mesh, &nodes)?;
        conditions(out, mesh, statics)
    })
}

fn head(out: &mut impl Write, statics: &Statics) -> io::Result<()> {
    let step = 1.0 / f64::from(STEPS);
    write!(
        out,
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <!-- Soft tissue of the breast at its stress-free shape. Patient coordinates LPS (x left, y \
         back, z head). Units mm, kg, s, mN, kPa. -->\n\
         <febio_spec version=\"4.0\">\n\
         <Module type=\"solid\">\n<units>mm-kg-s</units>\n</Module>\n\
         <Control>\n<analysis>STATIC</analysis>\n<time_steps>{STEPS}</time_steps>\n\
         <step_size>{step:?}</step_size>\n\
         <time_stepper type=\"default\">\n<max_retries>10</max_retries>\n<opt_iter>11</opt_iter>\n\
         <dtmin>0</dtmin>\n<dtmax>{step:?}</dtmax>\n</time_stepper>\n\
         <solver type=\"solid\">\n<symmetric_stiffness>symmetric</symmetric_stiffness>\n\
         <qn_method type=\"BFGS\">\n<max_ups>0</max_ups>\n</qn_method>\n</solver>\n</Control>\n\
         <Globals>\n<Constants>\n<T>0</T>\n<R>0</R>\n<Fc>0</Fc>\n</Constants>\n</Globals>\n\
         <Material>\n<material id=\"1\" name=\"soft_tissue\" type=\"neo-Hookean\">\n\
         <density>{:?}</density>\n<E>{:?}</E>\n<v>{:?}</v>\n</material>\n</Material>\n",
        statics.density_kg_mm3(),
        statics.young_kpa,
        statics.poisson,
    )
}

/// Node numbers from 1, with commas.
fn list(nodes: &[u32]) -> String {
    let numbers: Vec<String> = nodes.iter().map(|n| (n + 1).to_string()).collect();
    numbers.join(",")
}

fn geometry(out: &mut impl Write, mesh: &TetMesh, nodes: &Nodes<'_>) -> io::Result<()> {
    let (tet, face) = if nodes.quadratic() { ("tet10", "tri6") } else { ("tet4", "tri3") };
    writeln!(out, "<Mesh>\n<Nodes name=\"soft_tissue\">")?;
    for (n, p) in nodes.positions().iter().enumerate() {
        writeln!(out, "<node id=\"{}\">{:?},{:?},{:?}</node>", n + 1, p.x, p.y, p.z)?;
    }
    writeln!(out, "</Nodes>\n<Elements type=\"{tet}\" name=\"soft_tissue\">")?;
    for n in 0..mesh.tets().len() {
        writeln!(out, "<elem id=\"{}\">{}</elem>", n + 1, list(&nodes.tet(n)))?;
    }
    writeln!(out, "</Elements>")?;
    for tag in BoundaryTag::ALL {
        writeln!(out, "<NodeSet name=\"{}\">{}</NodeSet>", tag.name(), list(&nodes.on(tag)))?;
    }
    for tag in BoundaryTag::ALL {
        writeln!(out, "<Surface name=\"{}\">", tag.name())?;
        for (n, f) in mesh.boundary().iter().filter(|f| f.tag == tag).enumerate() {
            writeln!(out, "<{face} id=\"{}\">{}</{face}>", n + 1, list(&nodes.face(f)))?;
        }
        writeln!(out, "</Surface>")?;
    }
    writeln!(
        out,
        "</Mesh>\n<MeshDomains>\n<SolidDomain name=\"soft_tissue\" mat=\"soft_tissue\"/>\n\
         </MeshDomains>"
    )
}

fn conditions(out: &mut impl Write, mesh: &TetMesh, statics: &Statics) -> io::Result<()> {
    writeln!(out, "<Boundary>")?;
    let held = [(BoundaryTag::ChestWall, true), (BoundaryTag::Cut, statics.cut_held)];
    for (tag, held) in held {
        // FEBio stops at a condition on an empty set.
        if held && mesh.boundary().iter().any(|f| f.tag == tag) {
            writeln!(
                out,
                "<bc name=\"{0}\" node_set=\"{0}\" type=\"zero displacement\">\n\
                 <x_dof>1</x_dof>\n<y_dof>1</y_dof>\n<z_dof>1</z_dof>\n</bc>",
                tag.name()
            )?;
        }
    }
    // FEBio takes a body force as minus the force per mass.
    let force = -statics.acceleration_mm_s2();
    write!(
        out,
        "</Boundary>\n<Loads>\n\
         <!-- Force per mass, mm/s², with FEBio's sign: the tissue is drawn the other way. -->\n\
         <body_load name=\"gravity\" type=\"body force\">\n\
         <force lc=\"1\">{:?},{:?},{:?}</force>\n</body_load>\n</Loads>\n\
         <LoadData>\n<load_controller id=\"1\" name=\"ramp\" type=\"loadcurve\">\n\
         <interpolate>LINEAR</interpolate>\n<extend>CONSTANT</extend>\n\
         <points>\n<pt>0,0</pt>\n<pt>1,1</pt>\n</points>\n</load_controller>\n</LoadData>\n\
         <Output>\n<plotfile type=\"febio\">\n<var type=\"displacement\"/>\n<var type=\"stress\"/>\n\
         </plotfile>\n</Output>\n</febio_spec>\n",
        force.x, force.y, force.z
    )
}
