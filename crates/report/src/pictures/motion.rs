//! How the tissue moves: displacement with arrows.

use super::moving::Motion;
use super::{Legend, Picture, Row, Studio, dress, paint, round_up};
use crate::canvas::{Canvas, Pen};
use crate::lettering::Align;
use crate::{palette, words};
use supine_space::Plane;

/// Distance of arrows, pixels.
const STEP: usize = 26;
/// Longest arrow, in steps.
const LONGEST: f64 = 1.9;
/// Opacity of colours over the CT.
const VEIL: f64 = 0.65;

/// How arrows and colours are scaled, alike in all planes.
struct Scale {
    /// Displacement at the end of the colour bar, mm.
    full_mm: f64,
    /// Arrows are drawn this many times longer than the tissue moves.
    enlarged: f64,
    /// Displacement of the arrow in the key, mm.
    key_mm: f64,
}

impl Scale {
    fn new(planes: &[Motion], pixel_mm: f64) -> Self {
        let moves = || planes.iter().flat_map(|m| m.moves.iter().flatten());
        let largest = moves().map(|u| u.norm()).fold(0.0, f64::max);
        let full_mm = round_up(largest);
        let room = LONGEST * STEP as f64 * pixel_mm / full_mm;
        let steps = [20.0, 10.0, 5.0, 4.0, 3.0, 2.0, 1.5, 1.0, 0.5, 0.25];
        let enlarged = steps.into_iter().find(|s| *s <= room).unwrap_or(0.1);
        Self { full_mm, enlarged, key_mm: full_mm }
    }
}

pub(super) fn displacement(studio: &Studio<'_>, planes: &[Motion]) -> Row {
    let scale = Scale::new(planes, studio.pixel_mm);
    let draw = |motion: &Motion| {
        let plane = &motion.plane;
        let mut canvas = paint(plane, &motion.ground, 0.8);
        for (n, u) in motion.moves.iter().enumerate() {
            if let Some(u) = u {
                let rgb = palette::on_scale(&palette::RISING, u.norm() / scale.full_mm);
                canvas.mix(n, rgb, VEIL);
            }
        }
        arrows(&mut canvas, motion, &scale);
        studio.mark_before(&mut canvas, plane, false);
        dress(&mut canvas, plane, "displacement");
        key(&mut canvas, plane, &scale);
        Picture {
            name: format!("{}_displacement", plane.view.name()),
            caption: format!("Displacement, {}", plane.view.name()),
            canvas,
        }
    };
    Row {
        title: "Displacement".into(),
        text: format!(
            "From the CT to the operating position, at the place in the CT. Colour: length in \
             space; arrows: the part within the plane, drawn {} times as long.",
            words::trimmed(scale.enlarged)
        ),
        pictures: planes.iter().map(draw).collect(),
        ..Row::default()
    }
}

fn arrows(canvas: &mut Canvas, motion: &Motion, scale: &Scale) {
    let plane = &motion.plane;
    for y in (STEP / 2..plane.height).step_by(STEP) {
        for x in (STEP / 2..plane.width).step_by(STEP) {
            let Some(u) = motion.moves[y * plane.width + x] else { continue };
            let [dx, dy] = plane.along(&(u * scale.enlarged));
            if dx.hypot(dy) > 2.0 {
                let from = [x as f64, y as f64];
                let to = [from[0] + dx, from[1] + dy];
                canvas.arrow(from, to, Pen::new(1.6, palette::WHITE));
            }
        }
    }
}

fn key(canvas: &mut Canvas, plane: &Plane, scale: &Scale) {
    let colour = |share| palette::on_scale(&palette::RISING, share);
    let half = words::trimmed(scale.full_mm / 2.0);
    let ticks = ["0".into(), half, words::trimmed(scale.full_mm)];
    let [x, y] = Legend { colour: &colour, ticks, title: "length, mm" }.draw(canvas, 24);
    let y = y + 3.0;
    let length = scale.key_mm * scale.enlarged / plane.pixel_mm;
    canvas.arrow([x, y], [x + length, y], Pen::new(1.6, palette::WHITE));
    let label = format!("{} mm", words::trimmed(scale.key_mm));
    let spot = [x + length + 8.0, y + 5.0];
    canvas.text(&label, spot, Align::Left, 0.75 * super::LETTER, palette::TEXT);
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::View;
    use supine_space::{Point, Vector};

    /// Mean place of the white pixels of the arrow of one displacement, relative to its start.
    fn drawn(view: View, u: Vector) -> [f64; 2] {
        let frame = [Point::new(-50.0, -50.0, -50.0), Point::new(50.0, 50.0, 50.0)];
        let plane = Plane::new(view, &Point::origin(), frame, 0.5);
        let (width, pixels) = (plane.width, plane.width * plane.height);
        let start = STEP / 2 + 3 * STEP;
        let mut moves = vec![None; pixels];
        moves[start * width + start] = Some(u);
        let mut canvas = Canvas::new(width, plane.height);
        let motion = Motion { plane, ground: Vec::new(), below: Vec::new(), moves };
        arrows(&mut canvas, &motion, &Scale { full_mm: 5.0, enlarged: 3.0, key_mm: 5.0 });
        let (mut sum, mut n) = ([0.0; 2], 0.0);
        for p in 0..pixels {
            let (x, y) = (p % width, p / width);
            if canvas.at(x, y) == [255; 3] {
                sum = [sum[0] + x as f64 - start as f64, sum[1] + y as f64 - start as f64];
                n += 1.0;
            }
        }
        sum.map(|s| s / n)
    }

    #[test]
    fn arrows_point_where_the_tissue_goes() {
        let left_and_down = Vector::new(5.0, 0.0, -2.5);
        let [x, y] = drawn(View::Coronal, left_and_down);
        assert!(x > 8.0 && (y / x - 0.5).abs() < 0.1, "left is right, feet are down: {x} {y}");
        let [x, y] = drawn(View::Coronal, -left_and_down);
        assert!(x < -8.0 && (y / x - 0.5).abs() < 0.1, "{x} {y}");
        let [x, y] = drawn(View::Axial, left_and_down);
        assert!(x > 8.0 && y.abs() < 0.3, "no part along y: {x} {y}");
        let [x, y] = drawn(View::Sagittal, Vector::new(0.0, -5.0, 0.0));
        assert!(x < -8.0 && y.abs() < 0.3, "the front is left: {x} {y}");
    }
}
