//! How far the tumour moves, and how sure that is.

use crate::Error;
use crate::beyond::beyond;
use crate::curve::{Curve, Solver};
use crate::ellipsoid::Ellipsoid;
use crate::question::{Question, at_centre};
use crate::spread::{Drawn, Nominal, Rests, middle, quantile};
use crate::wall::Wall;
use supine_fem::{Body, GoalErrors, RestState, goal_errors};
use supine_mesh::{BoundaryTag, TetMesh};
use supine_record::{UncertaintyShare, UncertaintySource};
use supine_space::{Matrix, Point, Progress, Vector, Warning};

/// Probability with which the intervals hold.
pub const LEVEL: f64 = 0.95;
/// Below a modulus of ρ g L over this, with L the thickness of the tissue, the unloaded state
/// answers a tilt without measure and soon has no usable shape: 9.81e-3 x 55 / E > 1.3 on a
/// synthetic breast of 55 mm.
const SLACK: f64 = 1.3;

/// The displacement in the other rest state, with the run's modulus, or with the one fitted there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OtherState {
    /// That state.
    pub rest: RestState,
    /// The displacement, LPS, mm; `None` where that state has no usable shape at the run's modulus.
    pub displacement: Option<Vector>,
}

/// How far the tumour moves, and how sure that is.
#[derive(Clone, Debug, PartialEq)]
pub struct TumourInterval {
    /// The run's displacement of the tumour's centre before any fade, LPS, mm.
    pub displacement: Vector,
    /// Distance from it within which the true displacement lies, mm.
    pub within_mm: f64,
    /// Interval of its length, mm.
    pub length_mm: [f64; 2],
    /// Interval of each component, LPS, mm.
    pub components_mm: [[f64; 2]; 3],
    /// The displacements as an ellipsoid.
    pub ellipsoid: Ellipsoid,
    /// What each source adds, the widest first.
    pub shares: Vec<UncertaintyShare>,
    /// The other rest state; `None` when the modulus was given with its rest state.
    pub other: Option<OtherState>,
    /// The softest modulus with a usable unloaded shape among those tried, kPa; `None` when it was
    /// not asked or none has.
    pub softest_unloaded_kpa: Option<f64>,
    /// What each uncertain place of the wall may do to the displacement, in the order given, mm.
    pub patch_effects_mm: Vec<f64>,
    /// What a user should know.
    pub warnings: Vec<Warning>,
}

/// How far the tumour moves with 95 % probability, when modulus, rest state, chest wall, region,
/// mesh, the law of the tissue, arms and breath are as uncertain as they are.
///
/// Modulus, rest state, wall, region, mesh, law, arms and breath are drawn 10,000 times,
/// independently of each other.
/// A modulus that was given belongs to the run's rest state, so only that of the literature is
/// drawn with both states, each as likely. For every draw the displacement is read from curves over
/// the modulus ([`crate`], `curve`) through solutions in each state; wall and mesh add to it as the
/// adjoint solution tells ([`supine_fem::goal_errors`]), the region as a free and a held cut
/// differ.
///
/// # Errors
/// As the mechanics; [`supine_fem::Error::GoalOutside`] when no tissue of the mesh lies within the
/// tumour.
pub fn tumour_interval(
    question: &Question<'_>,
    progress: Progress<'_>,
) -> Result<TumourInterval, Error> {
    let Question { body, load, params, tumour, prior, .. } = *question;
    let centre = tumour.centre();
    let solver = Solver { body: question.coarse, load, params, place: &centre };
    let both = prior.other().is_some();
    let wanted = |rest: RestState| both || params.rest == rest;
    let range = |rest: RestState| {
        let other = prior.other().filter(|_| params.rest != rest);
        other.unwrap_or(prior.known()).interval_kpa()
    };
    let errors = goal_errors(body, load, params, &tumour, progress.part(0.0, 0.15))?;
    let beyond = beyond(question, progress.part(0.15, 0.2))?;
    let net = match wanted(RestState::Net) {
        true => {
            let part = progress.part(0.2, 0.4);
            Curve::through(solver, RestState::Net, range(RestState::Net), part)?
        }
        false => None,
    };
    let unloaded = match wanted(RestState::Unloaded) {
        true => {
            let (range, part) = (range(RestState::Unloaded), progress.part(0.4, 1.0));
            Curve::of_unloaded(solver, range, if both { slack_kpa(body) } else { 0.0 }, part)?
        }
        false => None,
    };
    let own = match params.rest {
        RestState::Net => &net,
        RestState::Unloaded => &unloaded,
    };
    if own.is_none() {
        return Err(Error::NoSolution { rest: params.rest, young_kpa: range(params.rest) });
    }
    let nominal = Nominal {
        kpa: body.mean_young_kpa(),
        rest: params.rest,
        displacement: at_centre(question.solved, &centre),
    };
    let error_mm = errors.wall.iter().map(|node| (question.wall_error_mm)(&node.place)).collect();
    let wall = Wall { nodes: &errors.wall, error_mm };
    let rests = Rests {
        prior,
        nominal,
        net: net.as_ref(),
        unloaded: unloaded.as_ref(),
        both,
        wall: root(&wall.covariance()),
        tissues: root(&by_tissues(question)?),
        beyond,
        mesh_mm: mesh_mm(&errors),
        others: question.others,
        untold: question.untold,
        posture: question.posture,
    };
    let mut interval = told(&rests, wall.effects_mm(question.patches))?;
    interval.warnings =
        [net, unloaded].into_iter().flatten().flat_map(|curve| curve.warnings).collect();
    Ok(interval)
}

/// The intervals of what is drawn.
fn told(rests: &Rests<'_>, patch_effects_mm: Vec<f64>) -> Result<TumourInterval, Error> {
    let nominal = rests.nominal;
    let cloud = rests.cloud(Drawn::ALL)?;
    let lengths = |cloud: &[Vector]| middle(LEVEL, cloud.iter().map(Vector::norm));
    let share = |source: UncertaintySource, drawn: Drawn| -> Result<UncertaintyShare, Error> {
        let cloud = rests.cloud(drawn)?;
        let within_mm = within(&cloud, &nominal.displacement);
        // What one source does begins at the value found; whether that is possible at all, the
        // whole interval tells.
        let ([low, high], found) = (lengths(&cloud), nominal.displacement.norm());
        Ok(UncertaintyShare { source, length_mm: [low.min(found), high.max(found)], within_mm })
    };
    let none = Drawn::default();
    let mut shares = vec![
        share(UncertaintySource::Modulus, Drawn { modulus: true, ..none })?,
        share(UncertaintySource::Tissues, Drawn { tissues: true, ..none })?,
        share(UncertaintySource::RestState, Drawn { rest: true, ..none })?,
        share(UncertaintySource::ChestWall, Drawn { wall: true, ..none })?,
        share(UncertaintySource::Region, Drawn { region: true, ..none })?,
        share(UncertaintySource::Mesh, Drawn { mesh: true, ..none })?,
        share(UncertaintySource::Law, Drawn { law: true, ..none })?,
        share(UncertaintySource::Arms, Drawn { arms: true, ..none })?,
        share(UncertaintySource::Breath, Drawn { breath: true, ..none })?,
    ];
    if rests.tissues == Matrix::zeros() {
        shares.retain(|share| share.source != UncertaintySource::Tissues);
    }
    if rests.beyond == Vector::zeros() {
        shares.retain(|share| share.source != UncertaintySource::Region);
    }
    if rests.posture.arms_moved <= 0.0 {
        shares.retain(|share| share.source != UncertaintySource::Arms);
    }
    if rests.posture.breath_mm <= 0.0 {
        shares.retain(|share| share.source != UncertaintySource::Breath);
    }
    shares.sort_by(|a, b| b.within_mm.total_cmp(&a.within_mm));
    let rest = match nominal.rest {
        RestState::Net => RestState::Unloaded,
        RestState::Unloaded => RestState::Net,
    };
    let other = rests
        .both
        .then(|| OtherState { rest, displacement: rests.at(rests.nominal_kpa(rest), rest) });
    Ok(TumourInterval {
        displacement: nominal.displacement,
        within_mm: within(&cloud, &nominal.displacement),
        length_mm: lengths(&cloud),
        components_mm: [0, 1, 2].map(|k| middle(LEVEL, cloud.iter().map(|v| v[k]))),
        ellipsoid: Ellipsoid::holding(LEVEL, &cloud),
        shares,
        other,
        softest_unloaded_kpa: rests.unloaded.map(Curve::softest_kpa),
        patch_effects_mm,
        warnings: Vec::new(),
    })
}

/// The distance from a displacement that is not exceeded with the probability [`LEVEL`], and that
/// reaches both ends of the interval of the length: two statements of one cloud must not contradict
/// each other.
fn within(cloud: &[Vector], from: &Vector) -> f64 {
    let [low, high] = middle(LEVEL, cloud.iter().map(Vector::norm));
    let radial = quantile(LEVEL, cloud.iter().map(|v| (v - from).norm()));
    radial.max(high - from.norm()).max(from.norm() - low)
}

/// The sum of the tetrahedra's shares, which adds them as if all had one sign, over what 95 % of
/// errors do not exceed. On the synthetic patients the sum was 7 to 16 times the difference to a
/// mesh of 20,000 tetrahedra.
const CANCEL: f64 = 5.0;

/// Standard deviation of a component by the mesh, mm.
fn mesh_mm(errors: &GoalErrors) -> f64 {
    errors.shares.iter().sum::<f64>() / (CANCEL * crate::modulus_prior::NORMAL_95)
}

/// Covariance of the displacement by the proportions of the tissues' moduli, mm².
fn by_tissues(question: &Question<'_>) -> Result<Matrix, Error> {
    let Question { load, params, solved, .. } = *question;
    let centre = question.tumour.centre();
    let own = at_centre(solved, &centre);
    let mut covariance = Matrix::zeros();
    for body in question.tissues {
        let (other, _) = supine_fem::solve(body, load, params, Progress::none())?;
        let change = at_centre(&other, &centre) - own;
        covariance += change * change.transpose();
    }
    Ok(covariance)
}

/// The modulus below which the unloaded state is not asked, kPa.
fn slack_kpa(body: &Body) -> f64 {
    body.tissue.weight() * thickness_mm(&body.mesh) / SLACK
}

/// The farthest that a point of the skin lies from the chest wall, mm.
fn thickness_mm(mesh: &TetMesh) -> f64 {
    let of = |tag| -> Vec<Point> {
        mesh.points_on(tag).into_iter().map(|p| mesh.points()[p as usize]).collect()
    };
    let wall = of(BoundaryTag::ChestWall);
    let near =
        |p: &Point| wall.iter().map(|q| (p - q).norm_squared()).fold(f64::INFINITY, f64::min);
    let far = of(BoundaryTag::Skin).iter().map(near).filter(|d| d.is_finite()).fold(0.0, f64::max);
    far.sqrt()
}

/// The symmetric square root of a covariance.
fn root(covariance: &Matrix) -> Matrix {
    let eigen = covariance.symmetric_eigen();
    let roots = eigen.eigenvalues.map(|value| value.max(0.0).sqrt());
    eigen.eigenvectors * Matrix::from_diagonal(&roots) * eigen.eigenvectors.transpose()
}

#[cfg(test)]
#[path = "interval_tests.rs"]
mod tests;
