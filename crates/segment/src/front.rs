//! The patient as seen from the front: how thick the soft tissue under the skin is.

use supine_space::{Grid, Matrix, Point, Vector};
use supine_volume::{LabelMap, Volume, distance_mm, gaussian, label, median};

/// Distance of the map's points, mm. Chosen, not measured.
const STEP_MM: f64 = 4.0;
/// The map is smoothed by a Gaussian of this, mm: noise and skin folds, not a breast. Chosen, not
/// measured.
const SMOOTH_MM: f64 = 8.0;
/// Seen from the axis of the chest, soft tissue up to the first of these angles from the front,
/// degrees, counts as a breast's; from there its share falls to nothing at the second: fat there is
/// that of the armpit and flank. Measured: nipples of seven CTs lie at 35 to 60; what passed for a
/// nipple on the arm of chest-cmb01068 lay at 70.
const FRONT_DEG: (f64, f64) = (50.0, 70.0);
/// The axis of the chest lies at this share of the way from its front to its back (reference,
/// section 4, step 2).
const AXIS: f64 = 0.55;

/// A map over x (to the patient's left) and z (towards the head) of the skin that faces the front.
///
/// Labels of any grid will do, the user's own too: they are looked up on a lattice along the
/// patient's axes.
pub(crate) struct Front {
    /// Distance from the skin to the chest wall, mm; 0 where there is no soft tissue. The grid has
    /// one row along y.
    pub(crate) thickness: Volume<f32>,
    /// The same, smoothed within the patient.
    pub(crate) smooth: Volume<f32>,
    /// The skin, LPS, mm, and the point half-way to the chest wall; `None` beside the patient.
    pub(crate) places: Vec<Option<[Point; 2]>>,
    /// Share to which what lies under the skin faces the front: 1 in front, 0 at armpit and flank.
    pub(crate) facing: Vec<f32>,
    /// Where the axis of the chest runs.
    pub(crate) axis: Axis,
}

/// The axis of the chest: a line along the body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axis {
    /// x of the middle of the chest wall, mm.
    pub(crate) x: f64,
    y: f64,
}

impl Axis {
    /// The point on the other side of the chest.
    pub(crate) fn mirrored(&self, p: Point) -> Point {
        Point::new(2.0 * self.x - p.x, p.y, p.z)
    }

    /// The share to which a point faces the front.
    pub(crate) fn facing(&self, p: &Point) -> f64 {
        let degrees = (p.x - self.x).abs().atan2(self.y - p.y).to_degrees();
        ((FRONT_DEG.1 - degrees) / (FRONT_DEG.1 - FRONT_DEG.0)).clamp(0.0, 1.0)
    }
}

impl Front {
    /// `None` without a chest wall.
    pub(crate) fn new(labels: &LabelMap) -> Option<Self> {
        let (low, high) = bounds(labels.grid());
        let lattice = on_lattice(labels, &lattice(low, high, STEP_MM)?);
        let wall = lattice.map(|&l| label::is_chest_wall(l));
        let axis = axis(&wall)?;
        let away = distance_mm(&wall);
        let [ni, nj, nk] = lattice.grid().size();
        let grid = lattice.grid().crop([0; 3], [ni, 1, nk]).ok()?;
        let skin = |[i, _, k]: [usize; 3]| {
            (0..nj).map(|j| [i, j, k]).find(|&v| lattice.at(v) != label::OUTSIDE)
        };
        let skin: Vec<Option<[usize; 3]>> = (0..grid.len()).map(|n| skin(grid.voxel(n))).collect();
        let thickness = |v: &Option<[usize; 3]>| match v {
            Some(v) if label::is_soft_tissue(lattice.at(*v)) => away.at(*v),
            _ => 0.0,
        };
        let thickness = Volume::new(grid, skin.iter().map(thickness).collect()).ok()?;
        let body = Volume::new(
            thickness.grid().clone(),
            skin.iter().map(|v| f32::from(v.is_some())).collect(),
        );
        let smooth = within(&thickness, &body.ok()?);
        let place = |v: [usize; 3]| {
            let skin = lattice.grid().centre(v);
            [skin, skin + 0.5 * f64::from(away.at(v)) * towards(&away, v)]
        };
        let places: Vec<Option<[Point; 2]>> = skin.into_iter().map(|v| v.map(place)).collect();
        let facing = |p: &Option<[Point; 2]>| p.map_or(0.0, |[skin, _]| axis.facing(&skin) as f32);
        let facing = places.iter().map(facing).collect();
        Some(Self { thickness, smooth, places, facing, axis })
    }
}

/// Points at a distance of `step` along the patient's axes, from one corner to about the other.
pub(crate) fn lattice(low: Point, high: Point, step: f64) -> Option<Grid> {
    let size = [0, 1, 2].map(|a| ((high[a] - low[a]) / step) as usize + 1);
    Grid::new(size, Vector::repeat(step), low, Matrix::identity()).ok()
}

/// The labels there; outside beyond the ends.
fn on_lattice(labels: &LabelMap, lattice: &Grid) -> LabelMap {
    Volume::par_from_fn(lattice.clone(), |v| {
        labels.grid().voxel_at(&lattice.centre(v)).map_or(label::OUTSIDE, |v| labels.at(v))
    })
}

/// Corners of the box along the patient's axes that holds the centres of all voxels.
fn bounds(grid: &Grid) -> (Point, Point) {
    let [i, j, k] = grid.size().map(|n| n - 1);
    let corners = [0, 1, 2, 3, 4, 5, 6, 7]
        .map(|c| grid.centre([i * (c & 1), j * (c >> 1 & 1), k * (c >> 2 & 1)]));
    let low = corners.iter().fold(corners[0], |a, b| a.inf(b));
    (low, corners.iter().fold(corners[0], |a, b| a.sup(b)))
}

/// The medians over the slices of the middle of the chest wall and of the place between its front
/// and back.
fn axis(wall: &Volume<bool>) -> Option<Axis> {
    let [ni, nj, nk] = wall.grid().size();
    let (mut xs, mut ys) = (Vec::new(), Vec::new());
    for k in 0..nk {
        let i = ends((0..ni).filter(|&i| (0..nj).any(|j| wall.at([i, j, k]))));
        let j = ends((0..nj).filter(|&j| (0..ni).any(|i| wall.at([i, j, k]))));
        if let (Some((left, right)), Some((front, back))) = (i, j) {
            let y = front + AXIS * (back - front);
            let middle = wall.grid().patient_from_index([0.5 * (left + right), y, 0.0]);
            xs.push(middle.x as f32);
            ys.push(middle.y as f32);
        }
    }
    Some(Axis { x: f64::from(median(&mut xs)?), y: f64::from(median(&mut ys)?) })
}

/// The first and the last.
fn ends(mut of: impl Iterator<Item = usize>) -> Option<(f64, f64)> {
    let first = of.next()?;
    Some((first as f64, of.last().unwrap_or(first) as f64))
}

/// The map smoothed where the mask is 1, as if nothing lay beside it.
fn within(map: &Volume<f32>, mask: &Volume<f32>) -> Volume<f32> {
    let sigma = [SMOOTH_MM, 0.0, SMOOTH_MM];
    let (mut sum, weight) = (gaussian(map, sigma), gaussian(mask, sigma));
    for n in 0..sum.data().len() {
        let inside = mask.data()[n] > 0.0;
        sum.data_mut()[n] = if inside { sum.data()[n] / weight.data()[n] } else { 0.0 };
    }
    sum
}

/// The direction in which the distance falls, a unit vector; zero where it is flat.
fn towards(away: &Volume<f32>, v: [usize; 3]) -> Vector {
    let size = away.grid().size();
    let slope = [0, 1, 2].map(|a| {
        let (mut below, mut above) = (v, v);
        below[a] = v[a].saturating_sub(1);
        above[a] = (v[a] + 1).min(size[a] - 1);
        f64::from(away.at(below) - away.at(above))
    });
    Vector::from(slope).try_normalize(0.0).unwrap_or_default()
}
