//! A plane of a volume's own grid, and what it cuts.

use crate::draw::planes::ViewShown;
use crate::draw::surface::Surface;
pub(crate) use supine_space::Spot;
use supine_space::{Grid, Point, Sphere};
use supine_volume::{SignedDistance, Volume, contour};

/// A plane of a grid.
pub(crate) struct Cut<'a> {
    pub(crate) grid: &'a Grid,
    pub(crate) view: ViewShown,
    pub(crate) slice: usize,
}

impl Cut<'_> {
    /// Where a position lies: right, down, and how many planes before this one.
    pub(crate) fn seen(&self, p: &Point) -> [f64; 3] {
        let index = self.grid.index_from_patient(p);
        let [right, down] = self.view.sides();
        [index[right], index[down], index[self.view.normal()] - self.slice as f64]
    }

    /// The line on which a distance is 0.
    pub(crate) fn level(&self, distance: &SignedDistance) -> Vec<Vec<Spot>> {
        let (size, [right, down]) = (self.grid.size(), self.view.sides());
        let mut samples = Vec::with_capacity(size[right] * size[down]);
        let mut voxel = [0; 3];
        voxel[self.view.normal()] = self.slice;
        for y in 0..size[down] {
            for x in 0..size[right] {
                (voxel[right], voxel[down]) = (x, y);
                samples.push(distance.mm(self.grid.offset(voxel)) as f32);
            }
        }
        joined(&contour(&samples, size[right], 0.0))
    }

    /// The parts of the wall that may be far wrong, as the report has them.
    pub(crate) fn uncertain(
        &self,
        wall: &[Vec<Spot>],
        map: &Volume<u8>,
        region: Option<&Sphere>,
    ) -> Vec<Vec<Spot>> {
        let [right, down] = self.view.sides();
        let doubted = |spot: &Spot| {
            let mut index = [self.slice as f64; 3];
            (index[right], index[down]) = (spot[0], spot[1]);
            let place = self.grid.patient_from_index(index);
            supine_flow::is_uncertain(map, region, supine_flow::UNCERTAIN_MM, &place)
        };
        let mut points = vec![];
        for line in wall {
            let runs = line.chunk_by(|a, b| doubted(a) == doubted(b));
            points.extend(runs.filter(|run| run.len() > 1 && doubted(&run[0])).map(<[_]>::to_vec));
        }
        points
    }

    /// The lines of a surface.
    pub(crate) fn surface(&self, surface: &Surface) -> Vec<Vec<Spot>> {
        let seen: Vec<[f64; 3]> = surface.points().iter().map(|p| self.seen(p)).collect();
        let cut = |t: &[u32; 3]| supine_mesh::cut_triangle(&t.map(|n| seen[n as usize]));
        joined(&surface.triangles().iter().filter_map(cut).collect::<Vec<_>>())
    }
}

/// Segments joined where they meet, to a thousandth of a voxel.
pub(crate) fn joined(segments: &[[Spot; 2]]) -> Vec<Vec<Spot>> {
    /// Ends this near are one, voxels.
    const NEAR: f64 = 1e-4;
    let short = |spot: Spot| spot.map(|x| (x * 1e3).round() / 1e3);
    let lines = supine_volume::joined(segments, NEAR).into_iter();
    lines.map(|line| line.into_iter().map(short).collect()).collect()
}
