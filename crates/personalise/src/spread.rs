//! Draws of what is not known, and the displacement with each.

use crate::Error;
use crate::curve::Curve;
use crate::modulus_prior::{LogNormal, ModulusPrior};
use crate::question::{OtherLaw, Posture};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal, StandardUniform};
use supine_fem::RestState;
use supine_record::ModulusOrigin;
use supine_space::{Matrix, Vector};

/// Draws: the ends of an interval of 95 % are then known to a hundredth of its width.
pub(crate) const DRAWS: usize = 10_000;
/// Draws per one that is possible.
const ATTEMPTS: usize = 20;
/// Start of the draws: the same each time.
const SEED: u64 = 95;

/// What the displacement rests on.
pub(crate) struct Rests<'a> {
    pub(crate) prior: ModulusPrior,
    /// What the run was given.
    pub(crate) nominal: Nominal,
    /// `None` when that state was not asked for.
    pub(crate) net: Option<&'a Curve>,
    /// `None` when that state was not asked for or has no usable shape.
    pub(crate) unloaded: Option<&'a Curve>,
    /// Whether the rest state is drawn too.
    pub(crate) both: bool,
    /// Square root of the covariance by the chest wall, mm.
    pub(crate) wall: Matrix,
    /// The same by the proportions of the tissues' moduli, mm.
    pub(crate) tissues: Matrix,
    /// One standard deviation by the tissue beyond the region, mm.
    pub(crate) beyond: Vector,
    /// Standard deviation of each component by the mesh, mm.
    pub(crate) mesh_mm: f64,
    /// Other laws that may hold.
    pub(crate) others: &'a [OtherLaw],
    /// Standard deviation of each component by what none of them says, as a share of the
    /// displacement.
    pub(crate) untold: f64,
    /// Arms and breath.
    pub(crate) posture: Posture,
}

/// The modulus and rest state of the run, and the displacement found with them.
#[derive(Clone, Copy)]
pub(crate) struct Nominal {
    pub(crate) kpa: f64,
    pub(crate) rest: RestState,
    pub(crate) displacement: Vector,
}

/// Which of these are drawn; the others are as in the run.
#[derive(Clone, Copy, Default)]
pub(crate) struct Drawn {
    pub(crate) modulus: bool,
    pub(crate) rest: bool,
    pub(crate) wall: bool,
    pub(crate) mesh: bool,
    pub(crate) tissues: bool,
    pub(crate) region: bool,
    pub(crate) law: bool,
    pub(crate) arms: bool,
    pub(crate) breath: bool,
}

impl Drawn {
    pub(crate) const ALL: Self = Self {
        modulus: true,
        rest: true,
        wall: true,
        mesh: true,
        tissues: true,
        region: true,
        law: true,
        arms: true,
        breath: true,
    };
}

impl Rests<'_> {
    /// The displacement at a modulus in a rest state. The run's own stands for what the curves
    /// leave open.
    pub(crate) fn at(&self, kpa: f64, rest: RestState) -> Option<Vector> {
        let Nominal { kpa: own, rest: state, displacement } = self.nominal;
        let curve = match rest {
            RestState::Net => self.net,
            RestState::Unloaded => self.unloaded,
        }?;
        // The run's modulus was solved, so that it and stiffer ones are possible in its state.
        let was_solved = rest == state && kpa >= own;
        if kpa < curve.possible_from_kpa && !was_solved {
            return None;
        }
        Some(curve.at(kpa) + self.off(own, state, displacement) * (own / kpa))
    }

    /// What is known of the modulus in a rest state.
    fn known(&self, rest: RestState) -> &LogNormal {
        let other = self.prior.other().filter(|_| rest != self.nominal.rest);
        other.unwrap_or(self.prior.known())
    }

    /// The modulus of a rest state when it is not drawn: the run's, but a fitted one belongs to its
    /// state.
    pub(crate) fn nominal_kpa(&self, rest: RestState) -> f64 {
        match self.prior.origin() == ModulusOrigin::Scans && rest != self.nominal.rest {
            true => self.known(rest).median_kpa(),
            false => self.nominal.kpa,
        }
    }

    /// What the curve of the run's state lacks to the run's displacement. It grows with 1/E as the
    /// displacement does, and the other state's curve, on the same mesh, lacks as much.
    fn off(&self, own: f64, state: RestState, displacement: Vector) -> Vector {
        let curve = match state {
            RestState::Net => self.net,
            RestState::Unloaded => self.unloaded,
        };
        curve.map_or(Vector::zeros(), |curve| displacement - curve.at(own))
    }

    /// Displacements, each with what is drawn drawn anew. A modulus at which the unloaded state has
    /// no usable shape is no possibility there: the pair is drawn again.
    ///
    /// # Errors
    /// [`Error::NoSolution`] when hardly any draw is possible.
    pub(crate) fn cloud(&self, drawn: Drawn) -> Result<Vec<Vector>, Error> {
        let mut random = ChaCha8Rng::seed_from_u64(SEED);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let mut of_tissues = ChaCha8Rng::seed_from_u64(SEED + 1);
        let mut of_region = ChaCha8Rng::seed_from_u64(SEED + 2);
        let mut of_law = ChaCha8Rng::seed_from_u64(SEED + 3);
        let mut of_posture = ChaCha8Rng::seed_from_u64(SEED + 4);
        let nominal = self.nominal.displacement.norm();
        let mut cloud = Vec::with_capacity(DRAWS);
        let mut tried = 0;
        while cloud.len() < DRAWS {
            tried += 1;
            if tried > ATTEMPTS * DRAWS {
                let young_kpa = self.prior.known().interval_kpa();
                return Err(Error::NoSolution { rest: self.nominal.rest, young_kpa });
            }
            // All are drawn each time: what one of them does is then seen beside the same others.
            let numbers: [f64; 8] = std::array::from_fn(|_| normal());
            let rest = match (drawn.rest && self.both, numbers[1] < 0.0) {
                (false, _) => self.nominal.rest,
                (true, true) => RestState::Unloaded,
                (true, false) => RestState::Net,
            };
            let kpa = match drawn.modulus {
                true => self.known(rest).at(numbers[0]),
                false => self.nominal_kpa(rest),
            };
            let Some(u) = self.at(kpa, rest) else { continue };
            let wall = self.wall * Vector::new(numbers[2], numbers[3], numbers[4]);
            let mesh = Vector::new(numbers[5], numbers[6], numbers[7]) * self.mesh_mm;
            let tissues =
                self.tissues * Vector::from_fn(|_, _| StandardNormal.sample(&mut of_tissues));
            let by_region: f64 = StandardNormal.sample(&mut of_region);
            let region = self.beyond * by_region;
            let law = self.by_law(&mut of_law, &u);
            let [arms, breath] = self.by_posture(&mut of_posture);
            // All grow with the displacement.
            let scale = if nominal > 0.0 { u.norm() / nominal } else { 1.0 };
            let by = |on: bool, v: Vector| if on { v * scale } else { Vector::zeros() };
            let added = [
                (drawn.wall, wall),
                (drawn.mesh, mesh),
                (drawn.tissues, tissues),
                (drawn.region, region),
            ];
            let moved = added.into_iter().fold(u, |u, (on, v)| u + by(on, v));
            let beside = [(drawn.law, law), (drawn.arms, arms), (drawn.breath, breath)];
            let beside = beside.into_iter().filter(|(on, _)| *on).map(|(_, v)| v);
            cloud.push(moved + beside.sum::<Vector>());
        }
        Ok(cloud)
    }

    /// What another law adds to a displacement `u`: that of one of those that may hold, and what
    /// none of them says.
    fn by_law(&self, random: &mut ChaCha8Rng, u: &Vector) -> Vector {
        let mut left = share(random);
        let other = self.others.iter().find(|other| {
            left -= other.probability;
            left < 0.0
        });
        let change = other.map_or(Vector::zeros(), |other| other.change);
        let untold = normal(random) * (self.untold * u.norm());
        change + untold
    }

    /// What arms and breath add.
    fn by_posture(&self, random: &mut ChaCha8Rng) -> [Vector; 2] {
        let Posture { arms_moved, arms_mm, breath_mm } = self.posture;
        let moved = share(random) < arms_moved;
        let arms = normal(random) * if moved { arms_mm } else { 0.0 };
        [arms, normal(random) * breath_mm]
    }
}

/// A number from 0 to 1.
fn share(random: &mut ChaCha8Rng) -> f64 {
    StandardUniform.sample(random)
}

/// Three independent numbers of a normal distribution.
fn normal(random: &mut ChaCha8Rng) -> Vector {
    Vector::from_fn(|_, _| StandardNormal.sample(random))
}

/// The value that this share of all does not exceed.
pub(crate) fn quantile(share: f64, values: impl Iterator<Item = f64>) -> f64 {
    at(share, &sorted(values))
}

/// The values between which the middle share of all lies.
pub(crate) fn middle(share: f64, values: impl Iterator<Item = f64>) -> [f64; 2] {
    let values = sorted(values);
    [(1.0 - share) / 2.0, (1.0 + share) / 2.0].map(|share| at(share, &values))
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

fn at(share: f64, sorted: &[f64]) -> f64 {
    sorted[((sorted.len() - 1) as f64 * share).round() as usize]
}
