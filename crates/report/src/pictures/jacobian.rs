//! The change of volume: det F over the CT, its histograms, and where it is most extreme.

use super::bars::Bars;
use super::moving::Motion;
use super::{Legend, Picture, Row, Studio, dress, paint};
use crate::canvas::{Canvas, Pen, Rgb};
use crate::words::{fixed, triple};
use crate::{Error, Shown, VolumeChange, palette, tables, words};
use supine_mesh::{Below, det_f};
use supine_space::View;
use supine_space::{Point, Progress};

/// Opacity of colours over the CT.
const VEIL: f64 = 0.65;
/// Opacity of the colour that says no change.
const FAINT: f64 = 0.12;
/// Size of a histogram, pixels.
const HISTOGRAM: [usize; 2] = [520, 250];
/// Histograms beside each other.
const COLUMNS: usize = 3;

/// det F in the planes through the focus, the figures and histograms of each structure, and the
/// planes through its extremes.
pub(super) fn rows(
    studio: &Studio<'_>,
    shown: &Shown<'_>,
    planes: &[Motion],
    progress: Progress<'_>,
) -> Result<Vec<Row>, Error> {
    // The first is all that is simulated.
    let Some(all) = shown.volumes.first() else { return Ok(Vec::new()) };
    let span = all.span;
    let mut rows = vec![Row {
        title: "Change of volume".into(),
        text: "det F at the place in the CT: below 1 (blue) compressed, above 1 (red) stretched. \
               Values beyond the bar take the colour of its end. It is the tissue's own; what the fade at the cut adds \
               in the exported CT is the last line of the table. HU are carried unchanged."
            .into(),
        pictures: planes.iter().map(|m| picture(studio, m, span, None)).collect(),
        table: tables::volumes(shown.volumes),
        ..Row::default()
    }];
    rows.push(histograms(shown.volumes));
    progress.at(0.4)?;
    let ends = [
        ("smallest", "min", all.min_mm, all.jacobian.min),
        ("largest", "max", all.max_mm, all.jacobian.max),
    ];
    for (n, (end, name, place, det)) in ends.into_iter().enumerate() {
        progress.at(0.4 + 0.3 * n as f64)?;
        rows.push(extreme(studio, span, (end, name), Point::from(place), det));
    }
    Ok(rows)
}

/// det F below each pixel.
fn dets(studio: &Studio<'_>, motion: &Motion) -> Vec<Option<f64>> {
    let scene = studio.scene;
    let det =
        |b: &Below| b.map(|(tet, l)| det_f(scene.mesh(), &studio.edges, scene.tissue, tet, l));
    motion.below.iter().map(det).collect()
}

/// det F in colour on the CT; a cross at `at`.
fn picture(studio: &Studio<'_>, motion: &Motion, span: f64, at: Option<&Point>) -> Picture {
    let plane = &motion.plane;
    let mut canvas = paint(plane, &motion.ground, 0.8);
    for (n, det) in dets(studio, motion).into_iter().enumerate() {
        if let Some(det) = det {
            let share = (det - 1.0) / span;
            let veil = FAINT + (VEIL - FAINT) * share.abs().min(1.0);
            canvas.mix(n, by_change(0.5 + share / 2.0), veil);
        }
    }
    studio.mark_before(&mut canvas, plane, false);
    cross(&mut canvas, motion, at);
    dress(&mut canvas, plane, "volume change");
    let ticks = [1.0 - span, 1.0, 1.0 + span].map(words::trimmed);
    Legend { colour: &by_change, ticks, title: "det F" }.draw(&mut canvas, 0);
    Picture {
        name: format!("{}_volume_change", plane.view.name()),
        caption: format!("Local change of volume, {}", plane.view.name()),
        canvas,
    }
}

fn cross(canvas: &mut Canvas, motion: &Motion, at: Option<&Point>) {
    if let Some(at) = at {
        canvas.circle(motion.plane.spot(at), 14.0, 0, Pen::new(1.8, palette::BEFORE));
    }
}

fn by_change(share: f64) -> Rgb {
    palette::on_scale(&palette::DIVERGING, share)
}

/// The axial plane through an extreme of det F: before, after, change of volume.
fn extreme(
    studio: &Studio<'_>,
    span: f64,
    (end, name): (&str, &str),
    place: Point,
    det: f64,
) -> Row {
    let motion = Motion::new(studio, studio.plane(View::Axial, &place));
    let plane = &motion.plane;
    let shown = |samples: &[f32], what: &str| {
        let mut canvas = paint(plane, samples, 1.0);
        studio.outline_region(&mut canvas, plane);
        cross(&mut canvas, &motion, Some(&place));
        dress(&mut canvas, plane, what);
        canvas
    };
    let before = shown(&motion.ground, "CT");
    let after = shown(&supine_volume::sample_plane(studio.scene.deformed, plane), "SIMULATED");
    let change = picture(studio, &motion, span, Some(&place));
    Row {
        text: format!(
            "The slice of the {end} det F, {}, at {} mm in the CT (circle).",
            fixed(det, 2),
            triple(place.coords.into(), 1),
        ),
        pair: true,
        pictures: vec![
            Picture {
                name: format!("{name}_volume_before"),
                caption: "The CT, patient on her back".into(),
                canvas: before,
            },
            Picture {
                name: format!("{name}_volume_after"),
                caption: "On the operating table (simulated)".into(),
                canvas: after,
            },
            Picture { name: format!("{name}_volume_change"), ..change },
        ],
        ..Row::default()
    }
}

/// Histograms of det F, one per structure, in columns.
fn histograms(volumes: &[VolumeChange]) -> Row {
    let columns = COLUMNS.min(volumes.len());
    let column = |n: usize| {
        let [width, height] = HISTOGRAM;
        let mut canvas = Canvas::new(width, height * volumes.len().div_ceil(columns));
        let size = [width, canvas.height()];
        canvas.rectangle([0, 0], size, palette::NOTHING, 1.0);
        let own: Vec<_> = volumes.iter().skip(n).step_by(columns).collect();
        for (at, change) in own.iter().enumerate() {
            histogram(&mut canvas, at * height, change);
        }
        let names: Vec<_> = own.iter().map(|c| words::capital(&c.structure)).collect();
        Picture { name: format!("volume_histograms_{}", n + 1), caption: names.join("; "), canvas }
    };
    Row {
        text:
            "How much of each structure's volume changes by how much; the outermost bars hold all \
               beyond."
                .into(),
        pictures: (0..columns).map(column).collect(),
        ..Row::default()
    }
}

fn histogram(canvas: &mut Canvas, top: usize, change: &VolumeChange) {
    let classes = change.shares.len() as f64;
    let share = |n: f64| n / classes;
    let bars = Bars {
        amounts: change.shares.clone(),
        every: (change.shares.len() / 4).max(1),
        tick: &|n| words::trimmed(1.0 + (2.0 * share(n as f64) - 1.0) * change.span),
        colour: &|n| by_change(share(n as f64 + 0.5)),
    };
    let title = format!("{}: det F, share of its volume", change.structure);
    bars.draw(canvas, top, HISTOGRAM[1], &title);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_histogram_stands_left_of_one_where_all_is_squeezed() {
        let mut shares = vec![0.0; 40];
        shares[0] = 1.0;
        let jacobian = crate::Jacobian { min: 0.7, p01: 0.7, mean: 0.7, p99: 0.7, max: 0.7 };
        let change = VolumeChange {
            structure: "fat".into(),
            before_ml: 1.0,
            after_ml: 0.7,
            jacobian,
            min_mm: [0.0; 3],
            max_mm: [0.0; 3],
            span: 0.1,
            shares,
        };
        let row = histograms(&vec![change; 4]);
        let heights: Vec<_> = row.pictures.iter().map(|p| p.canvas.height()).collect();
        assert_eq!(heights, [2 * HISTOGRAM[1]; 3]);
        let canvas = &row.pictures[0].canvas;
        let (y, blue) = (HISTOGRAM[1] - 60, by_change(0.0));
        let near = |rgb: Rgb| (0..3).all(|c| rgb[c].abs_diff(blue[c]) < 30);
        let filled: Vec<usize> = (0..HISTOGRAM[0]).filter(|&x| near(canvas.at(x, y))).collect();
        assert!(!filled.is_empty() && filled.iter().all(|x| *x < 90), "{filled:?}");
    }
}
