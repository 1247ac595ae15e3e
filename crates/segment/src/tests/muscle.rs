//! What is muscle and what only looks like it.

use super::phantom::{Thorax, Truth};
use super::{dice, run};
use supine_space::{Matrix, Point};
use supine_volume::label;

/// Share of the free border of the pectoralis that is labelled chest wall, and share of the chest
/// wall's labels near it that are not chest wall.
fn free_border(thorax: &Thorax) -> [f64; 2] {
    let (labels, _) = run(&thorax.ct(Matrix::identity()));
    let [mut border, mut found, mut wall, mut wrong] = [0usize; 4];
    for n in 0..labels.data().len() {
        let p = labels.grid().centre(labels.grid().voxel(n));
        let is_wall = label::is_chest_wall(labels.data()[n]);
        // 5 mm from both ends of the map.
        if (5.0..45.0).contains(&p.z) && thorax.in_free_border(&p) {
            border += 1;
            found += usize::from(is_wall);
        }
        if (60.0..140.0).contains(&p.x) && p.y < -20.0 && is_wall {
            wall += 1;
            wrong += usize::from(thorax.truth(&p) != Truth::Wall);
        }
    }
    [found as f64 / border as f64, wrong as f64 / wall as f64]
}

#[test]
fn the_free_border_of_the_pectoralis_is_followed_beyond_one_radius_per_ray() {
    // The surface alone takes in 0.42 of this sheet, which overhangs 30 mm of fat.
    let [found, wrong] = free_border(&Thorax { free_border: true, ..Thorax::default() });
    assert!(found > 0.53 && wrong < 0.03, "found {found:.3} wrong {wrong:.3}");
}

#[test]
fn gland_as_dense_as_muscle_stays_mostly_soft_tissue() {
    // Without the rule for blobs: 0.919 and 0.962.
    let thorax = Thorax { gland_hu: 52.0, ..Thorax::default() };
    let (labels, _) = run(&thorax.ct(Matrix::identity()));
    let [soft, wall] = dice(&thorax, &labels);
    assert!(soft > 0.935 && wall > 0.97, "soft {soft:.4} wall {wall:.4}");
}

#[test]
fn a_breast_full_of_gland_is_no_chest_wall() {
    // From the muscle to 6 mm under the skin, with strands as dense as muscle. 0.888 and 0.948 when
    // gland beyond the expected thickness costs nothing.
    let full = |p: &Point| {
        let beyond = Thorax::above_ribs(p) - Thorax::muscle_mm(p);
        let inside = beyond > 0.0 && Thorax::skin(p) < -6.0;
        let breast = (p.x - 75.0).hypot(p.z) < 36.0 && p.y < 0.0;
        let strand = (p.x + p.z).rem_euclid(17.0) < 2.0;
        (inside && breast).then_some(if strand { 58.0 } else { 34.0 })
    };
    let thorax = Thorax { object: Some(full), ..Thorax::default() };
    let (labels, _) = run(&thorax.ct(Matrix::identity()));
    let [soft, wall] = dice(&thorax, &labels);
    assert!(soft > 0.97 && wall > 0.988, "soft {soft:.4} wall {wall:.4}");
}
