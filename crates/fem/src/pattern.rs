//! Which entries the stiffness matrix has, and where an element's blocks go.

use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};
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

/// Compressed columns of a matrix over the free nodes, three unknowns each.
#[derive(Debug)]
pub(crate) struct Pattern {
    storage: Storage,
    /// The free nodes in ascending order.
    free: Vec<u32>,
    /// Per node its position in `free`, or `NONE`.
    number: Vec<u32>,
    columns: SymbolicSparseColMat<usize>,
    /// Per element, row node and column node: position of the block in its column.
    place: Vec<u32>,
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
        let mut neighbours: Vec<Vec<u32>> = vec![Vec::new(); free.len()];
        for element in elements {
            for column in element.map(|n| number[n as usize]) {
                for row in element.map(|n| number[n as usize]) {
                    if stored(row, column) {
                        neighbours[column as usize].push(row);
                    }
                }
            }
        }
        for rows in &mut neighbours {
            rows.sort_unstable();
            rows.dedup();
        }
        let mut place = Vec::with_capacity(elements.len() * N * N);
        for element in elements {
            for row in element.map(|n| number[n as usize]) {
                for column in element.map(|n| number[n as usize]) {
                    place.push(if stored(row, column) {
                        neighbours[column as usize].partition_point(|&r| r < row) as u32
                    } else {
                        NONE
                    });
                }
            }
        }
        let columns = compressed_columns(&neighbours, storage);
        Self { storage, free, number, columns, place }
    }

    /// Number of unknowns: three per free node.
    pub(crate) fn unknowns(&self) -> usize {
        3 * self.free.len()
    }

    /// Number of stored entries.
    pub(crate) fn entries(&self) -> usize {
        self.columns.row_idx().len()
    }

    /// The columns, for a symbolic factorisation.
    pub(crate) fn columns(&self) -> &SymbolicSparseColMat<usize> {
        &self.columns
    }

    /// The matrix with these entries.
    pub(crate) fn matrix<'a>(&'a self, values: &'a [f64]) -> SparseColMatRef<'a, usize, f64> {
        SparseColMatRef::new(self.columns.as_ref(), values)
    }

    /// The matrix with these entries times x.
    pub(crate) fn multiply(&self, values: &[f64], x: &[f64]) -> Vec<f64> {
        let (starts, rows) = (self.columns.col_ptr(), self.columns.row_idx());
        let mut product = vec![0.0; x.len()];
        for (column, x) in x.iter().enumerate() {
            let range = starts[column]..starts[column + 1];
            for (&row, value) in rows[range.clone()].iter().zip(&values[range]) {
                product[row] += value * x;
            }
        }
        product
    }

    /// Whether the block of two nodes (row, column) of an element is stored.
    pub(crate) fn holds<const N: usize>(&self, element: usize, row: usize, column: usize) -> bool {
        self.place[(element * N + row) * N + column] != NONE
    }

    /// Adds the 3 × 3 block of two nodes (row, column) of an element to the entries.
    pub(crate) fn add<const N: usize>(
        &self,
        element: &[u32; N],
        at: (usize, usize, usize),
        block: &Matrix,
        values: &mut [f64],
    ) {
        let (index, row, column) = at;
        let place = self.place[(index * N + row) * N + column];
        if place == NONE {
            return;
        }
        let first_column = 3 * self.number[element[column] as usize] as usize;
        let lower = self.storage == Storage::Lower;
        for k in 0..3 {
            // A lower column starts at its own diagonal entry.
            let skipped = if lower { k } else { 0 };
            let first = if place == 0 { skipped } else { 0 };
            let start = self.columns.col_ptr()[first_column + k] + 3 * place as usize;
            for i in first..3 {
                values[start + i - skipped] += block[(i, k)];
            }
        }
    }

    /// The free nodes' vectors as one vector of unknowns.
    pub(crate) fn gather(&self, nodes: &[Vector]) -> Vec<f64> {
        self.free.iter().flat_map(|&n| <[f64; 3]>::from(nodes[n as usize])).collect()
    }

    /// The vector of unknowns as vectors of all nodes, zero at held ones.
    pub(crate) fn scatter(&self, unknowns: &[f64]) -> Vec<Vector> {
        let mut nodes = vec![Vector::zeros(); self.number.len()];
        for (v, &n) in unknowns.chunks_exact(3).zip(&self.free) {
            nodes[n as usize] = Vector::new(v[0], v[1], v[2]);
        }
        nodes
    }
}

fn compressed_columns(neighbours: &[Vec<u32>], storage: Storage) -> SymbolicSparseColMat<usize> {
    let size = 3 * neighbours.len();
    let mut starts = vec![0];
    let mut rows = Vec::new();
    for (node, near) in neighbours.iter().enumerate() {
        for k in 0..3 {
            for &row in near {
                let own = storage == Storage::Lower && row as usize == node;
                let first = if own { k } else { 0 };
                rows.extend((first..3).map(|i| 3 * row as usize + i));
            }
            starts.push(rows.len());
        }
    }
    SymbolicSparseColMat::new_checked(size, size, starts, None, rows)
}
