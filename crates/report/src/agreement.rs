//! How well the moved CT agrees with the movement it was made by.

use crate::{Agreement, Scene, SkinAgreement};
use supine_mesh::{BoundaryFace, BoundaryTag};
use supine_space::Point;
use supine_volume::sample_trilinear_at;

/// Between air and tissue, HU.
const SKIN_HU: f32 = -450.0;
/// A skin is sought so far on both sides, mm.
const SEARCH_MM: f64 = 5.0;
/// In steps of this length, mm.
const STEP_MM: f64 = 0.25;

/// The measures of the scene: the moved mesh against the moved CT, independent of how that was
/// made.
pub fn agreement(scene: &Scene<'_>) -> Agreement {
    Agreement { voxel_mm: scene.ct.grid().spacing().max(), skin: skin(scene) }
}

fn skin(scene: &Scene<'_>) -> Option<SkinAgreement> {
    let faces = scene.mesh().boundary().iter().filter(|face| face.tag == BoundaryTag::Skin);
    let distances: Vec<Option<f64>> = faces.filter_map(|face| distance(scene, face)).collect();
    (!distances.is_empty()).then(|| told(&distances))
}

/// The distances where a skin was found, and how many places have none.
fn told(found: &[Option<f64>]) -> SkinAgreement {
    let mut distances: Vec<f64> = found.iter().copied().flatten().collect();
    distances.sort_by(f64::total_cmp);
    let at = |share: usize| {
        distances.get(distances.len().saturating_sub(1) * share / 100).copied().unwrap_or(0.0)
    };
    SkinAgreement {
        places: found.len(),
        lost: found.len() - distances.len(),
        mean_mm: distances.iter().sum::<f64>() / distances.len().max(1) as f64,
        p95_mm: at(95),
        max_mm: at(100),
    }
}

/// From the middle of a moved face along its normal to the nearest skin of the moved CT, mm; `None`
/// within when there is none near, without when the place lies outside the CT.
#[expect(clippy::option_option, reason = "not measured, and measured but lost, are two things")]
fn distance(scene: &Scene<'_>, face: &BoundaryFace) -> Option<Option<f64>> {
    let corners = face
        .points
        .map(|p| scene.mesh().points()[p as usize] + scene.displacement().values()[p as usize]);
    let middle = Point::from((corners[0].coords + corners[1].coords + corners[2].coords) / 3.0);
    let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
    let normal = normal.try_normalize(f64::EPSILON)?;
    scene.deformed.grid().voxel_at(&middle)?;
    let hu = |along: f64| sample_trilinear_at::<i16>(scene.deformed, &(middle + normal * along));
    Some(nearest_crossing(hu))
}

/// Distance from 0 of the nearest place where a profile falls through the skin's value outwards.
fn nearest_crossing(hu: impl Fn(f64) -> f32) -> Option<f64> {
    let steps = (2.0 * SEARCH_MM / STEP_MM) as usize;
    let along = |n: usize| n as f64 * STEP_MM - SEARCH_MM;
    let values: Vec<f32> = (0..=steps).map(|n| hu(along(n))).collect();
    let crossing = |n: usize| {
        let (inner, outer) = (values[n], values[n + 1]);
        (inner >= SKIN_HU && outer < SKIN_HU)
            .then(|| along(n) + STEP_MM * f64::from((inner - SKIN_HU) / (inner - outer)))
    };
    (0..steps).filter_map(crossing).map(f64::abs).reduce(f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_without_a_skin_are_counted_and_are_no_distance() {
        let found = told(&[Some(0.2), None, Some(0.4), None]);
        assert_eq!((found.places, found.lost, found.max_mm), (4, 2, 0.4));
        assert!((found.mean_mm - 0.3).abs() < 1e-12);
        assert_eq!(told(&[None]).lost, 1);
    }

    #[test]
    fn the_nearest_way_out_of_the_tissue_counts() {
        let step = |edge: f64| move |x: f64| if x < edge { 0.0 } else { -1000.0 };
        assert!((nearest_crossing(step(1.3)).unwrap() - 1.25).abs() < 0.2);
        assert!((nearest_crossing(step(-2.0)).unwrap() - 2.0).abs() < 0.2);
        assert_eq!(nearest_crossing(|_| 0.0), None, "no air");
        assert_eq!(nearest_crossing(|x| if x < 1.0 { -1000.0 } else { 0.0 }), None, "inwards");
        // A fold of skin farther off does not matter.
        let fold = |x: f64| if x < 0.5 || (2.0..3.0).contains(&x) { 0.0 } else { -1000.0 };
        assert!(nearest_crossing(fold).unwrap() < 0.7);
        let ramp = |x: f64| -500.0 - 100.0 * x as f32;
        assert!((nearest_crossing(ramp).unwrap() - 0.5).abs() < 1e-6);
    }
}
