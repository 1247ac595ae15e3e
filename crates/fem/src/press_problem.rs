//! The forces of a rigid body on tissue that is taken to be linear.

use crate::complementarity::complementary;
use crate::compliance::Learnt;
use crate::dense::Positive;
use crate::wall::{Press, Target, Wall};
use nalgebra::{DMatrix, DVector};
use supine_space::Vector;

/// Gaps and normals are set up at most so often, and stay when places change by less than this
/// share of the motion.
const ROUNDS: usize = 8;
const STAYS: f64 = 0.02;
/// Share of the body's curvature that is tried, and how far the stiffness of the pressed tissue
/// stays from being undone by it.
const CURVATURE: [f64; 4] = [1.0, 0.75, 0.5, 0.25];
const LEFT: f64 = 0.05;
/// Springs along pressed normals over what the tissue has there itself.
const SPRING: f64 = 10.0;
/// Gaps that are wider than this share of the margin, and than so many times the motion, do not
/// close.
const WIDE: (f64, f64) = (0.1, 3.0);

/// Tissue that is taken to be linear before a body that is taken as it is.
///
/// The motion of the nodes in reach is d = d₀ + A (f − f₀). With forces f = Σ λ n, normals n that
/// turn with the motion, and W = Σ λ ∇n, a round has f = Σ λ n + W (d − d') about the motion d' of
/// the last one: then A becomes (A⁻¹ − W)⁻¹, and the λ solve a linear complementarity problem. That
/// inverse is made positive definite by springs along the normals that are pressed (an augmented
/// Lagrangian), and else by a share of W.
pub(crate) struct Problem<'a> {
    pub(crate) wall: &'a Wall,
    pub(crate) target: Target<'a>,
    /// The nodes in reach.
    pub(crate) nodes: &'a [u32],
    /// Where they are, mm.
    pub(crate) places: Vec<Vector>,
    pub(crate) learnt: Learnt<'a>,
    /// How they move with the forces that are on them, mm.
    pub(crate) free: DVector<f64>,
    /// These forces, mN.
    pub(crate) before: &'a DVector<f64>,
}

/// A gap that may close.
struct Closing {
    /// Place of its node in the list.
    at: usize,
    part: usize,
    mm: f64,
    normal: Vector,
    /// Its force in the last round, mN.
    force: f64,
}

/// A round.
struct Round {
    presses: Vec<Press>,
    /// Forces on the nodes, mN.
    forces: DVector<f64>,
    /// Their motion, mm.
    motion: DVector<f64>,
}

/// A force or a motion along directions at nodes.
type Directions = Vec<(usize, Vector)>;

impl Problem<'_> {
    /// What presses, and the forces on the nodes, mN; `started` guesses the former.
    pub(crate) fn solve(&self, started: &[Press]) -> Option<(Vec<Press>, DVector<f64>)> {
        let mut last = self.round(&DVector::zeros(self.free.len()), started)?;
        let mut change = last.motion.amax();
        let mut kept = None;
        for _ in 1..ROUNDS {
            let Some(next) = self.round(&last.motion, &last.presses) else { break };
            let now = (&next.motion - &last.motion).amax();
            let stays = now <= STAYS * next.motion.amax();
            // Where the rounds lead away, the first of them is the step of a descent.
            if !stays && now > change {
                break;
            }
            kept.get_or_insert_with(|| (last.presses.clone(), last.forces.clone()));
            (last, change) = (next, now);
            if stays {
                return Some((last.presses, last.forces));
            }
        }
        kept.or(Some((last.presses, last.forces)))
    }

    /// With gaps and normals as they are after a `motion` of the nodes, pressed as `started` says.
    fn round(&self, motion: &DVector<f64>, started: &[Press]) -> Option<Round> {
        let gaps = self.gaps(motion, started);
        let n = gaps.len();
        let normals: Directions = gaps.iter().map(|gap| (gap.at, gap.normal)).collect();
        let bends = self.bends(&gaps, motion);
        let all: Directions = normals.iter().chain(&bends).copied().collect();
        let across = self.learnt.across(&all);
        let pressed: Vec<usize> = (0..n).filter(|&i| gaps[i].force > 0.0).collect();
        let stiff = Stiff::new(&across, (n, &pressed))?;
        let ways: Directions = stiff.rows.iter().map(|&row| all[row]).collect();
        let mut q: DMatrix<f64> = across.view((0, 0), (n, n)).into();
        let mixed = across.select_rows(&stiff.rows).columns(0, n).into_owned();
        q += mixed.transpose() * stiff.solve(&mixed);
        // Without forces along the normals.
        let gap_of = |row: usize| gaps.get(row).map_or(0.0, |gap| gap.mm);
        let opened = DVector::from_iterator(ways.len(), stiff.rows.iter().map(|&row| gap_of(row)));
        let back = stiff.weigh(&(along(&ways, motion) - &opened));
        let still =
            &self.free - self.learnt.motion(&(self.before + spread(&ways, &back, motion.len())));
        let unpressed = self.bent(&still, &ways, &stiff);
        let open =
            |gap: &Closing| gap.mm + gap.normal.dot(&(of(&unpressed, gap.at) - of(motion, gap.at)));
        let b = DVector::from_iterator(n, gaps.iter().map(open));
        let start: Vec<bool> = gaps.iter().map(|gap| gap.force > 0.0).collect();
        let lambda = complementary(&q, &b, &start)?;
        let by_normals = spread(&normals, &lambda, motion.len());
        let now = unpressed + self.bent(&self.learnt.motion(&by_normals), &ways, &stiff);
        let more = stiff.weigh(&(along(&ways, &(&now - motion)) + opened));
        let forces = by_normals + spread(&ways, &more, motion.len());
        let mut total = lambda;
        pressed.iter().zip(more.iter()).for_each(|(&i, more)| total[i] += more);
        let presses = gaps.iter().zip(total.iter()).filter(|(_, force)| **force > 0.0);
        let press = |(gap, force): (&Closing, &f64)| {
            let (node, normal) = (self.nodes[gap.at], gap.normal);
            Press { node, part: gap.part, force: *force, normal }
        };
        Some(Round { presses: presses.map(press).collect(), forces, motion: now })
    }

    /// The gaps that may close.
    fn gaps(&self, motion: &DVector<f64>, started: &[Press]) -> Vec<Closing> {
        let parts = self.wall.surface.parts();
        let wide = (WIDE.0 * self.wall.margin_mm).max(WIDE.1 * self.free.amax().max(motion.amax()));
        let all = (0..self.nodes.len()).flat_map(|at| (0..parts).map(move |part| (at, part)));
        let near = |(at, part): (usize, usize)| {
            let place = self.places[at] + of(motion, at);
            let gap = self.wall.gap(part, &place, self.target)?;
            let key = (self.nodes[at], part);
            let press = started.binary_search_by_key(&key, |press| (press.node, press.part));
            let force = press.map_or(0.0, |found| started[found].force);
            let near = gap.mm < wide || force > 0.0;
            near.then_some(Closing { at, part, mm: gap.mm, normal: gap.normal, force })
        };
        all.filter_map(near).collect()
    }

    /// Directions Z with W = Z Zᵀ.
    fn bends(&self, gaps: &[Closing], motion: &DVector<f64>) -> Directions {
        let pressed = gaps.iter().filter(|gap| gap.force > 0.0);
        let bends = pressed.flat_map(|gap| {
            let place = self.places[gap.at] + of(motion, gap.at);
            let bends = self.wall.surface.bends(gap.part, self.target.pose, &place);
            bends.map(|bend| (gap.at, bend * gap.force.sqrt()))
        });
        bends.filter(|(_, bend)| *bend != Vector::zeros()).collect()
    }

    /// (1 − A (s W − β N Nᵀ))⁻¹ times a motion.
    fn bent(&self, motion: &DVector<f64>, ways: &[(usize, Vector)], stiff: &Stiff) -> DVector<f64> {
        let along = along(ways, motion);
        let more = stiff.solve(&DMatrix::from_column_slice(along.len(), 1, along.as_slice()));
        motion + self.learnt.motion(&spread(ways, &more.column(0).into_owned(), motion.len()))
    }
}

/// The stiffness that the pressed tissue has by the turn of the normals and, so that this leaves it
/// positive definite where only motions along the surface are free, by springs β along the normals
/// that are pressed. These bear nothing in the end: the gaps there are zero.
struct Stiff {
    /// Which rows of the directions at hand: normals, then bends.
    rows: Vec<usize>,
    /// β of each normal, mN/mm, and the share s of the curvature.
    springs: DVector<f64>,
    share: f64,
    /// 1/β + Nᵀ A N, and 1/s − Zᵀ A Z + Zᵀ A N (1/β + Nᵀ A N)⁻¹ Nᵀ A Z.
    normal: Positive,
    bent: Option<Positive>,
    mixed: DMatrix<f64>,
}

impl Stiff {
    /// `across` is between `n` normals, of which some are pressed, and the bends.
    fn new(across: &DMatrix<f64>, (n, pressed): (usize, &[usize])) -> Option<Self> {
        let bends: Vec<usize> = (n..across.nrows()).collect();
        let of = |a: &[usize], b: &[usize]| across.select_rows(a).select_columns(b);
        let springs = pressed.iter().map(|&i| SPRING / across[(i, i)]);
        let springs = DVector::from_iterator(pressed.len(), springs);
        let mut normal = of(pressed, pressed);
        (0..pressed.len()).for_each(|i| normal[(i, i)] += 1.0 / springs[i]);
        let normal = Positive::new(normal)?;
        let mixed = of(pressed, &bends);
        let own = of(&bends, &bends) - mixed.transpose() * normal.solve(&mixed);
        let with = |share: f64, left: f64| {
            let one =
                DMatrix::from_diagonal_element(bends.len(), bends.len(), (1.0 - left) / share);
            Positive::new(one - &own)
        };
        let curvature = CURVATURE.into_iter().find_map(|share| {
            with(share, LEFT)?;
            Some((share, with(share, 0.0)?))
        });
        let (share, bent) = match curvature {
            Some((share, bent)) => (share, Some(bent)),
            None => (0.0, None),
        };
        let rows = pressed.iter().chain(&bends).copied().collect();
        Some(Self { rows, springs, share, normal, bent, mixed })
    }

    /// Forces by these stiffnesses on motions along the directions: those that drive on are
    /// positive.
    fn weigh(&self, along: &DVector<f64>) -> DVector<f64> {
        let weight = |row: usize| self.springs.get(row).map_or(self.share, |spring| -spring);
        DVector::from_fn(along.len(), |row, _| weight(row) * along[row])
    }

    /// M x with (A⁻¹ − s W + β N Nᵀ)⁻¹ = A + A E M Eᵀ A, E the directions.
    fn solve(&self, x: &DMatrix<f64>) -> DMatrix<f64> {
        let (a, columns) = (self.springs.len(), x.ncols());
        let normal = x.rows(0, a).into_owned();
        let mut all = DMatrix::zeros(x.nrows(), columns);
        let mut pressed = normal.clone();
        if let Some(bent) = &self.bent {
            let right =
                x.rows(a, x.nrows() - a) - self.mixed.transpose() * self.normal.solve(&normal);
            let bends = bent.solve(&right);
            pressed += &self.mixed * &bends;
            all.rows_mut(a, x.nrows() - a).copy_from(&bends);
        }
        all.rows_mut(0, a).copy_from(&-self.normal.solve(&pressed));
        all
    }
}

fn of(all: &DVector<f64>, at: usize) -> Vector {
    Vector::new(all[3 * at], all[3 * at + 1], all[3 * at + 2])
}

/// The parts of a motion along directions.
fn along(directions: &[(usize, Vector)], motion: &DVector<f64>) -> DVector<f64> {
    let parts = directions.iter().map(|(at, direction)| direction.dot(&of(motion, *at)));
    DVector::from_iterator(directions.len(), parts)
}

/// Forces along directions as forces on nodes.
fn spread(directions: &[(usize, Vector)], along: &DVector<f64>, rows: usize) -> DVector<f64> {
    let mut all = DVector::zeros(rows);
    for ((at, direction), force) in directions.iter().zip(along.iter()) {
        (0..3).for_each(|axis| all[3 * at + axis] += force * direction[axis]);
    }
    all
}
