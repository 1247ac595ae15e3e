//! Which blocks the stiffness matrix has, and where an element's blocks go.

use crate::analysis::{Analysis, OutOfMemory};
use faer::sparse::SymbolicSparseColMat;
use std::sync::OnceLock;
use supine_space::{Matrix, Vector};

/// No place: the block belongs to a held node, or to the half that is not stored.
const NONE: u32 = u32::MAX;

/// Which half is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Storage {
    /// The lower half of a symmetric matrix.
    Lower,
    /// All of an unsymmetric matrix.
    Full,
}

/// A 3 × 3 block, one row after the other.
pub(crate) type Block = [f64; 9];

/// Where the block of a pair of an element's nodes is added.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BlockIndex(u32);

impl BlockIndex {
    /// Adds a block (row node, column node) to the blocks of the matrix.
    #[inline(always)]
    pub(crate) fn add(self, block: &Block, blocks: &mut [Block]) {
        if self.0 == NONE {
            return;
        }
        let own = &mut blocks[(self.0 >> 1) as usize];
        if self.0 & 1 == 0 {
            own.iter_mut().zip(block).for_each(|(own, b)| *own += b);
        } else {
            for i in 0..3 {
                for k in 0..3 {
                    own[3 * k + i] += block[3 * i + k];
                }
            }
        }
    }
}

/// A plane in which a node moves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plane {
    pub(crate) node: u32,
    /// Its unit normal.
    pub(crate) normal: Vector,
    /// Stiffness that the node has by itself, mN/mm.
    pub(crate) stiffness: Matrix,
}

/// Columns of 3 × 3 blocks over the free nodes.
#[derive(Debug)]
pub(crate) struct Pattern {
    /// Which half is stored.
    pub(crate) storage: Storage,
    /// The free nodes in ascending order.
    free: Vec<u32>,
    /// Number of nodes, held ones included.
    nodes: usize,
    /// Per free node where its column begins.
    starts: Vec<usize>,
    /// Row of each block; the diagonal one first where only the lower half is stored.
    rows: Vec<u32>,
    /// Per element and pair of its nodes, in the order of [`pairs`].
    places: Vec<BlockIndex>,
    analysis: OnceLock<Analysis>,
}

/// The pairs (row, column) of an element's `nodes` nodes whose blocks it adds: each once, the row
/// not before the column, where the matrix is symmetric.
pub(crate) fn pairs(nodes: usize, storage: Storage) -> impl Iterator<Item = (usize, usize)> {
    let last = move |a: usize| if storage == Storage::Full { nodes } else { a + 1 };
    (0..nodes).flat_map(move |a| (0..last(a)).map(move |b| (a, b)))
}

/// The number of a pair among [`pairs`]; `None` where its block is not stored.
pub(crate) fn pair_number(nodes: usize, storage: Storage, (a, b): (usize, usize)) -> Option<usize> {
    match storage {
        Storage::Full => Some(a * nodes + b),
        Storage::Lower => (b <= a).then_some(a * (a + 1) / 2 + b),
    }
}

impl Pattern {
    /// The pattern of `elements` over the nodes that are not `fixed`.
    pub(crate) fn new<const N: usize>(
        elements: &[[u32; N]],
        fixed: &[bool],
        storage: Storage,
    ) -> Self {
        let free: Vec<u32> = (0..fixed.len() as u32).filter(|&n| !fixed[n as usize]).collect();
        let mut number = vec![NONE; fixed.len()];
        free.iter().enumerate().for_each(|(k, &n)| number[n as usize] = k as u32);
        let stored = |row: u32, column: u32| {
            row != NONE && column != NONE && (storage == Storage::Full || row >= column)
        };
        // The elements around each free node, one node after the other.
        let mut next = vec![0usize; free.len() + 1];
        let of_free = |element: &[u32; N]| element.map(|n| number[n as usize]);
        for column in elements.iter().flat_map(of_free).filter(|&n| n != NONE) {
            next[column as usize + 1] += 1;
        }
        (0..free.len()).for_each(|n| next[n + 1] += next[n]);
        let (first, mut around) = (next.clone(), vec![0; next[free.len()]]);
        for (e, element) in elements.iter().enumerate() {
            for column in of_free(element).into_iter().filter(|&n| n != NONE) {
                around[next[column as usize]] = e;
                next[column as usize] += 1;
            }
        }
        // The rows of each column, each once.
        let (mut starts, mut rows) = (vec![0], Vec::new());
        let mut seen = vec![NONE; free.len()];
        for column in 0..free.len() as u32 {
            let begin = rows.len();
            for &e in &around[first[column as usize]..first[column as usize + 1]] {
                for row in of_free(&elements[e]) {
                    if stored(row, column) && seen[row as usize] != column {
                        seen[row as usize] = column;
                        rows.push(row);
                    }
                }
            }
            rows[begin..].sort_unstable();
            starts.push(rows.len());
        }
        let place = |row: u32, column: u32| {
            if row == NONE || column == NONE {
                return BlockIndex(NONE);
            }
            let turned = storage == Storage::Lower && row < column;
            let (row, column) = if turned { (column, row) } else { (row, column) };
            let start = starts[column as usize];
            let within = &rows[start..starts[column as usize + 1]];
            let block = start + within.partition_point(|&r| r < row);
            BlockIndex((block as u32) << 1 | u32::from(turned))
        };
        let mut places = Vec::new();
        for element in elements {
            let own = element.map(|n| number[n as usize]);
            places.extend(pairs(N, storage).map(|(a, b)| place(own[a], own[b])));
        }
        let analysis = OnceLock::new();
        Self { storage, free, nodes: fixed.len(), starts, rows, places, analysis }
    }

    /// What the factors of its matrices share, found when first asked for.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn analysis(&self) -> Result<&Analysis, OutOfMemory> {
        if let Some(analysis) = self.analysis.get() {
            return Ok(analysis);
        }
        let analysis = Analysis::new(&self.graph(), self.scalar_columns())?;
        Ok(self.analysis.get_or_init(|| analysis))
    }

    /// Number of unknowns: three per free node.
    pub(crate) fn unknowns(&self) -> usize {
        3 * self.free.len()
    }

    /// A matrix of this pattern, all zero.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn zeros(&self) -> Result<Vec<Block>, OutOfMemory> {
        let mut blocks = Vec::new();
        blocks.try_reserve_exact(self.rows.len()).map_err(|_| OutOfMemory)?;
        blocks.resize(self.rows.len(), [0.0; 9]);
        Ok(blocks)
    }

    /// Where the pairs of `element`'s nodes are added, in the order of [`pairs`].
    pub(crate) fn places<const N: usize>(&self, element: usize) -> &[BlockIndex] {
        let each = if self.storage == Storage::Full { N * N } else { N * (N + 1) / 2 };
        &self.places[element * each..][..each]
    }

    /// Rows of the blocks in the column of a free node.
    fn column(&self, column: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        let range = self.starts[column]..self.starts[column + 1];
        range.map(|block| (block, self.rows[block] as usize))
    }

    /// The pattern node by node.
    fn graph(&self) -> SymbolicSparseColMat<usize> {
        let rows = self.rows.iter().map(|&r| r as usize).collect();
        SymbolicSparseColMat::new_checked(
            self.free.len(),
            self.free.len(),
            self.starts.clone(),
            None,
            rows,
        )
    }

    /// The pattern unknown by unknown.
    fn scalar_columns(&self) -> SymbolicSparseColMat<usize> {
        let (mut starts, mut rows) = (vec![0], Vec::with_capacity(9 * self.rows.len()));
        self.each_entry(|row, _| rows.push(row), |end| starts.push(end));
        SymbolicSparseColMat::new_checked(self.unknowns(), self.unknowns(), starts, None, rows)
    }

    /// The entries in the order of [`Self::scalar_columns`].
    pub(crate) fn scalars<T>(&self, blocks: &[Block], to: impl Fn(f64) -> T, out: &mut Vec<T>) {
        out.clear();
        self.each_entry(|_, (block, entry)| out.push(to(blocks[block][entry])), |_| ());
    }

    /// Visits every stored entry (row; block and place in it) and the end of every column.
    fn each_entry(&self, mut entry: impl FnMut(usize, (usize, usize)), mut end: impl FnMut(usize)) {
        let mut count = 0;
        for column in 0..self.free.len() {
            for k in 0..3 {
                for (block, row) in self.column(column) {
                    let own = self.storage == Storage::Lower && row == column;
                    for i in (if own { k } else { 0 })..3 {
                        entry(3 * row + i, (block, 3 * i + k));
                        count += 1;
                    }
                }
                end(count);
            }
        }
    }

    /// The matrix with these blocks times x.
    pub(crate) fn multiply(&self, blocks: &[Block], x: &[f64], product: &mut [f64]) {
        product.fill(0.0);
        for column in 0..self.free.len() {
            let own: [f64; 3] = [0, 1, 2].map(|k| x[3 * column + k]);
            let mut sum = [0.0; 3];
            for (block, row) in self.column(column) {
                let b = &blocks[block];
                let to = &mut product[3 * row..3 * row + 3];
                for i in 0..3 {
                    to[i] += b[3 * i] * own[0] + b[3 * i + 1] * own[1] + b[3 * i + 2] * own[2];
                }
                if self.storage == Storage::Lower && row != column {
                    let other = &x[3 * row..3 * row + 3];
                    for k in 0..3 {
                        sum[k] += b[k] * other[0] + b[3 + k] * other[1] + b[6 + k] * other[2];
                    }
                }
            }
            (0..3).for_each(|k| product[3 * column + k] += sum[k]);
        }
    }

    /// Projects rows and columns of some nodes to their planes. Along a normal, which no other
    /// unknown then meets, a node gets the mean stiffness of its own block.
    pub(crate) fn constrain(&self, planes: &[Plane], blocks: &mut [Block]) {
        let mut across = vec![None; self.free.len()];
        for plane in planes {
            if let Ok(free) = self.free.binary_search(&plane.node) {
                across[free] = Some(plane);
            }
        }
        for column in 0..self.free.len() {
            for (place, row) in self.column(column) {
                let (left, right) = (across[row], across[column]);
                if left.is_none() && right.is_none() {
                    continue;
                }
                let mut m = Matrix::from_row_slice(&blocks[place]);
                let mean = m.trace() / 3.0;
                if let (Some(own), true) = (left, row == column) {
                    m += own.stiffness;
                }
                if let Some(Plane { normal, .. }) = left {
                    m -= normal * (normal.transpose() * m);
                }
                if let Some(Plane { normal, .. }) = right {
                    m -= (m * normal) * normal.transpose();
                }
                if let (Some(Plane { normal, .. }), true) = (left, row == column) {
                    m += normal * normal.transpose() * mean;
                }
                blocks[place] = block(&m);
            }
        }
    }

    /// Adds a block to that of a node with itself, if it is free.
    pub(crate) fn add_at(&self, node: u32, block: &Block, blocks: &mut [Block]) {
        let Ok(free) = self.free.binary_search(&node) else { return };
        if let Some((place, _)) = self.column(free).find(|(_, row)| *row == free) {
            blocks[place].iter_mut().zip(block).for_each(|(own, b)| *own += b);
        }
    }

    /// Where the three unknowns of a node begin; `None` where it is held.
    pub(crate) fn row(&self, node: u32) -> Option<usize> {
        self.free.binary_search(&node).ok().map(|free| 3 * free)
    }

    /// The free nodes' vectors as one vector of unknowns.
    pub(crate) fn gather(&self, nodes: &[Vector]) -> Vec<f64> {
        self.free.iter().flat_map(|&n| <[f64; 3]>::from(nodes[n as usize])).collect()
    }

    /// Adds a vector of unknowns to the nodes' vectors.
    pub(crate) fn add_to(&self, nodes: &mut [Vector], unknowns: &[f64]) {
        for (v, &n) in unknowns.chunks_exact(3).zip(&self.free) {
            nodes[n as usize] += Vector::new(v[0], v[1], v[2]);
        }
    }

    /// The vector of unknowns as vectors of all nodes, zero at held ones.
    pub(crate) fn scatter(&self, unknowns: &[f64]) -> Vec<Vector> {
        let mut nodes = vec![Vector::zeros(); self.nodes];
        for (v, &n) in unknowns.chunks_exact(3).zip(&self.free) {
            nodes[n as usize] = Vector::new(v[0], v[1], v[2]);
        }
        nodes
    }
}

/// A matrix as a block.
pub(crate) fn block(m: &Matrix) -> Block {
    std::array::from_fn(|n| m[(n / 3, n % 3)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_have_their_numbers() {
        for storage in [Storage::Full, Storage::Lower] {
            let of = |pair| pair_number(10, storage, pair);
            assert!(pairs(10, storage).enumerate().all(|(n, pair)| of(pair) == Some(n)));
        }
        assert_eq!(pair_number(10, Storage::Lower, (2, 3)), None);
    }
}
