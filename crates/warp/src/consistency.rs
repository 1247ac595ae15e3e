//! How well the two fields of a map undo each other, and how well coarser vectors follow one of
//! them.

use crate::Fields;
use rayon::prelude::*;
use supine_record::Consistency;
use supine_space::{Grid, Vector};
use supine_volume::Volume;

/// How well `ct_to_deformed` and `deformed_to_ct` undo each other: forward, then backward, how far
/// from where it began a voxel of the CT comes out. `None` when nothing moves.
///
/// Over the voxels in the mesh that move to a place whose eight neighbours lie in the deformed
/// mesh. The backward field is sampled between its voxels, so that this is what a user of both
/// fields gets; it is not 0 for exact fields on a grid, but grows with the square of the spacing.
pub fn consistency(fields: &Fields) -> Option<Consistency> {
    let back = fields.deformed_to_ct();
    let grid = back.grid();
    let error = |(voxel, u): ([usize; 3], [f32; 3])| {
        let u = Vector::from(u.map(f64::from));
        let there = grid.centre(voxel) + u;
        let back = within(back, grid.index_from_patient(&there))?;
        Some((u + back).norm())
    };
    of_errors(fields.forward().filter_map(error).collect())
}

/// How well a reader follows `deformed_to_ct` who has `vectors` in its place, on a coarser grid
/// that covers it, and interpolates linearly between them: over the voxels of the deformed mesh
/// that move. `None` when nothing moves.
///
/// Beyond the outermost places of the coarser grid, at least two along each axis, the outermost
/// vectors go on.
pub fn interpolation_error(vectors: &Volume<[f32; 3]>, fields: &Fields) -> Option<Consistency> {
    let grid = fields.deformed_to_ct().grid();
    let error = |(voxel, to): ([usize; 3], [f32; 3])| {
        let place = vectors.grid().index_from_patient(&grid.centre(voxel));
        (between(vectors, place) - Vector::from(to.map(f64::from))).norm()
    };
    of_errors(fields.backward().map(error).collect())
}

/// Trilinear sample of a field at a continuous index; `None` where a neighbour lies outside the
/// mesh (its vector is exactly 0) or the grid.
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

/// The vector at a continuous index, trilinear.
fn between(vectors: &Volume<[f32; 3]>, index: [f64; 3]) -> Vector {
    let size = vectors.grid().size();
    let low = [0, 1, 2].map(|a| index[a].floor().clamp(0.0, size[a].saturating_sub(2) as f64));
    let mut sum = Vector::zeros();
    for corner in 0..8 {
        let step = [0, 1, 2].map(|a| corner >> a & 1);
        let value = vectors.at([0, 1, 2].map(|a| (low[a] as usize + step[a]).min(size[a] - 1)));
        let share = (0..3).map(|a| {
            let t = (index[a] - low[a]).clamp(0.0, 1.0);
            if step[a] == 1 { t } else { 1.0 - t }
        });
        sum += Vector::from(value.map(f64::from)) * share.product::<f64>();
    }
    sum
}

/// Mean, 99 % and largest of the errors of some voxels, mm; nothing of none.
fn of_errors(mut errors: Vec<f64>) -> Option<Consistency> {
    errors.par_sort_unstable_by(f64::total_cmp);
    let max_mm = *errors.last()?;
    Some(Consistency {
        voxels: errors.len(),
        mean_mm: errors.iter().sum::<f64>() / errors.len() as f64,
        p99_mm: errors[(errors.len() - 1) * 99 / 100],
        max_mm,
    })
}
