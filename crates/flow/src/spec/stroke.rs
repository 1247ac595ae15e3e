//! Strokes of a brush as a case file holds them: `{ tissue = "chest_wall", radius = 6.0, points =
//! [[x, y, z], ...] }`.

use super::json::{list, numbers};
use serde_json::{Value as Json, json};
use supine_space::Point;
use supine_volume::{SeedKind, Stroke};

/// Radii of a brush, mm.
pub(super) const RADIUS: [f64; 2] = [0.1, 50.0];
/// What a stroke may say, and the word for it.
const TISSUES: [(&str, Option<SeedKind>); 4] = [
    ("chest_wall", Some(SeedKind::ChestWall)),
    ("soft_tissue", Some(SeedKind::SoftTissue)),
    ("exclude", Some(SeedKind::Exclude)),
    ("erase", None),
];

/// The words for what a stroke says.
pub(super) fn words() -> [&'static str; 4] {
    TISSUES.map(|(word, _)| word)
}

/// A stroke, if it is one.
pub(super) fn of_json(given: &Json) -> Option<Stroke> {
    let given = given.as_object()?;
    if given.len() != 3 {
        return None;
    }
    let word = given.get("tissue")?.as_str()?;
    let (_, kind) = TISSUES.into_iter().find(|(known, _)| *known == word)?;
    let [least, most] = RADIUS;
    let radius_mm = given.get("radius")?.as_f64().filter(|r| (least..=most).contains(r))?;
    let points = list(given.get("points")?, numbers)?;
    let points: Vec<Point> = points.into_iter().map(|p: [f64; 3]| Point::from(p)).collect();
    (!points.is_empty()).then_some(Stroke { kind, radius_mm, points })
}

/// A stroke as a case file holds it.
pub(crate) fn to_json(stroke: &Stroke) -> Json {
    let word = TISSUES.iter().find(|(_, kind)| *kind == stroke.kind).map_or("", |(word, _)| word);
    let points: Vec<[f64; 3]> = stroke.points.iter().map(|p| p.coords.into()).collect();
    json!({ "tissue": word, "radius": stroke.radius_mm, "points": points })
}
