//! Level functions of surfaces that are known between the voxels.

use crate::boundary::{Boundary, SKIN, WALL};
use crate::fields::{Fields, Smoothing};
use crate::{Info, labels};
use std::sync::Arc;
use supine_space::{Grid, Matrix, Point, Sphere, Vector};
use supine_volume::{LabelMap, Region, SignedDistance, Surfaces, Volume, label};

/// Voxels of a usual thorax CT, and a region within.
fn grid() -> Grid {
    let (size, spacing) = ([50, 50, 30], Vector::new(1.4, 1.4, 3.0));
    let origin = Point::new(-34.3, -34.3, -43.5);
    Grid::new(size, spacing, origin, Matrix::identity()).unwrap()
}

fn sphere() -> Sphere {
    Sphere::new(Point::origin(), 26.0).unwrap()
}

/// About mm outside the skin, a dome; the patient's front is -y.
fn skin(p: &Point) -> f64 {
    1.0 - 12.0 * (-(p.x * p.x + p.z * p.z) / 500.0).exp() - p.y
}

/// About mm outside the chest wall, a gentle wave.
fn wall(p: &Point) -> f64 {
    10.0 + 0.8 * (p.z / 9.0).sin() - p.y
}

/// A lump of soft tissue apart from the patient, and a bubble of air in her.
const ISLAND: Point = Point::new(0.0, -20.0, 0.0);
const BUBBLE: Point = Point::new(0.0, 2.0, 0.0);

/// The surface of `f`, negative inside.
fn surface(f: impl Fn(&Point) -> f64 + Sync) -> SignedDistance {
    let grid = grid();
    let at = |n: usize| f(&grid.centre(grid.voxel(n)));
    let crossing = |n: usize, m: usize| (at(n) / (at(n) - at(m))) as f32;
    SignedDistance::new(&grid, 5.0, |n| at(n) < 0.0, crossing)
}

fn with_lumps(p: &Point) -> f64 {
    let (lump, bubble) = ((p - ISLAND).norm() - 3.5, 3.5 - (p - BUBBLE).norm());
    skin(p).min(lump).max(bubble)
}

fn surfaces() -> Surfaces {
    Surfaces { skin: surface(with_lumps), chest_wall: surface(wall) }
}

fn labelled(surfaces: &Surfaces) -> LabelMap {
    let grid = grid();
    Volume::from_fn(grid.clone(), |v| {
        let n = grid.offset(v);
        if surfaces.chest_wall.is_inside(n) {
            label::CHEST_WALL
        } else if surfaces.skin.is_inside(n) {
            label::SOFT_TISSUE
        } else {
            label::OUTSIDE
        }
    })
}

/// Mean |level| on the true skin and chest wall, mm.
fn off(fields: &Fields) -> [f64; 2] {
    let (mut sums, mut count) = ([0.0; 2], 0.0);
    for n in 0..900 {
        let (x, z) = (f64::from(n % 30) - 14.5, f64::from(n / 30) - 14.5);
        let at = |f: &dyn Fn(&Point) -> f64| Vector::new(x, f(&Point::new(x, 0.0, z)), z);
        sums[0] += fields.level(SKIN, &at(&skin)).abs();
        sums[1] += fields.level(WALL, &at(&wall)).abs();
        count += 1.0;
    }
    sums.map(|s| s / count)
}

#[test]
fn levels_lie_on_known_surfaces() {
    let surfaces = surfaces();
    let labels = labelled(&surfaces);
    let region = Region::new(Arc::new(labels.clone()), sphere()).unwrap();
    let kinds = labels::kinds(&region, crate::Piece::Largest, 12.0, &mut Info::new()).unwrap();
    let fields = |smoothing| Fields::new(&kinds, sphere(), smoothing, 1.0).unwrap();
    let known = off(&fields(Smoothing::Known(&surfaces, 1.0)));
    let smoothed = off(&fields(Smoothing::Labels(2.7)));
    assert!(known[0] < 0.1 && known[1] < 0.1, "{known:?}");
    assert!(known[0] < smoothed[0] && 2.0 * known[1] < smoothed[1], "{known:?} {smoothed:?}");
}

#[test]
fn what_the_voxels_became_wins_over_the_surfaces() {
    let surfaces = surfaces();
    let labels = labelled(&surfaces);
    let here = |p: &Point| grid().offset(grid().voxel_at(p).unwrap());
    assert!(surfaces.skin.is_inside(here(&ISLAND)) && !surfaces.skin.is_inside(here(&BUBBLE)));
    let region = Region::new(Arc::new(labels.clone()), sphere()).unwrap();
    let kinds = labels::kinds(&region, crate::Piece::Largest, 12.0, &mut Info::new()).unwrap();
    let fields = Fields::new(&kinds, sphere(), Smoothing::Known(&surfaces, 1.0), 1.0).unwrap();
    assert!(fields.level(SKIN, &ISLAND.coords) > 2.0, "the lump was dropped");
    assert!(fields.level(SKIN, &BUBBLE.coords) < -2.0, "the bubble was filled");
}

#[test]
fn surfaces_of_another_grid_are_refused() {
    let surfaces = surfaces();
    let labels = labelled(&surfaces);
    let part = grid().crop([0, 0, 0], [50, 50, 29]).unwrap();
    let other = SignedDistance::new(&part, 5.0, |n| n % 2 == 0, |_, _| 0.5);
    let other = Surfaces { skin: other, ..surfaces };
    let error = Region::new(Arc::new(labels.clone()), sphere())
        .unwrap()
        .with_surfaces(Arc::new(other.clone()))
        .unwrap_err();
    assert!(error.to_string().contains("[50, 50, 29]"), "{error}");
}
