//! Label maps, doses, surfaces and the consistency of fields on maps that are known in closed form.

use super::fixture::{lattice, moved, still};
use crate::{
    BeyondGrid, CarriedDose, Fields, Origins, Params, carry_dose, carry_labels, carry_mask,
    carry_surface, cell_mm, consistency, dose_totals, fields, interpolation_error,
};
use std::sync::Arc;
use supine_mesh::{BoundaryTag, Deformation, Order, TetMesh, TriSurface};
use supine_space::{Grid, Matrix, Point, Progress, Vector};
use supine_volume::{Volume, sample_trilinear_at};

/// A block of tissue of 60 x 40 x 40 mm, all of it skin.
fn block() -> Arc<TetMesh> {
    lattice([6, 4, 4], 10.0, Point::new(-30.0, -20.0, -20.0), |_| BoundaryTag::Skin)
}

fn params() -> Params {
    Params { fade_mm: Some(0.0), ..Params::default() }
}

/// A stretch by the given factors about the origin, and a shift.
fn affine(mesh: &Arc<TetMesh>, factors: [f64; 3], shift: [f64; 3]) -> Deformation {
    let by = Vector::from(factors.map(|f| f - 1.0));
    moved(mesh, Order::Quadratic, |p| p.coords.component_mul(&by) + Vector::from(shift))
}

fn grid(spacing: f64, half: f64) -> Grid {
    let n = (2.0 * half / spacing) as usize + 1;
    let (s, c) = 0.3f64.sin_cos();
    let turn = Matrix::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
    let origin = turn * Vector::repeat(-half);
    Grid::new([n; 3], Vector::repeat(spacing), Point::from(origin), turn).unwrap()
}

/// Level of an ellipsoid: below 0 inside.
fn ball(p: Point, centre: [f64; 3], radii: [f64; 3]) -> f64 {
    let away = p - Point::from(centre);
    (0..3).map(|a| (away[a] / radii[a]).powi(2)).sum::<f64>() - 1.0
}

#[test]
fn labels_go_with_the_tissue_and_are_never_mixed() {
    let mesh = block();
    let u = affine(&mesh, [1.1, 0.9, 1.0], [3.0, 0.0, 1.5]);
    let grid = grid(1.0, 45.0);
    let centre = [8.0, 2.0, -4.0];
    let labels = Volume::from_fn(grid.clone(), |v| {
        if ball(grid.centre(v), centre, [9.0; 3]) < 0.0 { 900u16 } else { 7 }
    });
    let origins = Origins::new(&grid, &u, &params(), 0.0, Progress::none()).unwrap();
    let carried = carry_labels(&labels, &origins, Progress::none()).unwrap();
    let (moved, radii) = ([8.0 * 1.1 + 3.0, 2.0 * 0.9, -2.5], [9.0 * 1.1, 8.1, 9.0]);
    let mut inside = 0;
    for (n, &label) in carried.data().iter().enumerate() {
        let p = grid.centre(grid.voxel(n));
        assert!([0, 7, 900].contains(&label), "{label} at {p}");
        let level = ball(p, moved, radii);
        // Nearest: half a voxel of the label map, some more along the diagonal.
        if level.abs() > 0.25 {
            assert_eq!(label == 900, level < 0.0, "{label} at {p}, level {level}");
        }
        inside += usize::from(label == 900);
        let left = (18.1..19.9).contains(&p.y.abs()) && p.x.abs() < 29.9 && p.z.abs() < 19.9;
        assert!(!left || label == 0, "tissue left {p}");
    }
    let want = 4.0 / 3.0 * std::f64::consts::PI * radii.iter().product::<f64>();
    assert!((inside as f64 / want - 1.0).abs() < 0.02, "{inside} mm³ for {want}");
    let still = Origins::new(&grid, &still(&mesh), &params(), 2.0, Progress::none());
    assert_eq!(carry_labels(&labels, &still.unwrap(), Progress::none()).unwrap(), labels);
}

/// Voxels that hold in both, twice, as a share of those that hold in either (Dice).
fn dice(a: &Volume<bool>, b: &Volume<bool>) -> f64 {
    let count = |v: &Volume<bool>| v.data().iter().filter(|held| **held).count() as f64;
    let both = a.data().iter().zip(b.data()).filter(|(a, b)| **a && **b).count() as f64;
    2.0 * both / (count(a) + count(b))
}

#[test]
fn masks_keep_their_volume_between_thick_slices() {
    let mesh = block();
    let turn = Matrix::identity();
    let size = [60, 60, 30];
    let grid = Grid::new(size, Vector::new(1.5, 1.5, 3.0), Point::new(-44.0, -44.5, -43.8), turn);
    let grid = grid.unwrap();
    let (mut worst, mut agreed) = ([0.0f64; 2], [0.0; 2]);
    for shift in [0.0, 0.4, 0.9, 1.3, 1.5, 1.7, 2.2, 2.6] {
        for radii in [[6.0; 3], [11.0; 3], [14.0, 9.0, 2.2]] {
            let factors = [1.0, 1.03, 0.95];
            let u = affine(&mesh, factors, [0.3 * shift, 0.0, shift]);
            let centre = [5.0, -4.0, 2.0];
            let mask = |centre: [f64; 3], radii: [f64; 3]| {
                Volume::from_fn(grid.clone(), |v| ball(grid.centre(v), centre, radii) < 0.0)
            };
            let given = mask(centre, radii);
            let origins = Origins::new(&grid, &u, &params(), 0.0, Progress::none()).unwrap();
            let carried = carry_mask(&given, &origins, Progress::none()).unwrap();
            let nearest = carry_labels(&given, &origins, Progress::none()).unwrap();
            let truth = mask(
                [0, 1, 2].map(|a| centre[a] * factors[a] + [0.3 * shift, 0.0, shift][a]),
                [0, 1, 2].map(|a| radii[a] * factors[a]),
            );
            let voxels = |v: &Volume<bool>| v.data().iter().filter(|held| **held).count() as f64;
            let wanted = voxels(&given) * factors.iter().product::<f64>();
            let off = |v: &Volume<bool>| (voxels(v) / wanted - 1.0).abs();
            let allowed = if radii[2] < 3.0 { 0.05 } else { 0.02 };
            assert!(off(&carried) < allowed, "{radii:?} {shift}: {}", off(&carried));
            agreed = [agreed[0] + dice(&carried, &truth), agreed[1] + dice(&nearest, &truth)];
            worst = [worst[0].max(off(&carried)), worst[1].max(off(&nearest))];
        }
    }
    let better = worst[1] > 3.0 * worst[0] && agreed[0] > agreed[1] + 0.3;
    assert!(better, "no better than the nearest: {worst:?} {agreed:?} of 24");
    let still = Origins::new(&grid, &still(&mesh), &params(), 2.0, Progress::none());
    let mask = Volume::from_fn(grid.clone(), |v| ball(grid.centre(v), [1.0; 3], [12.0; 3]) < 0.0);
    assert_eq!(carry_mask(&mask, &still.unwrap(), Progress::none()).unwrap(), mask);
    let none = mask.map(|_| false);
    let u = affine(&mesh, [1.0; 3], [0.0, 0.0, 4.0]);
    let origins = Origins::new(&grid, &u, &params(), 0.0, Progress::none()).unwrap();
    assert_eq!(carry_mask(&none, &origins, Progress::none()).unwrap(), none);
}

#[test]
fn a_rim_of_labels_beside_the_skin_goes_along() {
    let mesh = block();
    let u = affine(&mesh, [1.0; 3], [0.0, 0.0, 4.0]);
    let grid = grid(1.0, 45.0);
    // Labels that reach 0.8 mm beyond the mesh on every side.
    let labels = |shift: f64| {
        Volume::from_fn(grid.clone(), |v| {
            let p = grid.centre(v) - Vector::new(0.0, 0.0, shift);
            u16::from(p.x.abs() < 30.8 && p.y.abs() < 20.8 && p.z.abs() < 20.8)
        })
    };
    let wrong = |layer_mm| {
        let origins = Origins::new(&grid, &u, &params(), layer_mm, Progress::none());
        let carried = carry_labels(&labels(0.0), &origins.unwrap(), Progress::none()).unwrap();
        let wanted = labels(4.0);
        let pairs = carried.data().iter().zip(wanted.data());
        pairs.filter(|(a, b)| a != b).count()
    };
    let all = labels(0.0).data().iter().filter(|&&l| l == 1).count();
    let (without, with) = (wrong(0.0), wrong(1.7));
    assert!(without > all / 40, "a rim stays behind without the layer: {without} of {all}");
    assert!(with < all / 500, "{with} of {all}");
}

#[test]
fn labels_come_out_on_another_grid() {
    let mesh = block();
    let u = affine(&mesh, [1.0; 3], [0.0, 5.0, 0.0]);
    let (coarse, fine) = (grid(2.0, 44.0), grid(1.1, 38.0));
    let labels = Volume::from_fn(coarse.clone(), |v| {
        u16::from(ball(coarse.centre(v), [0.0; 3], [12.0; 3]) < 0.0)
    });
    let origins = Origins::new(&fine, &u, &params(), 0.0, Progress::none()).unwrap();
    let carried = carry_labels(&labels, &origins, Progress::none()).unwrap();
    assert_eq!(carried.grid(), &fine);
    let inside: Vec<Vector> = (0..fine.len())
        .filter(|&n| carried.data()[n] == 1)
        .map(|n| fine.centre(fine.voxel(n)).coords)
        .collect();
    let centre = inside.iter().sum::<Vector>() / inside.len() as f64;
    assert!((centre - Vector::new(0.0, 5.0, 0.0)).norm() < 0.2, "{centre}");
}

#[test]
fn a_dose_is_that_of_the_tissue_up_to_the_skin() {
    let mesh = block();
    let u = affine(&mesh, [1.0, 1.0, 0.8], [4.0, 0.0, 0.0]);
    let within = |p: Point, more: f64| {
        let half = [30.0, 20.0, 20.0].map(|half| half + more);
        (0..3).all(|a| p[a].abs() < half[a])
    };
    let ct = grid(1.0, 60.0);
    let ct = Volume::from_fn(ct.clone(), |v| if within(ct.centre(v), 0.0) { 0i16 } else { -1000 });
    let grid = grid(2.5, 50.0);
    let planned =
        |p: Point| 50.0 * (-(p - Point::new(12.0, 0.0, 5.0)).norm_squared() / 1250.0).exp();
    let origins = Origins::new(&grid, &u, &params(), cell_mm(&grid), Progress::none()).unwrap();
    // As far as it was computed: everywhere, in the tissue alone as planning systems do, or not
    // quite up to the skin. What goes on into the air then goes on straight.
    for (more, gy) in [(f64::INFINITY, 0.5), (0.0, 0.7), (-1.0, 0.7)] {
        let dose = Volume::from_fn(grid.clone(), |v| {
            let p = grid.centre(v);
            if within(p, more) { planned(p) as f32 } else { 0.0 }
        });
        let CarriedDose { carried, planned: before, .. } =
            carry_dose(&dose, Some(&ct), &origins, Progress::none()).unwrap();
        let (mut off, mut all) = (0usize, 0usize);
        for n in 0..60 * 40 * 40 {
            let at = [n % 60, n / 60 % 40, n / 2400].map(|i| i as f64 + 0.5);
            let source = Point::new(at[0] - 30.0, at[1] - 20.0, at[2] - 20.0);
            let place = Point::new(source.x + 4.0, source.y, 0.8 * source.z);
            let want = planned(source);
            let found = f64::from(sample_trilinear_at(&carried, &place));
            let kept = f64::from(sample_trilinear_at(&before, &source));
            all += 1;
            off += usize::from((found - want).abs() > gy);
            assert!((found - want).abs() < 1.0, "{found}, not {want}, at {source}");
            assert!((kept - want).abs() < 1.0, "{kept} before, not {want}, at {source}");
        }
        assert!(off * 1000 < all, "{off} of {all}");
        // Away from the skin the air has what it had.
        let corner = grid.centre([1, 1, 1]);
        assert_eq!(carried.at([1, 1, 1]), dose.at([1, 1, 1]), "{corner}");
    }
}

#[test]
fn a_dose_is_carried_and_its_sums_are_told() {
    let mesh = block();
    let u = affine(&mesh, [1.0, 1.0, 0.8], [4.0, 0.0, 0.0]);
    let grid = grid(1.5, 45.0);
    let level = |p: Point| 20.0 + 0.3 * p.x - 0.2 * p.y + 0.1 * p.z;
    let inside = |p: Point| ball(p, [0.0; 3], [17.0; 3]) < 0.0;
    let dose = Volume::from_fn(grid.clone(), |v| level(grid.centre(v)) as f32);
    let origins = Origins::new(&grid, &u, &params(), 0.0, Progress::none()).unwrap();
    let carried = carry_dose(&dose, None, &origins, Progress::none()).unwrap().carried;
    for (n, &d) in carried.data().iter().enumerate() {
        let p = grid.centre(grid.voxel(n));
        let source = Point::new(p.x - 4.0, p.y, p.z / 0.8);
        if inside(source) {
            assert!((f64::from(d) - level(source)).abs() < 1e-3, "{d} at {p}");
        }
    }
    // A dose within the tissue alone, in water: volume and energy shrink with the tissue.
    let dose = Volume::from_fn(grid.clone(), |v| if inside(grid.centre(v)) { 50.0 } else { 0.0 });
    let ct = Volume::from_fn(self::grid(2.0, 48.0), |_| 0i16);
    let carried = carry_dose(&dose, None, &origins, Progress::none()).unwrap().carried;
    let totals = dose_totals([&dose, &carried], &origins, Some(&ct));
    let [before, after] = totals.volume_gy_ml;
    assert!((before / (50.0 * 4.0 / 3.0 * std::f64::consts::PI * 4.913) - 1.0).abs() < 0.01);
    assert!((after / before - 0.8).abs() < 0.005, "{totals:?}");
    let sum: f64 = carried.data().iter().map(|&d| f64::from(d)).sum();
    assert!((totals.written_gy_ml - sum * grid.voxel_volume() / 1000.0).abs() < 1e-9);
    let energy = totals.energy_mj.unwrap();
    assert!((energy[0] - before).abs() < 1e-6 * before && (energy[1] - after).abs() < 1e-6 * after);
    let lung = ct.map(|_| -700i16);
    let energy = dose_totals([&dose, &carried], &origins, Some(&lung)).energy_mj.unwrap();
    assert!((energy[0] / before - 0.3).abs() < 1e-4, "{energy:?}");
    assert_eq!(dose_totals([&dose, &carried], &origins, None).energy_mj, None);
}

/// A grid that ends within the tissue: what crosses its edge is told.
#[test]
fn a_dose_whose_grid_is_too_small_says_so() {
    let mesh = block();
    let u = affine(&mesh, [1.0, 1.0, 1.0], [4.0, 0.0, 0.0]);
    let beyond = |grid: &Grid, dose: f32| {
        let dose = Volume::from_fn(grid.clone(), |_| dose);
        let origins = Origins::new(grid, &u, &params(), 0.0, Progress::none()).unwrap();
        carry_dose(&dose, None, &origins, Progress::none()).unwrap().beyond
    };
    let small = beyond(&grid(1.5, 9.0), 20.0);
    // The axes are turned by 0.3: 4 mm are 2.5 voxels along one and 0.8 along another, of 13.
    let entered = f64::from(13 * 13 - (13 - 3) * (13 - 1)) * 13.0 * 1.5f64.powi(3) / 1000.0;
    assert!((small.entered_ml - entered).abs() < 1e-9, "{small:?}, not {entered}");
    assert_eq!((small.edge_gy, small.left_gy), (20.0, 20.0));
    assert_eq!(beyond(&grid(1.5, 45.0), 20.0).entered_ml, 0.0);
    assert_eq!(beyond(&grid(1.5, 9.0), 0.0), BeyondGrid::default());
}

/// A ball from a cube whose faces are grids of `n` x `n`.
fn sphere(centre: Point, radius: f64, n: u32) -> TriSurface {
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for face in 0..6 {
        let first = points.len() as u32;
        let (axis, sign) = (face % 3, if face < 3 { 1.0 } else { -1.0 });
        for j in 0..=n {
            for i in 0..=n {
                let at = |m: u32| {
                    (std::f64::consts::FRAC_PI_4 * (2.0 * f64::from(m) / f64::from(n) - 1.0)).tan()
                };
                let mut v = Vector::zeros();
                (v[axis], v[(axis + 1) % 3], v[(axis + 2) % 3]) = (sign, sign * at(i), at(j));
                // Rounded, so that the faces share the points of their edges.
                let p = v.normalize() * radius;
                points.push(centre + p.map(|c| (c * 1e6).round() / 1e6));
            }
        }
        for j in 0..n {
            for i in 0..n {
                let at = |i, j| first + j * (n + 1) + i;
                triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    TriSurface::new(points, triangles).unwrap()
}

#[test]
fn a_surface_under_an_affine_map_is_exact() {
    let mesh = block();
    let u = affine(&mesh, [1.1, 0.9, 0.95], [3.0, -2.0, 1.0]);
    let ball = sphere(Point::new(2.0, 1.0, 0.0), 15.0, 12);
    let (surface, carried) = carry_surface(&ball, &u, &params(), Progress::none()).unwrap();
    assert_eq!(carried.moved_points, ball.points().len());
    for (p, q) in ball.points().iter().zip(surface.points()) {
        let want = Point::new(p.x * 1.1 + 3.0, p.y * 0.9 - 2.0, p.z * 0.95 + 1.0);
        assert!((q - want).norm() < 1e-9, "{q} for {want}");
    }
    let [before, after] = carried.volume_ml;
    assert!((after / before - 1.1 * 0.9 * 0.95).abs() < 1e-9, "{before} {after}");
}

#[test]
fn long_sides_are_split_until_they_follow_the_curve() {
    let mesh = block();
    let bend = |p: Point| Vector::new(0.0, 0.004 * p.x * p.x, 0.0);
    let u = moved(&mesh, Order::Quadratic, bend);
    // A box with sides as long as it is.
    let corner = |n: usize| {
        let side = |bit: usize, half: f64| if n >> bit & 1 == 1 { half } else { -half };
        Point::new(side(0, 28.0), side(1, 8.0), side(2, 8.0))
    };
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
    let solid = TriSurface::new((0..8).map(corner).collect(), triangles.collect()).unwrap();
    let (surface, carried) = carry_surface(&solid, &u, &params(), Progress::none()).unwrap();
    assert!(carried.added_points > 100, "{}", carried.added_points);
    for triangle in surface.triangles() {
        let [a, b, _] = triangle.map(|p| surface.points()[p as usize]);
        let middle = a + (b - a) * 0.5;
        // The face of the box that the side belongs to, if it is one of those that bend.
        for level in [-8.0, 8.0] {
            let off = |p: Point| p.y - bend(p).y - level;
            if off(a).abs() < 1e-6 && off(b).abs() < 1e-6 {
                assert!(off(middle).abs() < 0.11, "{middle}: {}", off(middle));
            }
        }
    }
    // A shear of each slice keeps the volume.
    assert!(
        (carried.volume_ml[1] / carried.volume_ml[0] - 1.0).abs() < 2e-3,
        "{:?}",
        carried.volume_ml
    );
}

#[test]
fn a_surface_beyond_reach_stays() {
    let mesh = block();
    let u = affine(&mesh, [1.0; 3], [5.0, 0.0, 0.0]);
    let far = sphere(Point::new(200.0, 0.0, 0.0), 20.0, 6);
    let (surface, carried) = carry_surface(&far, &u, &params(), Progress::none()).unwrap();
    assert_eq!((carried.moved_points, carried.added_points), (0, 0));
    assert_eq!(surface.points(), far.points());
}

#[test]
fn consistent_fields_are_told_from_others() {
    let mesh = block();
    let bent = |p: Point| {
        let wave = (p.x * 0.1).sin() * 1.5;
        Vector::new(2.0 + 0.05 * p.y, wave, 1.0 + 0.03 * p.x)
    };
    let u = moved(&mesh, Order::Quadratic, bent);
    let grid = grid(1.0, 45.0);
    let fields = fields(&grid, &u, &params(), Progress::none()).unwrap();
    let good = consistency(&fields).unwrap();
    assert!(good.voxels > 50_000, "{good:?}");
    assert!(good.max_mm < 0.05 && good.p99_mm <= good.max_mm, "{good:?}");
    assert!(good.mean_mm < good.p99_mm, "{good:?}");
    // A field of the wrong sign, and one that is a tenth too long.
    let with = |factor: f32| {
        let back = fields.deformed_to_ct().map(|v| v.map(|c| factor * c));
        let (forth, dets) = (fields.ct_to_deformed().clone(), fields.jacobian().clone());
        consistency(&Fields::new(back, forth, dets).unwrap())
    };
    assert_eq!(with(1.0), Some(good));
    assert!(with(-1.0).unwrap().mean_mm > 2.0);
    let long = with(1.1).unwrap();
    assert!(long.mean_mm > 0.15 && long.p99_mm < 1.0, "{long:?}");
    let none = crate::fields(&grid, &still(&mesh), &params(), Progress::none()).unwrap();
    assert_eq!(consistency(&none), None);
}

/// Vectors linear in the place are the same between any places.
#[test]
fn coarser_vectors_are_held_against_the_fields() {
    let mesh = block();
    let u = affine(&mesh, [1.1, 0.9, 1.0], [3.0, 0.0, 1.5]);
    let fields = fields(&grid(1.0, 45.0), &u, &params(), Progress::none()).unwrap();
    let back = |p: Point| {
        let from = Vector::new((p.x - 3.0) / 1.1, p.y / 0.9, p.z - 1.5);
        let way = from - p.coords;
        [way.x as f32, way.y as f32, way.z as f32]
    };
    let coarse = grid(7.0, 49.0);
    let vectors = Volume::from_fn(coarse.clone(), |v| back(coarse.centre(v)));
    let moved = fields.deformed_to_ct().data().iter().filter(|v| **v != [0.0; 3]).count();
    let exact = interpolation_error(&vectors, &fields).unwrap();
    assert_eq!(exact.voxels, moved);
    assert!(exact.max_mm < 1e-4, "{exact:?}");
    let long = vectors.map(|v| [v[0] + 0.3, v[1], v[2]]);
    assert!((interpolation_error(&long, &fields).unwrap().mean_mm - 0.3).abs() < 1e-4);
}
