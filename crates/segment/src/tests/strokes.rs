//! Strokes of a brush: what they cover is obeyed, what cannot be meant is left alone.

use super::phantom::Thorax;
use super::{at, ready};
use crate::{Error, SeedKind, Seeds, Segmenter};
use std::sync::Arc;
use supine_space::{Matrix, Point, Progress, Vector};
use supine_volume::{LabelMap, Stroke, label};

fn run(of: &Segmenter, strokes: Vec<Stroke>) -> Result<Arc<LabelMap>, Error> {
    let seeds = Seeds { strokes, ..Seeds::default() };
    Ok(of.segment(&seeds, Progress::none())?.0.labels)
}

fn stroke(kind: SeedKind, radius_mm: f64, points: &[[f64; 3]]) -> Stroke {
    let points = points.iter().map(|p| Point::from(*p)).collect();
    Stroke { kind: Some(kind), radius_mm, points }
}

/// The outermost chest wall along a direction in the plane z = 0.
fn surface(labels: &LabelMap, ray: &Vector) -> Point {
    let along = (0..200).map(|n| Point::origin() + ray * (60.0 + 0.5 * f64::from(n)));
    along.take_while(|p| at(labels, p) == label::CHEST_WALL).last().unwrap()
}

#[test]
fn a_stroke_moves_the_wall_to_its_rim_and_the_eraser_takes_it_back() {
    let ct = Thorax::default().ct(Matrix::identity());
    let segmenter = ready(&ct);
    let plain = run(&segmenter, vec![]).unwrap();
    let ray = Vector::new(0.5f64.sin(), -0.5f64.cos(), 0.0);
    let wall = surface(&plain, &ray);
    let side = Vector::new(0.0, 0.0, 8.0);
    let across = [wall + ray * 2.0 - side, wall + ray * 2.0 + side].map(|p| p.coords.into());
    let painted = stroke(SeedKind::ChestWall, 4.0, &across);
    let with = run(&segmenter, vec![painted.clone()]).unwrap();
    let mut covered = 0;
    painted.voxels(ct.grid(), |n| {
        covered += 1;
        assert_eq!(with.data()[n], label::CHEST_WALL);
    });
    assert!(covered > 20, "{covered}");
    assert!((surface(&with, &ray) - wall).norm() > 3.0);
    let erased = Stroke { kind: None, radius_mm: 5.0, ..painted.clone() };
    let back = run(&segmenter, vec![painted, erased]).unwrap();
    assert!(back.data() == plain.data());
}

#[test]
fn a_later_stroke_counts_where_two_cross() {
    let ct = Thorax::default().ct(Matrix::identity());
    let segmenter = ready(&ct);
    let ray = Vector::new(0.5f64.sin(), -0.5f64.cos(), 0.0);
    let wall = surface(&run(&segmenter, vec![]).unwrap(), &ray);
    let place = (wall + ray * 2.0).coords.into();
    let first = stroke(SeedKind::SoftTissue, 3.0, &[place]);
    let second = stroke(SeedKind::ChestWall, 4.0, &[place]);
    let labels = run(&segmenter, vec![first, second.clone()]).unwrap();
    second.voxels(ct.grid(), |n| assert_eq!(labels.data()[n], label::CHEST_WALL));
}

#[test]
fn a_broad_brush_over_the_skin_paints_the_patient_alone() {
    let thorax = Thorax::default();
    let ct = thorax.ct(Matrix::identity());
    let segmenter = ready(&ct);
    let plain = run(&segmenter, vec![]).unwrap();
    let apex = super::phantom::APEX;
    let over = stroke(SeedKind::SoftTissue, 9.0, &[apex.coords.into()]);
    assert!(run(&segmenter, vec![over]).unwrap().data() == plain.data());
    let beside = stroke(SeedKind::SoftTissue, 3.0, &[[75.0, -160.0, 0.0]]);
    let error = run(&segmenter, vec![beside]).unwrap_err();
    assert!(error.to_string().contains("covers nothing of the patient"), "{error}");
}
