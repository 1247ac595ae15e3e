//! Skin and chest wall between the voxels.

use super::phantom::{Thorax, Truth};
use super::ready;
use crate::Seeds;
use std::sync::Arc;
use supine_space::{Matrix, Point, Progress, Vector};
use supine_volume::{Ct, LabelMap, Surfaces, label};

fn run(ct: &Ct, seeds: &Seeds) -> (Arc<LabelMap>, Surfaces) {
    let segmenter = ready(ct);
    let (made, _) = segmenter.segment(seeds, Progress::none()).unwrap();
    let surfaces = segmenter.surfaces(&made, Progress::none()).unwrap();
    (made.labels, surfaces)
}

/// The sign is the label, at every voxel.
fn signs_are_labels(labels: &LabelMap, surfaces: &Surfaces) {
    assert_eq!(labels.grid(), surfaces.skin.grid());
    for (n, &l) in labels.data().iter().enumerate() {
        assert_eq!(surfaces.skin.is_inside(n), l != label::OUTSIDE, "skin at {n}");
        assert_eq!(surfaces.chest_wall.is_inside(n), label::is_chest_wall(l), "wall at {n}");
    }
}

/// Mean and mean magnitude of what lies between the true surface, where `inside` ends along rays
/// from the middle of the left breast's base, and the one found, mm; + when found too far out.
fn errors(found: impl Fn(&Point) -> f64, inside: impl Fn(&Point) -> bool) -> [f64; 2] {
    let mut errors = Vec::new();
    for n in 0..400 {
        // Over the cap of a half-sphere in front, evenly.
        let (z, turn) = (0.5 + f64::from(n) / 800.0, 2.399_963 * f64::from(n));
        let flat = (1.0 - z * z).sqrt();
        let ray = Vector::new(flat * turn.cos(), -z, flat * turn.sin());
        let base = Point::new(75.0, -60.0, 0.0);
        let (mut low, mut high) = (0.0, 120.0);
        for _ in 0..30 {
            let middle = 0.5 * (low + high);
            if inside(&(base + ray * middle)) { low = middle } else { high = middle }
        }
        // The wire lies below.
        if (base + ray * low).z < -20.0 {
            continue;
        }
        errors.push(-found(&(base + ray * low)));
    }
    let mean =
        |v: &dyn Fn(f64) -> f64| errors.iter().map(|&e| v(e)).sum::<f64>() / errors.len() as f64;
    [mean(&|e| e), mean(&f64::abs)]
}

#[test]
fn surfaces_lie_between_the_voxels_and_their_signs_are_the_labels() {
    let thorax = Thorax::default();
    let (labels, surfaces) = run(&thorax.ct(Matrix::identity()), &Seeds::default());
    signs_are_labels(&labels, &surfaces);
    // The breast's front, in voxels of 2.8 x 2.8 x 5 mm.
    let inside = |p: &Point| thorax.truth(p) != Truth::Outside;
    let [bias, mean] = errors(|p| surfaces.skin.at(p), inside);
    assert!(bias.abs() < 0.3 && mean < 0.5, "skin: bias {bias:.3} mean {mean:.3}");
    let [bias, mean] = errors(|p| surfaces.chest_wall.at(p), |p| thorax.truth(p) == Truth::Wall);
    assert!(bias.abs() < 0.8 && mean < 1.0, "wall: bias {bias:.3} mean {mean:.3}");
}

#[test]
fn signs_are_labels_under_seeds_and_at_the_end_of_the_field() {
    let thorax = Thorax { field_radius: Some(140.0), pocket: true, ..Thorax::default() };
    let seeds = Seeds {
        chest_wall: vec![Point::new(60.0, -100.0, 0.0)],
        soft_tissue: vec![Point::new(-60.0, -100.0, 0.0)],
        exclude: vec![Point::new(75.0, -124.0, 0.0)],
        ..Seeds::default()
    };
    let (labels, surfaces) = run(&thorax.ct(Matrix::identity()), &seeds);
    signs_are_labels(&labels, &surfaces);
    for p in &seeds.chest_wall {
        assert!(
            surfaces.chest_wall.is_inside(labels.grid().offset(labels.grid().voxel_at(p).unwrap()))
        );
    }
}
