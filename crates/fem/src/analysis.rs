//! The order of elimination and the entries of a sparse factor.

use faer::Side;
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::perm::PermRef;
use faer::sparse::SymbolicSparseColMat;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::amd;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};

/// There is not enough memory for the factors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OutOfMemory;

/// Above this many unknowns the dense blocks of the factor pay.
const SUPERNODAL_FROM: usize = 600;

pub(crate) fn buffer(request: StackReq) -> Result<MemBuffer, OutOfMemory> {
    MemBuffer::try_new(request).map_err(|_| OutOfMemory)
}

/// What the factors of all matrices of one pattern (lower half stored) share.
#[derive(Debug)]
pub(crate) struct Analysis {
    pub(crate) columns: SymbolicSparseColMat<usize>,
    pub(crate) symbolic: SymbolicCholesky<usize>,
}

impl Analysis {
    /// Of the lower half of a symmetric matrix: `graph` is its pattern node by node, `columns`
    /// unknown by unknown.
    ///
    /// Orders the unknowns by minimum degree, node by node (Amestoy, Davis and Duff 1996), and
    /// finds the entries of the factor.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn new(
        graph: &SymbolicSparseColMat<usize>,
        columns: SymbolicSparseColMat<usize>,
    ) -> Result<Self, OutOfMemory> {
        let threshold = if columns.ncols() > SUPERNODAL_FROM {
            SupernodalThreshold::FORCE_SUPERNODAL
        } else {
            SupernodalThreshold::AUTO
        };
        let parameters = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: threshold,
            ..Default::default()
        };
        let (order, inverse) = minimum_degree(graph)?;
        let ordering =
            SymmetricOrdering::Custom(PermRef::new_checked(&order, &inverse, order.len()));
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
fn minimum_degree(
    graph: &SymbolicSparseColMat<usize>,
) -> Result<(Vec<usize>, Vec<usize>), OutOfMemory> {
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
