//! The sparse direct solver.

use crate::analysis::{Analysis, OutOfMemory, buffer};
use crate::pattern::{Block, Pattern};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SparseColMatRef;
use faer::sparse::linalg::cholesky::LltRef;
use faer::traits::RealField;
use faer::{Conj, MatMut, Par, Side};
use nalgebra::DMatrix;
use rayon::prelude::*;

/// Nodes whose unit forces are solved for at once.
const NODES_AT_ONCE: usize = 8;

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

fn zeros<T: Precision>(n: usize) -> Result<Vec<T>, OutOfMemory> {
    let mut values = Vec::new();
    values.try_reserve_exact(n).map_err(|_| OutOfMemory)?;
    values.resize(n, T::of(0.0));
    Ok(values)
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

    /// The inverse of the matrix between nodes whose three unknowns begin at `rows`: three rows and
    /// columns for each, symmetric. The same bytes for any number of threads. `None` when a number
    /// is not finite.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn compliance(
        &self,
        pattern: &Pattern,
        rows: &[usize],
    ) -> Result<Option<DMatrix<f64>>, OutOfMemory> {
        let (analysis, unknowns) = (pattern.analysis()?, pattern.unknowns());
        let solved = |nodes: &[usize]| -> Result<Vec<f64>, OutOfMemory> {
            let columns = 3 * nodes.len();
            let work = analysis.symbolic.solve_in_place_scratch::<T>(columns, Par::Seq);
            let mut work = buffer(work)?;
            let mut right = zeros(columns * unknowns)?;
            for (k, row) in nodes.iter().enumerate() {
                (0..3).for_each(|axis| right[(3 * k + axis) * unknowns + row + axis] = T::of(1.0));
            }
            LltRef::new(&analysis.symbolic, &self.entries).solve_in_place_with_conj(
                Conj::No,
                MatMut::from_column_major_slice_mut(&mut right, unknowns, columns),
                Par::Seq,
                MemStack::new(&mut work),
            );
            let column = |own: &[T]| -> Vec<f64> {
                rows.iter().flat_map(|&row| [0, 1, 2].map(|axis| own[row + axis].value())).collect()
            };
            Ok(right.chunks_exact(unknowns).flat_map(column).collect())
        };
        let parts: Vec<Vec<f64>> =
            rows.par_chunks(NODES_AT_ONCE).map(solved).collect::<Result<_, _>>()?;
        let size = 3 * rows.len();
        let mut entries = Vec::new();
        entries.try_reserve_exact(size * size).map_err(|_| OutOfMemory)?;
        parts.iter().for_each(|part| entries.extend_from_slice(part));
        if !entries.iter().all(|v| v.is_finite()) {
            return Ok(None);
        }
        let mut matrix = DMatrix::from_vec(size, size, entries);
        for k in 0..size {
            for i in 0..k {
                let mean = 0.5 * (matrix[(i, k)] + matrix[(k, i)]);
                (matrix[(i, k)], matrix[(k, i)]) = (mean, mean);
            }
        }
        Ok(Some(matrix))
    }
}
