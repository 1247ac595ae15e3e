//! Where a plane of the CT's grid cuts the patient's own structures and doses.

use crate::draw::cut::{Cut, Spot, joined};
use supine_flow::Contours;
use supine_volume::{Outlines, Rule, Volume, contour, sample_trilinear};

/// A contour lies in a plane of the grid when its corners are no farther apart across it, voxels.
const FLAT: f64 = 0.2;
/// Contours are neighbours up to so many times the least distance of two.
const NEIGHBOURS: f64 = 1.5;

/// All contours of a structure at one height.
struct Layer {
    /// Where along the grid's axis, voxels.
    at: f64,
    /// Corners, voxels.
    rings: Vec<Vec<[f64; 3]>>,
}

/// The lines of a structure. Contours are slabs as thick as they lie apart: what they say of a
/// plane across them, and no more.
pub(crate) fn structure(contours: &Contours, cut: &Cut<'_>) -> Vec<Vec<Spot>> {
    let corners = |ring: &Vec<_>| -> Vec<[f64; 3]> {
        ring.iter().map(|p| cut.grid.index_from_patient(p)).collect()
    };
    let rings: Vec<Vec<[f64; 3]>> = contours.iter().map(corners).collect();
    let Some(axis) = (0..3).find(|&a| rings.iter().all(|ring| spread(ring, a) < FLAT)) else {
        return vec![];
    };
    let layers = layers(rings, axis);
    let gap = layers.windows(2).map(|pair| pair[1].at - pair[0].at).fold(f64::INFINITY, f64::min);
    let gap = if gap.is_finite() { gap } else { 1.0 };
    if axis == cut.view.normal() {
        along(&layers, gap, cut)
    } else {
        across(&layers, gap, axis, cut)
    }
}

fn spread(ring: &[[f64; 3]], axis: usize) -> f64 {
    let of = |pick: fn(f64, f64) -> f64, from| ring.iter().map(|p| p[axis]).fold(from, pick);
    of(f64::max, f64::NEG_INFINITY) - of(f64::min, f64::INFINITY)
}

fn layers(rings: Vec<Vec<[f64; 3]>>, axis: usize) -> Vec<Layer> {
    let mut rings: Vec<(f64, Vec<[f64; 3]>)> = rings
        .into_iter()
        .filter(|ring| ring.len() > 2)
        .map(|ring| (ring.iter().map(|p| p[axis]).sum::<f64>() / ring.len() as f64, ring))
        .collect();
    rings.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut layers: Vec<Layer> = vec![];
    for (at, ring) in rings {
        match layers.last_mut() {
            Some(last) if at - last.at < FLAT => last.rings.push(ring),
            _ => layers.push(Layer { at, rings: vec![ring] }),
        }
    }
    layers
}

/// In a plane that contours lie in: those of the nearest layer.
fn along(layers: &[Layer], gap: f64, cut: &Cut<'_>) -> Vec<Vec<Spot>> {
    let off = |layer: &&Layer| (layer.at - cut.slice as f64).abs();
    let Some(layer) = layers.iter().min_by(|a, b| off(a).total_cmp(&off(b))) else {
        return vec![];
    };
    if off(&layer) > (gap / 2.0).max(0.5) {
        return vec![];
    }
    let [right, down] = cut.view.sides();
    let closed = |ring: &Vec<[f64; 3]>| -> Vec<Spot> {
        ring.iter().chain(ring.first()).map(|p| [p[right], p[down]]).collect()
    };
    layer.rings.iter().map(closed).collect()
}

/// In a plane across the contours: the edge of the slabs.
fn across(layers: &[Layer], gap: f64, axis: usize, cut: &Cut<'_>) -> Vec<Vec<Spot>> {
    let [right, down] = cut.view.sides();
    let other = if right == axis { down } else { right };
    // Along the other axis and along that of the layers.
    let spot = |x: f64, h: f64| if right == axis { [h, x] } else { [x, h] };
    let normal = cut.view.normal();
    let mm = [other, normal].map(|a| cut.grid.spacing()[a]);
    let at = cut.slice as f64;
    let ends: Vec<Vec<f64>> =
        layers.iter().map(|layer| crossings(layer, [other, normal], at, mm)).collect();
    let near =
        |n: usize| layers.get(n + 1).is_some_and(|next| next.at - layers[n].at < NEIGHBOURS * gap);
    let mut segments = vec![];
    for (n, layer) in layers.iter().enumerate() {
        let low = match n.checked_sub(1).filter(|&before| near(before)) {
            Some(before) => f64::midpoint(layers[before].at, layer.at),
            None => layer.at - gap / 2.0,
        };
        let high =
            if near(n) { f64::midpoint(layer.at, layers[n + 1].at) } else { layer.at + gap / 2.0 };
        segments.extend(ends[n].iter().map(|&x| [spot(x, low), spot(x, high)]));
        // What only one of two neighbours holds ends between them.
        let above: &[f64] = if near(n) { &ends[n + 1] } else { &[] };
        let mut lids = vec![(high, [&ends[n], above].concat())];
        if n == 0 || !near(n - 1) {
            lids.push((low, ends[n].clone()));
        }
        for (h, mut edge) in lids {
            edge.sort_by(f64::total_cmp);
            let pairs = edge.chunks_exact(2).filter(|pair| pair[0] < pair[1]);
            segments.extend(pairs.map(|pair| [spot(pair[0], h), spot(pair[1], h)]));
        }
    }
    joined(&segments)
}

/// Where the edge of what a layer holds crosses a plane, along another axis, ascending: inside from
/// each odd one to the next. `mm` is the spacing along the other axis and across the plane.
fn crossings(layer: &Layer, [other, normal]: [usize; 2], at: f64, mm: [f64; 2]) -> Vec<f64> {
    let flat = |ring: &Vec<[f64; 3]>| ring.iter().map(|p| [p[other], p[normal]]).collect();
    let rings = layer.rings.iter().map(flat).collect();
    Outlines::new(rings, mm, Rule::Joined).line(at).into_iter().flatten().collect()
}

/// The lines of doses, Gy, in their order; nothing beyond the grid of the dose.
pub(crate) fn isodoses(
    dose: &Volume<f32>,
    levels_gy: &[f64],
    cut: &Cut<'_>,
) -> Vec<Vec<Vec<Spot>>> {
    let (size, [right, down]) = (cut.grid.size(), cut.view.sides());
    let last = dose.grid().size().map(|n| n as f64 - 0.5);
    let mut voxel = [0; 3];
    voxel[cut.view.normal()] = cut.slice;
    let mut samples = Vec::with_capacity(size[right] * size[down]);
    for y in 0..size[down] {
        for x in 0..size[right] {
            (voxel[right], voxel[down]) = (x, y);
            let index = dose.grid().index_from_patient(&cut.grid.centre(voxel));
            let inside = (0..3).all(|a| index[a] >= -0.5 && index[a] <= last[a]);
            samples.push(if inside { sample_trilinear(dose, index) } else { f32::NAN });
        }
    }
    levels_gy.iter().map(|gy| joined(&contour(&samples, size[right], *gy as f32))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::planes::views;
    use supine_space::{Grid, Matrix, Point, Vector};

    const RADIUS: f64 = 12.0;

    /// A grid with flipped rows and slices of 2 mm.
    fn grid() -> Grid {
        let axes = Matrix::from_columns(&[-Vector::x(), -Vector::y(), Vector::z()]);
        Grid::new([50, 44, 30], Vector::new(1.0, 1.0, 2.0), Point::new(25.0, 20.0, -30.0), axes)
            .unwrap()
    }

    /// A ball about the origin with a hole along the body, in every second slice.
    fn contours(grid: &Grid) -> Vec<Vec<Point>> {
        let mut all = vec![];
        for k in (0..30).step_by(2) {
            let z = grid.centre([0, 0, k]).z;
            let ring = |radius: f64| -> Vec<Point> {
                let at = |n: i32| (f64::from(n) * std::f64::consts::TAU / 90.0).sin_cos();
                (0..90).map(|n| Point::new(radius * at(n).1, radius * at(n).0, z)).collect()
            };
            if z.abs() < RADIUS - 1.0 {
                all.push(ring((RADIUS * RADIUS - z * z).sqrt()));
                all.push(ring(3.0));
            }
        }
        all
    }

    fn lines(view: &str, slice: usize) -> Vec<Vec<Spot>> {
        let grid = grid();
        let view = views(&grid).into_iter().find(|shown| shown.is(view)).unwrap();
        structure(&contours(&grid), &Cut { grid: &grid, view, slice })
    }

    /// What closed lines hold by the even-odd rule, voxels.
    fn area(lines: &[Vec<Spot>]) -> f64 {
        let one = |line: &Vec<Spot>| {
            let pairs = line.windows(2).map(|w| w[0][0] * w[1][1] - w[1][0] * w[0][1]);
            pairs.sum::<f64>().abs() / 2.0
        };
        let mut areas: Vec<f64> = lines.iter().map(one).collect();
        areas.sort_by(f64::total_cmp);
        let largest = areas.pop().unwrap_or(0.0);
        largest - areas.iter().sum::<f64>()
    }

    #[test]
    fn contours_are_drawn_where_they_lie_and_up_to_half_way_to_the_next() {
        // Slice 14 lies at z = -2 and has contours; 15 lies between two.
        for slice in [14, 15] {
            let drawn = lines("axial", slice);
            assert_eq!(drawn.len(), 2, "ball and hole");
            let wanted = std::f64::consts::PI * (RADIUS * RADIUS - 4.0 - 9.0);
            assert!((area(&drawn) / wanted - 1.0).abs() < 0.01, "{}", area(&drawn));
        }
        assert!(lines("axial", 3).is_empty());
    }

    #[test]
    fn across_them_they_are_slabs_with_their_hole() {
        // Voxels are 1 mm across and 2 mm high; contours lie 4 mm apart. Beside the hole and
        // through it.
        for (view, slice, hole) in [("sagittal", 30, false), ("coronal", 20, true)] {
            let drawn = lines(view, slice);
            assert!(drawn.iter().all(|line| line.first() == line.last()), "closed lines");
            let (off, mut wanted) = if hole { (0.0, 0.0) } else { (5.0f64, 0.0) };
            for z in [-10.0f64, -6.0, -2.0, 2.0, 6.0, 10.0] {
                let chord = (RADIUS * RADIUS - z * z - off * off).max(0.0).sqrt();
                wanted += 2.0 * (2.0 * chord - if hole { 6.0 } else { 0.0 });
            }
            let sum: f64 = if hole { two_halves(&drawn) } else { area(&drawn) };
            assert!((sum / wanted - 1.0).abs() < 0.02, "{view}: {sum} of {wanted}");
        }
    }

    /// The hole goes through: what is left are two parts.
    fn two_halves(lines: &[Vec<Spot>]) -> f64 {
        assert_eq!(lines.len(), 2);
        lines.iter().map(|line| area(std::slice::from_ref(line))).sum()
    }

    #[test]
    fn isodoses_lie_where_the_dose_is_so_and_not_at_its_edge() {
        let grid = grid();
        let size = [12, 10, 8];
        let on = Grid::new(
            size,
            Vector::repeat(3.0),
            Point::new(-17.0, -14.0, -10.0),
            Matrix::identity(),
        );
        let dose = Volume::from_fn(on.unwrap(), |v| v[0] as f32);
        let view = views(&grid).into_iter().find(|shown| shown.is("axial")).unwrap();
        let cut = Cut { grid: &grid, view, slice: 15 };
        let all = isodoses(&dose, &[4.5, 20.0], &cut);
        assert!(all[1].is_empty());
        assert_eq!(all[0].len(), 1);
        for [right, down] in &all[0][0] {
            let [a, b] = cut.view.sides();
            let mut index = [15.0; 3];
            (index[a], index[b]) = (*right, *down);
            let place = grid.patient_from_index(index);
            assert!((place.x - (-17.0 + 4.5 * 3.0)).abs() < 1e-3, "{place}");
            assert!((-15.5..=14.5).contains(&place.y), "{place}");
        }
    }
}
