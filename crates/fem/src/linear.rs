//! The sparse direct solver.

use crate::analysis::{Analysis, OutOfMemory, buffer};
use crate::pattern::{Block, Pattern};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SparseColMatRef;
use faer::sparse::linalg::cholesky::LltRef;
use faer::traits::RealField;
use faer::{Conj, MatMut, Par, Side};

/// Precision in which a factor is computed.
pub(crate) trait Precision: RealField + Copy {
    /// Rounds to it.
    fn of(value: f64) -> Self;
    /// The value.
    fn value(self) -> f64;
}

impl Precision for f32 {
    fn of(value: f64) -> Self {
        value as f32
    }
    fn value(self) -> f64 {
        f64::from(self)
    }
}

impl Precision for f64 {
    fn of(value: f64) -> Self {
        value
    }
    fn value(self) -> f64 {
        self
    }
}

/// Cholesky factor L Lᵀ of a symmetric matrix, in the precision of `T`.
///
/// Computed on one thread: several were never faster at these sizes, and one gives the same bytes
/// everywhere.
pub(crate) struct Factor<T> {
    /// The matrix, as [`Pattern::scalars`] gives it.
    values: Vec<T>,
    entries: Vec<T>,
    right: Vec<T>,
    work: MemBuffer,
    solve_work: MemBuffer,
}

impl<T: Precision> Factor<T> {
    /// Room for a factor.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn new(analysis: &Analysis) -> Result<Self, OutOfMemory> {
        let symbolic = &analysis.symbolic;
        let work = symbolic.factorize_numeric_llt_scratch::<T>(Par::Seq, Default::default());
        let solve_work = symbolic.solve_in_place_scratch::<T>(1, Par::Seq);
        let zeros = |n: usize| -> Result<Vec<T>, OutOfMemory> {
            let mut values = Vec::new();
            values.try_reserve_exact(n).map_err(|_| OutOfMemory)?;
            values.resize(n, T::of(0.0));
            Ok(values)
        };
        Ok(Self {
            values: zeros(analysis.columns.compute_nnz())?,
            entries: zeros(symbolic.len_val())?,
            right: zeros(analysis.columns.ncols())?,
            work: buffer(work)?,
            solve_work: buffer(solve_work)?,
        })
    }

    /// Factorises; false when the matrix is not positive definite in this precision.
    pub(crate) fn factorise(&mut self, pattern: &Pattern, blocks: &[Block]) -> bool {
        let Ok(analysis) = pattern.analysis() else { return false };
        if !blocks.iter().flatten().all(|v| v.is_finite()) {
            return false;
        }
        pattern.scalars(blocks, T::of, &mut self.values);
        let outcome = analysis.symbolic.factorize_numeric_llt::<T>(
            &mut self.entries,
            SparseColMatRef::new(analysis.columns.as_ref(), &self.values),
            Side::Lower,
            Default::default(),
            Par::Seq,
            MemStack::new(&mut self.work),
            Default::default(),
        );
        outcome.is_ok()
    }

    /// Solves in place with the last factor; false when the result is not finite.
    pub(crate) fn solve(&mut self, pattern: &Pattern, x: &mut [f64]) -> bool {
        let Ok(analysis) = pattern.analysis() else { return false };
        // Scaled, a vector of any size fits the precision.
        let scale = x.iter().fold(0.0f64, |max, v| max.max(v.abs()));
        if scale == 0.0 {
            return true;
        }
        self.right.clear();
        self.right.extend(x.iter().map(|v| T::of(v / scale)));
        let rows = x.len();
        LltRef::new(&analysis.symbolic, &self.entries).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(&mut self.right, rows, 1),
            Par::Seq,
            MemStack::new(&mut self.solve_work),
        );
        x.iter_mut().zip(&self.right).for_each(|(x, v)| *x = v.value() * scale);
        x.iter().all(|v| v.is_finite())
    }
}
