//! Planar contours to voxels.

use crate::{Outlines, Rule, Stray, Volume, distance_mm, median};
use rayon::prelude::*;
use supine_space::{Failure, Grid, Matrix, Point, Vector};

/// Contours of one plane, and a contour and its plane, may lie this far apart, mm: positions are
/// written with one or two decimals.
pub const SAME_PLANE_MM: f64 = 0.1;
/// Widest gap between planes that is bridged beside two usual steps, mm.
const BRIDGED_MM: f64 = 10.0;

/// Contours may lie this far beyond the grid that they belong to, mm: what was drawn on a larger
/// CT, or beyond the field of the scanner.
pub const MARGIN_MM: f64 = 500.0;

/// Where contours of one plane cross or lie upon each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    /// In how many planes.
    pub planes: usize,
    /// A point of the lowest of them, LPS, mm.
    pub at: [f64; 3],
}

/// What was made of the contours.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Filled {
    /// Planes with contours.
    pub planes: usize,
    /// Contours of fewer than three points, which enclose nothing and were left out.
    pub degenerate: usize,
    /// Where contours cross or lie upon each other, if any do.
    pub overlap: Option<Overlap>,
}

/// A corner that lies where nothing of a CT can be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beyond {
    /// Number of the contour, from 1.
    pub number: usize,
    /// The corner, LPS, mm.
    pub at: [f64; 3],
    /// How far beyond the CT it lies, mm.
    pub beyond_mm: f64,
    /// Another corner of the contour, LPS, mm.
    pub beside: [f64; 3],
}

/// Why contours cannot be filled.
#[derive(Debug, thiserror::Error, PartialEq)]
#[non_exhaustive]
pub enum ContourError {
    /// There are none, or none encloses anything.
    #[error("it has no contour of three points or more")]
    Empty,
    /// All lie in one plane.
    #[error("it is drawn in one plane alone, so that its thickness is not known")]
    OnePlane,
    /// A contour is not parallel to the slices.
    #[error(
        "contour {number} is not parallel to the slices of the CT (it spans {spread_mm:.2} mm \
         across them; its corner at {} lies furthest from its plane)",
        place(at)
    )]
    NotParallel {
        /// Number of the contour, from 1.
        number: usize,
        /// Its extent along the k axis, mm.
        spread_mm: f64,
        /// The corner furthest from the others' plane, LPS, mm.
        at: [f64; 3],
    },
    /// A corner lies where nothing of the CT can be.
    #[error(
        "contour {} has a corner at {}, {} beyond the CT on its slice through {}: a coordinate is \
         mistyped or the contours belong to another CT",
        .0.number, place(&.0.at), far(.0.beyond_mm), place(&.0.beside)
    )]
    Beyond(Box<Beyond>),
    /// A corner lies far from all others of its contour.
    #[error(
        "contour {} has a corner at {}, far from its others about {}: a coordinate is mistyped",
        .0.number, place(&.0.at), place(&.0.from)
    )]
    Stray(Box<Stray>),
    /// Planes are missing.
    #[error(
        "its contours leave a gap of {gap_mm:.1} mm above the plane through {}, elsewhere they are \
         {usual_mm:.1} mm apart: draw the missing ones",
        place(below)
    )]
    Gap {
        /// A point of the plane below the gap, LPS, mm.
        below: [f64; 3],
        /// Distance of the planes beside the gap, mm.
        gap_mm: f64,
        /// Median distance of neighbouring planes, mm.
        usual_mm: f64,
    },
}

impl ContourError {
    /// The kind of failure: the contours cannot be used.
    pub fn kind(&self) -> Failure {
        Failure::Input
    }
}

fn place(p: &[f64; 3]) -> String {
    let [x, y, z] = p.map(coordinate);
    format!("({x}, {y}, {z}) mm")
}

/// A coordinate, mm; by its power of ten where it is none that a patient has.
fn coordinate(mm: f64) -> String {
    if mm.abs() < 1e6 { format!("{mm:.1}") } else { format!("{mm:e}") }
}

fn far(mm: f64) -> String {
    if mm < 1e6 { format!("{:.1} m", mm / 1000.0) } else { "far".into() }
}

/// Contours of one plane.
struct Plane {
    /// Place along the k axis, voxels.
    k: f64,
    /// Contours, continuous index (i, j).
    outlines: Outlines,
}

/// The voxels whose centres lie within closed contours parallel to the slices; LPS, mm.
///
/// Within a plane `rule` tells how the contours go together ([`Outlines`]). A slice within 0.1 mm
/// of a plane takes that plane's contours; one between two planes the zero of the signed distances
/// of both, weighted by how near they are. Gaps of up to two usual steps (their median) or 10 mm
/// are bridged so. Beyond the outermost planes the contours hold for half a usual step.
///
/// # Errors
/// When no contour encloses anything, one lies more than [`MARGIN_MM`] beyond the grid or is not
/// parallel to the slices, or planes are missing.
pub fn fill_contours(
    grid: &Grid,
    contours: &[Vec<Point>],
    rule: Rule,
) -> Result<(Volume<bool>, Filled), ContourError> {
    held_by(grid, contours)?;
    let planes = planes(grid, contours, rule)?;
    let step = grid.spacing().z;
    let steps: Vec<f64> = planes.windows(2).map(|p| p[1].k - p[0].k).collect();
    let usual = median(&mut steps.clone()).unwrap_or(1.0);
    let limit = widest_bridged_mm(usual * step) / step;
    if let Some(n) = steps.iter().position(|gap| *gap > limit) {
        let below = planes[n].point(grid);
        let (gap_mm, usual_mm) = (steps[n] * step, usual * step);
        return Err(ContourError::Gap { below, gap_mm, usual_mm });
    }
    let [ni, nj, nk] = grid.size();
    let slices: Vec<Vec<bool>> =
        (0..nk).into_par_iter().map(|k| slice(grid, &planes, k, usual)).collect();
    let filled = Filled {
        planes: planes.len(),
        degenerate: contours.iter().filter(|c| c.len() < 3).count(),
        overlap: overlap_of(grid, &planes),
    };
    let mut mask = Vec::with_capacity(ni * nj * nk);
    mask.extend(slices.into_iter().flatten());
    Ok((Volume::from_parts(grid.clone(), mask), filled))
}

/// The widest gap between planes that is filled from the planes beside it, mm; `usual_mm` is the
/// median distance of neighbouring planes.
pub fn widest_bridged_mm(usual_mm: f64) -> f64 {
    (2.0 * usual_mm).max(BRIDGED_MM) + SAME_PLANE_MM
}

/// That contours lie within [`MARGIN_MM`] of a grid: nothing is made for contours that lie nowhere.
///
/// # Errors
/// When a corner lies further away or is no place.
pub fn held_by(grid: &Grid, contours: &[Vec<Point>]) -> Result<(), ContourError> {
    let (size, spacing) = (grid.size(), grid.spacing());
    let beyond = |p: &Point| {
        let index = grid.index_from_patient(p);
        let off =
            [0, 1, 2].map(|a| (-index[a]).max(index[a] - (size[a] as f64 - 1.0)) * spacing[a]);
        off.into_iter()
            .fold(0.0, |most: f64, mm| if mm.is_finite() { most.max(mm) } else { f64::MAX })
    };
    for (n, contour) in contours.iter().enumerate() {
        let Some(at) = contour.iter().find(|p| beyond(p) > MARGIN_MM) else { continue };
        let beside = contour.iter().find(|p| beyond(p) <= MARGIN_MM).unwrap_or(at);
        return Err(ContourError::Beyond(Box::new(Beyond {
            number: n + 1,
            at: at.coords.into(),
            beyond_mm: beyond(at),
            beside: beside.coords.into(),
        })));
    }
    Ok(())
}

impl Plane {
    /// A corner in it, LPS, mm.
    fn point(&self, grid: &Grid) -> [f64; 3] {
        let [i, j] = self.outlines.contours()[0][0];
        grid.patient_from_index([i, j, self.k]).coords.into()
    }
}

/// Where contours cross or lie upon each other.
fn overlap_of(grid: &Grid, planes: &[Plane]) -> Option<Overlap> {
    let mut crossed = planes.iter().filter(|plane| plane.outlines.overlap());
    let at = crossed.next()?.point(grid);
    Some(Overlap { planes: 1 + crossed.count(), at })
}

/// The contours by plane, ascending along k.
fn planes(grid: &Grid, contours: &[Vec<Point>], rule: Rule) -> Result<Vec<Plane>, ContourError> {
    let mm = [grid.spacing().x, grid.spacing().y];
    let outlined = |(k, contours)| Plane { k, outlines: Outlines::new(contours, mm, rule) };
    let planes = contours_by_plane(grid, contours, Vector::repeat(1.0))?;
    Ok(planes.into_par_iter().map(outlined).collect())
}

/// Places of planes, and the contours of each.
pub type ByPlane = Vec<(f64, Vec<Vec<[f64; 2]>>)>;

/// Closed contours by the planes parallel to the slices in which they lie, ascending: the place of
/// each plane along the k axis, and its contours along i and j; all in voxels times `unit`, which
/// is 1 for continuous indices and the grid's spacing for mm. Contours of fewer than three corners
/// are left out.
///
/// # Errors
/// When a contour is not parallel to the slices, or none is left.
pub fn contours_by_plane(
    grid: &Grid,
    contours: &[Vec<Point>],
    unit: Vector,
) -> Result<ByPlane, ContourError> {
    let step = grid.spacing().z / unit.z;
    let mut placed = Vec::new();
    for (n, contour) in contours.iter().enumerate().filter(|(_, c)| c.len() >= 3) {
        let index = contour.iter().map(|p| {
            let index = grid.index_from_patient(p);
            [0, 1, 2].map(|a| index[a] * unit[a])
        });
        let index: Vec<[f64; 3]> = index.collect();
        let low = index.iter().map(|v| v[2]).fold(f64::INFINITY, f64::min);
        let high = index.iter().map(|v| v[2]).fold(f64::NEG_INFINITY, f64::max);
        let spread_mm = (high - low) * step;
        if spread_mm.is_nan() || spread_mm > SAME_PLANE_MM {
            let at = off_plane(&index).map_or(contour[0], |corner| contour[corner]);
            let at = at.coords.into();
            return Err(ContourError::NotParallel { number: n + 1, spread_mm, at });
        }
        placed.push((0.5 * (low + high), index.iter().map(|v| [v[0], v[1]]).collect()));
    }
    placed.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut planes = ByPlane::new();
    for (k, contour) in placed {
        match planes.last_mut() {
            Some((at, contours)) if (k - *at) * step <= SAME_PLANE_MM => contours.push(contour),
            _ => planes.push((k, vec![contour])),
        }
    }
    if planes.is_empty() {
        return Err(ContourError::Empty);
    }
    Ok(planes)
}

/// The corner that lies furthest along k from where half of them do.
fn off_plane(index: &[[f64; 3]]) -> Option<usize> {
    let middle = median(&mut index.iter().map(|v| v[2]).collect::<Vec<_>>())?;
    let off = |n: &usize| (index[*n][2] - middle).abs();
    (0..index.len()).max_by(|a, b| off(a).total_cmp(&off(b)))
}

/// One slice.
fn slice(grid: &Grid, planes: &[Plane], k: usize, usual: f64) -> Vec<bool> {
    let (place, near) = (k as f64, SAME_PLANE_MM / grid.spacing().z);
    let above = planes.partition_point(|p| p.k < place);
    let below = above.checked_sub(1);
    let (below, above) = (below.map(|n| &planes[n]), planes.get(above));
    let nearest = match (below, above) {
        (Some(a), Some(b)) if place - a.k <= b.k - place => Some(a),
        (_, Some(b)) => Some(b),
        (a, None) => a,
    };
    let [ni, nj, _] = grid.size();
    match (nearest, below, above) {
        (Some(p), ..) if (p.k - place).abs() <= near => fill(ni, nj, &p.outlines),
        (_, Some(a), Some(b)) => {
            let share = (place - a.k) / (b.k - a.k);
            between(grid, a, b, share)
        }
        (Some(p), ..) if (p.k - place).abs() < 0.5 * usual - near => fill(ni, nj, &p.outlines),
        _ => vec![false; ni * nj],
    }
}

/// The shape at a share of the way from one plane to the next: the zero of the weighted signed
/// distances to both outlines.
fn between(grid: &Grid, a: &Plane, b: &Plane, share: f64) -> Vec<bool> {
    let [ni, nj, _] = grid.size();
    let spacing = Vector::new(grid.spacing().x, grid.spacing().y, 1.0);
    let signed = |plane: &Plane| -> Vec<f64> {
        let inside = fill(ni, nj, &plane.outlines);
        let Ok(flat) = Grid::new([ni, nj, 1], spacing, Point::origin(), Matrix::identity()) else {
            return Vec::new();
        };
        let outside = Volume::from_parts(flat.clone(), inside.iter().map(|m| !m).collect());
        let to_inside = distance_mm(&Volume::from_parts(flat, inside));
        let to_outside = distance_mm(&outside);
        let pair = to_inside.data().iter().zip(to_outside.data());
        pair.map(|(i, o)| f64::from(*i) - f64::from(*o)).collect()
    };
    let (a, b) = (signed(a), signed(b));
    a.iter().zip(&b).map(|(a, b)| (1.0 - share) * a + share * b < 0.0).collect()
}

/// The pixels whose centres lie within the contours. A centre on an edge counts on the lower side
/// of the shape, not on the upper.
fn fill(ni: usize, nj: usize, outlines: &Outlines) -> Vec<bool> {
    let mut pixels = vec![false; ni * nj];
    let rows = outlines.contours().iter().flatten().map(|p| p[1]);
    let (low, high) =
        rows.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), y| (a.min(y), b.max(y)));
    // Casts saturate, so that contours far outside stay within the rows.
    let rows = (low.ceil().max(0.0) as usize)..(high.floor() + 1.0).clamp(0.0, nj as f64) as usize;
    for j in rows {
        for line in outlines.line(j as f64) {
            let [first, end] = line.map(|x| x.ceil().clamp(0.0, ni as f64) as usize);
            pixels[j * ni + first..j * ni + end.max(first)].fill(true);
        }
    }
    pixels
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(size: [usize; 3]) -> Grid {
        // Axes that point right, front and head, as in a series scanned feet first and prone.
        let direction = Matrix::new(-1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0);
        let spacing = Vector::new(1.5, 1.0, 3.0);
        Grid::new(size, spacing, Point::new(50.0, -20.0, 7.0), direction).unwrap()
    }

    /// A closed contour from continuous indices.
    fn contour(grid: &Grid, k: f64, corners: &[[f64; 2]]) -> Vec<Point> {
        corners.iter().map(|c| grid.patient_from_index([c[0], c[1], k])).collect()
    }

    fn square(grid: &Grid, k: f64, low: f64, high: f64) -> Vec<Point> {
        contour(grid, k, &[[low, low], [high, low], [high, high], [low, high]])
    }

    fn count(mask: &Volume<bool>, k: usize) -> usize {
        let plane = mask.grid().size()[0] * mask.grid().size()[1];
        mask.data()[k * plane..(k + 1) * plane].iter().filter(|m| **m).count()
    }

    #[test]
    fn voxels_whose_centres_lie_inside_are_filled_and_inner_contours_are_holes() {
        let g = grid([20, 20, 3]);
        let contours = [square(&g, 1.0, 2.5, 12.5), square(&g, 1.0, 4.5, 7.5)];
        let (mask, filled) = fill_contours(&g, &contours, Rule::Joined).unwrap();
        assert_eq!([0, 1, 2].map(|k| count(&mask, k)), [0, 100 - 9, 0]);
        assert!(mask.at([3, 3, 1]) && !mask.at([5, 5, 1]) && !mask.at([2, 3, 1]));
        assert_eq!(filled, Filled { planes: 1, degenerate: 0, overlap: None });
    }

    #[test]
    fn a_keyhole_leaves_the_same_hole() {
        let g = grid([20, 20, 1]);
        // Out to the hole along one line and back along the same.
        let corners = [
            [2.5, 2.5],
            [12.5, 2.5],
            [12.5, 12.5],
            [2.5, 12.5],
            [2.5, 5.0],
            [4.5, 5.0],
            [4.5, 7.5],
            [7.5, 7.5],
            [7.5, 4.5],
            [4.5, 4.5],
            [4.5, 5.0],
            [2.5, 5.0],
        ];
        let (mask, _) = fill_contours(&g, &[contour(&g, 0.0, &corners)], Rule::Joined).unwrap();
        assert_eq!(count(&mask, 0), 100 - 9);
    }

    #[test]
    fn edges_through_centres_count_once() {
        let g = grid([20, 20, 1]);
        let halves = [
            contour(&g, 0.0, &[[2.0, 2.0], [6.0, 2.0], [6.0, 9.0], [2.0, 9.0]]),
            contour(&g, 0.0, &[[6.0, 2.0], [11.0, 2.0], [11.0, 9.0], [6.0, 9.0]]),
        ];
        let whole = contour(&g, 0.0, &[[2.0, 2.0], [11.0, 2.0], [11.0, 9.0], [2.0, 9.0]]);
        let (together, _) = fill_contours(&g, &halves, Rule::Joined).unwrap();
        assert_eq!(together, fill_contours(&g, &[whole], Rule::Joined).unwrap().0);
        assert_eq!(count(&together, 0), 9 * 7);
    }

    #[test]
    fn slices_between_planes_are_bridged_by_shape() {
        let g = grid([30, 30, 9]);
        // Planes on every second slice, growing, and the one on slice 4 is missing.
        let contours: Vec<_> =
            [0.0, 2.0, 6.0, 8.0].into_iter().map(|k| square(&g, k, 10.5 - k, 18.5 + k)).collect();
        let (mask, _) = fill_contours(&g, &contours, Rule::Joined).unwrap();
        for k in 0..9 {
            let side = 8 + 2 * k;
            let off = count(&mask, k).abs_diff(side * side);
            assert!(off <= 2 * side, "slice {k}: {} voxels, {}", count(&mask, k), side * side);
        }
    }

    #[test]
    fn outermost_contours_hold_for_half_a_step() {
        let g = grid([20, 20, 9]);
        let contours: Vec<_> = [2.8, 5.2].into_iter().map(|k| square(&g, k, 2.5, 8.5)).collect();
        let (mask, _) = fill_contours(&g, &contours, Rule::Joined).unwrap();
        let found: Vec<usize> = (0..9).filter(|&k| count(&mask, k) > 0).collect();
        assert_eq!(found, [2, 3, 4, 5, 6], "2 and 6 lie 0.8 of 1.2 from the last planes");
    }

    #[test]
    fn what_cannot_be_filled_says_why() {
        let g = grid([20, 20, 20]);
        let two = contour(&g, 1.0, &[[2.0, 2.0], [6.0, 2.0]]);
        assert_eq!(
            fill_contours(&g, std::slice::from_ref(&two), Rule::Joined).unwrap_err(),
            ContourError::Empty
        );
        assert_eq!(fill_contours(&g, &[], Rule::Joined).unwrap_err(), ContourError::Empty);
        let (_, filled) =
            fill_contours(&g, &[two, square(&g, 1.0, 2.5, 6.5)], Rule::Joined).unwrap();
        assert_eq!(filled.degenerate, 1);
        let upright: Vec<Point> = [[3.0, 3.0, 2.0], [3.0, 9.0, 2.0], [3.0, 9.0, 5.0]]
            .map(|v| g.patient_from_index(v))
            .to_vec();
        let error = fill_contours(&g, &[upright], Rule::Joined).unwrap_err();
        assert!(error.to_string().contains("9.00 mm"), "{error}");
        let far: Vec<_> = [1.0, 2.0, 3.0, 9.0].map(|k| square(&g, k, 2.5, 6.5)).to_vec();
        let error = fill_contours(&g, &far, Rule::Joined).unwrap_err().to_string();
        assert!(error.contains("18.0 mm") && error.contains("3.0 mm apart"), "{error}");
    }

    #[test]
    fn contours_that_lie_nowhere_are_refused_before_anything_is_made() {
        let g = grid([20, 20, 3]);
        for value in [1e6, 1e9, 1e30, f64::MAX, -20_000.0, -244_262.0, -2442.0] {
            for axis in 0..3 {
                let mut contour = square(&g, 1.0, 2.5, 12.5);
                contour[2][axis] = value;
                let all = [square(&g, 1.0, 2.5, 12.5), contour];
                let error = fill_contours(&g, &all, Rule::Joined).unwrap_err();
                assert!(matches!(&error, ContourError::Beyond(b) if b.number == 2), "{error}");
                let (text, value) = (error.to_string(), coordinate(value));
                assert!(text.contains(&value) && text.contains("slice through"), "{text}");
            }
        }
        let wide = [square(&g, 1.0, -300.0, 300.0)];
        assert_eq!(count(&fill_contours(&g, &wide, Rule::Joined).unwrap().0, 1), 400);
    }

    #[test]
    fn a_contour_drawn_twice_is_filled_and_told() {
        let g = grid([20, 20, 3]);
        let one = square(&g, 1.0, 2.5, 12.5);
        let alone = fill_contours(&g, std::slice::from_ref(&one), Rule::Joined).unwrap();
        let twice = fill_contours(&g, &[one.clone(), one.clone()], Rule::Joined).unwrap();
        assert_eq!(twice.0, alone.0);
        assert_eq!(alone.1.overlap, None);
        assert!(matches!(twice.1.overlap, Some(Overlap { planes: 1, .. })));
        let off = Point::from(twice.1.overlap.unwrap().at) - one[0];
        assert!(off.norm() < 1e-9, "{off}");
        let xor = fill_contours(&g, &[one.clone(), one], Rule::Exclusive).unwrap();
        assert_eq!(count(&xor.0, 1), 0);
    }
}
