//! How much of the chest wall's boundary within a region is uncertain, and where.

use crate::confidence::PER_MM;
use crate::pairs;
use rayon::prelude::*;
use std::collections::BTreeMap;
use supine_record::{UncertainPatch, WallUncertainty};
use supine_space::{Grid, Point, Side, Sphere, Vector};
use supine_volume::{LabelMap, Volume, components, label};

/// The boundary is called uncertain where it may be wrong by more than this in one of twenty
/// places, mm. Chosen, not measured; the two that follow too.
pub const UNCERTAIN_MM: f64 = 2.5;
/// A place this near to the nipple's level is neither above nor below it, mm.
const MIDDLE_MM: f64 = 12.0;
/// Voxel faces are summed to flat pieces of this size before their area is taken, mm.
const PIECE_MM: f64 = 8.0;

/// Where a place lies as seen from the front, from the `middle` of the breast of that side: `upper
/// outer quadrant`, `behind the middle of the breast`, ... Not from the nipple, which falls sideways
/// in who lies on her back.
fn place(of: &Point, middle: &Point, side: Side) -> &'static str {
    let off = of - middle;
    let (out, up) = (off.x * side.sign(), off.z);
    let beside = |x: f64| if x.abs() < MIDDLE_MM { 0 } else { x.signum() as i8 };
    match (beside(up), beside(out)) {
        (1, 1) => "upper outer quadrant",
        (1, -1) => "upper inner quadrant",
        (-1, 1) => "lower outer quadrant",
        (-1, -1) => "lower inner quadrant",
        (1, _) => "above the middle of the breast",
        (-1, _) => "below the middle of the breast",
        (_, 1) => "outer side, at the height of its middle",
        (_, -1) => "inner side, at the height of its middle",
        _ => "behind the middle of the breast",
    }
}

/// The uncertainty of the boundary within a sphere; places are named from the `middle` (LPS, mm) of
/// the breast of that side. What they do to the tumour is not known here. `map` is
/// [`crate::Segmenter::uncertainty`], on the grid of the labels.
pub fn wall_uncertainty(
    labels: &LabelMap,
    map: &Volume<u8>,
    region: Sphere,
    (middle, side): (&Point, Side),
) -> WallUncertainty {
    let none = || WallUncertainty {
        boundary_cm2: 0.0,
        uncertain_cm2: 0.0,
        limit_mm: UNCERTAIN_MM,
        patches: vec![],
    };
    let Some((start, part)) = labels.grid().around(&region) else { return none() };
    let whole = |v: [usize; 3]| [0, 1, 2].map(|a| v[a] + start[a]);
    let limit = (UNCERTAIN_MM * f64::from(PER_MM)) as u8;
    let uncertain = components(&Volume::par_from_fn(part.clone(), |v| {
        map.at(whole(v)) > limit && region.contains(&part.centre(v))
    }));
    let (mut boundary, mut patches) = (Pieces::default(), BTreeMap::<u32, Pieces>::new());
    let face = |n: usize| {
        let v = part.voxel(n);
        let inner = label::is_chest_wall(labels.at(whole(v)));
        let face = if inner { outward(labels, whole(v)) } else { [0.0; 3] };
        (face != [0.0; 3] && region.contains(&part.centre(v))).then_some((n, face))
    };
    let faces: Vec<(usize, [f64; 3])> = (0..part.len()).into_par_iter().filter_map(face).collect();
    for (n, face) in faces {
        let (v, id) = (part.voxel(n), uncertain.ids.data()[n]);
        boundary.add(&part, v, face, 0.0);
        if id != 0 {
            let error = f64::from(map.at(whole(v))) / f64::from(PER_MM);
            patches.entry(id).or_default().add(&part, v, face, error);
        }
    }
    let grid = labels.grid();
    let patch = |pieces: Pieces| pieces.patch(grid, |centre| place(centre, middle, side));
    let mut patches: Vec<UncertainPatch> = patches.into_values().map(patch).collect();
    patches.sort_by(|a, b| b.area_cm2.total_cmp(&a.area_cm2));
    let uncertain_cm2 = patches.iter().map(|p| p.area_cm2).sum();
    WallUncertainty { boundary_cm2: boundary.area_cm2(), uncertain_cm2, patches, ..none() }
}

/// The faces of a voxel that soft tissue touches, as a vector along the grid's axes, mm².
fn outward(labels: &LabelMap, v: [usize; 3]) -> [f64; 3] {
    let (size, spacing) = (labels.grid().size(), labels.grid().spacing());
    let soft = |v| label::is_soft_tissue(labels.at(v));
    [0, 1, 2].map(|a| {
        let area = spacing[(a + 1) % 3] * spacing[(a + 2) % 3];
        let (mut below, mut above) = (v, v);
        below[a] = v[a].saturating_sub(1);
        above[a] = (v[a] + 1).min(size[a] - 1);
        area * (f64::from(u8::from(soft(above))) - f64::from(u8::from(soft(below))))
    })
}

/// A part of the boundary as voxel faces, summed in small cubes.
#[derive(Default)]
struct Pieces {
    faces: BTreeMap<[usize; 3], [f64; 3]>,
    points: Vec<(Point, [f64; 3])>,
    errors: f64,
}

impl Pieces {
    fn add(&mut self, grid: &Grid, v: [usize; 3], face: [f64; 3], error: f64) {
        let cube = [0, 1, 2].map(|a| (v[a] as f64 * grid.spacing()[a] / PIECE_MM) as usize);
        let sum = self.faces.entry(cube).or_default();
        *sum = [0, 1, 2].map(|a| sum[a] + face[a]);
        self.points.push((grid.centre(v), face));
        self.errors += error;
    }

    fn area_cm2(&self) -> f64 {
        self.faces.values().map(|f| Vector::from(*f).norm()).sum::<f64>() / 100.0
    }

    fn patch(self, grid: &Grid, place: impl Fn(&Point) -> &'static str) -> UncertainPatch {
        let n = self.points.len() as f64;
        let sum = self.points.iter().fold(Vector::zeros(), |sum, (p, _)| sum + p.coords);
        let middle = Point::from(sum / n);
        let far = |p: &Point| (p - middle).norm_squared();
        let nearest = self.points.iter().min_by(|a, b| far(&a.0).total_cmp(&far(&b.0)));
        let (area_cm2, centre) = (self.area_cm2(), nearest.map_or(middle, |p| p.0));
        let faces = self.points.into_iter().map(|(p, f)| (p, grid.direction() * Vector::from(f)));
        let seeds = pairs::covering(&faces.collect::<Vec<_>>(), &grid.direction().column(2).into());
        UncertainPatch {
            area_cm2,
            centre_mm: centre.into(),
            error_mm: self.errors / n,
            place: place(&centre).into(),
            effect_mm: None,
            seeds_mm: seeds.into_iter().map(|pair| pair.map(<[f64; 3]>::from)).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::Matrix;

    /// From where places are named.
    const FROM: (&Point, Side) = (&Point::new(0.0, -60.0, 75.0), Side::Left);

    /// A cylinder of chest wall, radius 60 mm, with soft tissue round it; uncertain where `on`
    /// holds.
    fn limb(on: impl Fn(&Point) -> bool + Sync) -> (LabelMap, Volume<u8>) {
        let grid = Grid::new(
            [80, 80, 50],
            Vector::new(2.0, 2.0, 3.0),
            Point::new(-79.0, -79.0, 0.0),
            Matrix::identity(),
        );
        let labels = Volume::from_fn(grid.unwrap(), |_| 0u8);
        let of = |f: &dyn Fn(&Point) -> u8| {
            let grid = labels.grid();
            let data = (0..grid.len()).map(|n| f(&grid.centre(grid.voxel(n)))).collect();
            labels.with_data(data).unwrap()
        };
        let inside = |p: &Point| p.x.hypot(p.y) < 60.0;
        (
            of(&|p| if inside(p) { label::CHEST_WALL } else { label::SOFT_TISSUE }),
            of(&|p| {
                let near = (p.x.hypot(p.y) - 60.0).abs() < 3.0;
                if near && on(p) { 55 } else { u8::from(near) }
            }),
        )
    }

    #[test]
    fn areas_are_those_of_the_surface_and_places_are_found() {
        let square = |p: &Point| p.y < 0.0 && p.x.abs() < 15.0 && (p.z - 60.0).abs() < 20.0;
        let strip = |p: &Point| p.x > 50.0 && (p.z - 90.0).abs() < 5.0;
        let (labels, map) = limb(|p| square(p) || strip(p));
        let region = Sphere::new(Point::new(0.0, 0.0, 75.0), 300.0).unwrap();
        let found = wall_uncertainty(&labels, &map, region, FROM);
        let want = std::f64::consts::TAU * 6.0 * 15.0;
        assert!((found.boundary_cm2 / want - 1.0).abs() < 0.08, "{} {want}", found.boundary_cm2);
        assert_eq!(found.patches.len(), 2, "{found:?}");
        let [first, second] = [&found.patches[0], &found.patches[1]];
        let want = 2.0 * 6.0 * 0.25f64.asin() * 4.0;
        assert!((first.area_cm2 / want - 1.0).abs() < 0.15, "{first:?} {want}");
        let off = Point::from(first.centre_mm) - Point::new(0.0, -60.0, 60.0);
        assert!(off.norm() < 4.0, "{first:?}");
        let pairs = first.seeds_mm.iter().map(|pair| pair.map(Point::from));
        let across = pairs.map(|[wall, soft]| (soft - wall).normalize());
        assert!(across.clone().count() > 3 && across.into_iter().all(|a| a.y < -0.9), "{first:?}");
        assert!(second.centre_mm[0] > 55.0 && (first.error_mm - 5.5).abs() < 1e-9, "{second:?}");
        let sum = first.area_cm2 + second.area_cm2;
        assert!((found.share() - sum / found.boundary_cm2).abs() < 1e-12);
    }

    #[test]
    fn places_are_named_from_the_patients_side() {
        let at = |x: f64, z: f64, side: Side| {
            place(&Point::new(x, 0.0, z), &Point::new(70.0 * side.sign(), 0.0, 0.0), side)
        };
        assert_eq!(at(100.0, 30.0, Side::Left), "upper outer quadrant");
        assert_eq!(at(-100.0, -30.0, Side::Right), "lower outer quadrant");
        assert_eq!(at(-30.0, 40.0, Side::Right), "upper inner quadrant");
        assert_eq!(at(75.0, 3.0, Side::Left), "behind the middle of the breast");
        assert_eq!(at(65.0, -40.0, Side::Left), "below the middle of the breast");
    }

    #[test]
    fn outside_the_region_nothing_counts() {
        let (labels, map) = limb(|p| p.y > 0.0);
        let region = Sphere::new(Point::new(0.0, -60.0, 75.0), 40.0).unwrap();
        let found = wall_uncertainty(&labels, &map, region, FROM);
        assert!(found.patches.is_empty() && found.share() == 0.0, "{found:?}");
        assert!((35.0..60.0).contains(&found.boundary_cm2), "{}", found.boundary_cm2);
    }
}
