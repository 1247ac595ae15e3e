//! A cold solution of one of the problems of the reference data, its cost and its error:
//! `bench-mechanics REFERENCE MESH ORDER FIELD TOLERANCE [curved | LAW STIFFENING |
//! fibres RATIO | BOUNDARY]`, JSON on stdout.
//!
//! REFERENCE is the folder of the reference's arrays, MESH one of its meshes (`12k`), FIELD the
//! name of one of its displacement fields (`net_tilt`), `unl_X` for the stress-free shape, or
//! `net_sit_dxdE` for the derivative by the modulus. `curved`: the elements follow skin and chest
//! wall, and no stored field is theirs. LAW (`exponential`) takes its fields from `laws_1.6k_P2`,
//! BOUNDARY (a wall that slides, a skin or both: `wall`, `skin`, `both`, `soft`, `both_soft`) from
//! `surfaces_1.6k_P2`.
//! Everything from the mesh to the displacement counts as the
//! solution.
#![expect(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "a measurement reads its input and tells its result"
)]

mod curved;
mod reference;

use anyhow::{Context, Result, bail, ensure};
use ndarray::{Array1, Array2};
use ndarray_npy::ReadNpzError;
use reference::{Reference, cpu_s, memory_mb, order, rows};
use serde_json::json;
use std::sync::Arc;
use supine_fem::{
    Body, Cut, Info, Law, Load, Membrane, Params, RestState, SlidingArea, Tissue, sensitivity,
    solve, unload,
};
use supine_mesh::{Displacement, Edges, Locator, Order, TetMesh};
use supine_space::{Point, Progress, Vector, sitting, supine};

/// A solution is repeated until so much time went by, at most so often; the median counts.
const ENOUGH_S: f64 = 1.0;
const MOST: usize = 9;
/// The mesh whose quadratic solution the errors are taken against, or the next finer one that holds
/// the field.
const TRUE: [&str; 2] = ["40k", "12k"];

fn main() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [reference, mesh, order, field, tolerance, sides @ ..] = &words[..] else {
        bail!(
            "bench-mechanics REFERENCE MESH ORDER FIELD TOLERANCE [curved | LAW STIFFENING | BOUNDARY]"
        );
    };
    let order = self::order(order)?;
    let reference = Reference(reference.into());
    let mut problem = reference.problem(mesh, order, field)?;
    let curved = sides == ["curved"];
    match sides {
        [] => {}
        [word] if word == "curved" => {}
        [boundary] => {
            let params = reference.boundary(boundary, problem.params)?;
            (problem.params, problem.stored) = (params, Some(("surfaces", boundary.clone())));
        }
        [name, ratio] => {
            if name == "fibres" {
                problem.tissue.fibres = ratio.parse()?;
            } else {
                let law = Law::ALL.into_iter().find(|law| law.name() == name);
                problem.tissue.law = law.context("no such law")?;
                problem.tissue.stiffening = ratio.parse()?;
            }
            problem.stored = Some(("laws", name.clone()));
        }
        _ => bail!("{sides:?} is neither `curved` nor a law nor a boundary"),
    }
    if curved {
        problem.curved = Some(curved::offsets(&reference, &problem.mesh)?);
    }
    let before_mb = memory_mb("VmRSS")?;
    let (mut seconds, mut answer) = (Vec::new(), None);
    while seconds.iter().sum::<f64>() < ENOUGH_S && seconds.len() < MOST {
        let start = cpu_s();
        answer = Some(problem.solve(tolerance.parse()?)?);
        seconds.push(cpu_s() - start);
    }
    let peak_mb = memory_mb("VmHWM")?;
    let (u, info) = answer.context("no solution")?;
    seconds.sort_by(f64::total_cmp);
    let off =
        if curved { None } else { reference.difference((mesh, order, field), &problem, &u)? };
    let result = json!({
        "tetrahedra": problem.mesh.tets().len(),
        "unknowns": info.unknowns,
        "factor_mb": info.factor_entries as f64 * size_of::<f64>() as f64 * 1e-6,
        "iterations": info.solve.iterations,
        "indefinite": info.solve.indefinite,
        "load_steps": info.solve.load_steps,
        "cpu_s": seconds[seconds.len() / 2],
        "runs": seconds.len(),
        "before_mb": before_mb,
        "peak_mb": peak_mb,
        "max_mm": info.solve.max_displacement_mm,
        "off": off,
        "probes_mm": reference.at_probes(&problem.mesh, &u, field)?,
    });
    println!("{result}");
    Ok(())
}

/// What is solved.
struct Problem {
    mesh: Arc<TetMesh>,
    tissue: Tissue,
    young_kpa: Option<Arc<[f64]>>,
    /// How far the nodes of curved elements lie off the straight mesh, mm.
    curved: Option<Displacement>,
    load: Load,
    params: Params,
    wanted: Wanted,
    /// Archive and name of its stored fields, when they are not those of the mesh.
    stored: Option<(&'static str, String)>,
}

/// What of it is wanted.
#[derive(Clone, Copy, PartialEq)]
enum Wanted {
    Displacement,
    /// The derivative of the displacement by the modulus, mm/kPa.
    Slope,
    /// The stress-free shape.
    Shape,
}

impl Problem {
    fn solve(&self, tolerance: f64) -> Result<(Displacement, Info)> {
        let (young_kpa, curved) = (self.young_kpa.clone(), self.curved.clone());
        let body = Body { young_kpa, curved, ..Body::new(self.mesh.clone(), self.tissue) };
        let params = Params { tolerance, ..self.params };
        match self.wanted {
            Wanted::Displacement => {
                let (found, info) = solve(&body, &self.load, &params, Progress::none())?;
                Ok((found.displacement().clone(), info))
            }
            Wanted::Slope => {
                let (_, slope, info) = sensitivity(&body, &self.load, &params, Progress::none())?;
                Ok((slope, info))
            }
            Wanted::Shape => {
                let (y, unloading) = unload(&body, self.load.ct, &params, Progress::none())?;
                let y = y.displacement().clone();
                Ok((y, Info { unloading: Some(unloading), ..Info::default() }))
            }
        }
    }
}

impl Reference {
    /// The problem whose solution is the field of that name.
    fn problem(&self, mesh: &str, order: Order, field: &str) -> Result<Problem> {
        let words: Vec<&str> = field.split('_').collect();
        let (hetero, words) = match &words[..] {
            ["hetero", rest @ ..] => (true, rest),
            all => (false, all),
        };
        let (rest, pose, more) = match words {
            ["net", pose, more @ ..] => (RestState::Net, *pose, more),
            ["unl", pose, more @ ..] => (RestState::Unloaded, *pose, more),
            _ => bail!("{field} is no field of one solution"),
        };
        let mut tissue = Tissue::default();
        let mut params = Params { order, rest, cut: Cut::Free, ..Params::default() };
        match more {
            [] | ["dxdE"] => {}
            ["cutfixed"] => params.cut = Cut::Fixed,
            [young] => tissue.young_kpa = young.trim_start_matches('E').parse()?,
            _ => bail!("{field} is no field of one solution"),
        }
        let target = match pose {
            "tilt" => reference::tilt(),
            "sit" => sitting(),
            "X" => supine(),
            _ => bail!("{field} is no field of one solution"),
        };
        let young_kpa = if hetero {
            let mut stored = self.fields(mesh, order)?.context("no moduli for this mesh")?;
            let moduli: Array1<f64> = stored.by_name("hetero_E")?;
            Some(moduli.to_vec().into())
        } else {
            None
        };
        let load = Load { ct: supine(), target };
        let wanted = match (pose, more) {
            ("X", _) => Wanted::Shape,
            (_, ["dxdE"]) => Wanted::Slope,
            _ => Wanted::Displacement,
        };
        Ok(Problem {
            mesh: self.mesh(mesh)?.into(),
            tissue,
            young_kpa,
            curved: None,
            load,
            params,
            wanted,
            stored: None,
        })
    }

    /// The parameters with a boundary of `fixtures/fem/make_surfaces.py`.
    fn boundary(&self, name: &str, params: Params) -> Result<Params> {
        let centre: Array1<f64> = self.open("surfaces_1.6k_P2")?.by_name("wall_centre")?;
        let area = SlidingArea {
            centre_mm: Some([centre[0], centre[1], centre[2]]),
            radius_mm: 60.0,
            rim_mm: 20.0,
            stiffness_kpa_mm: 0.02,
        };
        let skin = |young_kpa, stretch| Some(Membrane { thickness_mm: 1.8, young_kpa, stretch });
        let (sliding, skin) = match name {
            "wall" => (Some(area), None),
            "skin" => (None, skin(40.0, 1.02)),
            "both" => (Some(area), skin(40.0, 1.02)),
            "soft" => (None, skin(5.0, 1.1)),
            "both_soft" => (Some(area), skin(5.0, 1.1)),
            _ => bail!("no boundary is called {name}"),
        };
        Ok(Params { sliding, skin, ..params })
    }

    /// Largest nodal difference to the stored field, mm, if it is stored; that of the derivative as
    /// a share of its largest value.
    fn difference(
        &self,
        (mesh, order, field): (&str, Order, &str),
        problem: &Problem,
        u: &Displacement,
    ) -> Result<Option<f64>> {
        let (stored, field) = match &problem.stored {
            None => (self.fields(mesh, order)?, field.to_owned()),
            Some((archive, name)) => {
                let archive = format!("{archive}_{mesh}_P{}", order.number());
                (self.open(&archive).ok(), format!("{name}_{field}"))
            }
        };
        let Some(mut stored) = stored else { return Ok(None) };
        let stored = match stored.by_name::<_, ndarray::Ix2>(&field) {
            Ok(stored) => rows(&stored),
            Err(ReadNpzError::Zip(_)) => return Ok(None),
            Err(other) => return Err(other.into()),
        };
        ensure!(stored.len() == u.values().len(), "{} nodes stored", stored.len());
        let mut own = u.values().to_vec();
        if problem.wanted == Wanted::Shape {
            // Stored as positions.
            let points = problem.mesh.points();
            let edges = Edges::new(&problem.mesh);
            let middles = edges.ends().iter().map(|e| {
                let [a, b] = e.map(|n| points[n as usize].coords);
                (a + b) / 2.0
            });
            let all = points.iter().map(|p| p.coords).chain(middles);
            own.iter_mut().zip(all).for_each(|(u, x)| *u += x);
        }
        let both = stored.iter().zip(&own);
        let off = both.map(|(a, b)| (Vector::from(*a) - b).norm()).fold(0.0, f64::max);
        let relative = problem.wanted == Wanted::Slope;
        Ok(Some(if relative { off / u.max_norm() } else { off }))
    }

    /// Error at the probes against the finest quadratic solution, rms and largest, mm, if there is
    /// one.
    fn at_probes(
        &self,
        mesh: &Arc<TetMesh>,
        u: &Displacement,
        field: &str,
    ) -> Result<Option<[f64; 2]>> {
        let Ok(mut probes) = self.open("probes") else { return Ok(None) };
        let probes: Array2<f64> = probes.by_name("pts")?;
        let name = format!("P2_{field}");
        let finest = TRUE.into_iter().find_map(|finest| {
            self.open(&format!("probes_{finest}")).ok()?.by_name::<_, ndarray::Ix2>(&name).ok()
        });
        let Some(finest): Option<Array2<f64>> = finest else { return Ok(None) };
        let (edges, locator) = (Edges::new(mesh), Locator::new(mesh.clone()));
        let mut errors = Vec::new();
        for (at, moved) in rows(&probes).into_iter().zip(rows(&finest)) {
            let place = locator.nearest(&Point::from(at));
            let u = u.at(mesh, &edges, place.tet, place.weights);
            errors.push((u - Vector::from(moved)).norm());
        }
        let square = errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64;
        Ok(Some([square.sqrt(), errors.into_iter().fold(0.0, f64::max)]))
    }
}
