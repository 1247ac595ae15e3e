//! The sparse direct solver.

use crate::pattern::Pattern;
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::{Conj, MatMut, Par, Side};

/// There is not enough memory for the factors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OutOfMemory;

/// Above this many unknowns the dense blocks of the factor pay.
const SUPERNODAL_FROM: usize = 600;

fn buffer(request: StackReq) -> Result<MemBuffer, OutOfMemory> {
    MemBuffer::try_new(request).map_err(|_| OutOfMemory)
}

fn finite(x: &[f64]) -> bool {
    x.iter().all(|v| v.is_finite())
}

/// Cholesky factor L Lᵀ of the symmetric matrices of one pattern (lower half stored).
///
/// The pattern is analysed once and factorised many times, on one thread: several threads were never
/// faster at these sizes, and one thread gives the same bytes everywhere.
pub(crate) struct Cholesky {
    symbolic: SymbolicCholesky<usize>,
    factor: Vec<f64>,
    work: MemBuffer,
    solve_work: MemBuffer,
}

impl Cholesky {
    /// Analyses the pattern (minimum-degree ordering).
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn new(pattern: &Pattern) -> Result<Self, OutOfMemory> {
        let threshold = if pattern.unknowns() > SUPERNODAL_FROM {
            SupernodalThreshold::FORCE_SUPERNODAL
        } else {
            SupernodalThreshold::AUTO
        };
        let parameters = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: threshold,
            ..Default::default()
        };
        let columns = pattern.columns().as_ref();
        let ordering = SymmetricOrdering::Amd;
        let symbolic = factorize_symbolic_cholesky(columns, Side::Lower, ordering, parameters)
            .map_err(|_| OutOfMemory)?;
        let work = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        let solve_work = symbolic.solve_in_place_scratch::<f64>(1, Par::Seq);
        let mut factor = Vec::new();
        factor.try_reserve_exact(symbolic.len_val()).map_err(|_| OutOfMemory)?;
        factor.resize(symbolic.len_val(), 0.0);
        Ok(Self { symbolic, factor, work: buffer(work)?, solve_work: buffer(solve_work)? })
    }

    /// Factorises; false when the matrix is not positive definite.
    pub(crate) fn factorise(&mut self, pattern: &Pattern, values: &[f64]) -> bool {
        if !finite(values) {
            return false;
        }
        let outcome = self.symbolic.factorize_numeric_llt::<f64>(
            &mut self.factor,
            pattern.matrix(values),
            Side::Lower,
            Default::default(),
            Par::Seq,
            MemStack::new(&mut self.work),
            Default::default(),
        );
        outcome.is_ok()
    }

    /// Solves in place with the last factor; false when the result is not finite.
    pub(crate) fn solve(&mut self, x: &mut [f64]) -> bool {
        let rows = x.len();
        LltRef::new(&self.symbolic, &self.factor).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(x, rows, 1),
            Par::Seq,
            MemStack::new(&mut self.solve_work),
        );
        finite(x)
    }
}
