//! Edge lengths by what each tetrahedron of a first mesh adds to an error.

use crate::{Error, Refinement};
use supine_mesh::{Order, TetMesh};
use supine_space::{Grid, GridError, Matrix, Point, Vector};
use supine_volume::{Volume, gaussian};

/// Spacing of the map of lengths, mm.
const SPACING_MM: f64 = 3.0;
/// No length is changed by more than this factor.
const MAX_TETRAHEDRA: f64 = 2.0;
/// The map holds where it was fed by at least this share of a tetrahedron.
const FED: f32 = 1e-6;

impl Refinement {
    /// Lengths with which an error is least for a number of tetrahedra, from the share that each
    /// tetrahedron of a first mesh has in it (any unit) with elements of that order. Smoothed over
    /// the mean edge of that mesh.
    ///
    /// With shares η ∝ h^(2p) V and a number of tetrahedra Σ V / h³ the sum of the shares is least
    /// at h ∝ (η / (V h^(2p)))^(-1 / (2p + 3)).
    ///
    /// # Errors
    /// When the mesh is too large for a map.
    pub fn balanced(mesh: &TetMesh, shares: &[f64], order: Order) -> Result<Self, Error> {
        let power = 2.0 * f64::from(order.number());
        let volumes: Vec<f64> = (0..shares.len()).map(|t| mesh.volume(t)).collect();
        // With h³ ∝ V the new length over the old one depends on the share alone.
        let log = |(share, volume): (&f64, &f64)| {
            -share.max(f64::MIN_POSITIVE).ln() / (power + 3.0) + volume.ln() / 3.0
        };
        let logs: Vec<f64> = shares.iter().zip(&volumes).map(log).collect();
        let whole: f64 = volumes.iter().sum();
        let mean = logs.iter().zip(&volumes).map(|(log, volume)| log * volume).sum::<f64>() / whole;
        let edge = supine_mesh::quality(mesh).mean_edge;
        let grid = around(mesh, edge)?;
        let zero = || Volume::from_fn(grid.clone(), |_| 0f32);
        let (mut sum, mut weight) = (zero(), zero());
        for (t, (log, volume)) in logs.iter().zip(&volumes).enumerate() {
            let middle = mesh.corners(t).iter().map(|c| c.coords).sum::<Vector>() / 4.0;
            let Some(voxel) = grid.voxel_at(&Point::from(middle)) else { continue };
            let at = grid.offset(voxel);
            sum.data_mut()[at] +=
                ((log - mean).clamp(-MAX_TETRAHEDRA.ln(), MAX_TETRAHEDRA.ln()) * volume) as f32;
            weight.data_mut()[at] += *volume as f32;
        }
        let (sum, weight) = (gaussian(&sum, [edge; 3]), gaussian(&weight, [edge; 3]));
        let least = FED * (whole / shares.len() as f64) as f32;
        let length = |v: [usize; 3]| {
            if weight.at(v) > least { (sum.at(v) / weight.at(v)).exp() } else { 1.0 }
        };
        Ok(Self::Map(Volume::from_fn(grid.clone(), length)))
    }
}

/// A grid that holds the mesh with a margin (mm).
fn around(mesh: &TetMesh, margin: f64) -> Result<Grid, GridError> {
    let (low, high) = mesh.bounds();
    let low = low - Vector::repeat(margin);
    let size = (high - low).add_scalar(margin) / SPACING_MM;
    let size = std::array::from_fn(|a| size[a].ceil() as usize + 1);
    Grid::new(size, Vector::repeat(SPACING_MM), low, Matrix::identity())
}
