//! Exact Euclidean distance to a set of voxels.

use crate::Volume;
use rayon::prelude::*;

/// Distance of every voxel centre to the nearest voxel centre where `mask` holds, mm;
/// infinite when it holds nowhere.
///
/// Exact for any spacing. Lower envelope of parabolas, one axis after the other.
/// Source: Felzenszwalb and Huttenlocher, Theory of Computing 8 (2012), section 2.
pub fn distance_mm(mask: &Volume<bool>) -> Volume<f32> {
    let grid = mask.grid();
    let [ni, nj, nk] = grid.size();
    let spacing = grid.spacing();
    let mut squared: Vec<f64> =
        mask.data().iter().map(|&m| if m { 0.0 } else { f64::INFINITY }).collect();
    squared.par_chunks_mut(ni).for_each(|row| envelope(row, spacing[0]));
    squared.par_chunks_mut(ni * nj).for_each(|slice| along(slice, ni, nj, spacing[1]));
    if nk > 1 {
        let columns: Vec<Vec<f64>> = (0..ni * nj)
            .into_par_iter()
            .map(|column| {
                let mut line: Vec<f64> = (0..nk).map(|k| squared[k * ni * nj + column]).collect();
                envelope(&mut line, spacing[2]);
                line
            })
            .collect();
        squared.par_chunks_mut(ni * nj).enumerate().for_each(|(k, slice)| {
            for (value, column) in slice.iter_mut().zip(&columns) {
                *value = column[k];
            }
        });
    }
    Volume::from_parts(grid.clone(), squared.into_par_iter().map(|d| d.sqrt() as f32).collect())
}

/// The envelope along the second axis of a slice of rows.
fn along(slice: &mut [f64], ni: usize, nj: usize, step: f64) {
    let mut line = vec![0.0; nj];
    for i in 0..ni {
        for j in 0..nj {
            line[j] = slice[j * ni + i];
        }
        envelope(&mut line, step);
        for j in 0..nj {
            slice[j * ni + i] = line[j];
        }
    }
}

/// Replaces f by min over q of f(q) + ((p - q) step)².
fn envelope(f: &mut [f64], step: f64) {
    let mut apex: Vec<(usize, f64)> = Vec::with_capacity(f.len());
    let mut from: Vec<f64> = Vec::with_capacity(f.len());
    for (q, &value) in f.iter().enumerate() {
        if value.is_infinite() {
            continue;
        }
        let start = loop {
            let Some(&(p, lower)) = apex.last() else { break f64::NEG_INFINITY };
            let (a, b) = (p as f64 * step, q as f64 * step);
            let cross = (value + b * b - lower - a * a) / (2.0 * (b - a));
            if cross > from[from.len() - 1] {
                break cross;
            }
            apex.pop();
            from.pop();
        };
        apex.push((q, value));
        from.push(start);
    }
    if apex.is_empty() {
        return;
    }
    let mut n = 0;
    for p in 0..f.len() {
        let x = p as f64 * step;
        while n + 1 < apex.len() && from[n + 1] < x {
            n += 1;
        }
        let (q, value) = apex[n];
        f[p] = value + (x - q as f64 * step).powi(2);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Grid, Matrix, Point, Vector};

    #[test]
    fn equals_the_brute_force_distance() {
        let s = Vector::new(0.7, 1.3, 2.1);
        let g = Grid::new([7, 6, 5], s, Point::origin(), Matrix::identity()).unwrap();
        let mask = Volume::from_fn(g.clone(), |[i, j, k]| (i * 31 + j * 17 + k * 7) % 23 == 0);
        let got = distance_mm(&mask);
        for n in 0..g.len() {
            let p = g.centre(g.voxel(n));
            let want = (0..g.len())
                .filter(|&m| mask.data()[m])
                .map(|m| (g.centre(g.voxel(m)) - p).norm())
                .fold(f64::INFINITY, f64::min);
            assert!((f64::from(got.data()[n]) - want).abs() < 1e-5, "{n}: {want}");
        }
    }

    #[test]
    fn nothing_is_infinitely_far() {
        let g = Grid::new([3; 3], Vector::repeat(1.0), Point::origin(), Matrix::identity());
        let d = distance_mm(&Volume::from_fn(g.unwrap(), |_| false));
        assert!(d.data().iter().all(|x| x.is_infinite()));
    }
}
