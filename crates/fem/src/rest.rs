//! The two rest states.

use crate::discretisation::Discretisation;
use crate::foundation::Foundation;
use crate::inverse::{Inverse, Solver};
use crate::material::{Fibres, Material};
use crate::model::Model;
use crate::newton::{Effort, KnownEquilibrium, Newton, norm};
use crate::outcome::{Equilibrium, SolveError};
use crate::pattern::Pattern;
use crate::surfaces::Surfaces;
use crate::tangent::Tangent;
use crate::warm_start::{Rest, SolutionHistory, State, WarmStart};
use crate::{Cut, Error, Info, Job, RestState, Tissue, Unloading, from_ct, sensitivity};
use std::sync::Arc;
use supine_mesh::BoundaryTag;
use supine_record::Solve;
use supine_space::{Point, Progress, Vector, Warning};

/// An unloaded shape counts only when a forward solve from it returns this close to the CT, mm.
const RELOAD_LIMIT_MM: f64 = 0.05;
/// Weight of the tissue over its stiffness, ρ g L / E with L its thickness, above which the
/// unloaded shape reacts violently to small changes.
const SOFTNESS_LIMIT: f64 = 1.3;
/// The search for a modulus at which an unloaded shape exists: factor and number of trials.
const SEARCH: (f64, usize) = (1.25, 8);
/// Smallest step in which gravity is taken away, as a share; the search takes it away at once.
const SMALLEST_STEP: f64 = 0.125;

/// A body in equilibrium.
pub(crate) struct LoadedBody<const N: usize, const Q: usize> {
    /// The body on its stress-free shape.
    pub(crate) model: Model<N, Q>,
    /// Nodal forces on it, mN.
    pub(crate) load: Vec<Vector>,
    /// Displacement from the stress-free shape to the CT shape, mm.
    pub(crate) to_ct: Vec<Vector>,
    /// Displacement from the stress-free shape, mm.
    pub(crate) u: Vec<Vector>,
    /// Derivative of the displacement by the mean modulus, mm/kPa, when asked for.
    pub(crate) slope: Option<Vec<Vector>>,
    /// How it was found.
    pub(crate) info: Info,
}

/// Equilibrium under the change of gravity of a body whose CT shape is taken as stress-free.
///
/// # Errors
/// See [`crate::solve`].
pub(crate) fn net<const N: usize, const Q: usize>(
    job: &Job<'_>,
    discretisation: &Discretisation<N, Q>,
    before: &mut WarmStart<N, Q>,
    progress: Progress<'_>,
) -> Result<LoadedBody<N, Q>, Error> {
    let model = job.model(discretisation);
    let load = model.elements.load(discretisation.held.len(), job.force());
    let zero = discretisation.zero();
    let tangent = before.loaded.take(&discretisation.lower).map_err(|_| discretisation.memory())?;
    let mut newton = job.newton(&model, tangent, &discretisation.held);
    let known = KnownEquilibrium { u: &zero, load: &zero };
    let expected = job.expected(&before.equilibria);
    let equilibrium = newton
        .resumed(&load, expected, known, job.params.tolerance, progress)
        .map_err(|halt| newton.failed(halt, job.params.tolerance))?;
    let info = job.info(&equilibrium, newton.effort, &model, &discretisation.lower)?;
    let slope =
        job.slope.then(|| sensitivity::net(job, &mut newton, &equilibrium.u)).transpose()?;
    before.loaded.keep(newton.into_tangent());
    before.equilibria.keep(|| job.state(job.load.target, equilibrium.u.clone(), slope.clone()));
    Ok(LoadedBody { model, load, to_ct: zero, u: equilibrium.u, slope, info })
}

/// Equilibrium of a body whose shape without gravity is stress-free.
///
/// The unloaded shape is accepted only if the CT shape is a stable equilibrium on it and, where
/// nothing is kept `before`, a forward solve from it, begun cold, returns to the CT shape.
///
/// # Errors
/// See [`crate::solve`]; [`Error::NoUnloadedShape`] when there is none, with a modulus at which
/// there is.
pub(crate) fn unloaded<const N: usize, const Q: usize>(
    job: &Job<'_>,
    discretisation: &Discretisation<N, Q>,
    before: &mut WarmStart<N, Q>,
    progress: Progress<'_>,
) -> Result<LoadedBody<N, Q>, Error> {
    let mut rest = match before.take_rest(job.young_kpa()) {
        Some(rest) => rest,
        None => stress_free(job, discretisation, before, progress)?,
    };
    let Rest { model, to_ct, .. } = rest.clone();
    let load = model.elements.load(discretisation.held.len(), job.force());
    let ct_load =
        model.elements.load(discretisation.held.len(), job.load.ct * job.body.tissue.weight());
    let tangent = before.loaded.take(&discretisation.lower).map_err(|_| discretisation.memory())?;
    let mut newton = job.newton(&model, tangent, &discretisation.held);
    let known = KnownEquilibrium { u: &to_ct, load: &ct_load };
    let off_ct = job.expected(&before.equilibria);
    let expected = off_ct.map(|d| d.iter().zip(&to_ct).map(|(d, ct)| d + ct).collect());
    let equilibrium = newton
        .resumed(&load, expected, known, job.params.tolerance, progress.part(0.6, 1.0))
        .map_err(|halt| newton.failed(halt, job.params.tolerance))?;
    let mut info = job.info(&equilibrium, newton.effort, &model, &discretisation.lower)?;
    info.unloading = Some(rest.unloading);
    info.solve.reload_error_mm = rest.unloading.reload_error_mm;
    info.warnings.extend(job.softness_warning());
    let slope = if job.slope {
        let of_rest = rest.slope(job, discretisation, before)?;
        let fibres = job.fibres(discretisation);
        let inverse = job.inverse(discretisation, rest.tissue(), fibres.as_ref());
        let parts = [to_ct.as_slice(), &of_rest];
        Some(sensitivity::unloaded(job, &mut newton, &inverse, parts, &equilibrium.u)?)
    } else {
        None
    };
    before.loaded.keep(newton.into_tangent());
    before
        .equilibria
        .keep(|| job.state(job.load.target, from_ct(&equilibrium.u, &to_ct), slope.clone()));
    before.keep_rest(rest);
    Ok(LoadedBody { model, load, to_ct, u: equilibrium.u, slope, info })
}

/// What resists deformation: the material of each element, and the boundary.
#[derive(Clone, Copy)]
struct Elastic<'a, const N: usize> {
    materials: &'a [Material],
    surfaces: &'a Surfaces<N>,
}

impl<const N: usize, const Q: usize> Rest<N, Q> {
    fn tissue(&self) -> Elastic<'_, N> {
        let Model { materials, surfaces, .. } = &self.model;
        Elastic { materials, surfaces }
    }

    /// −E times its derivative by the mean modulus E, mm.
    fn slope(
        &mut self,
        job: &Job<'_>,
        discretisation: &Discretisation<N, Q>,
        before: &mut WarmStart<N, Q>,
    ) -> Result<Vec<Vector>, Error> {
        if let Some(slope) = &self.slope {
            return Ok(slope.clone());
        }
        let tangent =
            before.in_ct.take(&discretisation.lower).map_err(|_| discretisation.memory())?;
        let mut solver = Solver::ready(tangent);
        let fibres = job.fibres(discretisation);
        let inverse = job.inverse(discretisation, self.tissue(), fibres.as_ref());
        let slope = sensitivity::of_rest(&inverse, &mut solver, &self.model, &self.to_ct)?;
        before.in_ct.keep(solver.tangent);
        before.shapes.keep(|| {
            let to_rest = self.to_ct.iter().map(|ct| -ct).collect();
            let by_modulus = slope.iter().map(|s| s / -self.young_kpa).collect();
            job.state(job.load.ct, to_rest, Some(by_modulus))
        });
        self.slope = Some(slope.clone());
        Ok(slope)
    }
}

/// The unloaded shape; takes 0.6 of the progress.
///
/// # Errors
/// See [`crate::unload`]; where something is kept `before`, no modulus is searched for.
pub(crate) fn stress_free<const N: usize, const Q: usize>(
    job: &Job<'_>,
    discretisation: &Discretisation<N, Q>,
    before: &mut WarmStart<N, Q>,
    progress: Progress<'_>,
) -> Result<Rest<N, Q>, Error> {
    let problem = match unload(job, discretisation, before, SMALLEST_STEP, progress.part(0.0, 0.6))?
    {
        Ok(found) => return Ok(found),
        Err(problem) => problem,
    };
    let exists_from_kpa = if before.keeps() {
        before.shapes.lowest_kpa()
    } else {
        search_modulus(job, discretisation, progress.part(0.6, 1.0))?
    };
    let young_kpa = job.young_kpa();
    Err(Error::NoUnloadedShape { young_kpa, problem, exists_from_kpa })
}

/// The unloaded shape, or the reason why there is no usable one.
fn unload<const N: usize, const Q: usize>(
    job: &Job<'_>,
    discretisation: &Discretisation<N, Q>,
    before: &mut WarmStart<N, Q>,
    smallest_step: f64,
    progress: Progress<'_>,
) -> Result<Result<Rest<N, Q>, String>, Error> {
    let memory = |_| discretisation.memory();
    let materials = job.body.materials(job.stiffer);
    let surfaces = job.surfaces(discretisation, &materials);
    let tissue = Elastic { materials: &materials, surfaces: &surfaces };
    let fibres = job.fibres(discretisation);
    let inverse = job.inverse(discretisation, tissue, fibres.as_ref());
    let mut solver = before.solver(&discretisation.lower).map_err(memory)?;
    let (ct, goal) = (&job.load.ct, job.params.tolerance);
    let expected = before.shapes.expected(ct, ct, 1.0 / job.young_kpa());
    let to_rest =
        match inverse.solve(&mut solver, expected, goal, smallest_step, progress.part(0.0, 0.6)) {
            Ok(found) => found,
            Err(SolveError::Stopped(stopped)) => return Err(stopped.into()),
            Err(_) => return Err(discretisation.memory()),
        };
    let Some(to_rest) = to_rest else {
        return Ok(Err("no shape without gravity becomes the CT shape under it".into()));
    };
    let Some(model) = inverse.body(&to_rest) else {
        return Ok(Err("the shape without gravity is folded".into()));
    };
    let Solver { tangent, iterations, .. } = solver;
    before.in_ct.keep(tangent);
    let to_ct: Vec<Vector> = to_rest.iter().map(|y| -y).collect();
    let tangent = before.in_ct.take(&discretisation.lower).map_err(memory)?;
    let mut newton = job.newton(&model, tangent, &discretisation.held);
    if !newton.is_stable(&to_ct).map_err(memory)? {
        return Ok(Err("the CT shape would not be a stable position of the tissue".into()));
    }
    let reload_error_mm = if before.keeps() {
        None
    } else {
        match reload_error(job, &mut newton, &to_ct, progress.part(0.6, 1.0))? {
            Ok(error) => Some(error),
            Err(problem) => return Ok(Err(problem)),
        }
    };
    before.in_ct.keep(newton.into_tangent());
    before.shapes.keep(|| job.state(job.load.ct, to_rest, None));
    let unloading = Unloading {
        iterations,
        max_distance_mm: to_ct.iter().map(Vector::norm).fold(0.0, f64::max),
        reload_error_mm,
        min_det: model.volume_ratio(&to_ct).map_or(0.0, |r| 1.0 / r.max),
    };
    let young_kpa = job.young_kpa();
    Ok(Ok(Rest { young_kpa, model, to_ct, unloading, slope: None }))
}

/// How far from the CT shape a cold forward solve from the stress-free shape ends, mm, or why it
/// does not return.
fn reload_error<const N: usize, const Q: usize>(
    job: &Job<'_>,
    newton: &mut Newton<'_, N, Q>,
    to_ct: &[Vector],
    progress: Progress<'_>,
) -> Result<Result<f64, String>, Error> {
    let Some(back) = reload(job, newton, progress)? else {
        return Ok(Err("supine gravity does not bring the shape without gravity to rest".into()));
    };
    let error = back.iter().zip(to_ct).map(|(u, ct)| (u - ct).norm()).fold(0.0, f64::max);
    Ok(if error <= RELOAD_LIMIT_MM {
        Ok(error)
    } else {
        Err(format!(
            "supine gravity brings the shape without gravity to another position, {error:.2} mm \
             off the CT shape"
        ))
    })
}

/// Displacement from the stress-free shape under the CT's gravity, begun cold; `None` when none is
/// found.
fn reload<const N: usize, const Q: usize>(
    job: &Job<'_>,
    newton: &mut Newton<'_, N, Q>,
    progress: Progress<'_>,
) -> Result<Option<Vec<Vector>>, Error> {
    let load = newton.model().elements.load(newton.nodes(), job.load.ct * job.body.tissue.weight());
    let zero = vec![Vector::zeros(); newton.nodes()];
    match newton.equilibrium(
        &load,
        &zero,
        KnownEquilibrium { u: &zero, load: &zero },
        job.params.tolerance,
        progress,
    ) {
        Ok(found) => Ok(Some(found.u)),
        Err(SolveError::NotConverged(_)) => Ok(None),
        Err(SolveError::Stopped(stopped)) => Err(stopped.into()),
        Err(SolveError::Memory) => Err(Error::Memory { unknowns: newton.unknowns() }),
    }
}

/// The first of some higher moduli at which an unloaded shape exists, kPa.
fn search_modulus<const N: usize, const Q: usize>(
    job: &Job<'_>,
    discretisation: &Discretisation<N, Q>,
    progress: Progress<'_>,
) -> Result<Option<f64>, Error> {
    let (factor, trials) = SEARCH;
    let mut stiffer = job.stiffer;
    for trial in 0..trials {
        stiffer *= factor;
        let (from, to) = (trial as f64 / trials as f64, (trial + 1) as f64 / trials as f64);
        let (trial, mut cold) = (Job { stiffer, ..*job }, WarmStart::nothing());
        if unload(&trial, discretisation, &mut cold, 1.0, progress.part(from, to))?.is_ok() {
            return Ok(Some(stiffer * job.body.mean_young_kpa()));
        }
    }
    Ok(None)
}

/// Thickness of the tissue: the largest distance of a skin point from the nearest chest wall point,
/// mm.
fn thickness(job: &Job<'_>) -> f64 {
    let mesh = &job.body.mesh;
    let of = |tag: BoundaryTag| -> Vec<Vector> {
        mesh.points_on(tag).iter().map(|&p| mesh.points()[p as usize].coords).collect()
    };
    let (skin, wall) = (of(BoundaryTag::Skin), of(BoundaryTag::ChestWall));
    skin.iter()
        .map(|s| wall.iter().map(|w| (s - w).norm_squared()).fold(f64::INFINITY, f64::min))
        .fold(0.0, f64::max)
        .sqrt()
}

impl Job<'_> {
    /// The load on the stress-free shape, kPa/mm.
    pub(crate) fn force(&self) -> Vector {
        (self.load.target - self.borne()) * self.body.tissue.weight()
    }

    /// The gravity under which the stress-free shape stays as it is; zero, or the unit vector of
    /// the CT's.
    pub(crate) fn borne(&self) -> Vector {
        match self.params.rest {
            RestState::Net => self.load.ct,
            RestState::Unloaded => Vector::zeros(),
        }
    }

    /// The search for the shape without the CT's gravity.
    fn inverse<'m, const N: usize, const Q: usize>(
        &self,
        discretisation: &'m Discretisation<N, Q>,
        tissue: Elastic<'m, N>,
        fibres: Option<&'m Fibres<Q>>,
    ) -> Inverse<'m, N, Q> {
        let Elastic { materials, surfaces } = tissue;
        let (loaded, positions) = (&*discretisation.elements, discretisation.positions.as_slice());
        let force = self.load.ct * self.body.tissue.weight();
        let weight = norm(&loaded.load(positions.len(), force));
        let full = discretisation.full();
        Inverse { loaded, materials, fibres, surfaces, force, positions, weight, full }
    }

    /// The body whose CT shape is free of stress.
    pub(crate) fn model<const N: usize, const Q: usize>(
        &self,
        discretisation: &Discretisation<N, Q>,
    ) -> Model<N, Q> {
        let materials = self.body.materials(self.stiffer);
        let mut surfaces = self.surfaces(discretisation, &materials);
        let (nodes, count) = (&discretisation.elements.nodes, discretisation.held.len());
        surfaces.skin = surfaces.skin.map(|skin| skin.borne(nodes, count));
        Model::new(discretisation.elements.clone(), materials, self.fibres(discretisation))
            .bounded(surfaces)
    }

    /// The fibres on the CT shape, if there are any.
    fn fibres<const N: usize, const Q: usize>(
        &self,
        discretisation: &Discretisation<N, Q>,
    ) -> Option<Fibres<Q>> {
        let Tissue { fibres, fibre_stiffening, .. } = self.body.tissue;
        let along = discretisation.fibres.clone()?;
        let c = |young_kpa: f64| 0.5 * fibres * self.stiffer * young_kpa;
        let c = match &self.body.young_kpa {
            Some(moduli) => moduli.iter().map(|e| c(*e)).collect(),
            None => vec![c(self.body.tissue.young_kpa); along.len()],
        };
        Some(Fibres { c, k: fibre_stiffening, along })
    }

    /// Where equilibria found before make the displacement from the CT shape expect this one, mm.
    fn expected(&self, equilibria: &SolutionHistory) -> Option<Vec<Vector>> {
        equilibria.expected(&self.load.target, &self.load.ct, 1.0 / self.young_kpa())
    }

    /// What is to be kept of a displacement from the CT shape (mm) under a gravity, and of its
    /// slope (mm/kPa).
    fn state(&self, gravity: Vector, values: Vec<Vector>, slope: Option<Vec<Vector>>) -> State {
        State { gravity, softness: 1.0 / self.young_kpa(), values, slope }
    }

    /// Says that the tissue is too soft for its thickness, if it is.
    fn softness_warning(&self) -> Option<Warning> {
        let softness = self.body.tissue.weight() * thickness(self) / self.young_kpa();
        (softness > SOFTNESS_LIMIT).then(|| {
            let text = format!(
                "the tissue is soft for its thickness (weight over stiffness {softness:.1}, above \
                 {SOFTNESS_LIMIT}): from the unloaded shape small tilts give large motions"
            );
            Warning::new("soft-tissue", text)
        })
    }

    /// What acts on the boundary of a body of these materials, on its CT shape.
    fn surfaces<const N: usize, const Q: usize>(
        &self,
        discretisation: &Discretisation<N, Q>,
        materials: &[Material],
    ) -> Surfaces<N> {
        let springs = self.params.cut == Cut::Spring;
        let cut = || Foundation::new(&self.body.mesh, materials, self.params.spring_kpa_mm);
        Surfaces {
            cut: springs.then(cut).map(Arc::new),
            wall: discretisation.wall.clone(),
            skin: discretisation.skin.clone(),
        }
    }

    /// Newton's method on a body with room for a factor, or with one of a similar stiffness.
    pub(crate) fn newton<'m, const N: usize, const Q: usize>(
        &self,
        model: &'m Model<N, Q>,
        tangent: Tangent,
        held: &'m [bool],
    ) -> Newton<'m, N, Q> {
        let norm = self.gravity_norm(model, held.len());
        Newton::new(model, tangent, held, norm, self.params.max_iterations)
    }

    /// Norm of the nodal forces of full gravity, mN.
    pub(crate) fn gravity_norm<const N: usize, const Q: usize>(
        &self,
        model: &Model<N, Q>,
        nodes: usize,
    ) -> f64 {
        norm(&model.elements.load(nodes, self.load.ct * self.body.tissue.weight()))
    }

    fn info<const N: usize, const Q: usize>(
        &self,
        found: &Equilibrium,
        effort: Effort,
        model: &Model<N, Q>,
        pattern: &Pattern,
    ) -> Result<Info, Error> {
        let ratio = model.volume_ratio(&found.u).map_err(|folded| Error::flat(folded.0))?;
        let solve = Solve {
            iterations: effort.iterations,
            indefinite: effort.indefinite,
            load_steps: effort.load_steps,
            residual: found.residual,
            min_det_f: ratio.min,
            min_det_f_mm: self.middle(&model.elements.nodes[ratio.worst]).into(),
            max_det_f: ratio.max,
            sliding: model.surfaces.wall.as_ref().map(|wall| wall.told(&found.u)),
            spring_kpa_mm: model.surfaces.cut.as_ref().map(|cut| cut.mean_kpa_mm),
            ..Solve::default()
        };
        Ok(Info {
            solve,
            unknowns: pattern.unknowns(),
            factor_entries: effort.factor_entries,
            ..Info::default()
        })
    }

    /// The middle of an element in the CT.
    pub(crate) fn middle<const N: usize>(&self, element: &[u32; N]) -> Point {
        let corners = element[..4].iter().map(|n| self.body.mesh.points()[*n as usize].coords);
        Point::from(corners.sum::<Vector>() / 4.0)
    }
}
