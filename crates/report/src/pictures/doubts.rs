//! Every uncertain place of the chest wall, near by.

use super::{Part, Picture, Row, Studio, dress, paint, uncertainty};
use crate::canvas::Pen;
use crate::summary::{UncertainPatch, WallUncertainty};
use crate::words::{fixed, triple};
use crate::{Error, palette};
use supine_space::{Plane, Point, Progress, Vector, View};

/// Half the side of a picture, mm.
const HALF_MM: f64 = 40.0;
/// Side of a pixel, mm.
const PIXEL_MM: f64 = 0.25;
/// Pictures side by side.
const IN_A_ROW: usize = 3;
/// The others are shown by the slice viewer alone.
const MOST: usize = 9;

/// A picture of each place, in the order and with the numbers of the table of places.
pub(super) fn rows(
    studio: &Studio<'_>,
    found: &WallUncertainty,
    progress: Progress<'_>,
) -> Result<Vec<Row>, Error> {
    let ranked: Vec<_> = found.ranked().into_iter().take(MOST).enumerate().collect();
    if ranked.is_empty() {
        return Ok(Vec::new());
    }
    let mut rows = Vec::new();
    for (n, places) in ranked.chunks(IN_A_ROW).enumerate() {
        progress.at((n * IN_A_ROW) as f64 / ranked.len() as f64)?;
        let pictures = places.iter().map(|&(n, patch)| near_by(studio, n + 1, patch));
        rows.push(Row {
            text: if n == 0 { told(found.patches.len()) } else { String::new() },
            part: Part::Uncertain,
            pictures: pictures.collect(),
            ..Row::default()
        });
    }
    Ok(rows)
}

fn told(places: usize) -> String {
    let which = match places {
        0..=MOST => "The uncertain places".to_owned(),
        _ => format!("The {MOST} uncertain places that do most to the tumour"),
    };
    format!(
        "{which} in the CT, near by, by their numbers in the table: chest wall orange, white and dashed where it is uncertain, \
         with a cross at the middle. Is the line where you see the boundary?"
    )
}

/// The axial plane through the middle of a place, with the outlines of chest wall and skin.
fn near_by(studio: &Studio<'_>, number: usize, patch: &UncertainPatch) -> Picture {
    let middle = Point::from(patch.centre_mm);
    let around = Vector::repeat(HALF_MM);
    let plane = Plane::new(View::Axial, &middle, [middle - around, middle + around], PIXEL_MM);
    let mut canvas = paint(&plane, &supine_volume::sample_plane(studio.scene.ct, &plane), 1.0);
    uncertainty::outlines(studio, &mut canvas, &plane);
    studio.mark_before(&mut canvas, &plane, false);
    canvas.cross(plane.spot(&middle), 7.0, Pen::new(1.6, palette::TEXT));
    dress(&mut canvas, &plane, &number.to_string());
    Picture {
        name: format!("uncertain_{number}"),
        caption: format!(
            "{number}: {}, {} mm, may be off by {} mm",
            patch.place,
            triple(patch.centre_mm, 1),
            fixed(patch.error_mm, 0)
        ),
        canvas,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phantom::Phantom;
    use supine_space::Matrix;

    fn patch(x: f64, effect_mm: f64) -> UncertainPatch {
        UncertainPatch {
            area_cm2: 1.0,
            centre_mm: [x, 5.0, 0.0],
            error_mm: 4.0,
            place: "upper outer".into(),
            effect_mm: Some(effect_mm),
            seeds_mm: vec![],
        }
    }

    #[test]
    fn what_moves_the_tumour_most_is_the_first_and_lies_in_the_middle() {
        let phantom = Phantom::new(Matrix::identity(), Vector::zeros());
        let scene = phantom.scene();
        let patches = (0..11).map(|n| patch(f64::from(n), 0.1 * f64::from(n))).collect();
        let found =
            WallUncertainty { boundary_cm2: 50.0, uncertain_cm2: 11.0, limit_mm: 2.0, patches };
        let rows = rows(&Studio::new(&scene, 2.0), &found, Progress::none()).unwrap();
        assert!(rows[0].text.contains("The 9 uncertain places"), "{}", rows[0].text);
        let pictures: Vec<_> = rows.into_iter().flat_map(|row| row.pictures).collect();
        assert_eq!(pictures.len(), MOST);
        assert!(pictures[0].caption.starts_with("1: upper outer, (10.0, 5.0, 0.0) mm"));
        let canvas = &pictures[0].canvas;
        let middle = [canvas.width() / 2, canvas.height() / 2];
        let cross = |n: usize| canvas.at(middle[0] - 6 + n % 12, middle[1] - 6 + n / 12);
        assert!((0..144).map(cross).any(|rgb| rgb.iter().all(|c| *c > 170)), "a light cross");
        // The boundary runs through it, uncertain on the patient's left, which the viewer has on
        // the right.
        let row = |x: usize| {
            (middle[1] - 8..middle[1] + 8).any(|y| canvas.at(x, y) == palette::UNCERTAIN)
        };
        assert!((middle[0] + 20..canvas.width() - 60).any(row));
    }
}
