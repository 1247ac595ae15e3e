//! Thoraxes with something in or on them that is no tissue.

use super::phantom::{APEX, Thorax};
use super::{at, dice, ready, run};
use std::sync::Arc;
use supine_space::{Matrix, Point};
use supine_volume::{LabelMap, label};

/// The labels, the facts, and the Dice of soft tissue and wall.
fn with(object: fn(&Point) -> Option<f64>) -> (Arc<LabelMap>, crate::Info, [f64; 2]) {
    let thorax = Thorax { object: Some(object), ..Thorax::default() };
    let (labels, info) = run(&thorax.ct(Matrix::identity()));
    let dice = dice(&thorax, &labels);
    (labels, info, dice)
}

/// Whether soft tissue and wall are as good as without any object, or nearly.
fn good([soft, wall]: [f64; 2]) -> bool {
    soft > 0.962 && wall > 0.982
}

/// On the muscle, under the gland; 1 at the rim.
fn in_implant(p: &Point) -> bool {
    let (x, y, z) = ((p.x - 68.0) / 45.0, (p.y + 86.0) / 32.0, p.z / 45.0);
    x.hypot(y).hypot(z) < 1.0 && Thorax::above_ribs(p) > Thorax::muscle_mm(p)
}

#[test]
fn implants_are_soft_tissue_and_do_not_draw_the_wall_over_themselves() {
    let silicone = |p: &Point| in_implant(p).then_some(105.0);
    let saline = |p: &Point| in_implant(p).then_some(5.0);
    for object in [silicone, saline] as [fn(&Point) -> Option<f64>; 2] {
        let (_, info, dice) = with(object);
        assert!(good(dice), "{dice:?}");
        assert!((60.0..250.0).contains(&info.implant_ml), "{}", info.implant_ml);
        assert!(
            info.warnings.iter().any(|w| w.to_string().contains("implant")),
            "{:?}",
            info.warnings
        );
    }
}

#[test]
fn a_muscle_over_an_implant_is_soft_tissue_too() {
    let object: fn(&Point) -> Option<f64> = |p| {
        let (x, y, z) = ((p.x - 68.0) / 49.0, (p.y + 86.0) / 36.0, p.z / 49.0);
        let muscle = x.hypot(y).hypot(z) < 1.0 && Thorax::above_ribs(p) > Thorax::muscle_mm(p);
        if in_implant(p) { Some(105.0) } else { muscle.then_some(52.0) }
    };
    let (labels, _, dice) = with(object);
    assert_eq!(at(&labels, &Point::new(68.0, -100.0, 0.0)), label::SOFT_TISSUE);
    assert!(dice[0] > 0.92 && dice[1] > 0.95, "{dice:?}");
}

#[test]
fn the_implants_voxels_are_told() {
    let object: fn(&Point) -> Option<f64> = |p| in_implant(p).then_some(105.0);
    let thorax = Thorax { object: Some(object), ..Thorax::default() };
    let ct = thorax.ct(Matrix::identity());
    let segmenter = ready(&ct);
    let implants = segmenter.implants().unwrap();
    let grid = ct.grid();
    let [mut both, mut found, mut there] = [0usize; 3];
    for (n, &l) in implants.data().iter().enumerate() {
        let truth = in_implant(&grid.centre(grid.voxel(n)));
        assert!(l == label::IMPLANT || l == label::OUTSIDE);
        found += usize::from(l == label::IMPLANT);
        there += usize::from(truth);
        both += usize::from(truth && l == label::IMPLANT);
    }
    let dice = 2.0 * both as f64 / (found + there) as f64;
    assert!(dice > 0.85, "{dice}");
    let plain = Thorax::default().ct(Matrix::identity());
    let none = ready(&plain);
    assert!(none.implants().is_none());
}

#[test]
fn no_implant_is_seen_where_there_is_none() {
    let info = run(&Thorax::default().ct(Matrix::identity())).1;
    assert_eq!(info.implant_ml, 0.0);
}

/// A port in the fat over the left second rib, as a place in it: 1 at the rim.
fn in_port(p: &Point) -> f64 {
    let off = p - Point::new(45.0, -94.5, 55.0);
    (off.x.hypot(off.z) / 11.0).max(off.y.abs() / 3.5)
}

#[test]
fn a_port_is_told_and_does_not_draw_the_wall_over_itself() {
    let object: fn(&Point) -> Option<f64> = |p| match in_port(p) {
        r if r < 0.6 => Some(3071.0),
        r if r < 1.0 => Some(450.0),
        _ => None,
    };
    let (labels, info, dice) = with(object);
    assert!(good(dice), "{dice:?}");
    let [device] = &info.devices[..] else { panic!("{:?}", info.devices) };
    assert!((device.middle - Point::new(45.0, -94.5, 55.0)).norm() < 3.0, "{device:?}");
    assert!((1.5..6.0).contains(&device.ml), "{device:?}");
    assert!(info.warnings.iter().any(|w| w.to_string().contains("a port")), "{:?}", info.warnings);
    let grid = labels.grid();
    // But for what touches the muscle.
    let port = |p: &Point| in_port(p) < 0.9 && Thorax::above_ribs(p) > Thorax::muscle_mm(p) + 1.5;
    let port = (0..grid.len()).filter(|&n| port(&grid.centre(grid.voxel(n))));
    let wall = |p: Point| format!("{p:?} {:.1}", Thorax::above_ribs(&p) - Thorax::muscle_mm(&p));
    let not_soft = port.filter(|&n| labels.data()[n] != label::SOFT_TISSUE);
    let not_soft: Vec<String> = not_soft.map(|n| wall(grid.centre(grid.voxel(n)))).collect();
    assert!(not_soft.is_empty(), "{not_soft:?}");
}

#[test]
fn what_is_left_out_as_lying_on_the_skin_is_told_with_volume_and_place() {
    let bead: fn(&Point) -> Option<f64> =
        |p| (in_electrode(p) && (p.x + APEX.x).hypot(p.z) < 4.0).then_some(3071.0);
    let gel: fn(&Point) -> Option<f64> = |p| in_electrode(p).then_some(160.0);
    for object in [bead, gel] {
        let (_, info, _) = with(object);
        let place = Point::new(-APEX.x, APEX.y - 2.5, APEX.z);
        let near = |middle: &Point| (middle - place).norm() < 5.0;
        let told = info.left_off.iter().find(|one| near(&one.middle));
        assert!(told.is_some_and(|one| (0.1..4.0).contains(&one.ml)), "{:?}", info.left_off);
        let warned = info.warnings.iter().find(|warning| warning.code() == "object-on-skin");
        let text = warned.map(ToString::to_string).unwrap_or_default();
        assert!(text.contains("left out of the patient"), "{text} {:?}", info.warnings);
    }
}

#[test]
fn wires_round_the_breastbone_are_no_device() {
    let object: fn(&Point) -> Option<f64> = |p| {
        let depth = -Thorax::above_ribs(p);
        let ring = (p.x.abs() / 15.0).max((depth - 4.0).abs() / 5.0);
        let wire = p.y < 0.0 && (0.7..1.0).contains(&ring) && (p.z / 20.0).fract().abs() < 0.25;
        wire.then_some(3071.0)
    };
    let (_, info, dice) = with(object);
    assert!(info.devices.is_empty() && good(dice), "{:?} {dice:?}", info.devices);
}

#[test]
fn clips_and_their_streaks_change_nothing() {
    let object: fn(&Point) -> Option<f64> = |p| {
        let clips = [(70.0, -100.0, 0.0), (78.0, -92.0, 5.0), (62.0, -96.0, -6.0)];
        let near = clips.map(|(x, y, z)| p - Point::new(x, y, z));
        if near.iter().any(|off| off.norm() < 2.5) {
            return Some(3071.0);
        }
        // Dark and bright rays through each clip in its own slices.
        near.iter()
            .find(|off| off.z.abs() < 3.0 && off.x.hypot(off.y) < 15.0)
            .map(|off| 30.0 + 250.0 * (5.0 * off.y.atan2(off.x)).sin())
    };
    let (labels, _, dice) = with(object);
    assert!(good(dice), "{dice:?}");
    assert_eq!(at(&labels, &Point::new(70.0, -100.0, 0.0)), label::SOFT_TISSUE);
}

#[test]
fn air_in_the_breast_is_part_of_it() {
    let object: fn(&Point) -> Option<f64> =
        |p| ((p - Point::new(80.0, -104.0, 0.0)).norm() < 9.0).then_some(-1000.0);
    let (labels, _, dice) = with(object);
    assert_eq!(at(&labels, &Point::new(80.0, -104.0, 0.0)), label::SOFT_TISSUE);
    assert!(good(dice), "{dice:?}");
}

/// A disc of 13 mm radius on the right breast.
fn in_electrode(p: &Point) -> bool {
    let off = p - Point::new(-APEX.x, APEX.y, APEX.z);
    (0.0..5.0).contains(&Thorax::skin(p)) && off.x.hypot(off.z) < 13.0 && p.y < -90.0
}

#[test]
fn electrodes_and_beads_are_not_the_patient() {
    let gel: fn(&Point) -> Option<f64> = |p| in_electrode(p).then_some(160.0);
    let bead: fn(&Point) -> Option<f64> =
        |p| (in_electrode(p) && (p.x + APEX.x).hypot(p.z) < 4.0).then_some(3071.0);
    for object in [gel, bead] {
        let (labels, info, dice) = with(object);
        let grid = labels.grid();
        let inside = (0..grid.len()).filter(|&n| {
            let p = grid.centre(grid.voxel(n));
            labels.data()[n] != label::OUTSIDE && object(&p).is_some() && Thorax::skin(&p) > 1.4
        });
        // Single voxels of its rim look like skin at 2.8 mm.
        let inside = inside.count();
        assert!(inside < 4, "{inside} voxels of the electrode in the patient");
        assert!(info.foreign_cm3 > 0.3 && good(dice), "{dice:?} {}", info.foreign_cm3);
    }
}

#[test]
fn skin_that_a_sharp_kernel_makes_as_dense_as_gel_is_the_patient() {
    let plain = run(&Thorax::default().ct(Matrix::identity())).1.foreign_cm3;
    let object: fn(&Point) -> Option<f64> =
        |p| (-1.5..0.0).contains(&Thorax::skin(p)).then_some(190.0);
    let (_, info, dice) = with(object);
    assert!(info.foreign_cm3 < plain + 1.0 && good(dice), "{plain} {} {dice:?}", info.foreign_cm3);
}

#[test]
fn a_tube_on_the_skin_is_not_the_patient_and_a_nipple_is() {
    // Along the breastbone, on the skin.
    let tube: fn(&Point) -> Option<f64> =
        |p| (p.x.hypot(p.y + 116.5) < 7.0 && p.z.abs() < 40.0).then_some(60.0);
    let (labels, info, dice) = with(tube);
    assert_eq!(at(&labels, &Point::new(0.0, -118.0, 0.0)), label::OUTSIDE);
    assert_eq!(at(&labels, &Point::new(0.0, -107.0, 0.0)), label::SOFT_TISSUE);
    assert!(info.foreign_cm3 > 3.0 && good(dice), "{dice:?} {}", info.foreign_cm3);
    let nipple: fn(&Point) -> Option<f64> = |p| {
        let off = p - APEX;
        (off.x.hypot(off.z) < 7.0 && (-8.0..2.0).contains(&off.y)).then_some(40.0)
    };
    let (labels, _, dice) = with(nipple);
    assert_eq!(at(&labels, &Point::new(APEX.x, APEX.y - 5.0, APEX.z)), label::SOFT_TISSUE);
    assert!(good(dice), "{dice:?}");
}
