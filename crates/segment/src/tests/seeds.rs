//! What the user says is never overruled.

use super::phantom::{APEX, Thorax, Truth};
use super::{at, ready};
use crate::{Error, SeedKind, Seeds, Segmenter};
use std::sync::Arc;
use supine_space::{Grid, Matrix, Point, Progress, Vector};
use supine_volume::{LabelMap, Volume, label};

fn run(of: &Segmenter, seeds: &Seeds) -> Result<Arc<LabelMap>, Error> {
    Ok(of.segment(seeds, Progress::none())?.0.labels)
}

/// Numbers from 0 to 1 (splitmix64).
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((x ^ (x >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn point(&mut self) -> Point {
        let mut within = |half: f64| (2.0 * self.next() - 1.0) * half;
        Point::new(within(150.0), within(120.0), within(75.0))
    }
}

fn obeyed(labels: &LabelMap, seeds: &Seeds) {
    let kinds = [SeedKind::ChestWall, SeedKind::SoftTissue, SeedKind::Exclude];
    for (kind, want) in kinds.into_iter().zip([label::CHEST_WALL, label::SOFT_TISSUE, 0]) {
        for p in seeds.points(kind) {
            assert_eq!(at(labels, p), want, "{kind:?} {p}");
        }
        for map in &seeds.painted {
            for n in (0..map.grid().len()).filter(|&n| map.data()[n] == Some(kind)) {
                let p = map.grid().centre(map.grid().voxel(n));
                assert_eq!(at(labels, &p), want, "painted {kind:?} {p}");
            }
        }
    }
}

/// Behind this the muscles of the back end in a step that hides soft tissue from the axis, mm.
const STEP_MM: f64 = 10.0;

/// Balls of what is true in front of the step, on a cropped part of the CT's grid.
fn strokes(thorax: &Thorax, grid: &Grid, dice: &mut Dice) -> Volume<Option<SeedKind>> {
    let balls: Vec<Point> = (0..12).map(|_| dice.point()).collect();
    let part = grid.crop([10, 8, 3], [110, 100, 27]).unwrap();
    Volume::from_fn(part.clone(), |v| {
        let p = part.centre(v);
        let near = balls.iter().any(|b| (p - b).norm() < 9.0);
        let near = near && p.y < STEP_MM;
        match thorax.truth(&p) {
            Truth::Wall if near => Some(SeedKind::ChestWall),
            Truth::Soft if near => Some(SeedKind::SoftTissue),
            _ => None,
        }
    })
}

#[test]
fn seeds_of_the_truth_are_obeyed_to_the_voxel_whatever_their_number() {
    let thorax = Thorax::default();
    let ct = thorax.ct(Matrix::identity());
    let segmenter = ready(&ct);
    let mut dice = Dice(7);
    for round in 0..16 {
        let mut seeds = Seeds::default();
        for _ in 0..4 * (round % 5) {
            let p = dice.point();
            match thorax.truth(&p) {
                Truth::Wall if p.y < STEP_MM => seeds.chest_wall.push(p),
                Truth::Soft if p.y < STEP_MM => seeds.soft_tissue.push(p),
                _ => {}
            }
        }
        if round % 2 == 1 {
            seeds.painted.push(strokes(&thorax, ct.grid(), &mut dice));
        }
        match run(&segmenter, &seeds) {
            Ok(labels) => obeyed(&labels, &seeds),
            // Voxels whose point is true and whose centre belongs to the neighbour.
            Err(Error::SeedsContradict { why, .. }) => assert!(why.contains("one voxel"), "{why}"),
            Err(error) => panic!("{error}"),
        }
    }
}

#[test]
fn any_seeds_are_obeyed_or_refused() {
    let ct = Thorax::default().ct(Matrix::identity());
    let segmenter = ready(&ct);
    let mut dice = Dice(99);
    let mut refused = 0;
    for _ in 0..40 {
        let mut seeds = Seeds::default();
        for _ in 0..3 {
            let p = dice.point();
            match (dice.next() * 3.0) as usize {
                0 => seeds.chest_wall.push(p),
                1 => seeds.soft_tissue.push(p),
                _ => seeds.exclude.push(p),
            }
        }
        match run(&segmenter, &seeds) {
            Ok(labels) => obeyed(&labels, &seeds),
            Err(Error::Seed { .. } | Error::SeedsContradict { .. }) => refused += 1,
            Err(error) => panic!("{error}"),
        }
    }
    assert!((1..40).contains(&refused), "{refused}");
}

#[test]
fn a_seed_takes_its_surroundings_along_and_nothing_else() {
    let ct = Thorax::default().ct(Matrix::identity());
    let segmenter = ready(&ct);
    let plain = run(&segmenter, &Seeds::default()).unwrap();
    // In the gland 6 mm in front of the wall; in the muscle 6 mm behind its surface.
    let ray = Vector::new(0.5f64.sin(), -0.5f64.cos(), 0.0);
    let surface = (0..200)
        .map(|n| Point::origin() + ray * (60.0 + 0.5 * f64::from(n)))
        .take_while(|p| at(&plain, p) == label::CHEST_WALL)
        .last()
        .unwrap();
    let (gland, muscle) = (surface + 6.0 * ray, surface - 6.0 * ray);
    let as_wall = Seeds { chest_wall: vec![gland], ..Seeds::default() };
    let as_soft = Seeds { soft_tissue: vec![muscle], ..Seeds::default() };
    for seeds in [as_wall, as_soft] {
        let labels = run(&segmenter, &seeds).unwrap();
        obeyed(&labels, &seeds);
        let moved = (0..plain.data().len()).filter(|&n| labels.data()[n] != plain.data()[n]);
        let far = |n: &usize| (ct.grid().centre(ct.grid().voxel(*n)) - surface).norm() > 100.0;
        assert_eq!(moved.clone().filter(far).count(), 0, "labels changed 100 mm away");
        assert!((20..4000).contains(&moved.clone().count()), "{}", moved.count());
    }
}

#[test]
fn a_seed_that_moves_the_wall_far_is_named_with_what_it_did() {
    let ct = Thorax::default().ct(Matrix::identity());
    let segmenter = ready(&ct);
    let plain = run(&segmenter, &Seeds::default()).unwrap();
    let ray = Vector::new(0.5f64.sin(), -0.5f64.cos(), 0.0);
    let surface = (0..200)
        .map(|n| Point::origin() + ray * (60.0 + 0.5 * f64::from(n)))
        .take_while(|p| at(&plain, p) == label::CHEST_WALL)
        .last()
        .unwrap();
    let told = |out: f64| -> Vec<String> {
        let seeds = Seeds { chest_wall: vec![surface + ray * out], ..Seeds::default() };
        let (_, info) = segmenter.segment(&seeds, Progress::none()).unwrap();
        let of_seeds = info.warnings.iter().filter(|w| w.code() == "seed-moves-wall");
        of_seeds.map(ToString::to_string).collect()
    };
    assert!(told(-2.0).is_empty(), "{:?}", told(-2.0));
    let far = told(18.0);
    assert_eq!(far.len(), 1, "{far:?}");
    assert!(far[0].contains("chest-wall seed") && far[0].contains("outwards"), "{far:?}");
}

#[test]
fn careless_seeds_are_named_with_the_reason() {
    let ct = Thorax::default().ct(Matrix::identity());
    let segmenter = ready(&ct);
    let point = |x: f64, y: f64, z: f64| vec![Point::new(x, y, z)];
    let wall = |p| Seeds { chest_wall: p, ..Seeds::default() };
    let soft = |p| Seeds { soft_tissue: p, ..Seeds::default() };
    let refused = |seeds: Seeds, reason: &str| {
        let message = run(&segmenter, &seeds).unwrap_err().to_string();
        assert!(message.contains(reason), "{message}");
    };
    refused(wall(point(0.0, 0.0, 900.0)), "outside the CT");
    refused(wall(point(75.0, -160.0, 0.0)), "outside the body");
    refused(soft(point(75.0, -160.0, 0.0)), "outside the body");
    refused(wall(vec![APEX + Vector::new(0.0, 0.2, 0.0)]), "in the skin");
    refused(soft(point(50.0, 0.0, 0.0)), "there is lung in front of it");
    // Sensible: on the skin line, in the lung, in the back, in the axilla, in the other breast.
    for seeds in [
        soft(vec![APEX]),
        wall(point(50.0, 0.0, 0.0)),
        wall(point(60.0, 82.0, 0.0)),
        soft(point(135.0, -20.0, 40.0)),
        wall(point(-60.0, -88.0, 0.0)),
    ] {
        obeyed(&run(&segmenter, &seeds).unwrap(), &seeds);
    }
    let (inner, outer) = (Point::new(60.0, -80.0, 0.0), Point::new(67.0, -90.4, 0.0));
    let crossed = Seeds { chest_wall: vec![outer], soft_tissue: vec![inner], ..Seeds::default() };
    refused(crossed.clone(), "60.0");
    refused(crossed, "67.0");
    let both = Seeds { chest_wall: vec![inner], exclude: vec![inner], ..Seeds::default() };
    refused(both, "one voxel");
    let far =
        Grid::new([9; 3], Vector::repeat(2.0), Point::new(900.0, 0.0, 0.0), Matrix::identity());
    let map = Volume::from_fn(far.unwrap(), |_| Some(SeedKind::SoftTissue));
    refused(Seeds { painted: vec![map], ..Seeds::default() }, "another series");
}

#[test]
fn painted_regions_the_wrong_way_round_are_named_by_place() {
    let ct = Thorax::default().ct(Matrix::identity());
    let segmenter = ready(&ct);
    let map = Volume::from_fn(ct.grid().clone(), |v| {
        let p = ct.grid().centre(v);
        let side = (p - Point::new(60.0, -88.0, 0.0)).norm() < 12.0;
        side.then_some(if p.y < -88.0 { SeedKind::ChestWall } else { SeedKind::SoftTissue })
    });
    let error = run(&segmenter, &Seeds { painted: vec![map], ..Seeds::default() }).unwrap_err();
    let Error::SeedsContradict { first, second, .. } = error else { panic!("{error}") };
    for p in [first, second] {
        assert!((Point::from(p) - Point::new(60.0, -88.0, 0.0)).norm() < 16.0, "{p:?}");
    }
}

#[test]
fn a_stroke_over_its_neck_takes_a_lead_off_the_patient() {
    let thorax = Thorax::default();
    let mut ct = thorax.ct(Matrix::identity());
    let grid = ct.grid().clone();
    // A thick lead that leaves the patient's left side.
    let lead = |p: &Point| {
        p.y.abs() < 9.0
            && p.z.abs() < 14.0
            && p.x > 0.0
            && p.x < 182.0
            && thorax.truth(p) == Truth::Outside
    };
    for n in (0..grid.len()).filter(|&n| lead(&grid.centre(grid.voxel(n)))) {
        ct.data_mut()[n] = 60;
    }
    let left = |labels: &LabelMap| {
        let of_lead = |n: &usize| lead(&grid.centre(grid.voxel(*n)));
        (0..grid.len()).filter(of_lead).filter(|&n| labels.data()[n] != label::OUTSIDE).count()
    };
    let segmenter = ready(&ct);
    let plain = run(&segmenter, &Seeds::default()).unwrap();
    assert!(left(&plain) > 100, "{}", left(&plain));
    let neck = Volume::from_fn(grid.clone(), |v| {
        let p = grid.centre(v);
        (lead(&p) && p.x < 163.0).then_some(SeedKind::Exclude)
    });
    let seeds = Seeds { painted: vec![neck], ..Seeds::default() };
    assert_eq!(left(&run(&segmenter, &seeds).unwrap()), 0);

    // A point in it takes a hole alone, and that is told.
    let middle = |p: Point| Seeds { exclude: vec![p], ..Seeds::default() };
    let (made, info) =
        segmenter.segment(&middle(Point::new(170.0, 0.0, 0.0)), Progress::none()).unwrap();
    assert!(left(&made.labels) > 50, "{}", left(&made.labels));
    let told = info.warnings.iter().find(|w| w.code() == "exclude-seed-alone").unwrap();
    assert!(told.to_string().contains("[170.0, 0.0, 0.0]"), "{told}");
}

/// Mean distance between the walls of two label maps along rays over the left breast, mm.
fn off(labels: &LabelMap, thorax: &Thorax) -> f64 {
    let edge = |is_wall: &dyn Fn(&Point) -> bool, angle: f64, z: f64| {
        let along = |r: f64| Point::new(r * angle.sin(), -r * angle.cos(), z);
        (120..340).map(|n| 0.5 * f64::from(n)).take_while(|&r| is_wall(&along(r))).count() as f64
            * 0.5
    };
    let mut sum = 0.0;
    for a in 0..25 {
        for k in 0..13 {
            let (angle, z) = (0.25 + 0.04 * f64::from(a), 5.0 * f64::from(k) - 30.0);
            let got = edge(&|p| at(labels, p) == label::CHEST_WALL, angle, z);
            let want = edge(&|p| thorax.truth(p) == Truth::Wall, angle, z);
            sum += (got - want).abs() / (25.0 * 13.0);
        }
    }
    sum
}

#[test]
fn three_pairs_repair_a_flooded_breast() {
    // Gland as dense as muscle that lies on it without fat between: nothing in the CT tells.
    let thorax = Thorax { noise: 4.0, ..Thorax::default() };
    let is_gland = |p: &Point| {
        let off = *p - Point::new(70.0, -90.0, 0.0);
        (off.x / 44.0).hypot(off.y / 26.0).hypot(off.z / 42.0) < 1.0
    };
    let mut ct = thorax.ct(Matrix::identity());
    let grid = ct.grid().clone();
    for n in 0..grid.len() {
        let p = grid.centre(grid.voxel(n));
        if is_gland(&p) && thorax.truth(&p) == Truth::Soft {
            ct.data_mut()[n] = 52 + (n % 9) as i16 - 4;
        }
    }
    let segmenter = ready(&ct);
    let flooded = off(&run(&segmenter, &Seeds::default()).unwrap(), &thorax);
    let mut seeds = Seeds::default();
    for (angle, z) in [(0.62f64, 0.0), (0.5, -14.0), (0.75, 12.0)] {
        let along = |r: f64| Point::new(r * angle.sin(), -r * angle.cos(), z);
        let r = (120..340)
            .map(|n| 0.5 * f64::from(n))
            .take_while(|&r| thorax.truth(&along(r)) == Truth::Wall)
            .last()
            .unwrap();
        seeds.chest_wall.push(along(r - 2.0));
        seeds.soft_tissue.push(along(r + 2.0));
    }
    let repaired = off(&run(&segmenter, &seeds).unwrap(), &thorax);
    assert!(flooded > 2.0 * repaired && repaired < 1.5, "{flooded:.2} -> {repaired:.2} mm");
}
