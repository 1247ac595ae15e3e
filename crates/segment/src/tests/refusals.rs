//! What is refused, with its reason; and what must not be.

use super::phantom::{Thorax, Truth};
use crate::{Breast, BreastPlace, Error, Info, Params, QualityCheck, RegionCheck, segment};
use std::sync::Arc;
use supine_space::{Matrix, Point, Posture, Progress, Side, Sphere};
use supine_volume::{Ct, Field, LabelMap, label};

/// The thorax with the voxels changed by `f`.
fn changed(f: impl Fn(&Point, i16) -> i16) -> Ct {
    changed_along(Matrix::identity(), f)
}

/// The same on a grid with these directions.
fn changed_along(direction: Matrix, f: impl Fn(&Point, i16) -> i16) -> Ct {
    let mut ct = Thorax::default().ct(direction);
    let grid = ct.grid().clone();
    for (n, v) in ct.data_mut().iter_mut().enumerate() {
        *v = f(&grid.centre(grid.voxel(n)), *v);
    }
    ct
}

fn run(ct: &Ct) -> Result<Info, Error> {
    Ok(segment(Arc::new(ct.clone()), &Params::default(), Progress::none())?.1)
}

/// Lungs denser towards `down`, HU per mm, and the table there instead of behind.
fn lying(on: fn(&Point) -> f64, per_mm: f64) -> Ct {
    let thorax = Thorax::default();
    changed(|p, v| match v {
        _ if thorax.truth(p) == Truth::Wall && v < -600 => v + (per_mm * on(p)) as i16,
        _ if p.y > 113.0 => -1000,
        _ if thorax.truth(p) == Truth::Outside && on(p) > 164.5 && on(p) < 171.0 => 120,
        _ => v,
    })
}

#[test]
fn values_that_are_not_hounsfield_units_are_refused() {
    let refused = |f: fn(i16) -> i16| run(&changed(|_, v| f(v))).unwrap_err();
    assert!(matches!(refused(|_| 0), Error::Uniform { value: 0 }));
    let wrong: [fn(i16) -> i16; 4] =
        [|v| v + 1024, |v| v.max(-100), |v| v / 2, |v| (v / 8 + 128).clamp(0, 255)];
    for f in wrong {
        let error = refused(f);
        assert!(matches!(error, Error::NotHounsfield { .. }), "{error}");
    }
}

#[test]
fn slices_without_a_patient_between_others_are_refused() {
    let error = run(&changed(|p, v| if (p.z - 10.0).abs() < 8.0 { -1000 } else { v })).unwrap_err();
    assert!(matches!(error, Error::EmptySlices { first: 17, last: 20 }), "{error}");
    // At the ends of the volume they are nothing but air.
    assert!(run(&changed(|p, v| if p.z > 76.0 { -1000 } else { v })).is_ok());
}

#[test]
fn prone_and_decubitus_are_refused_and_a_sick_lung_is_not() {
    for (on, name) in [
        ((|p: &Point| -p.y) as fn(&Point) -> f64, "front"),
        (|p: &Point| p.x, "left side"),
        (|p: &Point| -p.x, "right side"),
    ] {
        let error = run(&lying(on, 0.5)).unwrap_err();
        assert!(
            matches!(error, Error::LiesOtherwise { on, taken: "back" } if on == name),
            "{name}: {error}"
        );
    }
    // As the case says.
    let ways: [(Posture, Off); 3] =
        [(Posture::Prone, |p| -p.y), (Posture::LeftSide, |p| p.x), (Posture::RightSide, |p| -p.x)];
    for (posture, on) in ways {
        let params = Params { posture, ..Params::default() };
        let ct = Arc::new(lying(on, 0.5));
        let (_, info) = segment(Arc::clone(&ct), &params, Progress::none()).unwrap();
        assert!(info.warnings.iter().all(|w| w.code() != "lung-density"), "{:?}", info.warnings);
        let upright = Params { posture: Posture::Upright, ..Params::default() };
        assert!(segment(ct, &upright, Progress::none()).is_ok());
    }
    let prone = Params { posture: Posture::Prone, ..Params::default() };
    let supine = changed(|p, v| match v {
        _ if Thorax::default().truth(p) == Truth::Wall && v < -600 => v + (0.5 * p.y) as i16,
        _ => v,
    });
    let error = segment(Arc::new(supine), &prone, Progress::none()).unwrap_err();
    assert!(matches!(error, Error::LiesOtherwise { on: "back", taken: "front" }), "{error}");
    // Denser in front, but the table is behind her: a warning.
    let thorax = Thorax::default();
    let sick = changed(|p, v| match v {
        _ if thorax.truth(p) == Truth::Wall && v < -600 => v - (0.5 * p.y) as i16,
        _ => v,
    });
    let info = run(&sick).unwrap();
    assert!(
        info.warnings.iter().any(|w| w.to_string().contains("denser in front")),
        "{:?}",
        info.warnings
    );
}

/// How far a point is beyond a cut, mm.
type Off = fn(&Point) -> f64;

#[test]
fn half_a_chest_is_refused_with_the_side_that_is_missing() {
    // Cut at the middle by the field, filled with air, through a lung that is open then, and
    // through the chest askew.
    for (side, sign) in [(Side::Left, 1.0), (Side::Right, -1.0)] {
        let beyond: [(Off, i16, &str); 4] = [
            (|p| p.x + 2.0, -2048, "flat cut"),
            (|p| p.x + 2.0, -1000, "flat cut"),
            (|p| p.x + 62.0, -1000, "flat cut"),
            (|p| p.x + 0.12 * p.y + 2.0, -2048, "within 10 mm of the lung"),
        ];
        for (off, fill, why) in beyond {
            let mirrored = |p: &Point| off(&Point::new(sign * p.x, p.y, p.z));
            let error = run(&changed(|p, v| if mirrored(p) > 0.0 { fill } else { v })).unwrap_err();
            assert!(matches!(error, Error::HalfChest { side: s, .. } if s == side), "{error}");
            assert!(error.to_string().contains(why), "{side} {fill}: {error}");
        }
    }
    // i to the back, j to the right, k to the feet.
    let turned = Matrix::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
    let cut = changed_along(turned, |p, v| if p.x > -2.0 { -1000 } else { v });
    let error = run(&cut).unwrap_err();
    assert!(matches!(error, Error::HalfChest { side: Side::Left, .. }), "{error}");
    // A flank is no half.
    assert!(run(&changed(|p, v| if p.x > 140.0 { -2048 } else { v })).is_ok());
}

#[test]
fn one_lung_denser_than_the_other_is_no_side_that_she_lies_on() {
    let thorax = Thorax::default();
    let sick = changed(|p, v| match v {
        _ if thorax.truth(p) == Truth::Wall && v < -600 => {
            v + (0.3 * p.y) as i16 + if p.x > 0.0 { 120 } else { 0 }
        }
        _ => v,
    });
    let checks = run(&sick).unwrap().checks;
    let side = checks.iter().find(|c| c.what.contains("towards one side")).unwrap();
    assert!(side.value < 3.0, "{side:?}");
}

/// The labels as they truly are, and a region round the left breast.
fn truth() -> (LabelMap, Sphere) {
    let thorax = Thorax::default();
    let ct = thorax.ct(Matrix::identity());
    let grid = ct.grid();
    let of = |n: usize| match thorax.truth(&grid.centre(grid.voxel(n))) {
        Truth::Outside => label::OUTSIDE,
        Truth::Soft => label::SOFT_TISSUE,
        Truth::Wall => label::CHEST_WALL,
    };
    let labels = ct.with_data((0..grid.len()).map(of).collect()).unwrap();
    (labels, Sphere::new(Point::new(75.0, -80.0, 0.0), 60.0).unwrap())
}

fn place(region: Sphere, breast: Option<&Breast>) -> BreastPlace<'_> {
    BreastPlace { region, side: Side::Left, breast, uncertainty: None }
}

fn check_region(ct: &Ct, labels: &LabelMap, of: &BreastPlace<'_>) -> Result<RegionCheck, Error> {
    crate::check_region(ct, &Field::found(ct), labels, of)
}

fn check(ct: &Ct, region: Sphere) -> Result<Vec<supine_space::Warning>, Error> {
    let checked = check_region(ct, &truth().0, &place(region, None))?;
    assert_eq!(checked.checks.len(), 2, "{checked:?}");
    Ok(checked.warnings)
}

#[test]
fn an_arm_before_the_breast_is_refused_and_a_clip_is_told() {
    let (_, region) = truth();
    let plain = check(&changed(|_, v| v), region).unwrap();
    assert!(plain.is_empty(), "{plain:?}");
    let bar = |half: f64| {
        let inside = move |p: &Point| (p.y + 116.0).hypot(p.z) < half && p.x > 30.0;
        changed(move |p, v| if inside(p) { 900 } else { v })
    };
    let error = check(&bar(9.0), region).unwrap_err();
    assert!(matches!(error, Error::BoneInBreast { bone_cm3 } if bone_cm3 > 15.0), "{error}");
    let told = check(&bar(4.0), region).unwrap();
    assert!(told.len() == 1 && told[0].to_string().contains("dense as bone"), "{told:?}");
}

#[test]
fn a_breast_cut_by_the_field_or_the_end_is_refused() {
    let (labels, region) = truth();
    let beyond = |x: f64| changed(move |p, v| if p.x > x { -2048 } else { v });
    let error = check(&beyond(75.0), region).unwrap_err();
    assert!(matches!(error, Error::BreastCut { side: Side::Left, .. }), "{error}");
    let told = check(&beyond(128.0), region).unwrap();
    assert!(told.len() == 1 && told[0].to_string().contains("reconstructed field"), "{told:?}");
    // A region that is cut little, of a breast that is cut where it is thickest.
    let breast = Breast::find(&labels, Side::Left, None).unwrap();
    let small = Sphere::new(Point::new(60.0, -80.0, 0.0), 40.0).unwrap();
    let of = |x, breast| check_region(&beyond(x), &labels, &place(small, breast));
    assert!(of(95.0, None).is_ok());
    let error = of(95.0, Some(&breast)).unwrap_err().to_string();
    assert!(error.contains("thickest"), "{error}");
    assert!(of(128.0, Some(&breast)).is_ok());
    // The lower half of the volume is not there.
    let ct = Thorax::default().ct(Matrix::identity());
    let [ni, nj, nk] = ct.grid().size();
    let grid = ct.grid().crop([0, 0, 16], [ni, nj, nk - 16]).unwrap();
    let (ct, labels) = (
        Ct::new(grid.clone(), ct.data()[16 * ni * nj..].to_vec()).unwrap(),
        LabelMap::new(grid, labels.data()[16 * ni * nj..].to_vec()).unwrap(),
    );
    let breast = Breast::find(&labels, Side::Left, None).unwrap();
    let error = check_region(&ct, &labels, &place(region, Some(&breast))).unwrap_err();
    assert!(matches!(error, Error::BreastCut { .. }), "{error}");
}

#[test]
fn a_thin_breast_is_told_and_a_flat_chest_has_none() {
    let (labels, region) = truth();
    let ct = changed(|_, v| v);
    let of_height = |mm: f64| {
        let skin = |p: &Point| {
            Thorax::muscle_mm(p)
                + 14.0
                + mm * (-((p.x - 75.0).powi(2) + p.z.powi(2)) / 1800.0).exp()
        };
        let grid = labels.grid().clone();
        LabelMap::from_fn(grid.clone(), |v| match (grid.centre(v), labels.at(v)) {
            (_, label::CHEST_WALL) => label::CHEST_WALL,
            (p, _) if Thorax::above_ribs(&p) < skin(&p) => label::SOFT_TISSUE,
            _ => label::OUTSIDE,
        })
    };
    let told = |mm: f64| {
        let labels = of_height(mm);
        let breast = Breast::find(&labels, Side::Left, None)?;
        let checked = check_region(&ct, &labels, &place(region, Some(&breast)))?;
        Ok::<_, Error>(checked.warnings.iter().any(|w| w.to_string().contains("hardly a breast")))
    };
    assert!(matches!(told(0.0), Err(Error::NoBreast { .. })));
    assert!(told(10.0).unwrap() && !told(35.0).unwrap());
}

#[test]
fn a_breast_on_the_other_side_only_is_refused_by_name_and_half_of_one_is_told() {
    let (labels, region) = truth();
    let ct = changed(|_, v| v);
    // After a mastectomy of the left: 8 mm over the muscle, and so much more of a mound as is left.
    let with_mound = |mm: f64| {
        let skin = |p: &Point| {
            let away = (p.x - 75.0).hypot(p.z);
            Thorax::muscle_mm(p) + 8.0 + mm * (-away * away / 1800.0).exp()
        };
        let grid = labels.grid().clone();
        LabelMap::from_fn(grid.clone(), |v| {
            let p = grid.centre(v);
            let off = p.x > 0.0 && p.y < 0.0 && Thorax::above_ribs(&p) > skin(&p);
            if off { label::OUTSIDE } else { labels.at(v) }
        })
    };
    let found = |mm: f64, tumour: Option<Point>| {
        let labels = with_mound(mm);
        assert!(Breast::find(&labels, Side::Right, None).is_ok(), "{mm}");
        let breast = Breast::find(&labels, Side::Left, tumour)?;
        let checked = check_region(&ct, &labels, &place(region, Some(&breast)))?;
        Ok::<_, Error>(checked.warnings.iter().any(|w| w.to_string().contains("other breast")))
    };
    for tumour in [None, Some(Point::new(75.0, -98.0, 0.0)), Some(Point::new(50.0, -100.0, 30.0))] {
        let error = found(0.0, tumour).unwrap_err();
        assert!(matches!(error, Error::BreastMissing { side: Side::Left, .. }), "{error}");
        assert!(error.to_string().contains("mastectomy"), "{error}");
        let steps = (0..10).map(|step| found(4.0 * f64::from(step), tumour));
        let told: Vec<bool> = steps.filter_map(Result::ok).collect();
        assert!(told.first() == Some(&true) && told.last() == Some(&false), "{told:?}");
        assert!(told.is_sorted_by(|a, b| a >= b), "{told:?}");
    }
}

#[test]
fn the_figures_of_a_sound_case_lie_within_their_limits_and_those_of_a_bad_one_near_them() {
    let check = |checks: &[QualityCheck], what: &str| {
        checks.iter().find(|g| g.what.contains(what)).unwrap_or_else(|| panic!("{what}")).clone()
    };
    let (_, info) =
        segment(Arc::new(changed(|_, v| v)), &Params::default(), Progress::none()).unwrap();
    for g in &info.checks {
        let within = |limit: Option<f64>| {
            limit.is_none_or(|limit| match g.at_most {
                true => g.value <= limit,
                false => g.value >= limit,
            })
        };
        // The phantom's lungs are equally dense everywhere; alone this does not refuse.
        assert!(within(g.warns) && (g.jointly || within(g.refuses)), "{g:?}");
    }
    let lung = check(&info.checks, "air-filled lung");
    assert!((lung.value - info.lung_l).abs() < 1e-9, "{lung:?}");
    let (_, region) = truth();
    let measured = |ct: &Ct, what: &str| {
        let checked = check_region(ct, &truth().0, &place(region, None)).unwrap();
        check(&checked.checks, what)
    };
    let clip = |half: f64| {
        let inside = move |p: &Point| (p.y + 116.0).hypot(p.z) < half && p.x > 30.0;
        changed(move |p, v| if inside(p) { 900 } else { v })
    };
    let (none, some) = (changed(|_, v| v), clip(4.0));
    assert!(measured(&none, "dense as bone").value < 1.0);
    let bone = measured(&some, "dense as bone");
    assert!(bone.warns.is_some_and(|w| bone.value > w), "{bone:?}");
    assert!(bone.refuses.is_some_and(|r| bone.value < r), "{bone:?}");
    assert!(measured(&none, "reconstructed field").value < 1.0);
}
