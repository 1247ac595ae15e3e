//! An applicator that presses the reference breast, for another program to solve anew:
//! `bench-contact REFERENCE FOLDER`, one JSON object for each problem on stdout, its arrays in
//! FOLDER/NAME.npz.
//!
//! REFERENCE is the folder of the reference's arrays. Each problem is gone to live, step by step,
//! and its last place is written: `nodes`, `cells` (those that bear, in the order of VTK), `held`
//! nodes, `load` (kPa/mm), the applicator's `centre`, `radius`, `axis` and `shaft` (radius and
//! length; 0: none) there, in which part of the way it came (`away`), our `moved` (mm) and `forces`
//! (mN). LPS, mm.
#![expect(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "a measurement reads its input and tells its result"
)]

#[expect(dead_code, reason = "the other benches use the rest")]
mod reference;

use anyhow::{Context, Result, bail};
use ndarray::{Array1, Array2};
use ndarray_npy::NpzWriter;
use reference::{Reference, cpu_s, memory_mb};
use serde_json::json;
use std::fs::File;
use std::path::Path;
use std::sync::Arc;
use supine_fem::{
    Applicator, Body, Contact, Cut, Insertion, Load, Params, Shaft, SphereOnShaft, Tissue,
    snapped_to_cavity,
};
use supine_mesh::{BoundaryTag, Edges, Order, TetMesh};
use supine_space::{Point, Pose, Progress, Vector, supine};

/// In the middle of the tilted breast.
const CENTRE: Point = Point::new(96.689_502_2, -111.251_350_18, 0.0);
/// Where the nipple points.
const OUT: Vector = Vector::new(0.0, -1.0, 0.0);
/// Steps of each way.
const STEPS: u32 = 40;

/// A problem: which mesh, which elements, and from where the applicator comes.
struct Case {
    name: &'static str,
    mesh: &'static str,
    order: Order,
    /// Cut for it before, instead of coming from outside.
    cavity: bool,
}

const CASES: [Case; 6] = [
    Case { name: "outside-1.6k-linear", mesh: "1.6k", order: Order::Linear, cavity: false },
    Case { name: "outside-1.6k-quadratic", mesh: "1.6k", order: Order::Quadratic, cavity: false },
    Case { name: "outside-12k-linear", mesh: "12k", order: Order::Linear, cavity: false },
    Case { name: "cavity-5k-linear", mesh: "5k", order: Order::Linear, cavity: true },
    Case { name: "cavity-5k-quadratic", mesh: "5k", order: Order::Quadratic, cavity: true },
    Case { name: "cavity-12k-linear", mesh: "12k", order: Order::Linear, cavity: true },
];

fn main() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [reference, folder] = &words[..] else { bail!("bench-contact REFERENCE FOLDER") };
    let reference = Reference(reference.into());
    for case in &CASES {
        let told = case.solve(&reference, folder.as_ref()).context(case.name)?;
        println!("{told}");
    }
    Ok(())
}

impl Case {
    /// The applicator as it is put in.
    fn rigid(&self, wider_mm: f64, mesh: &TetMesh) -> SphereOnShaft {
        if self.cavity {
            // The way in is wider than a tetrahedron: a narrow one leaves tissue across it.
            let radius_mm = 6.0 + 5.0 * wider_mm;
            let shaft = Shaft { direction: OUT, radius_mm, length_mm: 90.0 };
            return SphereOnShaft {
                centre: CENTRE,
                radius_mm: 17.5 + wider_mm,
                shaft: Some(shaft),
            };
        }
        // Just beyond all of the tissue, in front of its middle, moved aside.
        let front = mesh.points().iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
        let centre = Point::new(CENTRE.x + 10.0, front - 35.0, CENTRE.z + 8.0);
        SphereOnShaft { centre, radius_mm: 20.0, shaft: None }
    }

    /// After that share of its way.
    fn pose(&self, share: f64, put_in: &SphereOnShaft) -> Pose {
        if self.cavity {
            let turn = Vector::new(0.06, 0.0, 0.1) * share;
            let turn = nalgebra::UnitQuaternion::from_scaled_axis(turn);
            let shift = Vector::new(4.0, 1.5, -3.0) * share;
            return Pose::from(shift) * Pose::rotation_wrt_point(turn, put_in.centre);
        }
        Pose::from((-OUT * 24.0 + Vector::new(-6.0, 0.0, -4.0)) * share)
    }

    fn solve(&self, reference: &Reference, folder: &Path) -> Result<serde_json::Value> {
        let mesh = reference.mesh(self.mesh)?;
        let cavity = self.rigid(1.0, &mesh);
        let mesh = if self.cavity { snapped_to_cavity(&mesh, &cavity)?.0 } else { Arc::new(mesh) };
        let rigid = self.rigid(0.0, &mesh);
        let load = Load { ct: supine(), target: reference::tilt() };
        let params =
            Params { order: self.order, cut: Cut::Free, tolerance: 1e-8, ..Params::default() };
        let insertion = Insertion {
            rigid: &rigid,
            contact: Contact::Unilateral,
            cavity: self.cavity.then_some(&cavity as &dyn supine_fem::RigidBody),
        };
        let (start, body) = (cpu_s(), Body::new(mesh.clone(), Tissue::default()));
        let (mut live, _) =
            Applicator::attach(&body, &load, &params, &insertion, Progress::none())?;
        for step in 1..=STEPS {
            live.step(&self.pose(f64::from(step) / f64::from(STEPS), &rigid))?;
            live.renew()?;
        }
        let seconds = cpu_s() - start;
        self.write(&folder.join(format!("{}.npz", self.name)), &mesh, &rigid, &live)?;
        Ok(json!({
            "name": self.name,
            "pressed": live.coupled_nodes(),
            "force_n": live.reaction().force_n.norm(),
            "cpu_s": seconds,
            "peak_mb": memory_mb("VmHWM")?,
            "bearing": live.bearing().iter().filter(|bears| **bears).count(),
        }))
    }

    fn write(
        &self,
        path: &Path,
        mesh: &TetMesh,
        rigid: &SphereOnShaft,
        live: &Applicator,
    ) -> Result<()> {
        let (nodes, cells, held) = nodes_and_cells(mesh, self.order, live.bearing());
        let mut forces = vec![Vector::zeros(); nodes.len()];
        live.contact_forces().iter().for_each(|(n, force)| forces[*n as usize] = *force);
        let pose = live.pose();
        let axis = rigid.shaft.map_or_else(Vector::zeros, |shaft| pose * shaft.direction);
        let shaft = rigid.shaft.map_or([0.0; 2], |shaft| [shaft.radius_mm, shaft.length_mm]);
        let force = (reference::tilt() - supine()) * Tissue::default().weight();
        let away = if self.cavity { Vector::zeros() } else { OUT };
        let mut file = NpzWriter::new(File::create(path)?);
        file.add_array("nodes", &table(nodes.iter().map(|p| p.coords)))?;
        file.add_array("cells", &cells)?;
        file.add_array("held", &Array1::from(held))?;
        file.add_array("load", &vector(&force))?;
        file.add_array("centre", &vector(&(pose * rigid.centre).coords))?;
        file.add_array("radius", &Array1::from(vec![rigid.radius_mm]))?;
        file.add_array("axis", &vector(&axis))?;
        file.add_array("shaft", &Array1::from(shaft.to_vec()))?;
        file.add_array("away", &vector(&away))?;
        file.add_array(
            "moved",
            &table(live.deformation()?.displacement().values().iter().copied()),
        )?;
        file.add_array("forces", &table(forces.into_iter()))?;
        file.finish()?;
        Ok(())
    }
}

fn vector(v: &Vector) -> Array1<f64> {
    Array1::from(vec![v.x, v.y, v.z])
}

fn table(rows: impl Iterator<Item = Vector>) -> Array2<f64> {
    let flat: Vec<f64> = rows.flat_map(|v| [v.x, v.y, v.z]).collect();
    Array2::from_shape_fn((flat.len() / 3, 3), |(n, k)| flat[3 * n + k])
}

/// All nodes in the CT shape, the cells that bear, and the nodes that the chest wall holds.
fn nodes_and_cells(
    mesh: &TetMesh,
    order: Order,
    bearing: &[bool],
) -> (Vec<Point>, Array2<i64>, Vec<i64>) {
    let mut nodes = mesh.points().to_vec();
    let edges = Edges::new(mesh);
    let corners = nodes.len();
    let wall = mesh.boundary().iter().filter(|face| face.tag == BoundaryTag::ChestWall);
    let mut held: Vec<i64> = wall.clone().flat_map(|face| face.points.map(i64::from)).collect();
    if order == Order::Quadratic {
        let middle = |[a, b]: &[u32; 2]| {
            nalgebra::center(&mesh.points()[*a as usize], &mesh.points()[*b as usize])
        };
        nodes.extend(edges.ends().iter().map(middle));
        let mut sides: Vec<[u32; 2]> = wall
            .flat_map(|f| [(0, 1), (1, 2), (2, 0)].map(|(a, b)| [f.points[a], f.points[b]]))
            .collect();
        sides.iter_mut().for_each(|side| side.sort_unstable());
        let of_wall = |end: &[u32; 2]| {
            let mut end = *end;
            end.sort_unstable();
            sides.contains(&end)
        };
        let middles = edges.ends().iter().enumerate().filter(|(_, ends)| of_wall(ends));
        held.extend(middles.map(|(e, _)| (corners + e) as i64));
    }
    held.sort_unstable();
    held.dedup();
    let kept: Vec<usize> = (0..mesh.tets().len()).filter(|t| bearing[*t]).collect();
    let width = if order == Order::Quadratic { 10 } else { 4 };
    let cells = Array2::from_shape_fn((kept.len(), width), |(row, k)| {
        let t = kept[row];
        match k {
            0..4 => i64::from(mesh.tets()[t][k]),
            // Edges are in the order of VTK.
            _ => (corners + edges.of_tets()[t][k - 4] as usize) as i64,
        }
    });
    (nodes, cells, held)
}
