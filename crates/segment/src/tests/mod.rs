//! Whole segmentations of thoraxes built here.

mod finer;
mod muscle;
mod objects;
mod orientation;
mod phantom;
mod refusals;
mod seeds;
mod strokes;
mod surfaces;
mod uncertainty;

use crate::{Breast, Error, Params, Segmenter, segment};
use phantom::{Thorax, Truth};
use std::sync::Arc;
use supine_space::{Matrix, Point, Progress, Side, Sphere, Vector};
use supine_volume::{Ct, Field, LabelMap, label};

/// A server keeps these.
const _: fn() = || {
    fn keeps<T: Send + Sync + 'static>() {}
    keeps::<(Segmenter, crate::Segmentation)>();
};

fn ready(ct: &Ct) -> Segmenter {
    let field = Field::found(ct);
    Segmenter::new(Arc::new(ct.clone()), &field, &Params::default(), Progress::none()).unwrap()
}

fn run(ct: &Ct) -> (Arc<LabelMap>, crate::Info) {
    let (made, info) = segment(Arc::new(ct.clone()), &Params::default(), Progress::none()).unwrap();
    (made.labels, info)
}

/// Dice of soft tissue and of chest wall within 75 mm of a breast, as the planner sees it.
fn dice(thorax: &Thorax, labels: &LabelMap) -> [f64; 2] {
    let mut counts = [[0usize; 3]; 2];
    for (n, &l) in labels.data().iter().enumerate() {
        let p = labels.grid().centre(labels.grid().voxel(n));
        if (p - Point::new(75.0, -75.0, 0.0)).norm() > 75.0 {
            continue;
        }
        if thorax.field_radius.is_some_and(|r| p.x.hypot(p.y) > r) {
            continue;
        }
        let truth = thorax.truth(&p);
        for (c, want, got) in [
            (0, truth == Truth::Soft, label::is_soft_tissue(l)),
            (1, truth == Truth::Wall, label::is_chest_wall(l)),
        ] {
            counts[c][0] += usize::from(want && got);
            counts[c][1] += usize::from(want);
            counts[c][2] += usize::from(got);
        }
    }
    counts.map(|[both, a, b]| 2.0 * both as f64 / (a + b) as f64)
}

#[test]
fn a_thorax_with_ribs_gland_on_muscle_table_and_wire() {
    let thorax = Thorax::default();
    let ct = thorax.ct(Matrix::identity());
    let (labels, info) = run(&ct);
    let [soft, wall] = dice(&thorax, &labels);
    assert!(soft > 0.97 && wall > 0.985, "soft {soft:.4} wall {wall:.4}");
    assert!((info.fat_hu + 100.0).abs() < 6.0 && (info.muscle_hu - 52.0).abs() < 6.0, "{info:?}");
    // The wire on the skin is left out, and told.
    let told: Vec<&str> = info.warnings.iter().map(|warning| warning.code()).collect();
    assert!(told == ["object-on-skin"] && info.truncated_share == 0.0, "{:?}", info.warnings);
    assert!(info.foreign_cm3 > 0.1, "the wire was not found");
    let mut foreign = 0;
    for (n, &l) in labels.data().iter().enumerate() {
        let p = labels.grid().centre(labels.grid().voxel(n));
        foreign += usize::from(l != 0 && thorax.is_table_or_wire(&p));
    }
    assert_eq!(foreign, 0, "voxels of table or wire in the patient");
}

#[test]
fn any_direction_of_the_axes_gives_the_same_patient() {
    let thorax = Thorax::default();
    // i to the back, j to the right, k to the feet; and tilted by 12 degrees about x.
    let turned = Matrix::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
    let (s, c) = 12f64.to_radians().sin_cos();
    let tilted = Matrix::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c);
    for direction in [turned, tilted] {
        let labels = run(&thorax.ct(direction)).0;
        let [soft, wall] = dice(&thorax, &labels);
        assert!(soft > 0.965 && wall > 0.98, "soft {soft:.4} wall {wall:.4}");
    }
}

#[test]
fn sagittal_slices_are_refused() {
    let d = Matrix::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
    let error = segment(Arc::new(Thorax::default().ct(d)), &Params::default(), Progress::none());
    assert!(matches!(error, Err(Error::NotAxial { .. })), "{error:?}");
}

#[test]
fn a_truncated_field_with_padding_is_reported_and_survived() {
    let thorax = Thorax { field_radius: Some(140.0), ..Thorax::default() };
    let (labels, info) = run(&thorax.ct(Matrix::identity()));
    assert!(info.truncated_share > 0.9, "{info:?}");
    assert!(
        info.warnings.iter().any(|w| w.to_string().contains("reconstructed field")),
        "{info:?}"
    );
    let [soft, wall] = dice(&thorax, &labels);
    assert!(soft > 0.94 && wall > 0.97, "soft {soft:.4} wall {wall:.4}");
}

#[test]
fn air_under_the_breast_is_not_the_patient_and_open_airways_are() {
    let thorax = Thorax { pocket: true, airway: true, ..Thorax::default() };
    let (labels, info) = run(&thorax.ct(Matrix::identity()));
    assert_eq!(labels.at(labels.grid().voxel_at(&phantom::POCKET).unwrap()), label::OUTSIDE);
    assert_eq!(at(&labels, &Point::new(0.0, 0.0, 55.0)), label::CHEST_WALL);
    assert!(info.lung_l > 1.0, "{info:?}");
    assert!(dice(&thorax, &labels)[0] > 0.97);
}

fn at(labels: &LabelMap, p: &Point) -> u8 {
    labels.at(labels.grid().voxel_at(p).unwrap())
}

#[test]
fn what_is_not_a_chest_is_refused() {
    let ct = Thorax::default().ct(Matrix::identity());
    let of =
        |f: fn(i16) -> i16| Ct::new(ct.grid().clone(), ct.data().iter().map(|&v| f(v)).collect());
    let refused = |ct: Ct| segment(Arc::new(ct), &Params::default(), Progress::none()).unwrap_err();
    assert!(matches!(
        refused(of(|v| if v < -500 { -1000 } else { v }).unwrap()),
        Error::NoLungs { .. }
    ));
    assert!(matches!(refused(of(|v| v.min(60)).unwrap()), Error::NoRibs { .. }));
    let level = Params { skin_hu: 50.0, ..Params::default() };
    let error = segment(Arc::new(ct), &level, Progress::none()).unwrap_err();
    assert!(matches!(error, Error::Parameter { name: "skin_hu", .. }), "{error}");
}

#[test]
fn stopping_stops() {
    let ct = Thorax::default().ct(Matrix::identity());
    let error = segment(Arc::new(ct), &Params::default(), Progress::new(&|x| x < 0.5));
    assert!(matches!(error, Err(Error::Stopped(_))), "{error:?}");
}

#[test]
fn one_thread_and_two_give_the_same_bytes() {
    let ct = Thorax::default().ct(Matrix::identity());
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&ct))
    };
    assert_eq!(with(1), with(2));
}

#[test]
fn the_region_holds_the_breast_and_the_tumour() {
    let thorax = Thorax::default();
    let labels = thorax.ct(Matrix::identity());
    let labels = labels
        .with_data(
            (0..labels.grid().len())
                .map(|n| match thorax.truth(&labels.grid().centre(labels.grid().voxel(n))) {
                    Truth::Outside => label::OUTSIDE,
                    Truth::Soft => label::SOFT_TISSUE,
                    Truth::Wall => label::CHEST_WALL,
                })
                .collect(),
        )
        .unwrap();
    for side in [Side::Left, Side::Right] {
        let breast = Breast::find(&labels, side, None).unwrap();
        let apex = Point::new(side.sign() * phantom::APEX.x, phantom::APEX.y, phantom::APEX.z);
        let region = breast.region(&labels, None).unwrap().0;
        // The mound's axis stands 75 mm beside the middle, its rim 50 mm round that.
        let off = region.centre() - Point::new(side.sign() * 75.0, -105.0, 0.0);
        assert!(off.norm() < 12.0 && off.z.abs() < 5.0, "{side}: {region:?}");
        assert!(region.signed_distance(&apex) < -30.0, "{side}: {region:?}");
        assert!((65.0..82.0).contains(&region.radius()), "{side}: {region:?}");
        let tumour = Sphere::new(apex + Vector::new(0.0, 60.0, 40.0), 10.0).unwrap();
        let held = breast.region(&labels, Some(tumour)).unwrap().0;
        assert!(held.signed_distance(&tumour.centre()) <= -tumour.radius() - 10.0, "{held:?}");
        let far = Sphere::new(apex + Vector::new(0.0, 0.0, 300.0), 10.0).unwrap();
        assert!(matches!(breast.region(&labels, Some(far)), Err(Error::NoRegion { .. })));
    }
    let flat = labels.map(|&l| if l == label::SOFT_TISSUE { label::OUTSIDE } else { l });
    let empty = labels.map(|_| label::OUTSIDE);
    for none in [flat, empty] {
        let error = Breast::find(&none, Side::Left, None).unwrap_err();
        assert!(matches!(error, Error::NoBreast { side: Side::Left, .. }), "{error}");
    }
}
