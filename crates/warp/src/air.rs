//! A dose continued from tissue into the air beside it, so that what is interpolated near the skin
//! rests on tissue alone.

use rayon::prelude::*;
use supine_space::Point;
use supine_volume::{Ct, Volume, sample_trilinear_at};

/// Below this a place is air, HU: half-way from air to water.
const AIR_HU: f32 = -500.0;
/// Nodes beside those with a dose that take a value: a cell with tissue in it has all its corners,
/// though the outermost nodes of tissue may have no dose.
const LAYERS: usize = 3;
/// A dose in air is one of the tissue beside it, and is kept, up to this many times more or less
/// than what goes on from there.
const LIKE: f32 = 2.0;

/// Whether a place is tissue; what lies beyond the CT is not known to be air.
pub(crate) fn is_tissue(ct: &Ct, at: &Point) -> bool {
    ct.grid().voxel_at(at).is_none_or(|_| sample_trilinear_at(ct, at) > AIR_HU)
}

/// A dose, Gy, whose nodes in air within a window (its first node, and nodes along each axis) go on
/// linearly from the tissue beside them. Planning systems leave the air without dose, and so would
/// take half of it from the skin.
///
/// A node of air that has about that dose already keeps it. Tissue beside air without any dose lies
/// outside the contour up to which the dose was computed, and counts as air.
pub(crate) fn continued(
    dose: &Volume<f32>,
    ct: &Ct,
    (start, size): ([usize; 3], [usize; 3]),
) -> Volume<f32> {
    let grid = dose.grid();
    let len = size.iter().product();
    let voxel = |n: usize| {
        let within = [n % size[0], n / size[0] % size[1], n / (size[0] * size[1])];
        [0, 1, 2].map(|a| start[a] + within[a])
    };
    let all = (0..len).into_par_iter();
    let tissue: Vec<bool> = all.map(|n| is_tissue(ct, &grid.centre(voxel(n)))).collect();
    let near = Near { dose, known: &tissue, start, size };
    let is_known = |n| tissue[n] && (dose.at(voxel(n)) > 0.0 || !near.is_beside_unknown(voxel(n)));
    let mut known: Vec<bool> = (0..len).into_par_iter().map(is_known).collect();
    let mut filled = dose.clone();
    let most = dose.data().iter().copied().fold(0.0, f32::max);
    for _ in 0..LAYERS {
        let near = Near { dose: &filled, known: &known, start, size };
        let open = (0..len).into_par_iter().filter(|n| !known[*n]);
        let layer: Vec<(usize, f32)> =
            open.filter_map(|n| Some((n, near.going_on(voxel(n))?.min(most)))).collect();
        for (n, from_tissue) in layer {
            known[n] = true;
            let given = dose.at(voxel(n));
            let is_like = given * LIKE >= from_tissue && given <= from_tissue * LIKE;
            let at = grid.offset(voxel(n));
            filled.data_mut()[at] = if is_like { given } else { from_tissue };
        }
    }
    filled
}

/// What is known in a window.
struct Near<'a> {
    dose: &'a Volume<f32>,
    known: &'a [bool],
    start: [usize; 3],
    size: [usize; 3],
}

impl Near<'_> {
    /// The number in the window of the node so many steps away, if it lies there.
    fn beside(&self, voxel: [usize; 3], step: [isize; 3], times: isize) -> Option<usize> {
        let mut n = 0;
        for a in (0..3).rev() {
            let within = (voxel[a] - self.start[a]).checked_add_signed(step[a] * times)?;
            if within >= self.size[a] {
                return None;
            }
            n = n * self.size[a] + within;
        }
        Some(n)
    }

    /// Whether a node of the 26 around is not known.
    fn is_beside_unknown(&self, voxel: [usize; 3]) -> bool {
        steps().any(|step| self.beside(voxel, step, 1).is_some_and(|n| !self.known[n]))
    }

    /// The value, if it is known, of the node so many steps away.
    fn known(&self, voxel: [usize; 3], step: [isize; 3], times: isize) -> Option<f32> {
        let n = self.beside(voxel, step, times)?;
        let at = [0, 1, 2].map(|a| voxel[a].wrapping_add_signed(step[a] * times));
        self.known[n].then(|| self.dose.at(at))
    }

    /// The mean of what goes on linearly from the nodes around, the nearer the more; `None` with no
    /// known node beside it.
    fn going_on(&self, voxel: [usize; 3]) -> Option<f32> {
        let spacing = self.dose.grid().spacing();
        // Sums of value times weight, and of weights: by two nodes in a row, and by one.
        let (mut lines, mut single) = ([0.0f64; 2], [0.0f64; 2]);
        for step in steps() {
            let Some(near) = self.known(voxel, step, 1) else { continue };
            let mm: f64 = (0..3).map(|a| (step[a] as f64 * spacing[a]).powi(2)).sum();
            let add = |sums: &mut [f64; 2], value: f32| {
                sums[0] += f64::from(value) / mm;
                sums[1] += 1.0 / mm;
            };
            match self.known(voxel, step, 2) {
                Some(far) => add(&mut lines, (2.0 * near - far).max(0.0)),
                None => add(&mut single, near),
            }
        }
        let [sum, weight] = if lines[1] > 0.0 { lines } else { single };
        (weight > 0.0).then(|| (sum / weight) as f32)
    }
}

/// The ways to the 26 nodes around a node.
fn steps() -> impl Iterator<Item = [isize; 3]> {
    (0..27).filter(|n| *n != 13).map(|n| [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1])
}
