//! The sparse direct solver.

use crate::pattern::{Block, Pattern};
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::perm::PermRef;
use faer::sparse::SparseColMatRef;
use faer::sparse::SymbolicSparseColMat;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::amd;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::traits::RealField;
use faer::{Conj, MatMut, Par, Side};

/// There is not enough memory for the factors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OutOfMemory;

/// Above this many unknowns the dense blocks of the factor pay.
const SUPERNODAL_FROM: usize = 600;

fn buffer(request: StackReq) -> Result<MemBuffer, OutOfMemory> {
    MemBuffer::try_new(request).map_err(|_| OutOfMemory)
}

/// Digits in which a factor is computed.
pub(crate) trait Digits: RealField + Copy {
    /// Rounds to these digits.
    fn of(value: f64) -> Self;
    /// The value.
    fn value(self) -> f64;
}

impl Digits for f32 {
    fn of(value: f64) -> Self {
        value as f32
    }
    fn value(self) -> f64 {
        f64::from(self)
    }
}

impl Digits for f64 {
    fn of(value: f64) -> Self {
        value
    }
    fn value(self) -> f64 {
        self
    }
}

/// What the factors of all matrices of one pattern (lower half stored) share.
#[derive(Debug)]
pub(crate) struct Analysis {
    columns: SymbolicSparseColMat<usize>,
    symbolic: SymbolicCholesky<usize>,
}

impl Analysis {
    /// Orders the unknowns by minimum degree, node by node (Amestoy, Davis and Duff 1996), and finds the
    /// entries of the factor.
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
        let (order, inverse) = minimum_degree(pattern)?;
        let ordering =
            SymmetricOrdering::Custom(PermRef::new_checked(&order, &inverse, order.len()));
        let columns = pattern.scalar_columns();
        let symbolic =
            factorize_symbolic_cholesky(columns.as_ref(), Side::Lower, ordering, parameters)
                .map_err(|_| OutOfMemory)?;
        Ok(Self { columns, symbolic })
    }

    /// Stored entries of a factor.
    pub(crate) fn entries(&self) -> usize {
        self.symbolic.len_val()
    }
}

/// The elimination order of the unknowns and its inverse.
fn minimum_degree(pattern: &Pattern) -> Result<(Vec<usize>, Vec<usize>), OutOfMemory> {
    let graph = pattern.graph();
    let nodes = graph.ncols();
    let (mut order, mut inverse) = (vec![0; nodes], vec![0; nodes]);
    let mut work = buffer(amd::order_scratch::<usize>(nodes, graph.compute_nnz()))?;
    let control = amd::Control::default();
    amd::order(&mut order, &mut inverse, graph.as_ref(), control, MemStack::new(&mut work))
        .map_err(|_| OutOfMemory)?;
    let each =
        |nodes: Vec<usize>| nodes.iter().flat_map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
    Ok((each(order), each(inverse)))
}

/// Cholesky factor L Lᵀ of a symmetric matrix, in the digits of `T`.
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

impl<T: Digits> Factor<T> {
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

    /// Factorises; false when the matrix is not positive definite in these digits.
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
        // A vector of any size fits the digits.
        let scale = x.iter().fold(0.0f64, |most, v| most.max(v.abs()));
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
