//! How far what the live region shows lies from where the displacement has it, and how long a
//! picture takes.

use anyhow::Result;
use serde_json::{Value, json};
use std::sync::Arc;
use std::time::Instant;
use supine_mesh::Deformation;
use supine_navigate::{Follower, LiveRegion};
use supine_space::{Point, Progress};
use supine_volume::{Ct, Volume};
use supine_warp::{Params, fields};

/// HU of a mm, and of the middle of the CT: the values of each of three CTs tell a coordinate.
const HU_PER_MM: f64 = 80.0;
const MIDDLE_HU: f64 = 17_000.0;

/// The live region of three CTs that tell where each voxel comes from.
pub(crate) struct Pictures {
    coordinates: Vec<LiveRegion>,
    /// Where the three tell the same, LPS, mm.
    middle: Point,
    off_mm: Vec<f64>,
    took_ms: Vec<f64>,
}

impl Pictures {
    pub(crate) fn new(ct: &Ct, follower: &Follower) -> Result<Self> {
        let grid = ct.grid();
        let middle = grid.centre(grid.size().map(|n| n / 2));
        let one = |axis: usize| {
            let value = |voxel| {
                let way = grid.centre(voxel)[axis] - middle[axis];
                (MIDDLE_HU + HU_PER_MM * way).clamp(0.0, 32_000.0).round() as i16
            };
            Ok(follower.region(Arc::new(Ct::from_fn(grid.clone(), value)))?)
        };
        let coordinates = (0..3).map(one).collect::<Result<_>>()?;
        Ok(Self { coordinates, middle, off_mm: vec![], took_ms: vec![] })
    }

    /// Makes one picture for its time.
    pub(crate) fn time(&mut self, deformation: &Deformation) -> Result<()> {
        let start = Instant::now();
        self.coordinates[0].carry(deformation)?;
        self.took_ms.push(start.elapsed().as_secs_f64() * 1e3);
        Ok(())
    }

    /// Compares each voxel's origin with that of the map itself, to a hundredth of a mm. Voxels
    /// beside the surface do not count: there both tell of air, or of tissue that does not move.
    pub(crate) fn compare(&mut self, deformation: &Deformation) -> Result<()> {
        let params = Params { curve_tolerance_mm: 0.01, ..Params::default() };
        let Some(region) = self.coordinates.first_mut() else { return Ok(()) };
        let grid = region.carry(deformation)?.grid().clone();
        let map = fields(&grid, deformation, &params, Progress::none())?;
        let back = map.deformed_to_ct();
        let deep: Vec<usize> = (0..grid.len()).filter(|n| is_deep(back, grid.voxel(*n))).collect();
        let mut square = vec![0.0; deep.len()];
        for (axis, region) in self.coordinates.iter_mut().enumerate() {
            let shown = region.carry(deformation)?;
            for (sum, n) in square.iter_mut().zip(&deep) {
                let came = grid.centre(grid.voxel(*n))[axis] + f64::from(back.data()[*n][axis]);
                let told =
                    (f64::from(shown.data()[*n]) - MIDDLE_HU) / HU_PER_MM + self.middle[axis];
                *sum += (told - came).powi(2);
            }
        }
        self.off_mm.extend(square.iter().map(|square: &f64| square.sqrt()));
        Ok(())
    }

    /// Off: 99.9 % and the largest of all voxels of all compared pictures, mm. Took: median, 99 %
    /// and the largest, ms.
    pub(crate) fn told(&mut self) -> Value {
        let Self { off_mm, took_ms, .. } = self;
        off_mm.sort_by(f64::total_cmp);
        took_ms.sort_by(f64::total_cmp);
        let of = |all: &[f64], share: f64| all.get((share * all.len() as f64) as usize).copied();
        json!({
            "voxels": off_mm.len(),
            "off_mm": [of(off_mm, 0.999), off_mm.last().copied()],
            "pictures": took_ms.len(),
            "took_ms": [of(took_ms, 0.5), of(took_ms, 0.99), took_ms.last().copied()],
        })
    }
}

/// Whether a voxel and those on its six sides are of tissue that moves.
fn is_deep(back: &Volume<[f32; 3]>, voxel: [usize; 3]) -> bool {
    let size = back.grid().size();
    let moves = |at: [usize; 3]| back.at(at) != [0.0; 3];
    let sides = (0..3).all(|axis| {
        let mut at = voxel;
        let inner = voxel[axis] > 0 && voxel[axis] + 1 < size[axis];
        inner
            && [voxel[axis] - 1, voxel[axis] + 1].into_iter().all(|n| {
                at[axis] = n;
                moves(at)
            })
    });
    sides && moves(voxel)
}
