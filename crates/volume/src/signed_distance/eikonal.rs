//! |grad d| = 1 from the crossings of a surface with the lines between voxel centres.

use rayon::prelude::*;
use supine_space::Grid;

/// Units of the values per mm: 16 bits then reach 16 mm, to 0.0005 mm.
pub(super) const PER_MM: f32 = 2000.0;
/// Passes over the voxels beside the surface, alternately forwards and backwards. Chosen, not
/// measured.
const NEAR_PASSES: usize = 6;

/// A voxel beside the surface and the distance to it along each axis, mm; infinite where the
/// surface does not cross the way to a neighbour.
struct Near {
    n: usize,
    crossing: [f32; 3],
}

/// Turns signs (values of magnitude `far`) into distances up to `far`.
pub(super) fn solve(
    grid: &Grid,
    far: i16,
    values: &mut [i16],
    crossing: impl Fn(usize, usize) -> f32 + Sync,
) {
    let lattice = Lattice::new(grid, far);
    let near = lattice.near(values, crossing);
    for beside in &near {
        let slope: f32 = beside.crossing.iter().map(|d| 1.0 / (d * d)).sum();
        lattice.lower(values, beside.n, 1.0 / slope.sqrt());
    }
    for pass in 0..NEAR_PASSES {
        if pass % 2 == 0 {
            near.iter().for_each(|beside| lattice.relax_near(values, beside));
        } else {
            near.iter().rev().for_each(|beside| lattice.relax_near(values, beside));
        }
    }
    lattice.march(values, near.iter().map(|beside| beside.n));
}

/// Sizes of the grid.
struct Lattice {
    size: [usize; 3],
    stride: [usize; 3],
    /// Spacing, mm.
    step: [f32; 3],
    /// 1 / spacing², 1/mm².
    weight: [f32; 3],
    /// Magnitude of what is farther than the band.
    far: i16,
}

impl Lattice {
    fn new(grid: &Grid, far: i16) -> Self {
        let size = grid.size();
        let step = [0, 1, 2].map(|a| grid.spacing()[a] as f32);
        let weight = step.map(|h| 1.0 / (h * h));
        Self { size, stride: [1, size[0], size[0] * size[1]], step, weight, far }
    }

    #[inline]
    fn voxel(&self, n: usize) -> [usize; 3] {
        let (row, k) = (n / self.size[0], n / self.stride[2]);
        [n - row * self.size[0], row - k * self.size[1], k]
    }

    /// The neighbours of a voxel below and above along an axis, where there are any.
    #[inline]
    fn pair(&self, n: usize, v: [usize; 3], a: usize) -> [Option<usize>; 2] {
        let below = if v[a] > 0 { Some(n - self.stride[a]) } else { None };
        let above = if v[a] + 1 < self.size[a] { Some(n + self.stride[a]) } else { None };
        [below, above]
    }

    /// The voxels with a face neighbour on the other side, in order of memory.
    fn near(&self, values: &[i16], crossing: impl Fn(usize, usize) -> f32 + Sync) -> Vec<Near> {
        let (ni, [nj, nk]) = (self.size[0], [self.size[1], self.size[2]]);
        let rows: Vec<Vec<Near>> = (0..nj * nk)
            .into_par_iter()
            .map(|row| {
                let here = &values[row * ni..(row + 1) * ni];
                let beside = |there: bool, row: usize| {
                    if there { &values[row * ni..(row + 1) * ni] } else { here }
                };
                let (j, k) = (row % nj, row / nj);
                let sides = [
                    beside(j > 0, row.wrapping_sub(1)),
                    beside(j + 1 < nj, row + 1),
                    beside(k > 0, row.wrapping_sub(nj)),
                    beside(k + 1 < nk, row + nj),
                ];
                let mut near = Vec::new();
                for i in 0..ni {
                    let other = |v: i16| (v ^ here[i]) < 0;
                    if sides.iter().any(|side| other(side[i]))
                        || other(here[i.saturating_sub(1)])
                        || other(here[(i + 1).min(ni - 1)])
                    {
                        near.push(self.crossings(values, row * ni + i, &crossing));
                    }
                }
                near
            })
            .collect();
        rows.into_iter().flatten().collect()
    }

    fn crossings(
        &self,
        values: &[i16],
        n: usize,
        crossing: &(impl Fn(usize, usize) -> f32 + Sync),
    ) -> Near {
        let inside = values[n] < 0;
        let mut to = [f32::INFINITY; 3];
        let v = self.voxel(n);
        for a in 0..3 {
            for m in self.pair(n, v, a).into_iter().flatten() {
                if (values[m] < 0) != inside {
                    let share = if inside { crossing(n, m) } else { 1.0 - crossing(m, n) };
                    // At least one unit: the sign of a voxel stays what it is.
                    to[a] = to[a].min((share * self.step[a]).max(1.0 / PER_MM));
                }
            }
        }
        Near { n, crossing: to }
    }

    /// Lowers the magnitude of a voxel to `mm`, if that is lower; gives the new magnitude.
    #[inline]
    fn lower(&self, values: &mut [i16], n: usize, mm: f32) -> Option<i16> {
        let old = values[n];
        let new = ((mm * PER_MM + 0.5) as i16).max(1);
        if new >= old.abs() {
            return None;
        }
        values[n] = if old < 0 { -new } else { new };
        Some(new)
    }

    /// Solves a voxel beside the surface from its crossings and its neighbours on the same side.
    ///
    /// Where the surface runs obliquely to long voxels it crosses some axes beyond the neighbour,
    /// which is nearer and knows more.
    fn relax_near(&self, values: &mut [i16], beside: &Near) {
        let here = values[beside.n];
        let mut known = beside.crossing.map(|to| (0.0f32, to));
        let v = self.voxel(beside.n);
        for a in 0..3 {
            for m in self.pair(beside.n, v, a).into_iter().flatten() {
                let there = values[m];
                if (there ^ here) < 0 || there.abs() >= here.abs() {
                    continue;
                }
                let value = f32::from(there.abs()) / PER_MM;
                if value + self.step[a] < known[a].0 + known[a].1 {
                    known[a] = (value, self.step[a]);
                }
            }
        }
        let terms = known.map(|(value, step)| Term { value, weight: 1.0 / (step * step) });
        self.lower(values, beside.n, upwind(terms));
    }

    /// Carries the distances on from the voxels beside the surface, in rising order but for the
    /// width of a bucket; a voxel that is lowered later is carried on again.
    fn march(&self, values: &mut [i16], near: impl Iterator<Item = usize>) {
        let finest = self.step[0].min(self.step[1]).min(self.step[2]);
        let width = ((0.25 * finest * PER_MM) as i16).max(1);
        let bucket = |value: i16| (value / width) as usize;
        let mut buckets = vec![Vec::new(); bucket(self.far) + 1];
        near.for_each(|n| buckets[bucket(values[n].abs())].push(n));
        for b in 0..buckets.len() {
            let mut queue = std::mem::take(&mut buckets[b]);
            let mut next = 0;
            while let Some(&n) = queue.get(next) {
                next += 1;
                let value = values[n].abs();
                if bucket(value) < b {
                    continue;
                }
                let v = self.voxel(n);
                for side in 0..6 {
                    let (a, up) = (side / 2, side % 2);
                    let Some(m) = self.pair(n, v, a)[up] else { continue };
                    if values[m].abs() <= value {
                        continue;
                    }
                    let mut w = v;
                    w[a] = if up == 1 { w[a] + 1 } else { w[a] - 1 };
                    if let Some(new) = self.relax(values, m, w) {
                        if bucket(new) <= b { queue.push(m) } else { buckets[bucket(new)].push(m) }
                    }
                }
            }
        }
    }

    /// Solves a voxel from its neighbours; one beside the surface stays. Gives the new magnitude
    /// when it is lower.
    #[inline]
    fn relax(&self, values: &mut [i16], n: usize, v: [usize; 3]) -> Option<i16> {
        let here = values[n];
        let mut nearest = [self.far; 3];
        for a in 0..3 {
            let [below, above] = self.pair(n, v, a);
            let below = below.map_or(here, |m| values[m]);
            let above = above.map_or(here, |m| values[m]);
            if (below ^ here) < 0 || (above ^ here) < 0 {
                return None;
            }
            nearest[a] = below.abs().min(above.abs());
        }
        let term =
            |a: usize| Term { value: f32::from(nearest[a]) / PER_MM, weight: self.weight[a] };
        self.lower(values, n, upwind([term(0), term(1), term(2)]))
    }
}

/// What a neighbour says of a voxel's distance along one axis.
#[derive(Clone, Copy)]
struct Term {
    /// The neighbour's distance, mm.
    value: f32,
    /// 1 / step², 1/mm².
    weight: f32,
}

/// d with sum of weight (d - value)² = 1 over the terms whose value lies below d, mm.
#[inline]
fn upwind([mut a, mut b, mut c]: [Term; 3]) -> f32 {
    if a.value > b.value {
        std::mem::swap(&mut a, &mut b);
    }
    if b.value > c.value {
        std::mem::swap(&mut b, &mut c);
    }
    if a.value > b.value {
        std::mem::swap(&mut a, &mut b);
    }
    // In terms of what exceeds the first value: no cancellation far from the surface.
    let (mut squares, mut mixed, mut rest) = (a.weight, 0.0, -1.0f32);
    let mut excess = a.weight.sqrt().recip();
    for Term { value, weight } in [b, c] {
        let more = value - a.value;
        if more >= excess {
            break;
        }
        squares += weight;
        mixed += weight * more;
        rest += weight * more * more;
        excess = (mixed + (mixed * mixed - squares * rest).max(0.0).sqrt()) / squares;
    }
    a.value + excess
}
