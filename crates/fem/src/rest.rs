//! The two rest states.

use crate::element::Elements;
use crate::foundation::Foundation;
use crate::inverse::Inverse;
use crate::material::NeoHookean;
use crate::model::Model;
use crate::newton::{Effort, Known, Newton, norm};
use crate::outcome::{Equilibrium, Halt, Stall};
use crate::pattern::{Pattern, Storage};
use crate::{Cut, Error, Info, Job, RestState, Unloading, sensitivity};
use std::sync::Arc;
use supine_mesh::BoundaryTag;
use supine_space::{Point, Progress, Vector, Warning};

/// An unloaded shape counts only when a forward solve from it returns this close to the CT, mm.
const RELOAD_LIMIT_MM: f64 = 0.05;
/// Weight of the tissue over its stiffness, ρ g L / E with L its thickness, above which the unloaded
/// shape reacts violently to small changes.
const SOFTNESS_LIMIT: f64 = 1.3;
/// The search for a modulus at which an unloaded shape exists: factor and number of trials.
const SEARCH: (f64, usize) = (1.25, 8);
/// Smallest step in which gravity is taken away, as a share; the search takes it away at once.
const SMALLEST_STEP: f64 = 0.125;

/// A body in equilibrium.
pub(crate) struct Settled<const N: usize, const Q: usize> {
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
    shape: Elements<N, Q>,
    held: &[bool],
    progress: Progress<'_>,
) -> Result<Settled<N, Q>, Error> {
    let pattern = Arc::new(Pattern::new(&shape.nodes, held, Storage::Lower));
    let materials = job.body.materials(job.stiffer);
    let foundation = job.foundation(&materials);
    let model = Model::new(shape, materials).on(foundation);
    let load = model.elements.load(held.len(), job.force());
    let zero = vec![Vector::zeros(); held.len()];
    let mut newton = job.newton(&model, &pattern, held)?;
    let found = newton
        .equilibrium(&load, &zero, Known { u: &zero, load: &zero }, job.params.tolerance, progress)
        .map_err(|halt| job.halted(halt, newton.effort, &model, &pattern))?;
    let info = job.info(&found, newton.effort, &model, &pattern)?;
    let slope = job.slope.then(|| sensitivity::net(job, &mut newton, &found.u)).transpose()?;
    Ok(Settled { model, load, to_ct: zero, u: found.u, slope, info })
}

/// Equilibrium of a body whose shape without gravity is stress-free.
///
/// The unloaded shape is accepted only if the CT shape is a stable equilibrium on it and a forward
/// solve from it, begun cold, returns to the CT shape.
///
/// # Errors
/// See [`crate::solve`]; [`Error::NoUnloadedShape`] when there is none, with a modulus at which
/// there is.
pub(crate) fn unloaded<const N: usize, const Q: usize>(
    job: &Job<'_>,
    positions: &[Vector],
    shape: &Elements<N, Q>,
    held: &[bool],
    progress: Progress<'_>,
) -> Result<Settled<N, Q>, Error> {
    let pattern = Arc::new(Pattern::new(&shape.nodes, held, Storage::Lower));
    let (Rest { model, to_ct }, unloading) =
        stress_free(job, positions, shape, Free { held, pattern: &pattern }, progress)?;
    let load = model.elements.load(held.len(), job.force());
    let ct_load = model.elements.load(held.len(), job.load.ct * job.body.tissue.weight());
    let mut newton = job.newton(&model, &pattern, held)?;
    let goal = job.params.tolerance;
    let found = newton
        .equilibrium(
            &load,
            &to_ct,
            Known { u: &to_ct, load: &ct_load },
            goal,
            progress.part(0.6, 1.0),
        )
        .map_err(|halt| job.halted(halt, newton.effort, &model, &pattern))?;
    let mut info = job.info(&found, newton.effort, &model, &pattern)?;
    info.unloading = Some(unloading);
    let softness = job.body.tissue.weight() * thickness(job) / job.young_kpa();
    if softness > SOFTNESS_LIMIT {
        let text = format!(
            "the tissue is soft for its thickness (weight over stiffness {softness:.1}, above \
             {SOFTNESS_LIMIT}): from the unloaded shape small tilts give large motions"
        );
        info.warnings.push(Warning::new("soft-tissue", text));
    }
    let slope = job.slope.then(|| {
        let full = Pattern::new(&shape.nodes, held, Storage::Full);
        let tissue =
            Elastic { materials: &model.materials, foundation: model.foundation.as_deref() };
        let patterns = Patterns { full: &full, lower: &pattern };
        let inverse = job.inverse(positions, shape, tissue, patterns);
        sensitivity::unloaded(job, &mut newton, &inverse, &to_ct, &found.u)
    });
    let slope = slope.transpose()?;
    Ok(Settled { model, load, to_ct, u: found.u, slope, info })
}

/// Which nodes are held, and the pattern of the stiffness of the others.
#[derive(Clone, Copy)]
pub(crate) struct Free<'a> {
    pub(crate) held: &'a [bool],
    pub(crate) pattern: &'a Arc<Pattern>,
}

/// What resists deformation: the material of each element, and springs.
struct Elastic<'a, const N: usize> {
    materials: &'a [NeoHookean],
    foundation: Option<&'a Foundation<N>>,
}

/// The same pattern with all entries and with the lower half.
struct Patterns<'a> {
    full: &'a Pattern,
    lower: &'a Arc<Pattern>,
}

/// A stress-free shape.
pub(crate) struct Rest<const N: usize, const Q: usize> {
    /// The body on it.
    model: Model<N, Q>,
    /// Displacement from it to the CT shape, mm.
    pub(crate) to_ct: Vec<Vector>,
}

/// The unloaded shape; takes 0.6 of the progress.
///
/// # Errors
/// See [`crate::unload`].
pub(crate) fn stress_free<const N: usize, const Q: usize>(
    job: &Job<'_>,
    positions: &[Vector],
    shape: &Elements<N, Q>,
    free: Free<'_>,
    progress: Progress<'_>,
) -> Result<(Rest<N, Q>, Unloading), Error> {
    let found = unload(job, positions, shape, free, SMALLEST_STEP, progress.part(0.0, 0.6))?;
    let problem = match found {
        Ok(found) => return Ok(found),
        Err(problem) => problem,
    };
    let exists_from_kpa = search_modulus(job, positions, shape, free, progress.part(0.6, 1.0))?;
    let young_kpa = job.young_kpa();
    Err(Error::NoUnloadedShape { young_kpa, problem, exists_from_kpa })
}

/// The unloaded shape, or the reason why there is no usable one.
fn unload<const N: usize, const Q: usize>(
    job: &Job<'_>,
    positions: &[Vector],
    shape: &Elements<N, Q>,
    free: Free<'_>,
    smallest_step: f64,
    progress: Progress<'_>,
) -> Result<Result<(Rest<N, Q>, Unloading), String>, Error> {
    let Free { held, pattern } = free;
    let materials = job.body.materials(job.stiffer);
    let foundation = job.foundation(&materials);
    let full = Pattern::new(&shape.nodes, held, Storage::Full);
    let tissue = Elastic { materials: &materials, foundation: foundation.as_ref() };
    let patterns = Patterns { full: &full, lower: pattern };
    let inverse = job.inverse(positions, shape, tissue, patterns);
    let (to_rest, iterations) =
        match inverse.solve(job.params.tolerance, smallest_step, progress.part(0.0, 0.6)) {
            Ok(found) => found,
            Err(Halt::Stopped(stopped)) => return Err(stopped.into()),
            Err(_) => return Err(Error::Memory { unknowns: pattern.unknowns() }),
        };
    let Some(to_rest) = to_rest else {
        return Ok(Err("no shape without gravity becomes the CT shape under it".into()));
    };
    let Some(model) = inverse.body(&to_rest) else {
        return Ok(Err("the shape without gravity is folded".into()));
    };
    let to_ct: Vec<Vector> = to_rest.iter().map(|y| -y).collect();
    let mut newton = job.newton(&model, pattern, held)?;
    let stable =
        newton.is_stable(&to_ct).map_err(|_| Error::Memory { unknowns: pattern.unknowns() })?;
    if !stable {
        return Ok(Err("the CT shape would not be a stable position of the tissue".into()));
    }
    let back = reload(job, &mut newton, &model, progress.part(0.6, 1.0))?;
    let error =
        back.map(|u| u.iter().zip(&to_ct).map(|(u, ct)| (u - ct).norm()).fold(0.0, f64::max));
    match error {
        Some(reload_error_mm) if reload_error_mm <= RELOAD_LIMIT_MM => {
            let unloading = Unloading {
                iterations,
                max_distance_mm: to_ct.iter().map(Vector::norm).fold(0.0, f64::max),
                reload_error_mm,
                min_det: model.volume_ratio(&to_ct).map_or(0.0, |r| 1.0 / r.max),
            };
            Ok(Ok((Rest { model, to_ct }, unloading)))
        }
        Some(error) => Ok(Err(format!(
            "supine gravity brings the shape without gravity to another position, {error:.2} mm \
             off the CT shape"
        ))),
        None => Ok(Err("supine gravity does not bring the shape without gravity to rest".into())),
    }
}

/// Displacement from the stress-free shape under the CT's gravity, begun cold; `None` when none is
/// found.
fn reload<const N: usize, const Q: usize>(
    job: &Job<'_>,
    newton: &mut Newton<'_, N, Q>,
    model: &Model<N, Q>,
    progress: Progress<'_>,
) -> Result<Option<Vec<Vector>>, Error> {
    let load = model.elements.load(newton.nodes(), job.load.ct * job.body.tissue.weight());
    let zero = vec![Vector::zeros(); newton.nodes()];
    match newton.equilibrium(
        &load,
        &zero,
        Known { u: &zero, load: &zero },
        job.params.tolerance,
        progress,
    ) {
        Ok(found) => Ok(Some(found.u)),
        Err(Halt::Stalled(_)) => Ok(None),
        Err(Halt::Stopped(stopped)) => Err(stopped.into()),
        Err(Halt::Memory) => Err(Error::Memory { unknowns: newton.unknowns() }),
    }
}

/// The first of some higher moduli at which an unloaded shape exists, kPa.
fn search_modulus<const N: usize, const Q: usize>(
    job: &Job<'_>,
    positions: &[Vector],
    shape: &Elements<N, Q>,
    free: Free<'_>,
    progress: Progress<'_>,
) -> Result<Option<f64>, Error> {
    let (factor, trials) = SEARCH;
    let mut stiffer = job.stiffer;
    for trial in 0..trials {
        stiffer *= factor;
        let (from, to) = (trial as f64 / trials as f64, (trial + 1) as f64 / trials as f64);
        let trial = Job { stiffer, ..*job };
        if unload(&trial, positions, shape, free, 1.0, progress.part(from, to))?.is_ok() {
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
        let supported = match self.params.rest {
            RestState::Net => self.load.ct,
            RestState::Unloaded => Vector::zeros(),
        };
        (self.load.target - supported) * self.body.tissue.weight()
    }

    /// The search for the shape without the CT's gravity.
    fn inverse<'m, const N: usize, const Q: usize>(
        &self,
        positions: &'m [Vector],
        loaded: &'m Elements<N, Q>,
        tissue: Elastic<'m, N>,
        patterns: Patterns<'m>,
    ) -> Inverse<'m, N, Q> {
        let (Elastic { materials, foundation }, Patterns { full, lower }) = (tissue, patterns);
        let force = self.load.ct * self.body.tissue.weight();
        let weight = norm(&loaded.load(positions.len(), force));
        Inverse { loaded, materials, foundation, force, positions, weight, full, lower }
    }

    /// The springs on the cut of a body of these materials, if there are any.
    pub(crate) fn foundation<const N: usize>(
        &self,
        materials: &[NeoHookean],
    ) -> Option<Foundation<N>> {
        let springs = self.params.cut == Cut::Spring;
        springs.then(|| Foundation::new(&self.body.mesh, materials, self.params.spring_kpa_mm))
    }

    pub(crate) fn newton<'m, const N: usize, const Q: usize>(
        &self,
        model: &'m Model<N, Q>,
        pattern: &'m Arc<Pattern>,
        held: &'m [bool],
    ) -> Result<Newton<'m, N, Q>, Error> {
        let gravity = model.elements.load(held.len(), self.load.ct * self.body.tissue.weight());
        Newton::new(model, pattern, held, norm(&gravity), self.params.max_iterations)
            .map_err(|_| Error::Memory { unknowns: pattern.unknowns() })
    }

    fn info<const N: usize, const Q: usize>(
        &self,
        found: &Equilibrium,
        effort: Effort,
        model: &Model<N, Q>,
        pattern: &Pattern,
    ) -> Result<Info, Error> {
        let ratio = model.volume_ratio(&found.u).map_err(|folded| Error::flat(folded.0))?;
        Ok(Info {
            iterations: effort.iterations,
            indefinite: effort.indefinite,
            load_steps: effort.load_steps,
            residual: found.residual,
            min_det_f: ratio.min,
            min_det_f_at: self.middle(&model.elements.nodes[ratio.worst]),
            max_det_f: ratio.max,
            unknowns: pattern.unknowns(),
            factor_entries: effort.factor_entries,
            spring_kpa_mm: model.foundation.as_ref().map(|f| f.mean_kpa_mm),
            ..Info::default()
        })
    }

    /// The middle of an element in the CT.
    pub(crate) fn middle<const N: usize>(&self, element: &[u32; N]) -> Point {
        let corners = element[..4].iter().map(|n| self.body.mesh.points()[*n as usize].coords);
        Point::from(corners.sum::<Vector>() / 4.0)
    }

    pub(crate) fn halted<const N: usize, const Q: usize>(
        &self,
        halt: Halt,
        effort: Effort,
        model: &Model<N, Q>,
        pattern: &Pattern,
    ) -> Error {
        match halt {
            Halt::Stopped(stopped) => stopped.into(),
            Halt::Memory => Error::Memory { unknowns: pattern.unknowns() },
            Halt::Stalled(Stall { cause, residual, u, load_share }) => {
                let (tet, volume_ratio) = match model.volume_ratio(&u) {
                    Ok(ratio) => (ratio.worst, ratio.min),
                    Err(folded) => (folded.0, 0.0),
                };
                let (cause, advice) = cause.explain();
                Error::NonConvergence {
                    cause,
                    iterations: effort.iterations,
                    residual,
                    tolerance: self.params.tolerance,
                    load_share,
                    tet,
                    volume_ratio,
                    advice,
                }
            }
        }
    }
}
