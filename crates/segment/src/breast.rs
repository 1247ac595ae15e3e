//! The breast in the labels: its highest point and the sphere that holds it.
//!
//! The breast is where the skin of one side stands far off the chest wall. It is looked for on a
//! coarse lattice along the patient's axes, so labels of any grid will do, the user's own too.

use crate::Error;
use crate::bones::median;
use supine_space::{Grid, Matrix, Point, Side, Sphere, Vector};
use supine_volume::{LabelMap, Volume, distance_mm, label};

/// Distance of lattice points, mm.
const STEP_MM: f64 = 4.0;
/// Sectors per turn round the thorax, and rows of the map along the body, mm.
const SECTORS: usize = 120;
/// The breast's highest point lies between these angles from the front midline, degrees.
const PEAK_DEG: (f64, f64) = (15.0, 95.0);
/// The breast itself may reach between these.
const BREAST_DEG: (f64, f64) = (-5.0, 115.0);
/// The highest point is not looked for this close to the ends of the volume, mm.
const ENDS_MM: f64 = 20.0;
/// The breast ends where the thickness has fallen to this share between the rest and the peak: the
/// first share for which the breast does not run on into axilla and flank or out of the volume.
const RIM_SHARES: [f64; 5] = [0.15, 0.25, 0.35, 0.5, 0.65];
/// A breast fits into a sphere of this radius, mm.
const LARGEST_MM: f64 = 105.0;
/// The sphere holds the breast and this much more, mm.
const MARGIN_MM: f64 = 15.0;
/// The sphere stays this far from the first and last slice, mm.
const CLEAR_MM: f64 = 1.0;
/// Least thickness of a breast at its peak, mm.
const LEAST_MM: f64 = 12.0;

/// Sphere round the breast of that side: the whole breast and 15 mm, kept clear of the first and
/// last slice, and larger where it must be to hold the tumour.
///
/// # Errors
/// [`Error::NoRegion`] when the labels hold no breast on that side, or no sphere within the volume
/// can hold the tumour.
pub fn propose_region(
    labels: &LabelMap,
    side: Side,
    tumour: Option<Sphere>,
) -> Result<Sphere, Error> {
    let fail = |why: String| Error::NoRegion {
        side: if side == Side::Left { "left" } else { "right" },
        why,
    };
    let found = Breast::find(labels, side).map_err(|why| fail(why.into()))?;
    let Breast { centre, reach, .. } = found;
    let mut radius = reach + MARGIN_MM;
    if let Some(t) = tumour {
        radius = radius.max((t.centre() - centre).norm() + t.radius() + MARGIN_MM);
    }
    let (centre, radius) = keep_clear(labels.grid(), centre, radius);
    let sphere = Sphere::new(centre, radius).map_err(|e| fail(e.to_string()))?;
    match tumour {
        Some(t) if (t.centre() - centre).norm() + t.radius() > radius => Err(fail(format!(
            "the tumour at {:.1?} mm does not fit into a sphere of {radius:.0} mm that stays within \
             the slices; give the region, or a CT that reaches farther",
            t.centre().coords.as_slice()
        ))),
        _ => Ok(sphere),
    }
}

/// The sphere moved along the slices' normal, and if need be shrunk, so that it stays within.
fn keep_clear(grid: &Grid, centre: Point, radius: f64) -> (Point, f64) {
    let normal: Vector = grid.direction().column(2).into();
    let depth = normal.dot(&(centre - grid.origin()));
    let length = (grid.size()[2] - 1) as f64 * grid.spacing()[2];
    let radius = radius.min(0.5 * length - CLEAR_MM);
    let moved = depth.clamp(radius + CLEAR_MM, (length - radius - CLEAR_MM).max(radius + CLEAR_MM));
    (centre + normal * (moved - depth), radius)
}

/// Where the breast of one side is.
pub(crate) struct Breast {
    /// Middle of the box round its soft tissue.
    centre: Point,
    /// Distance of the farthest soft tissue, mm.
    reach: f64,
    /// Soft tissue farthest off the wall.
    pub(crate) top: Point,
    /// Greatest thickness near the first and last slice, as a share of that at the top.
    pub(crate) at_ends: f64,
}

/// A point of soft tissue on one side.
struct Spot {
    point: Point,
    /// Place in the map of sectors and rows.
    cell: usize,
    /// Degrees from the front midline towards the side.
    angle: f64,
    /// Distance to the chest wall, mm.
    height: f64,
}

impl Breast {
    /// The breast of that side, or why there is none.
    pub(crate) fn find(labels: &LabelMap, side: Side) -> Result<Self, &'static str> {
        let coarse = coarse(labels);
        let wall = coarse.map(|&l| label::is_chest_wall(l));
        let axis = axis(&wall).ok_or("there is no chest wall in the labels")?;
        let spots = spots(&coarse, &wall, axis, side);
        let rows = coarse.grid().size()[2];
        let mut map = vec![0.0f64; SECTORS * rows];
        for s in &spots {
            map[s.cell] = map[s.cell].max(s.height);
        }
        let ends = (ENDS_MM / STEP_MM) as usize;
        let top = spots
            .iter()
            .filter(|s| {
                let row = s.cell / SECTORS;
                row >= ends && row + ends < rows && (PEAK_DEG.0..=PEAK_DEG.1).contains(&s.angle)
            })
            .max_by(|a, b| a.height.total_cmp(&b.height))
            .ok_or("there is no soft tissue in front of the chest wall")?;
        if top.height < LEAST_MM {
            return Err("the soft tissue in front of the chest wall is too thin for a breast");
        }
        let mut known: Vec<f32> = map.iter().filter(|h| **h > 0.0).map(|&h| h as f32).collect();
        let rest = f64::from(median(&mut known)).min(0.5 * top.height);
        let length = labels.grid().size()[2] as f64 * labels.grid().spacing()[2];
        let largest = LARGEST_MM.min(0.5 * length - MARGIN_MM - 2.0 * CLEAR_MM);
        let near_end = |s: &&Spot| {
            let row = s.cell / SECTORS;
            (row < ends || row + ends >= rows) && (PEAK_DEG.0..=PEAK_DEG.1).contains(&s.angle)
        };
        let at_ends = spots.iter().filter(near_end).map(|s| s.height).fold(0.0, f64::max);
        let at_ends = at_ends / top.height;
        let mut found = Self { centre: top.point, reach: 0.0, top: top.point, at_ends };
        for share in RIM_SHARES {
            let part = connected(&map, top.cell, rest + share * (top.height - rest));
            let tissue = || spots.iter().filter(|s| part[s.cell]).map(|s| s.point);
            let low = tissue().fold(top.point, |a, b| a.inf(&b));
            let high = tissue().fold(top.point, |a, b| a.sup(&b));
            found.centre = low + 0.5 * (high - low);
            found.reach = tissue().map(|p| (p - found.centre).norm()).fold(0.0, f64::max);
            if found.reach < largest {
                break;
            }
        }
        Ok(found)
    }
}

/// The labels on a lattice along the patient's axes.
fn coarse(labels: &LabelMap) -> LabelMap {
    let grid = labels.grid();
    let [i, j, k] = grid.size().map(|n| n - 1);
    let corners = [0, 1, 2, 3, 4, 5, 6, 7]
        .map(|c| grid.centre([i * (c & 1), j * (c >> 1 & 1), k * (c >> 2 & 1)]));
    let low = corners.iter().fold(corners[0], |a, b| a.inf(b));
    let high = corners.iter().fold(corners[0], |a, b| a.sup(b));
    let size = [0, 1, 2].map(|a| ((high[a] - low[a]) / STEP_MM) as usize + 1);
    let lattice = Grid::new(size, Vector::repeat(STEP_MM), low, Matrix::identity());
    match lattice {
        Ok(lattice) => Volume::from_fn(lattice.clone(), |v| {
            grid.voxel_at(&lattice.centre(v)).map_or(label::OUTSIDE, |v| labels.at(v))
        }),
        // A lattice inside a valid grid is valid.
        Err(_) => labels.clone(),
    }
}

/// x and y of the middle of the chest wall, mm.
fn axis(wall: &Volume<bool>) -> Option<[f64; 2]> {
    let [ni, nj, nk] = wall.grid().size();
    let (mut xs, mut ys) = (Vec::new(), Vec::new());
    for k in 0..nk {
        let (mut x, mut y) = ((usize::MAX, 0), (usize::MAX, 0));
        for j in 0..nj {
            for i in (0..ni).filter(|&i| wall.at([i, j, k])) {
                x = (x.0.min(i), x.1.max(i));
                y = (y.0.min(j), y.1.max(j));
            }
        }
        if x.0 < x.1 {
            let middle = wall.grid().patient_from_index([
                0.5 * (x.0 + x.1) as f64,
                0.5 * (y.0 + y.1) as f64,
                k as f64,
            ]);
            xs.push(middle.x as f32);
            ys.push(middle.y as f32);
        }
    }
    (!xs.is_empty()).then(|| [median(&mut xs).into(), median(&mut ys).into()])
}

/// The soft tissue of one side, with its place round the thorax.
fn spots(coarse: &LabelMap, wall: &Volume<bool>, axis: [f64; 2], side: Side) -> Vec<Spot> {
    let grid = coarse.grid();
    let height = distance_mm(wall);
    let mut out = Vec::new();
    for (n, &l) in coarse.data().iter().enumerate() {
        if !label::is_soft_tissue(l) {
            continue;
        }
        let voxel = grid.voxel(n);
        let point = grid.centre(voxel);
        let (x, y) = ((point.x - axis[0]) * side.sign(), point.y - axis[1]);
        let angle = x.atan2(-y).to_degrees();
        if (BREAST_DEG.0..=BREAST_DEG.1).contains(&angle) {
            let sector = (angle.rem_euclid(360.0) / 360.0 * SECTORS as f64) as usize % SECTORS;
            let cell = voxel[2] * SECTORS + sector;
            out.push(Spot { point, cell, angle, height: f64::from(height.data()[n]) });
        }
    }
    out
}

/// The cells joined to `from` whose value is above `rim`.
fn connected(map: &[f64], from: usize, rim: f64) -> Vec<bool> {
    let mut part = vec![false; map.len()];
    let mut stack = vec![from];
    part[from] = true;
    while let Some(n) = stack.pop() {
        let (row, sector) = (n / SECTORS * SECTORS, n % SECTORS);
        let beside =
            [row + (sector + 1) % SECTORS, row + (sector + SECTORS - 1) % SECTORS, n + SECTORS];
        for m in beside.into_iter().chain(n.checked_sub(SECTORS)) {
            if m < map.len() && !part[m] && map[m] > rim {
                part[m] = true;
                stack.push(m);
            }
        }
    }
    part
}
