//! Before, after and change, in planes through the tumour and at the level of the nipple.

use super::{Legend, Part, Picture, Row, Studio, curtain, dress, paint};
use crate::canvas::{Canvas, Pen, Rgb};
use crate::{Error, Shown, palette, words};
use supine_space::{Plane, View};
use supine_space::{Point, Progress, Vector};

/// Change of HU at which the colour is full.
const FULL_HU: f64 = 200.0;
/// Change of HU below which no colour shows: the noise of a CT.
const NOISE_HU: f64 = 25.0;

/// Distance from the plane within which the nipple is marked, mm.
const NEAR_MM: f64 = 2.5;

/// Rows of before, after and change.
pub(super) fn rows(
    studio: &Studio<'_>,
    shown: &Shown<'_>,
    progress: Progress<'_>,
) -> Result<Vec<Row>, Error> {
    let mut rows = Vec::new();
    for (n, view) in View::ALL.into_iter().enumerate() {
        progress.at(n as f64 / 6.0)?;
        let mut row = compare(studio, shown, &studio.plane(view, &studio.focus), "");
        if let (Some(tumour), Some(after)) = (studio.scene.tumour, studio.scene.tumour_after) {
            row.text += &out_of_plane("tumour's centre", view, tumour.centre(), after);
        }
        if n == 0 {
            row.title = format!("Before and after, through the {}", studio.focus_name);
            row.part = Part::First;
        }
        rows.push(row);
    }
    rows.push(curtain::row(studio, progress.part(0.5, 0.66))?);
    let nipple = studio.scene.nipple.filter(|_| studio.scene.tumour.is_some());
    for (n, view) in [View::Axial, View::Sagittal].into_iter().enumerate() {
        let Some(nipple) = nipple else { break };
        progress.at((4 + n) as f64 / 6.0)?;
        let mut row = compare(studio, shown, &studio.plane(view, &nipple), "nipple_");
        if let Some(m) = &shown.nipple {
            row.text += &out_of_plane("nipple", view, nipple, Point::from(m.after_mm));
        }
        if n == 0 {
            row.title = "Before and after, at the level of the nipple".into();
        }
        rows.push(row);
    }
    Ok(rows)
}

/// How far a place leaves the plane it was in.
fn out_of_plane(what: &str, view: View, before: Point, after: Point) -> String {
    let mut along = Vector::zeros();
    along[view.axis()] = (after - before)[view.axis()];
    if along.norm() < 0.05 {
        return format!(" The {what} stays in this plane.");
    }
    format!(" The {what} leaves this plane by {}.", words::directions(along.into()))
}

fn compare(studio: &Studio<'_>, shown: &Shown<'_>, plane: &Plane, prefix: &str) -> Row {
    let scene = studio.scene;
    let (ct, deformed) = (
        supine_volume::sample_plane(scene.ct, plane),
        supine_volume::sample_plane(scene.deformed, plane),
    );
    let nipple = shown.nipple.as_ref().map(|n| [n.before_mm, n.after_mm].map(Point::from));
    let mark = |canvas: &mut Canvas, n: usize, rgb: Rgb| {
        if let Some(places) = nipple.filter(|[before, _]| plane.depth(before).abs() < NEAR_MM) {
            canvas.cross(plane.spot(&places[n]), 9.0, Pen::new(1.8, rgb));
        }
    };

    let mut before = paint(plane, &ct, 1.0);
    studio.outline_region(&mut before, plane);
    studio.mark_before(&mut before, plane, false);
    mark(&mut before, 0, palette::BEFORE);
    dress(&mut before, plane, "CT");

    let mut after = paint(plane, &deformed, 1.0);
    studio.outline_region(&mut after, plane);
    studio.mark_before(&mut after, plane, true);
    studio.mark_after(&mut after, plane);
    studio.mark_within(&mut after, plane);
    mark(&mut after, 1, palette::AFTER);
    dress(&mut after, plane, "SIMULATED");

    let mut change = paint(plane, &deformed, 0.55);
    tint_change(&mut change, &ct, &deformed);
    studio.mark_before(&mut change, plane, false);
    studio.mark_after(&mut change, plane);
    dress(&mut change, plane, "change");
    let ticks = ["-200", "0", "+200"].map(String::from);
    Legend { colour: &|share| on_ground(share), ticks, title: "change, HU" }.draw(&mut change, 0);

    let name = plane.view.name();
    let picture = |what: &str, caption: &str, canvas| Picture {
        name: format!("{prefix}{name}_{what}"),
        caption: caption.into(),
        canvas,
    };
    Row {
        text: format!("{} plane, {} mm.", words::capital(name), words::minus(&plane.position())),
        pair: true,
        pictures: vec![
            picture("before", "The CT, patient on her back", before),
            picture("after", "On the operating table (simulated)", after),
            picture("change", "Change: red denser, blue less dense", change),
        ],
        ..Row::default()
    }
}

/// Colours what became denser red and what became less dense blue.
fn tint_change(canvas: &mut Canvas, ct: &[f32], deformed: &[f32]) {
    for (n, (a, b)) in ct.iter().zip(deformed).enumerate() {
        let change = f64::from(b.clamp(-1000.0, 1000.0) - a.clamp(-1000.0, 1000.0));
        if !change.is_nan() {
            let (rgb, alpha) = tint(change);
            canvas.mix(n, rgb, alpha);
        }
    }
}

/// Colour and opacity of a change of HU.
fn tint(change: f64) -> (Rgb, f64) {
    let rgb = palette::CHANGE[usize::from(change <= 0.0)];
    (rgb, ((change.abs() - NOISE_HU) / (FULL_HU - NOISE_HU)).clamp(0.0, 1.0))
}

/// The tint as it looks on the grey of fat, for the colour bar.
fn on_ground(share: f64) -> Rgb {
    let (rgb, alpha) = tint((2.0 * share - 1.0) * FULL_HU);
    rgb.map(|c| (60.0 + (f64::from(c) - 60.0) * alpha).round() as u8)
}
