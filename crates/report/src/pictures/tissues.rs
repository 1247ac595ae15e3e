//! Fat, gland and other tissues, in colour on the CT.

use super::{LETTER, Picture, Row, Studio, dress, paint};
use crate::canvas::Canvas;
use crate::lettering::Align;
use crate::summary::Tissues;
use crate::words::fixed;
use crate::{Error, palette, tables};
use supine_space::Plane;
use supine_space::Progress;
use supine_volume::{LabelMap, label};

/// Opacity of the colours within the region, and outside of it.
const OPACITY: [f64; 2] = [0.5, 0.15];
/// Swatches beside each other in the key.
const COLUMNS: usize = 2;

/// The tissues in the three planes through the focus.
pub(super) fn row(
    studio: &Studio<'_>,
    labels: &LabelMap,
    tissues: &Tissues,
    progress: Progress<'_>,
) -> Result<Row, Error> {
    let mut pictures = Vec::new();
    for (n, plane) in studio.planes().into_iter().enumerate() {
        progress.at(n as f64 / 3.0)?;
        let mut canvas = paint(&plane, &supine_volume::sample_plane(studio.scene.ct, &plane), 1.0);
        let seen = tint(studio, &mut canvas, &plane, labels);
        studio.outline_region(&mut canvas, &plane);
        studio.mark_before(&mut canvas, &plane, false);
        dress(&mut canvas, &plane, "");
        key(&mut canvas, &seen);
        pictures.push(Picture {
            name: format!("{}_tissues", plane.view.name()),
            caption: format!("Tissues, {}", plane.view.name()),
            canvas,
        });
    }
    Ok(Row {
        title: "Tissues".into(),
        text: sentence(tissues),
        pictures,
        table: Some(tables::tissues(tissues)),
        ..Row::default()
    })
}

/// Lays the colours over the CT; gives which labels are seen.
fn tint(studio: &Studio<'_>, canvas: &mut Canvas, plane: &Plane, labels: &LabelMap) -> [bool; 256] {
    let mut seen = [false; 256];
    for n in 0..plane.width * plane.height {
        let place = plane.patient([(n % plane.width) as f64, (n / plane.width) as f64]);
        let Some(voxel) = labels.grid().voxel_at(&place) else { continue };
        let here = labels.at(voxel);
        if let Some((.., rgb)) = label::ALL.iter().find(|(l, ..)| *l == here) {
            let outside = !studio.scene.sphere.contains(&place);
            canvas.mix(n, *rgb, OPACITY[usize::from(outside)]);
            seen[usize::from(here)] = true;
        }
    }
    seen
}

/// What the colours mean.
fn key(canvas: &mut Canvas, seen: &[bool; 256]) {
    let small = 0.75 * LETTER;
    let shown: Vec<_> = label::ALL.iter().filter(|(l, ..)| seen[usize::from(*l)]).collect();
    let lines = shown.len().div_ceil(COLUMNS);
    let (width, height) = (90 * COLUMNS + 6, 18 * lines + 6);
    let top = canvas.height().saturating_sub(height + 5);
    canvas.rectangle([5, top], [width, height], palette::PANEL, super::PANEL);
    for (n, (_, name, rgb)) in shown.into_iter().enumerate() {
        let (x, y) = (12 + 90 * (n / lines.max(1)), top + 6 + 18 * (n % lines.max(1)));
        canvas.rectangle([x, y], [14, 11], *rgb, 1.0);
        let spot = [(x + 20) as f64, (y + 10) as f64];
        canvas.text(name, spot, Align::Left, small, palette::TEXT);
    }
}

/// What the pictures say, in words.
fn sentence(tissues: &Tissues) -> String {
    let density = match tissues.density_percent {
        Some(density) => format!(
            "Breast density within the region: {} % (gland over gland and fat, by volume).",
            fixed(density, 0)
        ),
        None => "There is neither gland nor fat within the region.".into(),
    };
    let gland = tissues.levels.gland_hu.map_or_else(
        || "no gland is thick enough to be measured".into(),
        |hu| format!("gland {} HU", fixed(hu, 0)),
    );
    format!(
        "{density} Told apart half-way between the levels of this CT: fat {} HU, {gland}. Muscle in \
         front of the chest wall counts as gland, strands thinner than 4 mm as fat. For information: \
         mesh and deformed CT do not depend on these colours.",
        fixed(tissues.levels.fat_hu, 0)
    )
}
