//! How many times a surface goes round each voxel centre of a grid.
//!
//! Every triangle is met with the lines of voxel centres along each axis. The surface is closed, so
//! the sum of its crossings on the way to a place, +1 into it and -1 out of it, is how many times
//! it goes round that place, whatever crosses or touches itself. All decisions are exact: a line
//! counts as moved aside by (e, e²), e -> 0+, so that none meets an edge.

use rayon::prelude::*;
use robust::Coord;
use supine_mesh::TriSurface;
use supine_space::Grid;

/// Crossings of a surface with the lines of voxel centres of a grid.
#[derive(Debug)]
pub(crate) struct Winding {
    size: [usize; 3],
    /// By axis.
    lines: [Lines; 3],
}

/// The crossings with all lines along one axis, line by line, each line from low to high.
#[derive(Debug)]
struct Lines {
    /// Where the crossings of a line start; one more than there are lines.
    starts: Vec<usize>,
    crossings: Vec<Crossing>,
}

#[derive(Clone, Copy, Debug)]
struct Crossing {
    /// Along the line, in voxels.
    at: f64,
    /// +1 into the surface, -1 out of it.
    turn: i32,
}

impl Winding {
    /// The crossings of a surface; `grid` has the axes of the patient.
    pub(crate) fn new(surface: &TriSurface, grid: &Grid) -> Self {
        let size = grid.size();
        let index = |p| grid.index_from_patient(p);
        let corners: Vec<[f64; 3]> = surface.points().iter().map(index).collect();
        let lines = [0, 1, 2].map(|axis| Lines::new(surface.triangles(), &corners, size, axis));
        Self { size, lines }
    }

    /// Line along an axis that a voxel lies on.
    fn line(&self, [i, j, k]: [usize; 3], axis: usize) -> &[Crossing] {
        let number = match axis {
            0 => j + k * self.size[1],
            1 => k + i * self.size[2],
            _ => i + j * self.size[0],
        };
        let lines = &self.lines[axis];
        &lines.crossings[lines.starts[number]..lines.starts[number + 1]]
    }

    /// How many times the surface goes round each voxel centre, i fastest.
    pub(crate) fn numbers(&self) -> Vec<i32> {
        let [ni, nj, nk] = self.size;
        let mut numbers = vec![0; ni * nj * nk];
        numbers.par_chunks_mut(ni).enumerate().for_each(|(row, out)| {
            let (mut crossings, mut number) = (self.line([0, row % nj, row / nj], 0).iter(), 0);
            let mut next = crossings.next();
            for (i, out) in out.iter_mut().enumerate() {
                while let Some(crossing) = next.filter(|c| c.at <= i as f64) {
                    number += crossing.turn;
                    next = crossings.next();
                }
                *out = number;
            }
        });
        numbers
    }

    /// Where the surface is left on the way from the centre of voxel `from` to that of its face
    /// neighbour `to`, as a share of it.
    ///
    /// Lines along different axes can differ by a rounding error about a centre that lies on the
    /// surface: then the nearest crossing counts.
    pub(crate) fn leaves(&self, from: [usize; 3], to: [usize; 3]) -> f32 {
        let axis = (0..3).find(|&a| from[a] != to[a]).unwrap_or(0);
        let (here, there) = (from[axis] as f64, to[axis] as f64);
        let share = |c: &Crossing| (c.at - here) / (there - here);
        let out = if there > here { -1 } else { 1 };
        let off = |share: f64| (share - share.clamp(0.0, 1.0)).abs();
        let leaving = self.line(from, axis).iter().filter(|c| c.turn == out).map(share);
        let nearest = leaving.min_by(|a, b| off(*a).total_cmp(&off(*b)).then(a.total_cmp(b)));
        nearest.map_or(0.5, |share| share.clamp(0.0, 1.0) as f32)
    }
}

impl Lines {
    fn new(triangles: &[[u32; 3]], corners: &[[f64; 3]], size: [usize; 3], axis: usize) -> Self {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let meet =
            |t: &[u32; 3]| crossings(t.map(|p| corners[p as usize]), axis, [size[u], size[v]]);
        let mut all: Vec<(usize, Crossing)> = triangles.par_iter().flat_map_iter(meet).collect();
        // At one place in before out, so that pieces that touch stay one.
        all.par_sort_unstable_by(|(n, a), (m, b)| {
            n.cmp(m).then(a.at.total_cmp(&b.at)).then(b.turn.cmp(&a.turn))
        });
        let mut starts = vec![0; size[u] * size[v] + 1];
        all.iter().for_each(|(line, _)| starts[line + 1] += 1);
        for line in 1..starts.len() {
            starts[line] += starts[line - 1];
        }
        Self { starts, crossings: all.into_iter().map(|(_, crossing)| crossing).collect() }
    }
}

/// The lines along an axis that a triangle (in voxels) crosses, by number, and where.
fn crossings(t: [[f64; 3]; 3], axis: usize, size: [usize; 2]) -> Vec<(usize, Crossing)> {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let flat = t.map(|p| Coord { x: p[u], y: p[v] });
    let span = |c: usize, size: usize| {
        let (low, high) = (t[0][c].min(t[1][c]).min(t[2][c]), t[0][c].max(t[1][c]).max(t[2][c]));
        // A line moved aside meets what ends at it.
        (low.ceil() - 1.0).max(0.0) as usize..(high.floor() + 1.0).clamp(0.0, size as f64) as usize
    };
    let mut crossings = Vec::new();
    for b in span(v, size[1]) {
        for a in span(u, size[0]) {
            let line = Coord { x: a as f64, y: b as f64 };
            let areas = [1, 2, 0].map(|c| robust::orient2d(flat[c], flat[(c + 1) % 3], line));
            let sides = [1, 2, 0].map(|c| side(flat[c], flat[(c + 1) % 3], line));
            if sides[0] == 0 || sides[0] != sides[1] || sides[1] != sides[2] {
                continue;
            }
            let whole: f64 = areas.iter().sum();
            let mean: f64 = (0..3).map(|c| areas[c] / whole * t[c][axis]).sum();
            let (low, high) = (
                t[0][axis].min(t[1][axis]).min(t[2][axis]),
                t[0][axis].max(t[1][axis]).max(t[2][axis]),
            );
            // Turned about from the axis its outside lies towards, a triangle leads in.
            let at = if mean.is_finite() { mean.clamp(low, high) } else { 0.5 * (low + high) };
            crossings.push((a + b * size[0], Crossing { at, turn: -sides[0] }));
        }
    }
    crossings
}

/// Side of the edge from a to b on which the line p, moved aside, lies: 1 left, -1 right; 0 only
/// when the edge is a point.
fn side(a: Coord<f64>, b: Coord<f64>, p: Coord<f64>) -> i32 {
    let exact = robust::orient2d(a, b, p);
    // The derivatives of (b - a) x (p - a) along x and y.
    let signs = [exact, a.y - b.y, b.x - a.x];
    let decides = signs.into_iter().find(|s| *s != 0.0).unwrap_or(0.0);
    if decides > 0.0 {
        1
    } else if decides < 0.0 {
        -1
    } else {
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Matrix, Point, Vector};

    fn grid() -> Grid {
        Grid::new([7, 6, 5], Vector::repeat(1.0), Point::origin(), Matrix::identity()).unwrap()
    }

    /// A box with its corners on voxel centres.
    fn cuboid(low: [f64; 3], high: [f64; 3]) -> TriSurface {
        let corner = |n: usize| {
            Point::from([0, 1, 2].map(|a| if n >> a & 1 == 1 { high[a] } else { low[a] }))
        };
        let quads =
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        TriSurface::new((0..8).map(corner).collect(), triangles).unwrap()
    }

    fn inside(surface: &TriSurface) -> Vec<usize> {
        let numbers = Winding::new(surface, &grid()).numbers();
        assert!(numbers.iter().all(|n| (0..=1).contains(n)));
        (0..numbers.len()).filter(|&n| numbers[n] == 1).collect()
    }

    #[test]
    fn boxes_side_by_side_own_each_centre_once() {
        let (whole, parts) = (
            inside(&cuboid([0.0; 3], [6.0, 5.0, 4.0])),
            [
                inside(&cuboid([0.0; 3], [3.0, 5.0, 4.0])),
                inside(&cuboid([3.0, 0.0, 0.0], [6.0, 2.0, 4.0])),
                inside(&cuboid([3.0, 2.0, 0.0], [6.0, 5.0, 4.0])),
            ],
        );
        assert_eq!(whole.len(), 6 * 5 * 4);
        let mut together = parts.concat();
        together.sort_unstable();
        assert_eq!(together, whole);
    }

    #[test]
    fn crossings_are_where_the_surface_is() {
        let winding = Winding::new(&cuboid([0.75, 1.5, 0.25], [4.25, 3.75, 2.5]), &grid());
        for (from, to, share) in [
            ([1, 2, 1], [0, 2, 1], 0.25),
            ([4, 2, 1], [5, 2, 1], 0.25),
            ([2, 2, 1], [2, 1, 1], 0.5),
            ([2, 3, 1], [2, 4, 1], 0.75),
            ([2, 2, 1], [2, 2, 0], 0.75),
            ([2, 2, 2], [2, 2, 3], 0.5),
        ] {
            assert!((winding.leaves(from, to) - share).abs() < 1e-6, "{from:?} {to:?}");
        }
    }

    #[test]
    fn what_lies_in_two_pieces_is_gone_round_twice() {
        let (a, b) = (cuboid([0.5; 3], [3.5; 3]), cuboid([1.5; 3], [5.5, 4.5, 3.6]));
        let points = [a.points(), b.points()].concat();
        let beside = b.triangles().iter().map(|t| t.map(|p| p + a.points().len() as u32));
        let both = a.triangles().iter().copied().chain(beside).collect();
        let numbers = Winding::new(&TriSurface::new(points, both).unwrap(), &grid()).numbers();
        let count = |n| numbers.iter().filter(|m| **m == n).count();
        assert_eq!((count(2), count(1) + count(2)), (8, 27 + 4 * 3 * 2 - 8));
    }
}
