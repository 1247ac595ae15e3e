//! CTs whose head and feet or sides are exchanged.

use super::phantom::Thorax;
use crate::{Error, Info, Params, segment};
use std::sync::Arc;
use supine_space::{Matrix, Point, Progress};
use supine_volume::Ct;

/// A heart in the lower half at the left, and the aorta before the spine.
fn heart(p: &Point) -> Option<f64> {
    let heart = (0.0..55.0).contains(&p.x) && (-60.0..-4.0).contains(&p.y) && p.z < 0.0;
    let aorta = (8.0..32.0).contains(&p.x) && (-5.0..28.0).contains(&p.y);
    (heart || aorta).then_some(45.0)
}

/// A liver under the right lung, and neither heart nor aorta.
fn liver(p: &Point) -> Option<f64> {
    let inner = Thorax::above_ribs(p) < -11.0 && p.y.abs() < 55.0;
    (inner && p.x < -10.0 && p.z < -40.0).then_some(60.0)
}

/// The CT with its voxels exchanged along i and k, and the header as it was.
fn run(organs: fn(&Point) -> Option<f64>, exchanged: [bool; 2]) -> Result<Info, Error> {
    let ct = Thorax { object: Some(organs), ..Thorax::default() }.ct(Matrix::identity());
    let [ni, _, nk] = ct.grid().size();
    let from = |[i, j, k]: [usize; 3]| {
        let i = if exchanged[0] { ni - 1 - i } else { i };
        ct.at([i, j, if exchanged[1] { nk - 1 - k } else { k }])
    };
    let turned = Ct::from_fn(ct.grid().clone(), from);
    Ok(segment(Arc::new(turned), &Params::default(), Progress::none())?.1)
}

fn doubts(info: &Info) -> Vec<String> {
    let told = info.warnings.iter().map(ToString::to_string);
    told.filter(|text| text.contains("may be exchanged")).collect()
}

#[test]
fn head_and_feet_exchanged_are_refused_and_sides_are_told() {
    let info = run(heart, [false, false]).unwrap();
    assert!(doubts(&info).is_empty(), "{:?}", doubts(&info));
    for what in ["ribs that run down", "towards the feet", "(the aorta)", "(the heart)"] {
        let check = info.checks.iter().find(|check| check.what.contains(what)).unwrap();
        assert!(check.value > 15.0, "{check:?}");
    }
    let told = doubts(&run(heart, [true, false]).unwrap());
    assert!(told.len() == 1 && told[0].contains("left and right"), "{told:?}");
    for sides in [false, true] {
        let error = run(heart, [sides, true]).unwrap_err();
        assert!(matches!(error, Error::HeadFeetReversed), "{error}");
    }
}

#[test]
fn a_liver_on_the_left_is_told_where_heart_and_aorta_say_nothing() {
    let info = run(liver, [false, false]).unwrap();
    assert!(doubts(&info).is_empty(), "{:?}", doubts(&info));
    let check = info.checks.iter().find(|check| check.what.contains("(the liver)")).unwrap();
    assert!(check.value > 90.0, "{check:?}");
    let told = doubts(&run(liver, [true, false]).unwrap());
    assert!(told.len() == 1 && told[0].contains("the liver lies on the left"), "{told:?}");
    // Where heart and aorta lie as they should, it is another organ or an effusion.
    let both = |p: &Point| heart(p).or(liver(&Point::new(-p.x, p.y, p.z)));
    let told = doubts(&run(both, [false, false]).unwrap());
    assert!(told.is_empty(), "{told:?}");
}

#[test]
fn ribs_alone_warn() {
    let ct = Thorax::default().ct(Matrix::identity());
    let nk = ct.grid().size()[2];
    let turned = Ct::from_fn(ct.grid().clone(), |[i, j, k]| ct.at([i, j, nk - 1 - k]));
    let info = segment(Arc::new(turned), &Params::default(), Progress::none()).unwrap().1;
    let told = doubts(&info);
    assert!(told.len() == 1 && told[0].contains("ribs run up"), "{told:?}");
}
