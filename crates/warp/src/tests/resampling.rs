//! Fields that are cropped to what moves and led on into the air that tissue left.

use super::fixture::{lattice, moved, still};
use crate::{
    Fields, MovingPart, Params, carry_points, consistency, fields, moving_part, resampling,
};
use std::sync::Arc;
use supine_mesh::{BoundaryTag, Deformation, Order, TetMesh};
use supine_space::{Grid, Matrix, Point, Progress, Vector};
use supine_volume::Volume;

/// A block of tissue of 60 x 40 x 40 mm, all of it skin.
fn block() -> Arc<TetMesh> {
    lattice([6, 4, 4], 10.0, Point::new(-30.0, -20.0, -20.0), |_| BoundaryTag::Skin)
}

fn within(p: Point) -> bool {
    p.x.abs() < 30.0 && p.y.abs() < 20.0 && p.z.abs() < 20.0
}

fn params() -> Params {
    Params { fade_mm: Some(0.0), ..Params::default() }
}

fn shifted(by: Vector) -> Deformation {
    moved(&block(), Order::Linear, |_| by)
}

/// A turned grid whose box is `half` mm to each side of the origin.
fn grid(half: f64) -> Grid {
    let spacing = Vector::new(1.2, 1.5, 2.0);
    let (s, c) = 0.3f64.sin_cos();
    let turn = Matrix::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
    let size = [0, 1, 2].map(|a| (2.0 * half / spacing[a]) as usize + 1);
    Grid::new(size, spacing, Point::from(turn * Vector::repeat(-half)), turn).unwrap()
}

fn part_of(grid: &Grid, u: &Deformation) -> MovingPart {
    moving_part(grid, u, &params(), Progress::none()).unwrap()
}

fn at(v: [f32; 3]) -> Vector {
    Vector::from(v.map(f64::from))
}

/// Calls `see` with each voxel of `whole`, and with where it lies in `part`.
fn each(whole: &Grid, part: &Grid, mut see: impl FnMut(usize, Option<usize>)) {
    let first = whole.index_from_patient(&part.origin());
    assert!(first.iter().all(|n| (n - n.round()).abs() < 1e-9), "whole voxels: {first:?}");
    for n in 0..whole.len() {
        let voxel = whole.voxel(n);
        let at = [0, 1, 2].map(|a| voxel[a].wrapping_sub(first[a].round() as usize));
        let held = (0..3).all(|a| at[a] < part.size()[a]);
        see(n, held.then(|| part.offset(at)));
    }
}

#[test]
fn the_part_holds_all_that_moves_and_its_border_does_not() {
    let (whole, u) = (grid(60.0), shifted(Vector::new(2.0, -9.0, 3.0)));
    let all = fields(&whole, &u, &params(), Progress::none()).unwrap();
    let MovingPart { fields: own, resampling, points } = part_of(&whole, &u);
    let part = resampling.grid();
    assert!(own.jacobian().grid() == part && 3 * part.len() < whole.len(), "{:?}", part.size());
    let near = |a: [f32; 3], b: [f32; 3]| (at(a) - at(b)).norm() < 1e-5;
    each(&whole, part, |n, m| {
        let (back, forth) = (all.deformed_to_ct().data()[n], all.ct_to_deformed().data()[n]);
        let Some(m) = m else {
            assert!(back == [0.0; 3] && forth == [0.0; 3] && all.jacobian().data()[n] == 1.0);
            return;
        };
        assert!(near(own.deformed_to_ct().data()[m], back), "{n}");
        assert!(near(own.ct_to_deformed().data()[m], forth), "{n}");
        assert!((own.jacobian().data()[m] - all.jacobian().data()[n]).abs() < 1e-6, "{n}");
        if back != [0.0; 3] {
            assert!(near(resampling.data()[m], back), "in the mesh it is the map: {n}");
        }
    });
    for n in 0..part.len() {
        let (voxel, size) = (part.voxel(n), part.size());
        if (0..3).any(|a| voxel[a] == 0 || voxel[a] == size[a] - 1) {
            assert_eq!(resampling.data()[n], [0.0; 3], "{voxel:?}");
            assert_eq!(own.ct_to_deformed().data()[n], [0.0; 3], "{voxel:?}");
            assert_eq!(own.jacobian().data()[n], 1.0, "{voxel:?}");
            assert_eq!(points.data()[n], [0.0; 3], "{voxel:?}");
        }
    }
    // How well fields undo each other is said of the map, wherever it is cropped.
    let (cropped, whole) = (consistency(&own).unwrap(), consistency(&all).unwrap());
    assert_eq!(cropped.voxels, whole.voxels);
    assert!((cropped.max_mm - whole.max_mm).abs() < 1e-5, "{cropped:?} {whole:?}");
}

/// Trilinear, as other programs read fields; 0 beyond them.
fn sampled(field: &Volume<[f32; 3]>, p: Point) -> Vector {
    let (index, size) = (field.grid().index_from_patient(&p), field.grid().size());
    if (0..3).any(|a| index[a] < 0.0 || index[a] > (size[a] - 1) as f64) {
        return Vector::zeros();
    }
    Vector::from(supine_volume::sample_vector(field, index))
}

/// A block that goes 9 mm one way leaves 9 mm of air behind: between voxels too, nothing there may
/// lead into the block that was, and all places in the block that is must.
#[test]
fn vectors_lead_to_air_where_tissue_left() {
    let by = Vector::new(2.0, -9.0, 3.0);
    let (whole, u) = (grid(60.0), shifted(by));
    let MovingPart { fields: own, resampling, .. } = part_of(&whole, &u);
    // Places that were left, those of them that show the block, places beside both that show it,
    // tissue that is not shown.
    let seen = |field: &Volume<[f32; 3]>| {
        let mut counts = [0; 4];
        for n in 0..50 * 50 * 50 {
            let p = Point::new(-47.3, -41.7, -43.1)
                + Vector::new(f64::from(n % 50), f64::from(n / 50 % 50), f64::from(n / 2500)) * 1.9;
            let (was, is, shows) = (within(p), within(p - by), within(p + sampled(field, p)));
            let met = [was && !is, was && !is && shows, !was && !is && shows, is && !shows];
            (0..4).for_each(|c| counts[c] += i32::from(met[c]));
        }
        counts
    };
    let [left, ghost, ..] = seen(own.deformed_to_ct());
    assert!(left > 3000 && ghost > left / 2, "the map alone leaves {ghost} of {left}");
    let [_, ghost, beside, missing] = seen(&resampling);
    assert!(ghost == 0 && missing == 0, "{ghost} and {missing}");
    // Where the vectors end, in the air at the edges of the block, shorter ones than those of its
    // tissue meet it.
    assert!(beside < left / 40, "{beside} of {left}");
}

/// Points on the skin, under it and on a mark beside it: the vectors between voxels move them as
/// they are carried.
#[test]
fn a_point_at_the_skin_goes_between_voxels_where_it_is_carried() {
    let (whole, by) = (grid(60.0), Vector::new(2.0, -9.0, 3.0));
    let stretch = Vector::new(0.1, -0.1, 0.05);
    let u = moved(&block(), Order::Linear, |p| p.coords.component_mul(&stretch) + by);
    let MovingPart { fields: own, points: field, .. } = part_of(&whole, &u);
    let at_skin: Vec<Point> = (-2..=4)
        .flat_map(|off| (0..40).map(move |n| (f64::from(off), f64::from(n))))
        .map(|(off, n)| Point::new(1.3 * n - 25.0, -20.0 - off, 7.0 * (0.7 * n).sin()))
        .collect();
    let carried = carry_points(&u, &params(), &at_skin).unwrap();
    let worst = |field: &Volume<[f32; 3]>| {
        let off = |(p, after): (&Point, &Option<Point>)| {
            (p + sampled(field, *p) - after.expect("within the collar")).norm()
        };
        at_skin.iter().zip(&carried).map(off).fold(0.0, f64::max)
    };
    let (alone, led_on) = (worst(own.ct_to_deformed()), worst(&field));
    assert!(alone > 5.0, "the map alone is off by {alone} mm");
    // The layer beside the skin is rigid, the tissue stretches: within a cell the vectors have a
    // kink at the skin.
    assert!(led_on < 0.15, "{led_on} mm");
    for n in 0..field.grid().len() {
        let (map, vector) = (own.ct_to_deformed().data()[n], field.data()[n]);
        assert!(map == [0.0; 3] || map == vector, "in the mesh it is the map");
    }
}

/// On a grid of its own the same vectors, cropped to themselves.
#[test]
fn vectors_alone_are_those_of_the_part() {
    let (whole, u) = (grid(60.0), shifted(Vector::new(2.0, -9.0, 3.0)));
    let alone = resampling(&whole, &u, &params(), Progress::none()).unwrap();
    let with = part_of(&whole, &u).resampling;
    let mut moved = 0;
    each(with.grid(), alone.grid(), |n, m| {
        let vector = m.map_or([0.0; 3], |m| alone.data()[m]);
        assert_eq!(vector, with.data()[n]);
        moved += usize::from(vector != [0.0; 3]);
    });
    assert_eq!(moved, alone.data().iter().filter(|v| **v != [0.0; 3]).count());
}

#[test]
fn where_nothing_moves_the_fields_are_small_and_zero() {
    let whole = grid(60.0);
    let rests = still(&block());
    // The second lies beside the grid.
    let beside = whole.crop([0; 3], [3, 4, 5]).unwrap();
    for (grid, u) in [(&whole, rests), (&beside, shifted(Vector::new(1.0, 0.0, 0.0)))] {
        let MovingPart { fields, resampling, points } = part_of(grid, &u);
        assert_eq!(resampling.grid().size(), [2; 3]);
        let zero = |field: &Volume<[f32; 3]>| field.data().iter().all(|v| *v == [0.0; 3]);
        assert!(
            zero(&resampling) && zero(fields.deformed_to_ct()) && zero(fields.ct_to_deformed())
        );
        assert!(zero(&points));
        assert!(fields.jacobian().data().iter().all(|det| *det == 1.0));
        assert_eq!(consistency(&fields), None);
    }
    let on = |n: usize| Volume::from_fn(grid(n as f64), |_| [0f32; 3]);
    let ones = on(5).map(|_| 1.0);
    assert!(Fields::new(on(5), on(6), ones).is_err(), "several grids");
}
