//! The CT and the simulated CT in strips beside each other, so that steps show what moved.

use super::{LETTER, PANEL, Picture, Row, Studio, dress, paint};
use crate::canvas::{Canvas, Pen, Rgb, Spot};
use crate::lettering::{Align, text_width};
use crate::palette;
use supine_space::Plane;
use supine_space::{Progress, Stopped};

/// Strips across a picture.
const STRIPS: usize = 6;

/// The three planes through the focus.
pub(super) fn row(studio: &Studio<'_>, progress: Progress<'_>) -> Result<Row, Stopped> {
    let mut pictures = Vec::new();
    for (n, plane) in studio.planes().into_iter().enumerate() {
        progress.at(n as f64 / 3.0)?;
        let name = plane.view.name();
        pictures.push(Picture {
            name: format!("{name}_curtain"),
            caption: format!("CT and simulated CT in turn, {name}"),
            canvas: strips(studio, &plane),
        });
    }
    Ok(Row {
        text: "Strips of the CT and of the simulated CT in turn. Where nothing may move (ribs, chest wall, \
               all outside the dashed circle) lines must run on across the strips; steps at the skin are the \
               movement."
            .into(),
        pictures,
        ..Row::default()
    })
}

fn strips(studio: &Studio<'_>, plane: &Plane) -> Canvas {
    let strip = |x: usize| x * STRIPS / plane.width;
    let mut samples = supine_volume::sample_plane(studio.scene.ct, plane);
    for (n, after) in
        supine_volume::sample_plane(studio.scene.deformed, plane).into_iter().enumerate()
    {
        if strip(n % plane.width) % 2 == 1 {
            samples[n] = after;
        }
    }
    let mut canvas = paint(plane, &samples, 1.0);
    studio.outline_region(&mut canvas, plane);
    let height = plane.height as f64;
    for n in 0..STRIPS {
        let [left, right] = [n, n + 1].map(|n| (n * plane.width / STRIPS) as f64);
        let (name, rgb) =
            if n % 2 == 0 { ("CT", palette::BEFORE) } else { ("SIM", palette::AFTER) };
        // Below the line of the plane's position.
        name_strip(&mut canvas, name, [0.5 * (left + right), 4.2 * LETTER], rgb);
        if n > 0 {
            let line = [[left, 0.0], [left, height]];
            canvas.stroke(&[line], Pen::new(1.0, palette::REGION).alpha(0.35));
        }
    }
    dress(&mut canvas, plane, "");
    canvas
}

/// A name in the middle of a strip, on a panel: it may stand on bone.
fn name_strip(canvas: &mut Canvas, name: &str, [x, y]: Spot, rgb: Rgb) {
    let small = 0.8 * LETTER;
    let (half, free) = (0.5 * text_width(name, small), 5.0);
    let corner = [x - half - free, y - small - free].map(|c| c.max(0.0) as usize);
    let size = [2.0 * (half + free), small + 2.0 * free].map(|c| c as usize);
    canvas.rectangle(corner, size, palette::PANEL, PANEL);
    canvas.text(name, [x, y], Align::Centre, small, rgb);
}
