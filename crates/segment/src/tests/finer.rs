//! Finer labels of a thorax whose tissues are known.

use super::phantom::{Thorax, Truth};
use crate::{Error, tissues};
use supine_space::{Matrix, Point, Progress, Sphere};
use supine_volume::{Ct, LabelMap, label};

const CENTRE: Point = Point::new(108.0, -92.0, 25.0);
const RADIUS: f64 = 8.0;

/// The CT with a tumour of 60 HU in the fat, and its true coarse labels.
fn thorax() -> (Ct, LabelMap) {
    let object: fn(&Point) -> Option<f64> = |p| ((p - CENTRE).norm() < RADIUS).then_some(60.0);
    let thorax = Thorax { object: Some(object), ..Thorax::default() };
    let ct = thorax.ct(Matrix::identity());
    let labels =
        LabelMap::from_fn(ct.grid().clone(), |v| match thorax.truth(&ct.grid().centre(v)) {
            Truth::Outside => label::OUTSIDE,
            Truth::Soft => label::SOFT_TISSUE,
            Truth::Wall => label::CHEST_WALL,
        });
    (ct, labels)
}

fn ml(info: &crate::TissueInfo, label: u8) -> f64 {
    info.shares.iter().find(|s| s.label == label).unwrap().ml
}

#[test]
fn every_voxel_stays_on_its_side_and_gets_its_tissue() {
    let (ct, coarse) = thorax();
    let tumour = Sphere::new(CENTRE, RADIUS).unwrap();
    let (fine, info) = tissues(&ct, &coarse, None, Some(tumour), Progress::none()).unwrap();
    for (&f, &c) in fine.data().iter().zip(coarse.data()) {
        assert_eq!(label::is_soft_tissue(f), label::is_soft_tissue(c));
        assert_eq!(label::is_chest_wall(f), label::is_chest_wall(c));
        assert!(f != label::SOFT_TISSUE && f != label::CHEST_WALL, "a coarse label is left");
    }
    let of = |x, y, z| fine.at(fine.grid().voxel_at(&Point::new(x, y, z)).unwrap());
    assert_eq!(of(CENTRE.x, CENTRE.y, CENTRE.z), label::TUMOUR);
    assert_eq!(of(-70.0, -98.0, 0.0), label::GLAND);
    assert_eq!(of(-75.0, -90.0, -40.0), label::FAT);
    assert_eq!(of(60.0, 0.0, 0.0), label::LUNG);
    assert_eq!(of(0.0, 66.0, 0.0), label::BONE);
    assert!(info.warnings.is_empty() && info.levels.tumour_grown, "{info:?}");
    assert!((info.levels.fat_hu + 100.0).abs() < 6.0, "{info:?}");
    assert!(info.levels.gland_hu.is_some_and(|hu| (hu - 32.0).abs() < 8.0), "{info:?}");
    let sphere = 4.0 / 3.0 * std::f64::consts::PI * RADIUS.powi(3) / 1000.0;
    assert!((0.6..1.5).contains(&(ml(&info, label::TUMOUR) / sphere)), "{info:?}");
    assert!((1.0..5.0).contains(&(ml(&info, label::LUNG) / 1000.0)), "{info:?}");
    // A second time on its own product: fine labels are as good as coarse ones.
    let again = tissues(&ct, &fine, None, Some(tumour), Progress::none()).unwrap();
    assert_eq!(again, (fine, info));
}

#[test]
fn a_tumour_that_does_not_stand_out_is_the_sphere_and_says_so() {
    let (ct, coarse) = thorax();
    let in_fat = Sphere::new(Point::new(-105.0, -92.0, 25.0), 6.0).unwrap();
    let (fine, info) = tissues(&ct, &coarse, None, Some(in_fat), Progress::none()).unwrap();
    assert!(info.warnings.len() == 1 && !info.levels.tumour_grown, "{info:?}");
    let inside = |l: u8| l == label::TUMOUR;
    assert!(inside(fine.at(fine.grid().voxel_at(&in_fat.centre()).unwrap())));
}

#[test]
fn labels_of_another_ct_are_refused() {
    let (ct, coarse) = thorax();
    let part = coarse.grid().crop([0; 3], [60, 60, 20]).unwrap();
    let other = LabelMap::from_fn(part, |v| coarse.at(v));
    let error = tissues(&ct, &other, None, None, Progress::none());
    assert!(matches!(error, Err(Error::OtherGrid { .. })), "{error:?}");
}

#[test]
fn implants_stay_implants_and_are_no_gland() {
    let (ct, coarse) = thorax();
    let gland = Point::new(-70.0, -98.0, 0.0);
    let grid = ct.grid();
    let inside = |n: usize| (grid.centre(grid.voxel(n)) - gland).norm() < 12.0;
    let implant = |n: usize| if inside(n) { label::IMPLANT } else { label::OUTSIDE };
    let implants = ct.with_data((0..grid.len()).map(implant).collect()).unwrap();
    let (fine, info) = tissues(&ct, &coarse, Some(&implants), None, Progress::none()).unwrap();
    for (n, &l) in fine.data().iter().enumerate() {
        let soft = label::is_soft_tissue(coarse.data()[n]);
        assert_eq!(l == label::IMPLANT, inside(n) && soft, "{:?}", grid.voxel(n));
    }
    let (without, before) = tissues(&ct, &coarse, None, None, Progress::none()).unwrap();
    assert_eq!(without.at(grid.voxel_at(&gland).unwrap()), label::GLAND);
    assert!(ml(&before, label::GLAND) - ml(&info, label::GLAND) > 2.0, "{info:?}");
    // Within a sphere round it, nothing but what lies there is counted.
    let here = crate::tissue_shares(&ct, &fine, Sphere::new(gland, 5.0).unwrap());
    let there: Vec<u8> = here.iter().filter(|s| s.ml > 0.0).map(|s| s.label).collect();
    assert_eq!(there, [label::IMPLANT]);
}

#[test]
fn it_can_be_stopped_at_every_step() {
    let (ct, coarse) = thorax();
    for end in [0.0, 0.2, 0.4, 0.7, 0.94] {
        let sink = |share: f64| share <= end;
        let error = tissues(&ct, &coarse, None, None, Progress::new(&sink));
        assert!(matches!(error, Err(Error::Stopped(_))), "{end}: {error:?}");
    }
}
