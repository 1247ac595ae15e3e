//! Linear systems with the stiffness at a displacement.

use crate::analysis::{Analysis, OutOfMemory};
use crate::batch::VolumeStrain;
use crate::krylov::conjugate_gradients;
use crate::linear::Factor;
use crate::model::Model;
use crate::pattern::{Block, Pattern};
use crate::wall_turn::{Normals, WallTurn};
use nalgebra::DMatrix;
use std::sync::Arc;
use supine_space::Vector;

/// Lowest eigenvalue of the shifted material tangent, in units of the shear modulus.
pub(crate) const FLOOR: f64 = 1e-3;
/// Steps of the iteration when the factor is that of the matrix itself; two or three are usual.
const FRESH_STEPS: usize = 25;

/// A factor whose product undoes that of the matrix nearly.
enum Preconditioner {
    /// Half the memory and time.
    Single(Factor<f32>),
    Double(Factor<f64>),
}

impl Preconditioner {
    fn is_single(&self) -> bool {
        matches!(self, Self::Single(_))
    }
}

/// Which stiffness was factorised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stiffness {
    Exact,
    Shifted,
}

/// The stiffness of one body, and a factor of it or of a former one.
///
/// Systems are solved by conjugate gradients (Hestenes and Stiefel 1952) on the exact stiffness;
/// the factor is only their preconditioner. It may be rounded, and serves until the iteration
/// becomes slow.
pub(crate) struct Tangent {
    pattern: Arc<Pattern>,
    blocks: Vec<Block>,
    preconditioner: Preconditioner,
    /// There is a factor.
    factorised: bool,
    /// The normals of a wall on which nodes slide where it was made.
    normals: Normals,
    /// The last one made by [`Tangent::renew`] is of the shifted stiffness.
    shifted: bool,
}

/// The solution of a linear system.
pub(crate) struct LinearSolution {
    pub(crate) x: Vec<f64>,
    /// That of the exact stiffness, not of the shifted one.
    pub(crate) exact: bool,
}

impl Tangent {
    /// Room for the stiffness and a factor; the lower half is stored.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn new(pattern: &Arc<Pattern>) -> Result<Self, OutOfMemory> {
        let preconditioner = Preconditioner::Single(Factor::new(pattern.analysis()?)?);
        let blocks = pattern.zeros()?;
        Ok(Self {
            pattern: pattern.clone(),
            blocks,
            preconditioner,
            factorised: false,
            normals: Normals::new(),
            shifted: false,
        })
    }

    /// The pattern of the stiffness.
    pub(crate) fn pattern(&self) -> &Arc<Pattern> {
        &self.pattern
    }

    /// Whether there is a factor.
    pub(crate) fn is_factorised(&self) -> bool {
        self.factorised
    }

    /// Whether [`Tangent::renew`] had to shift the stiffness: the factor is that of a stiffer body.
    pub(crate) fn is_shifted(&self) -> bool {
        self.shifted
    }

    /// Entries of the triangular factor.
    pub(crate) fn factor_entries(&self) -> usize {
        self.pattern.analysis().map_or(0, Analysis::entries)
    }

    /// Solves K(u) x = `right` for each right side to |K x − right| ≤ `goal` |right|, K with the
    /// `predicted` volume strain if there is one, or with the shifted stiffness where that one is
    /// not positive definite.
    ///
    /// `None` when an element is turned inside out at `u` or neither has a factor.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn solve<const N: usize, const Q: usize, const K: usize>(
        &mut self,
        model: &Model<N, Q>,
        u: &[Vector],
        predicted: Option<&VolumeStrain<Q>>,
        right: [&[f64]; K],
        goal: f64,
    ) -> Result<Option<[LinearSolution; K]>, OutOfMemory> {
        if model.stiffness(u, predicted, &self.pattern, &mut self.blocks).is_none() {
            return Ok(None);
        }
        if self.factorised {
            let turn = WallTurn::new(&self.pattern, &self.normals, &model.surfaces.wall_normals(u));
            if let Some(found) = self.iterate(right, goal, self.patience(), &turn) {
                return Ok(Some(found));
            }
        }
        loop {
            let exact = match self.factorise_some(model, u)? {
                None => return Ok(None),
                Some(Stiffness::Shifted) => false,
                Some(Stiffness::Exact) => {
                    let fresh = WallTurn::default();
                    if let Some(found) = self.iterate(right, goal, FRESH_STEPS, &fresh) {
                        return Ok(Some(found));
                    }
                    if self.use_double()? {
                        continue;
                    }
                    // There is no higher precision.
                    true
                }
            };
            let solutions = right.map(|right| {
                let mut x = right.to_vec();
                self.apply_factor(&mut x).then_some(LinearSolution { x, exact })
            });
            return Ok(all(solutions));
        }
    }

    /// Whether the exact stiffness at `u` is positive definite.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn is_definite<const N: usize, const Q: usize>(
        &mut self,
        model: &Model<N, Q>,
        u: &[Vector],
    ) -> Result<bool, OutOfMemory> {
        if model.stiffness(u, None, &self.pattern, &mut self.blocks).is_none() {
            return Ok(false);
        }
        self.normals = model.surfaces.wall_normals(u);
        Ok(self.factorise() || (self.use_double()? && self.factorise()))
    }

    /// Replaces `x` by what the factor makes of it.
    pub(crate) fn apply_factor(&mut self, x: &mut [f64]) -> bool {
        match &mut self.preconditioner {
            Preconditioner::Single(factor) => factor.solve(&self.pattern, x),
            Preconditioner::Double(factor) => factor.solve(&self.pattern, x),
        }
    }

    /// The inverse of the factorised matrix between nodes whose three unknowns begin at `rows`,
    /// symmetric; `None` when a number is not finite.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn compliance(&self, rows: &[usize]) -> Result<Option<DMatrix<f64>>, OutOfMemory> {
        match &self.preconditioner {
            Preconditioner::Single(factor) => factor.compliance(&self.pattern, rows),
            Preconditioner::Double(factor) => factor.compliance(&self.pattern, rows),
        }
    }

    /// Makes the factor that of the exact stiffness of `model` at `u`, or of the shifted one.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn renew<const N: usize, const Q: usize>(
        &mut self,
        model: &Model<N, Q>,
        u: &[Vector],
    ) -> Result<bool, OutOfMemory> {
        if model.stiffness(u, None, &self.pattern, &mut self.blocks).is_none() {
            return Ok(false);
        }
        let made = self.factorise_some(model, u)?;
        self.shifted = made == Some(Stiffness::Shifted);
        Ok(made.is_some())
    }

    /// Factorises the exact stiffness at `u`, which `blocks` hold, or else the shifted one, first
    /// in the precision at hand, then in double. `None` when neither has a factor.
    fn factorise_some<const N: usize, const Q: usize>(
        &mut self,
        model: &Model<N, Q>,
        u: &[Vector],
    ) -> Result<Option<Stiffness>, OutOfMemory> {
        self.normals = model.surfaces.wall_normals(u);
        loop {
            if self.factorise() {
                return Ok(Some(Stiffness::Exact));
            }
            let blocks = &mut self.blocks;
            if model.shifted_stiffness(u, FLOOR, &self.pattern, blocks).is_none() {
                return Ok(None);
            }
            if self.factorise() {
                return Ok(Some(Stiffness::Shifted));
            }
            let blocks = &mut self.blocks;
            if !(self.preconditioner.is_single()
                && model.stiffness(u, None, &self.pattern, blocks).is_some()
                && self.use_double()?)
            {
                return Ok(None);
            }
        }
    }

    fn factorise(&mut self) -> bool {
        self.factorised = match &mut self.preconditioner {
            Preconditioner::Single(f) => f.factorise(&self.pattern, &self.blocks),
            Preconditioner::Double(f) => f.factorise(&self.pattern, &self.blocks),
        };
        self.factorised
    }

    /// Changes to a factor in double precision; false when it is one already.
    pub(crate) fn use_double(&mut self) -> Result<bool, OutOfMemory> {
        if !self.preconditioner.is_single() {
            return Ok(false);
        }
        self.factorised = false;
        self.preconditioner = Preconditioner::Double(Factor::new(self.pattern.analysis()?)?);
        Ok(true)
    }

    /// Steps of the iteration that cost about as much as a new factor: the operations of a
    /// factorisation grow with the square of the entries in a column, those of a step with their
    /// number, and memory slows the step down.
    fn patience(&self) -> usize {
        let entries = self.pattern.analysis().map_or(0, Analysis::entries);
        (entries / self.pattern.unknowns().max(1) / 32).clamp(6, 30)
    }

    fn iterate<const K: usize>(
        &mut self,
        right: [&[f64]; K],
        goal: f64,
        max_steps: usize,
        turn: &WallTurn,
    ) -> Option<[LinearSolution; K]> {
        let solutions = right.map(|right| {
            let (pattern, blocks) = (&*self.pattern, &self.blocks);
            let preconditioner = &mut self.preconditioner;
            let x = conjugate_gradients(
                |x, product| pattern.multiply(blocks, x, product),
                |x| {
                    turn.undo(x);
                    let solved = match preconditioner {
                        Preconditioner::Single(factor) => factor.solve(pattern, x),
                        Preconditioner::Double(factor) => factor.solve(pattern, x),
                    };
                    turn.apply(x);
                    solved
                },
                right,
                goal,
                max_steps,
            )?;
            Some(LinearSolution { x, exact: true })
        });
        all(solutions)
    }
}

/// All values, if each is one.
fn all<T, const K: usize>(values: [Option<T>; K]) -> Option<[T; K]> {
    let values: Option<Vec<T>> = values.into_iter().collect();
    values.and_then(|values| values.try_into().ok())
}
