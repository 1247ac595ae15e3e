//! How well the two fields of a map undo each other.

use crate::Fields;
use rayon::prelude::*;
use supine_space::{Grid, Vector};
use supine_volume::Volume;

/// Forward, then backward: how far from where it began a voxel of the CT comes out, mm.
///
/// Over the voxels in the mesh that move to a place whose eight neighbours lie in the deformed mesh.
/// The backward field is sampled between its voxels, so that this is what a user of both fields gets; it is
/// not 0 for exact fields on a grid, but grows with the square of the spacing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Consistency {
    /// Voxels that count.
    pub voxels: usize,
    /// Mean, mm.
    pub mean_mm: f64,
    /// 99 % lie below this, mm.
    pub p99_mm: f64,
    /// Largest, mm.
    pub max_mm: f64,
}

/// How well `ct_to_deformed` and `deformed_to_ct` undo each other; `None` when nothing moves.
pub fn consistency(fields: &Fields) -> Option<Consistency> {
    let (forward, back) = (&fields.ct_to_deformed, &fields.deformed_to_ct);
    let grid = forward.grid();
    let error = |(n, u): (usize, &[f32; 3])| {
        if *u == [0.0; 3] {
            return None;
        }
        let u = Vector::from(u.map(f64::from));
        let there = grid.centre(grid.voxel(n)) + u;
        let back = within(back, grid.index_from_patient(&there))?;
        Some((u + back).norm())
    };
    let mut errors: Vec<f64> = forward.data().par_iter().enumerate().filter_map(error).collect();
    errors.par_sort_unstable_by(f64::total_cmp);
    let max_mm = *errors.last()?;
    Some(Consistency {
        voxels: errors.len(),
        mean_mm: errors.iter().sum::<f64>() / errors.len() as f64,
        p99_mm: errors[(errors.len() - 1) * 99 / 100],
        max_mm,
    })
}

/// Trilinear sample of a field at a continuous index; `None` where a neighbour lies outside the mesh (its
/// vector is exactly 0) or the grid.
fn within(field: &Volume<[f32; 3]>, index: [f64; 3]) -> Option<Vector> {
    let grid: &Grid = field.grid();
    let base = index.map(f64::floor);
    if (0..3).any(|a| base[a] < 0.0 || base[a] + 1.0 > (grid.size()[a] - 1) as f64) {
        return None;
    }
    let mut sum = Vector::zeros();
    for corner in 0..8 {
        let step = [0, 1, 2].map(|a| corner >> a & 1);
        let value = field.at([0, 1, 2].map(|a| base[a] as usize + step[a]));
        if value == [0.0; 3] {
            return None;
        }
        let share = (0..3).map(|a| {
            let t = index[a] - base[a];
            if step[a] == 1 { t } else { 1.0 - t }
        });
        sum += Vector::from(value.map(f64::from)) * share.product::<f64>();
    }
    Some(sum)
}
