//! `supine solve`: the displacement of a mesh under gravity.

use super::{Gather, Outputs, ends, given_mesh, mesh_file, messages, usage};
use crate::nodes::{Law, Meshed};
use crate::shared::statics;
use crate::spec::Spec;
use crate::{Error, NodeId, Observer};
use serde::Serialize;
use std::path::PathBuf;
use supine_exchange::{Spring, write_mesh_fields, write_problem};
use supine_fem::{Between, Body, Cut, Info, RestState, between, sensitivity};
use supine_mesh::{Deformation, Displacement};
use supine_report::Warning;
use supine_space::Vector;

/// Keys of the table of parameters that it takes, beside the tilt of the operating table.
pub const KEYS: &[&str] = &[
    "position",
    "tissue.young",
    "tissue.poisson",
    "tissue.density",
    "tissue.law",
    "tissue.stiffening",
    "tissue.fibres",
    "tissue.fibre_stiffening",
    "tissue.fibre_direction",
    "tissue.rest",
    "tissue.cut",
    "tissue.spring",
    "wall.hold",
    "wall.shear",
    "wall.radius",
    "wall.centre",
    "skin.young",
    "skin.thickness",
    "skin.stretch",
    "tissue.young_interval",
    "mesh.order",
];

/// What is asked.
#[derive(Clone, Debug)]
pub struct Solve {
    /// Values for [`KEYS`], and the tilt of the operating table for [`Target::Table`].
    pub spec: Spec,
    /// The mesh at the CT shape, with its boundary tags.
    pub mesh: PathBuf,
    /// Where gravity points.
    pub target: Target,
    /// Whether the derivative by the modulus is wanted too.
    pub sensitivity: bool,
    /// A file for the same problem, for another solver.
    pub problem: Option<PathBuf>,
    /// The file of the deformed mesh.
    pub out: PathBuf,
    /// Whether files that are there already may be replaced.
    pub overwrite: bool,
}

/// Where gravity points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// As on the table that the specification gives.
    Table,
    /// As in a patient who sits upright.
    Sitting,
    /// Along a direction of any length, LPS.
    Direction([f64; 3]),
}

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub struct SolveDone {
    /// The file of the deformed mesh.
    pub deformed: PathBuf,
    /// Direction of gravity, LPS, unit vector.
    pub gravity: [f64; 3],
    /// Young's modulus, kPa.
    pub young_kpa: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Density, kg/m³.
    pub density_kg_m3: f64,
    /// Order of the displacement within a tetrahedron.
    pub order: u8,
    /// Newton steps.
    pub iterations: usize,
    /// Residual force, relative.
    pub residual: f64,
    /// Smallest det F.
    pub min_det_f: f64,
    /// Largest det F.
    pub max_det_f: f64,
    /// Stiffness of the springs at the cut, kPa/mm.
    pub spring_kpa_mm: Option<f64>,
    /// Largest displacement of a node, mm.
    pub max_displacement_mm: f64,
    /// Largest derivative of a displacement by the modulus, mm/kPa, where it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_displacement_mm_per_kpa: Option<f64>,
    /// What an interval of moduli gives, where it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub young_interval: Option<IntervalFacts>,
    /// What the user must know.
    #[serde(serialize_with = "messages")]
    pub warnings: Vec<Warning>,
}

/// What an interval of moduli gives.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct IntervalFacts {
    /// Its ends, kPa.
    pub young_kpa: [f64; 2],
    /// Largest displacement of a node at both ends, mm.
    pub max_displacement_mm: [f64; 2],
    /// How far a displacement within the interval lies outside those at its ends, mm.
    pub overshoot_mm: f64,
}

/// Finds the displacement of a mesh under gravity, by the law and the solver of a run.
///
/// # Errors
/// When an input cannot be used, the solver fails, or a file cannot be written.
pub fn solve(given: &Solve, observer: &dyn Observer) -> Result<SolveDone, Error> {
    mesh_file(&given.out)?;
    Outputs::beside(given.spec.files().chain([given.mesh.as_path()]))
        .file("--out", Some(&given.out))
        .file("--problem", given.problem.as_deref())
        .check(given.overwrite)?;
    let case = given.spec.case()?;
    let target = match given.target {
        Target::Table => case.table_pose()?.gravity(),
        Target::Sitting => supine_space::sitting(),
        Target::Direction(g) if Vector::from(g).norm() > 0.0 => Vector::from(g).normalize(),
        Target::Direction(_) => return Err(usage("--gravity: 0,0,0 is no direction")),
    };
    let law = Law::under(&case, case.load_to(target));
    let meshed = Meshed::given(given_mesh(&given.mesh)?);
    let body = law.body(&meshed, None, None);
    problem(given, &law, &body)?;
    let gather = Gather::new(observer, &[]);
    let solution = find(given, &law, &body, case.young_interval_kpa, &gather)?;
    gather.warn_all(NodeId::Solve, solution.info.warnings.clone());
    let interval = solution.between.as_ref().zip(case.young_interval_kpa);
    let young_interval = interval.map(|(between, young_kpa)| {
        let max_displacement_mm =
            [&between.low, &between.high].map(|end| end.displacement().max_norm());
        let overshoot_mm = between.overshoot_mm;
        IntervalFacts { young_kpa, max_displacement_mm, overshoot_mm }
    });
    if let Some(between) = &solution.between {
        gather.warn_all(NodeId::Interval, between.warnings.clone());
    }
    write_mesh_fields(&body.mesh, &solution.fields(), &given.out).map_err(Error::product)?;
    let info = &solution.info;
    Ok(SolveDone {
        deformed: given.out.clone(),
        gravity: target.into(),
        young_kpa: case.tissue.young_kpa,
        poisson: case.tissue.poisson,
        density_kg_m3: case.tissue.density_kg_m3,
        order: case.mesh.order.number(),
        iterations: info.solve.iterations,
        residual: info.solve.residual,
        min_det_f: info.solve.min_det_f,
        max_det_f: info.solve.max_det_f,
        spring_kpa_mm: info.solve.spring_kpa_mm,
        max_displacement_mm: info.solve.max_displacement_mm,
        max_displacement_mm_per_kpa: solution.slope.as_ref().map(Displacement::max_norm),
        young_interval,
        warnings: gather.warnings(),
    })
}

/// Writes the problem for another solver, when it is asked for and such a file can hold it.
fn problem(given: &Solve, law: &Law, body: &Body) -> Result<(), Error> {
    let Some(path) = &given.problem else { return Ok(()) };
    let (solver, load) = (law.solver(), law.load());
    if solver.rest == RestState::Unloaded {
        return Err(usage("--problem: the mesh is the stress-free shape with --rest net only"));
    }
    if let Some(what) = law.beyond_problem_files() {
        return Err(usage(format!(
            "--problem: neither .feb nor .inp is written with {what}: only with law = \"neo-hookean\", without fibres, and with \
             a wall and a skin that are as they are unless something is said"
        )));
    }
    let springs = if solver.cut == Cut::Spring {
        let springs =
            supine_fem::nodal_springs(body, solver.order, solver.spring_kpa_mm).into_iter();
        springs.map(|s| Spring { nodes: s.nodes, stiffness: s.stiffness }).collect()
    } else {
        vec![]
    };
    if !springs.is_empty() && ends(path, &[".feb"]) {
        return Err(usage(
            "--problem: a .feb file holds no springs between nodes and the ground; name an .inp file, or add --cut free or \
             --cut fixed",
        ));
    }
    let held = solver.cut == Cut::Fixed;
    let statics = statics(&law.tissue(), load.target - load.ct, solver.order, held);
    write_problem(&body.mesh, &statics, &springs, path).map_err(Error::product)
}

/// What was found, as fields.
struct Found {
    deformation: Deformation,
    slope: Option<Displacement>,
    between: Option<Between>,
    info: Info,
}

fn find(
    given: &Solve,
    law: &Law,
    body: &Body,
    interval_kpa: Option<[f64; 2]>,
    gather: &Gather<'_>,
) -> Result<Found, Error> {
    let (load, solver) = (law.load(), law.solver());
    let (deformation, slope, info) = gather.work(NodeId::Solve, |progress| {
        if given.sensitivity {
            let (deformation, slope, info) = sensitivity(body, &load, &solver, progress)?;
            return Ok((deformation, Some(slope), info));
        }
        let (deformation, info) = supine_fem::solve(body, &load, &solver, progress)?;
        Ok((deformation, None, info))
    })?;
    let ends = |ends| {
        gather.work(NodeId::Interval, |progress| Ok(between(body, &load, &solver, ends, progress)?))
    };
    Ok(Found { deformation, slope, between: interval_kpa.map(ends).transpose()?, info })
}

impl Found {
    fn fields(&self) -> Vec<(&'static str, &Displacement)> {
        let mut fields = vec![("displacement", self.deformation.displacement())];
        fields.extend(self.slope.iter().map(|slope| ("displacement_per_kpa", slope)));
        if let Some(between) = &self.between {
            fields.push(("displacement_low_modulus", between.low.displacement()));
            fields.push(("displacement_high_modulus", between.high.displacement()));
        }
        fields
    }
}
