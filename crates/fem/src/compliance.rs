//! How tissue gives way to forces at the nodes near a rigid body.

use crate::analysis::OutOfMemory;
use crate::pairs::Pairs;
use crate::pattern::Pattern;
use crate::site::ContactSite;
use crate::tangent::Tangent;
use nalgebra::{DMatrix, DVector, DVectorView};
use std::sync::Arc;
use supine_space::Vector;

/// A factor of the tissue's stiffness without contact, and its inverse between the nodes in reach.
pub(crate) struct Compliance {
    tangent: Tangent,
    pattern: Arc<Pattern>,
    /// Displacement at which it was made, mm.
    pub(crate) u: Vec<Vector>,
    /// The nodes in reach, in rising order.
    pub(crate) nodes: Vec<u32>,
    /// Where their unknowns begin.
    rows: Vec<usize>,
    /// Displacement per force between them, three rows and columns each, mm/mN.
    between: DMatrix<f64>,
    /// What corrections have taught since.
    pub(crate) pairs: Pairs,
}

impl Compliance {
    /// At displacement `u` (mm) between `nodes`, which are free and in rising order; `None` when
    /// the stiffness there has no factor.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn new<const N: usize, const Q: usize>(
        site: &ContactSite<N, Q>,
        u: &[Vector],
        nodes: Vec<u32>,
        spare: Option<Tangent>,
    ) -> Result<Option<Self>, OutOfMemory> {
        let pattern = site.pattern.clone();
        let mut tangent = match spare {
            Some(tangent) => tangent,
            None => Tangent::new(&pattern)?,
        };
        if !tangent.renew(&site.model, u)? {
            return Ok(None);
        }
        let rows: Vec<usize> = nodes.iter().filter_map(|n| pattern.row(*n)).collect();
        if rows.len() != nodes.len() {
            return Ok(None);
        }
        let Some(between) = tangent.compliance(&rows)? else { return Ok(None) };
        let (u, pairs) = (u.to_vec(), Pairs::default());
        Ok(Some(Self { tangent, pattern, u, nodes, rows, between, pairs }))
    }

    /// How far the tissue has moved since, mm.
    pub(crate) fn age_mm(&self, u: &[Vector]) -> f64 {
        u.iter().zip(&self.u).map(|(u, old)| (u - old).norm()).fold(0.0, f64::max)
    }

    /// Whether it is that of a stiffer body than the tissue.
    pub(crate) fn is_stiffer(&self) -> bool {
        self.tangent.is_shifted()
    }

    /// The room of its factor.
    pub(crate) fn into_tangent(self) -> Tangent {
        self.tangent
    }

    /// Replaces forces on all unknowns (mN) by what the factor makes of them (mm).
    pub(crate) fn undo(&mut self, forces: &mut [f64]) -> bool {
        self.tangent.apply_factor(forces)
    }

    /// The values of the nodes in reach.
    pub(crate) fn local(&self, all: &[f64]) -> DVector<f64> {
        let own = self.rows.iter().flat_map(|&row| [all[row], all[row + 1], all[row + 2]]);
        DVector::from_iterator(3 * self.rows.len(), own)
    }

    /// Values of the nodes in reach among zeros.
    pub(crate) fn spread(&self, local: &DVector<f64>) -> Vec<f64> {
        let mut all = vec![0.0; self.pattern.unknowns()];
        for (k, &row) in self.rows.iter().enumerate() {
            (0..3).for_each(|axis| all[row + axis] = local[3 * k + axis]);
        }
        all
    }

    /// The same with what was learnt, for the time of a correction.
    pub(crate) fn learnt(&self) -> Learnt<'_> {
        Learnt { between: &self.between, w: self.pairs.local(&self.rows), pairs: &self.pairs }
    }
}

/// The inverse between the nodes in reach with the pairs: C + W M Wᵀ.
pub(crate) struct Learnt<'a> {
    between: &'a DMatrix<f64>,
    w: DMatrix<f64>,
    pairs: &'a Pairs,
}

impl Learnt<'_> {
    /// Displacement (mm) by forces at the nodes in reach (mN).
    pub(crate) fn motion(&self, forces: &DVector<f64>) -> DVector<f64> {
        let mut motion = DVector::zeros(forces.len());
        for (column, force) in self.between.column_iter().zip(forces.iter()) {
            if *force != 0.0 {
                motion.axpy(*force, &column, 1.0);
            }
        }
        if self.w.ncols() > 0 {
            let parts = self.pairs.middle() * self.w.tr_mul(forces);
            motion.gemv(1.0, &self.w, &parts, 1.0);
        }
        motion
    }

    /// The same between directions at nodes: Nᵀ (C + W M Wᵀ) N, mm/mN; `directions` are unit
    /// vectors at places in the list of the nodes in reach.
    pub(crate) fn across(&self, directions: &[(usize, Vector)]) -> DMatrix<f64> {
        let n = directions.len();
        let mut compliance = DMatrix::zeros(n, n);
        // Of the nodes at which there are directions alone.
        let mut nodes: Vec<usize> = directions.iter().map(|(at, _)| *at).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let own: Vec<usize> =
            directions.iter().map(|(at, _)| nodes.partition_point(|node| node < at)).collect();
        let mut way = vec![Vector::zeros(); nodes.len()];
        for (k, (at, normal)) in directions.iter().enumerate() {
            let [x, y, z] = [0, 1, 2].map(|axis| self.between.column(3 * at + axis));
            for (way, node) in way.iter_mut().zip(&nodes) {
                let of = |rows: &DVectorView<'_, f64>| rows.fixed_rows::<3>(3 * node).into_owned();
                *way = of(&x) * normal.x + of(&y) * normal.y + of(&z) * normal.z;
            }
            for (i, (_, direction)) in directions.iter().enumerate().take(k + 1) {
                compliance[(i, k)] = direction.dot(&way[own[i]]);
            }
        }
        let columns = self.w.ncols();
        if columns > 0 {
            let along = |i: usize, k: usize| {
                let (at, normal) = &directions[i];
                (0..3).map(|axis| normal[axis] * self.w[(3 * at + axis, k)]).sum()
            };
            let own = DMatrix::from_fn(n, columns, along);
            let more = &own * self.pairs.middle() * own.transpose();
            for k in 0..n {
                for i in 0..=k {
                    compliance[(i, k)] += 0.5 * (more[(i, k)] + more[(k, i)]);
                }
            }
        }
        compliance.fill_lower_triangle_with_upper_triangle();
        compliance
    }
}
