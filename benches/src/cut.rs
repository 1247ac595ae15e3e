//! The error of the displacement by what happens at the cut, against a truth that was solved on
//! more than the sphere: `bench-cut PATIENT BEYOND[,BEYOND...] CUT[,CUT...]`, JSON on stdout.
//!
//! PATIENT is a folder of the synthetic cohort; her labels, tissue and rest state are the true
//! ones. BEYOND: how far the sphere reaches beyond the breast's footprint, mm. CUT: `free`,
//! `fixed`, `spring`, or the stiffness of springs in kPa/mm.
#![expect(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "a measurement reads its input and tells its result"
)]

use anyhow::{Context, Result, bail, ensure};
use ndarray::{Array1, Array2};
use ndarray_npy::NpzReader;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use supine_exchange::{NamedPoint, read_labels, read_points};
use supine_fem::{Body, Cut, Load, Params as Solver, RestState, Tissue, solve};
use supine_flow::{Mesher, Refine, mesh_region};
use supine_mesh::{Displacement, Edges, Locator, Order, TetMesh};
use supine_space::{Point, Progress, Sphere, Vector, sitting, supine};
use supine_tetrahedralise::Params;
use supine_volume::{LabelMap, Region, label};

/// What a planner's mesh has.
const TETRAHEDRA: usize = 5000;
/// The cohort's `roi` reaches so far beyond the breast's footprint, mm.
const ROI_BEYOND_MM: f64 = 15.0;
/// The labels of the truth, by their numbers 0 to 9.
const LABELS: [u8; 10] = [
    label::OUTSIDE,
    label::FAT,
    label::SKIN,
    label::GLAND,
    label::TUMOUR,
    label::CHEST_WALL,
    label::BONE,
    label::LUNG,
    label::OUTSIDE,
    label::CHEST_WALL,
];
/// Samples along the edge of a tetrahedron of which its modulus is the mean.
const SAMPLES: usize = 6;

fn main() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    ensure!(words.len() == 3, "bench-cut PATIENT BEYOND[,BEYOND...] CUT[,CUT...]");
    let patient = Patient::read(Path::new(&words[0]))?;
    let mut rows = Vec::new();
    for beyond in words[1].split(',') {
        rows.extend(patient.rows(beyond.parse()?, words[2].split(','))?);
    }
    println!("{}", json!({ "breast_mm": patient.breast.radius(), "rows": rows }));
    Ok(())
}

/// A patient and her truth.
struct Patient {
    folder: PathBuf,
    labels: Arc<LabelMap>,
    /// Footprint of the breast.
    breast: Sphere,
    rest: RestState,
    tissue: Tissue,
    /// Moduli of fat, gland and skin where they differ, kPa.
    moduli: Option<[f64; 3]>,
    poses: [Pose; 2],
    supine: Vec<NamedPoint>,
    /// Points of the true mesh within the breast that are not on the wall.
    nodes: Vec<(usize, Point)>,
}

/// A direction of gravity and where things are under it.
struct Pose {
    name: &'static str,
    gravity: Vector,
    points: Vec<NamedPoint>,
    /// Displacement of all points of the true mesh, mm.
    moved: Array2<f32>,
}

fn json_file(path: &Path) -> Result<Value> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    Ok(serde_json::from_str(&text)?)
}

fn number(json: &Value, pointer: &str) -> Result<f64> {
    json.pointer(pointer).and_then(Value::as_f64).with_context(|| format!("no number {pointer}"))
}

fn triple(json: &Value, pointer: &str) -> Result<[f64; 3]> {
    let n = |k: usize| number(json, &format!("{pointer}/{k}"));
    Ok([n(0)?, n(1)?, n(2)?])
}

impl Patient {
    fn read(folder: &Path) -> Result<Self> {
        let (facts, truth) = (
            json_file(&folder.join("patient.json"))?,
            json_file(&folder.join("truth/truth.json"))?,
        );
        let footprint = number(&facts, "/roi/radius_mm")? - ROI_BEYOND_MM;
        let breast = Sphere::new(Point::from(triple(&facts, "/roi/centre_mm")?), footprint)?;
        let labels = read_labels(&folder.join("truth/labels.nrrd"), Progress::none())?;
        let moduli = match number(&truth, "/E_kPa") {
            Ok(_) => None,
            Err(_) => {
                let of = |tissue: &str| number(&truth, &format!("/E_kPa/{tissue}"));
                Some([of("fat")?, of("gland")?, of("skin")?])
            }
        };
        let young_kpa = number(&truth, "/E_kPa").or(number(&truth, "/E_volume_mean_breast_kPa"))?;
        let mut file = NpzReader::new(File::open(folder.join("truth/displacement.npz"))?)?;
        let nodes: Array2<f32> = file.by_name("nodes")?;
        let wall: Array1<u16> = file.by_name("wall_nodes")?;
        let wall: BTreeSet<usize> = wall.iter().map(|n| usize::from(*n)).collect();
        let at = |n: usize| Point::from([0, 1, 2].map(|k| f64::from(nodes[(n, k)])));
        let free = (0..nodes.nrows()).filter(|n| !wall.contains(n)).map(|n| (n, at(n)));
        let table = Vector::from(triple(&truth, "/gravity/operating")?).normalize();
        let mut pose = |name: &'static str, gravity: Vector| -> Result<Pose> {
            let points = read_points(&folder.join(format!("truth/points_{name}.csv")))?;
            Ok(Pose { name, gravity, points, moved: file.by_name(&format!("u_{name}"))? })
        };
        Ok(Self {
            folder: folder.into(),
            labels: Arc::new(labels.map(|l| LABELS[usize::from(*l)])),
            breast,
            rest: match truth["rest_state"].as_str() {
                Some("net") => RestState::Net,
                Some("unloaded") => RestState::Unloaded,
                other => bail!("rest state {other:?}"),
            },
            tissue: Tissue { young_kpa, poisson: number(&truth, "/nu")?, ..Tissue::default() },
            moduli,
            poses: [pose("operating", table)?, pose("sitting", sitting())?],
            supine: read_points(&folder.join("truth/points_supine.csv"))?,
            nodes: free.filter(|(_, p)| breast.contains(p)).collect(),
        })
    }

    /// The errors with a sphere that reaches so far beyond the breast; none when the CT does not
    /// hold it.
    fn rows<'c>(&self, beyond: f64, cuts: impl Iterator<Item = &'c str>) -> Result<Vec<Value>> {
        let sphere = Sphere::new(self.breast.centre(), self.breast.radius() + beyond)?;
        let region = match Region::new(self.labels.clone(), sphere) {
            Ok(region) => region,
            Err(held) => {
                return Ok(vec![json!({ "beyond_mm": beyond, "refused": held.to_string() })]);
            }
        };
        let params = Params { tetrahedra: TETRAHEDRA, ..Params::default() };
        let mesher = (Mesher::Native, &Refine::Nowhere);
        let (mesh, _) = mesh_region(&region, &params, mesher, Progress::none())?;
        let moduli = self.moduli.map(|m| self.young(&mesh, m));
        let mesh = Arc::new(mesh);
        let young_kpa = moduli.map(Into::into);
        let body = Body { young_kpa, ..Body::new(mesh.clone(), self.tissue) };
        let mut rows = Vec::new();
        for cut in cuts {
            let (kind, spring_kpa_mm) = match cut {
                "free" => (Cut::Free, None),
                "fixed" => (Cut::Fixed, None),
                "spring" => (Cut::Spring, None),
                stiffness => (Cut::Spring, Some(stiffness.parse()?)),
            };
            for pose in &self.poses {
                let load = Load { ct: supine(), target: pose.gravity };
                let order = Order::Quadratic;
                let solver = Solver {
                    order,
                    rest: self.rest,
                    cut: kind,
                    spring_kpa_mm,
                    ..Solver::default()
                };
                let (u, info) = solve(&body, &load, &solver, Progress::none())
                    .with_context(|| self.folder.display().to_string())?;
                let mut row = self.errors(&mesh, u.displacement(), pose)?;
                row["beyond_mm"] = beyond.into();
                row["cut"] = cut.into();
                row["pose"] = pose.name.into();
                row["spring_kpa_mm"] = info.solve.spring_kpa_mm.into();
                rows.push(row);
            }
        }
        Ok(rows)
    }

    /// Mean modulus of each tetrahedron by the labels within it, kPa.
    fn young(&self, mesh: &TetMesh, [fat, gland, skin]: [f64; 3]) -> Vec<f64> {
        let grid = self.labels.grid();
        let of = |p: Point| {
            let label = grid.voxel_at(&p).map(|v| self.labels.data()[grid.offset(v)])?;
            match label {
                label::FAT => Some(fat),
                label::GLAND | label::TUMOUR => Some(gland),
                label::SKIN => Some(skin),
                _ => None,
            }
        };
        let share = |n: usize| (n as f64 + 0.25) / SAMPLES as f64;
        let all = || (0..SAMPLES).flat_map(|i| (0..SAMPLES - i).map(move |j| (i, j)));
        let weights: Vec<[f64; 3]> = all()
            .flat_map(|(i, j)| (0..SAMPLES - i - j).map(move |k| [i, j, k].map(share)))
            .collect();
        (0..mesh.tets().len())
            .map(|t| {
                let [a, b, c, d] = mesh.corners(t);
                let inside =
                    weights.iter().map(|w| a + (b - a) * w[0] + (c - a) * w[1] + (d - a) * w[2]);
                let found: Vec<f64> = inside.filter_map(of).collect();
                if found.is_empty() { fat } else { found.iter().sum::<f64>() / found.len() as f64 }
            })
            .collect()
    }

    fn errors(&self, mesh: &Arc<TetMesh>, u: &Displacement, pose: &Pose) -> Result<Value> {
        let (edges, locator) = (Edges::new(mesh), Locator::new(mesh.clone()));
        let (mut tumour, mut fiducials) = (None, Vec::new());
        for (from, to) in self.supine.iter().zip(&pose.points) {
            ensure!(from.name == to.name, "{} and {} are no pair", from.name, to.name);
            let place = locator.nearest(&from.position);
            let error =
                u.at(mesh, &edges, place.tet, place.weights) - (to.position - from.position);
            match from.name.as_str() {
                "tumour" => tumour = Some(error.norm()),
                name if name.starts_with('f') => fiducials.push(error.norm()),
                _ => {}
            }
        }
        let at = |(n, p): &(usize, Point)| {
            let place = locator.locate(p)?;
            let moved = Vector::from([0, 1, 2].map(|k| f64::from(pose.moved[(*n, k)])));
            Some(((u.at(mesh, &edges, place.tet, place.weights) - moved).norm(), moved.norm()))
        };
        let (nodes, moved): (Vec<f64>, Vec<f64>) = self.nodes.iter().filter_map(at).unzip();
        Ok(json!({
            "tumour_mm": tumour.context("no tumour among the points")?,
            "fiducials_mm": [rms(&fiducials), largest(&fiducials)],
            "nodes_mm": [rms(&nodes), largest(&nodes)],
            "moved_mm": rms(&moved),
            "nodes": nodes.len(),
        }))
    }
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}
