//! What a plane shows of a volume: samples at its pixels, and lines through them.

use crate::{Volume, sample_trilinear};
use rayon::prelude::*;
use supine_space::{Plane, Spot};

/// Trilinear samples at the pixels' centres, row by row; NaN outside the volume's voxels.
pub fn sample_plane<T: Copy + Into<f32> + Sync>(volume: &Volume<T>, plane: &Plane) -> Vec<f32> {
    let grid = volume.grid();
    let last = grid.size().map(|n| n as f64 - 0.5);
    let at = |n: usize| {
        let spot = [(n % plane.width) as f64, (n / plane.width) as f64];
        let index = grid.index_from_patient(&plane.patient(spot));
        let inside = (0..3).all(|a| index[a] >= -0.5 && index[a] <= last[a]);
        if inside { sample_trilinear(volume, index) } else { f32::NAN }
    };
    (0..plane.width * plane.height).into_par_iter().map(at).collect()
}

/// The lines at which a picture of samples (row by row, `width` across) crosses `level`, by
/// marching squares with linear interpolation, in pixels; cells with a NaN are left out.
pub fn contour(samples: &[f32], width: usize, level: f32) -> Vec<[Spot; 2]> {
    let height = samples.len().checked_div(width).unwrap_or(0);
    let mut segments = Vec::new();
    for y in 0..height.saturating_sub(1) {
        for x in 0..width - 1 {
            let corners = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)];
            let value = corners.map(|(x, y)| samples[y * width + x]);
            let above = value.iter().filter(|v| **v > level).count();
            // Most cells are crossed by nothing.
            if above == 0 || above == 4 || value.iter().any(|v| v.is_nan()) {
                continue;
            }
            let mut crossings: Vec<Spot> = Vec::with_capacity(4);
            for a in 0..4 {
                let b = (a + 1) % 4;
                if (value[a] > level) != (value[b] > level) {
                    let t = f64::from((level - value[a]) / (value[b] - value[a]));
                    let mix = |p: usize, q: usize| p as f64 + t * (q as f64 - p as f64);
                    crossings
                        .push([mix(corners[a].0, corners[b].0), mix(corners[a].1, corners[b].1)]);
                }
            }
            segments.extend(crossings.chunks_exact(2).map(|c| [c[0], c[1]]));
        }
    }
    segments
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_contour_of_a_cone_is_a_circle() {
        let cone: Vec<f32> =
            (0..1600).map(|n| ((n % 40) as f32 - 19.5).hypot((n / 40) as f32 - 19.5)).collect();
        let circle = contour(&cone, 40, 12.0);
        let length: f64 = circle.iter().map(|[a, b]| (a[0] - b[0]).hypot(a[1] - b[1])).sum();
        assert!((length - std::f64::consts::TAU * 12.0).abs() < 0.2, "{length}");
        for [x, y] in circle.iter().flatten() {
            assert!(((x - 19.5).hypot(y - 19.5) - 12.0).abs() < 0.02);
        }
    }
}
