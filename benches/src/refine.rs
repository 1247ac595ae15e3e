//! The error of the tumour's displacement by where a mesh is fine, on the labels of a finished run:
//! `bench-refine RUN N...`, JSON on stdout.
//!
//! The error is that of the mesh alone: against the same tissue meshed with several times as many
//! tetrahedra, fine where the displacement depends on it.
#![expect(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "a measurement reads its input and tells its result"
)]

use anyhow::{Context, Result, ensure};
use std::path::Path;
use std::sync::Arc;
use supine_fem::{Body, Load, Params as SolverParams, Tissue, solve};
use supine_flow::{Goal, Mesher, Refine, Summary, mesh_region, read_surfaces};
use supine_mesh::{Displacement, Edges, Locator, Order, TetMesh};
use supine_space::{Point, Progress, Sphere, Vector};
use supine_tetrahedralise::{Domain, Params};
use supine_volume::Region;

/// Tetrahedra of the mesh whose displacement counts as the true one.
const TRUE: usize = 20_000;
/// Meshes of nearly the same number, so that no single mesh decides.
const MESHES: usize = 3;
/// Samples along the tumour's radius.
const SAMPLES: i32 = 6;

fn main() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    ensure!(words.len() >= 2, "bench-refine RUN N...");
    let problem = Problem::read(Path::new(&words[0]))?;
    let fine = problem.mesh(TRUE, Some(Order::Quadratic))?;
    let truth = problem.moved(&fine, Order::Quadratic, true)?;
    let mut rows = Vec::new();
    for n in &words[1..] {
        let n: usize = n.parse()?;
        for order in [Order::Linear, Order::Quadratic] {
            let wishes = [(None, false), (Some(order), false), (None, true), (Some(order), true)];
            let curved = |(_, curved): &(_, bool)| order == Order::Quadratic || !curved;
            for (goal, curved) in wishes.into_iter().filter(curved) {
                let (mut square, mut worst) = (0.0, f64::INFINITY);
                for mesh in 0..MESHES {
                    let mesh = problem.mesh(n + n * mesh / 20, goal)?;
                    let error = problem.moved(&mesh, order, curved)? - truth;
                    square += error.norm_squared() / MESHES as f64;
                    worst = worst.min(supine_mesh::quality(&mesh).min_dihedral_deg);
                }
                rows.push(serde_json::json!({
                    "tetrahedra": n, "order": order.number(), "goal": goal.is_some(),
                    "curved": curved, "error_mm": square.sqrt(), "min_dihedral_deg": worst,
                }));
            }
        }
    }
    let moved = serde_json::json!({ "moved_mm": truth.norm(), "rows": rows });
    println!("{moved}");
    Ok(())
}

/// The tissue, the tumour and what moves it.
struct Problem {
    region: (Arc<supine_volume::LabelMap>, Option<Arc<supine_volume::Surfaces>>, Sphere),
    tumour: Sphere,
    tissue: Tissue,
    load: Load,
}

impl Problem {
    fn read(run: &Path) -> Result<Self> {
        let summary = std::fs::read_to_string(run.join("summary.json"))?;
        let summary: Summary = serde_json::from_str(&summary)?;
        let labels = supine_exchange::read_labels(&run.join("labels.seg.nrrd"), Progress::none())?;
        let surfaces = read_surfaces(&run.join(".stages/surfaces"), &labels, Progress::none())?;
        let region = &summary.parameters.region;
        let sphere = Sphere::new(Point::from(region.centre_mm), region.radius_mm)?;
        let tumour = summary.position.tumour.as_ref().context("no tumour")?;
        let gravity = Vector::from(summary.position.table.gravity);
        Ok(Self {
            region: (Arc::new(labels), surfaces.map(Arc::new), sphere),
            tumour: Sphere::new(Point::from(tumour.centre_mm), tumour.radius_mm)?,
            tissue: Tissue::default(),
            load: Load { ct: supine_space::supine(), target: gravity.normalize() },
        })
    }

    /// A mesh, fine where the displacement of elements of that order depends on it.
    fn mesh(&self, tetrahedra: usize, goal: Option<Order>) -> Result<Arc<TetMesh>> {
        let (labels, surfaces, sphere) = &self.region;
        let region = Region::new(labels.clone(), *sphere)?.with_surfaces(surfaces.clone())?;
        let params = Params { tetrahedra, ..Params::default() };
        let refine = goal.map_or(Refine::Nowhere, |order| {
            Refine::Goal(Box::new(Goal {
                place: self.tumour,
                tissue: self.tissue,
                load: self.load,
                solver: solver(order),
            }))
        });
        let mesher = (Mesher::Native, &refine);
        let (mesh, _) = mesh_region(&region, &params, mesher, Progress::none())?;
        ensure!(mesh.tets().len() == tetrahedra, "{} tetrahedra", mesh.tets().len());
        Ok(mesh.into())
    }

    /// Mean displacement of the tumour, mm, by elements straight or curved.
    fn moved(&self, mesh: &Arc<TetMesh>, order: Order, curved: bool) -> Result<Vector> {
        let (labels, surfaces, sphere) = &self.region;
        let offsets = if curved {
            let region = Region::new(labels.clone(), *sphere)?.with_surfaces(surfaces.clone())?;
            let domain = Domain::new(&region, &Params::default(), Progress::none())?;
            Some(domain.curved(mesh)?.0)
        } else {
            None
        };
        let body = Body { curved: offsets, ..Body::new(mesh.clone(), self.tissue) };
        let (u, _) = solve(&body, &self.load, &solver(order), Progress::none())?;
        Ok(mean(mesh, u.displacement(), &self.tumour))
    }
}

fn solver(order: Order) -> SolverParams {
    SolverParams { order, ..SolverParams::default() }
}

fn mean(mesh: &Arc<TetMesh>, u: &Displacement, place: &Sphere) -> Vector {
    let (edges, locator) = (Edges::new(mesh), Locator::new(mesh.clone()));
    let step = place.radius() / f64::from(SAMPLES);
    let along = || (-SAMPLES..=SAMPLES).map(|n| f64::from(n) * step);
    let found: Vec<_> = along()
        .flat_map(|z| along().flat_map(move |y| along().map(move |x| Vector::new(x, y, z))))
        .map(|offset| place.centre() + offset)
        .filter(|p| place.contains(p))
        .filter_map(|p| locator.locate(&p))
        .collect();
    let sum: Vector = found.iter().map(|l| u.at(mesh, &edges, l.tet, l.weights)).sum();
    sum / found.len() as f64
}
