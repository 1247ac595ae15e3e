//! Scans on the model, coloured by distance, and how well each modulus fits.

use super::{EDGE, LETTER, Legend, Picture, Row, Studio, letter, scale_bar};
use crate::body::{Camera, Side};
use crate::canvas::{Canvas, Pen, Rgb};
use crate::lettering::Align;
use crate::tables::Table;
use crate::{Error, Evaluation, SkinDistances, StateFit, TissueFit, palette, words};
use supine_mesh::{ScanDistances, SurfaceDistances};
use supine_space::{Point, Progress, Vector};

/// Pixels across each picture.
const SIZE: usize = 520;
/// What is shown, in radii of the region from its middle.
const AROUND: f64 = 1.35;
/// Distance at the ends of the colours, mm.
const FULL_MM: f64 = 3.0;
/// Radius of a point of a scan, mm: points lie 2.5 mm apart.
const DOT_MM: f64 = 2.6;

/// The scan of the sitting patient before and after the fit, and the fit itself.
pub(super) fn sitting(
    studio: &Studio<'_>,
    (fit, scan): (&TissueFit, &ScanDistances),
    progress: Progress<'_>,
) -> Result<Row, Error> {
    let words = |name: &str| match name {
        "ct" => "CT, not deformed",
        _ => "fitted tissue",
    };
    let mut pictures = views(studio, scan, ("sitting", &words), None, progress)?;
    pictures.push(Picture {
        name: "fit_objective".into(),
        caption: "How well each modulus fits, by rest state".into(),
        canvas: objective(fit),
    });
    let text = format!(
        "The scan of the sitting patient, laid onto the model, coloured by its distance from the skin: of the CT before, of the fitted \
         model after. Blue: the scan lies inside the skin, red: outside; the colours end at {FULL_MM} mm. Grey: no skin that is modelled \
         or at rest. The curve has its lowest place at the modulus that fits best; the band holds it with 95 % probability."
    );
    Ok(row("Fit of the modulus", text, pictures, None))
}

/// The scan on the operating table against the CT, the default tissue and the result.
pub(super) fn intraop(
    studio: &Studio<'_>,
    (told, scan): (&Evaluation, &ScanDistances),
    progress: Progress<'_>,
) -> Result<Row, Error> {
    let near = (Point::from(told.near_mm), told.near_radius_mm);
    let named = ("intraop", &Evaluation::words as &dyn Fn(&str) -> &'static str);
    let pictures = views(studio, scan, named, Some(near), progress)?;
    let text = format!(
        "The scan of the patient on the operating table, coloured by its distance from the skin; its pose comes from the torso alone. \
         Blue: inside, red: outside; the colours end at {FULL_MM} mm. The circle holds the skin within {} mm of the point \
         nearest to the tumour. Distances of skin are not the error of the tumour: a wrong tissue may lie as near.",
        words::trimmed(told.near_radius_mm)
    );
    Ok(row("Scan on the operating table", text, pictures, Some(table(told))))
}

fn row(title: &str, text: String, pictures: Vec<Picture>, table: Option<Table>) -> Row {
    Row { title: title.into(), text, pictures, table, ..Row::default() }
}

/// Distances from each surface.
fn table(told: &Evaluation) -> Table {
    let head = ["Skin of", "Where", "Points", "Mean, mm", "RMS, mm", "95 %, mm", "Largest, mm"];
    let mut table = Table::list("Distance of the scan on the operating table", &head);
    for surface in &told.surfaces {
        for (part, of) in [("near the tumour", surface.near), ("breast", surface.breast)] {
            let SkinDistances { points, mean_mm, rms_mm, p95_mm, max_mm } = of;
            let name = Evaluation::words(&surface.name).to_string();
            let lengths = [mean_mm, rms_mm, p95_mm, max_mm].map(|mm| words::fixed(mm, 2));
            table.rows.push([vec![name, part.into(), points.to_string()], lengths.into()].concat());
        }
    }
    table
}

/// The scan from the front, once for each surface.
fn views(
    studio: &Studio<'_>,
    scan: &ScanDistances,
    (name, words): (&str, &dyn Fn(&str) -> &'static str),
    near: Option<(Point, f64)>,
    progress: Progress<'_>,
) -> Result<Vec<Picture>, Error> {
    let sphere = studio.scene.sphere;
    let pixel_mm = 2.0 * AROUND * sphere.radius() / SIZE as f64;
    let camera = Camera { side: Side::Front, centre: sphere.centre(), pixel_mm, size: SIZE };
    let mut pictures = Vec::new();
    for (n, surface) in scan.surfaces.iter().enumerate() {
        progress.at(n as f64 / scan.surfaces.len() as f64)?;
        let mut canvas = camera.dotted(dots(scan, surface), DOT_MM);
        letter(&mut canvas, camera.side.letters());
        let spot = [SIZE as f64 - EDGE, EDGE + 0.8 * LETTER];
        canvas.text(words(&surface.name), spot, Align::Right, 0.8 * LETTER, palette::TEXT);
        if let Some((near, radius_mm)) = near {
            let pen = Pen::new(1.8, palette::TEXT);
            canvas.circle(camera.spot(&near), radius_mm / pixel_mm, 0, pen);
        }
        let (low, high) = (format!("-{FULL_MM}"), format!("+{FULL_MM}"));
        let ticks = [low, "0".into(), high];
        Legend { colour: &share_colour, ticks, title: "scan off the skin, mm" }
            .draw(&mut canvas, 0);
        scale_bar(&mut canvas, pixel_mm);
        pictures.push(Picture {
            name: format!("scan_{name}_{}", surface.name),
            caption: format!("Distance from the skin: {}", words(&surface.name)),
            canvas,
        });
    }
    Ok(pictures)
}

fn dots<'a>(
    scan: &'a ScanDistances,
    surface: &'a SurfaceDistances,
) -> impl Iterator<Item = (Point, Vector, Rgb)> + 'a {
    let rgb =
        |mm: Option<f64>| mm.map_or(palette::UNKNOWN, |mm| share_colour(0.5 + 0.5 * mm / FULL_MM));
    let places = scan.places.iter().zip(&scan.normals).zip(&surface.mm);
    places.map(move |((place, normal), mm)| (*place, *normal, rgb(*mm)))
}

fn share_colour(share: f64) -> Rgb {
    palette::on_scale(&palette::DIVERGING, share)
}

/// Where the curve is drawn, pixels: left, right, upper and lower end.
const FRAME: [f64; 4] = [64.0, 492.0, 84.0, 462.0];
/// Moduli below which a tick may stand, kPa.
const TICKS: [f64; 10] = [0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0];

/// The objective over the modulus, with the modulus that was fitted and its interval.
fn objective(fit: &TissueFit) -> Canvas {
    let mut canvas = Canvas::new(SIZE, SIZE);
    canvas.rectangle([0, 0], [SIZE, SIZE], palette::NOTHING, 1.0);
    let steps = || fit.states.iter().flat_map(|state| &state.path);
    let moduli = steps().map(|step| step.young_kpa.ln());
    let ends = fit.states.iter().flat_map(|state| state.interval_kpa).map(f64::ln);
    let (low, high) = moduli
        .chain(ends)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    let top = super::round_up(steps().map(|step| step.objective_mm2).fold(0.0, f64::max));
    let [left, right, upper, base] = FRAME;
    let x = |kpa: f64| left + (right - left) * (kpa.ln() - low) / (high - low).max(1e-9);
    let y = |mm2: f64| base - (base - upper) * (mm2 / top).clamp(0.0, 1.0);
    axes(&mut canvas, (&x, [low.exp(), high.exp()]), (&y, top));
    // The one that the run goes on with lies on top.
    for (n, state) in fit.states.iter().enumerate().rev() {
        let rgb = if n == 0 { palette::AFTER } else { palette::BEFORE };
        curve(&mut canvas, state, (&x, &y), (rgb, if n == 0 { 0.4 } else { 0.15 }));
        let text = format!(
            "{}: {} kPa{}",
            state.rest,
            words::fixed(state.young_kpa, 3),
            if n > 0 {
                ""
            } else if fit.decided {
                ", chosen"
            } else {
                ", better"
            }
        );
        let spot = [left, 24.0 + 20.0 * n as f64];
        canvas.text(&text, spot, Align::Left, 0.85 * LETTER, rgb);
    }
    canvas
}

/// The curve of one rest state, its modulus and the interval.
fn curve(
    canvas: &mut Canvas,
    state: &StateFit,
    (x, y): (&dyn Fn(f64) -> f64, &dyn Fn(f64) -> f64),
    (rgb, band): (Rgb, f64),
) {
    let [_, _, upper, base] = FRAME;
    let [from, to] = state.interval_kpa.map(x);
    let size = [(to - from).max(2.0) as usize, (base - upper) as usize];
    canvas.rectangle([from as usize, upper as usize], size, rgb, band);
    let middle = x(state.young_kpa);
    canvas.stroke(&[[[middle, upper], [middle, base]]], Pen::new(1.2, rgb));
    let spot = |n: usize| [x(state.path[n].young_kpa), y(state.path[n].objective_mm2)];
    let lines: Vec<_> = (1..state.path.len()).map(|n| [spot(n - 1), spot(n)]).collect();
    canvas.stroke(&lines, Pen::new(1.8, rgb));
    for n in 0..state.path.len() {
        canvas.circle(spot(n), 3.0, 0, Pen::new(2.4, rgb));
    }
}

fn axes(
    canvas: &mut Canvas,
    (x, [low, high]): (&dyn Fn(f64) -> f64, [f64; 2]),
    (y, top): (&dyn Fn(f64) -> f64, f64),
) {
    let [left, right, upper, base] = FRAME;
    let small = 0.75 * LETTER;
    for share in [0.0, 0.5, 1.0] {
        let at = y(share * top);
        canvas.stroke(&[[[left, at], [right, at]]], Pen::new(1.0, palette::TEXT).alpha(0.25));
        let label = words::trimmed(share * top);
        canvas.text(&label, [left - 8.0, at + 4.0], Align::Right, small, palette::TEXT);
    }
    for kpa in TICKS.into_iter().filter(|kpa| (low..=high).contains(kpa)) {
        let at = x(kpa);
        canvas.stroke(&[[[at, base], [at, base + 5.0]]], Pen::new(1.0, palette::TEXT));
        let spot = [at, base + 10.0 + small];
        canvas.text(&words::trimmed(kpa), spot, Align::Centre, small, palette::TEXT);
    }
    let below = [0.5 * (left + right), base + 40.0];
    canvas.text("modulus, kPa", below, Align::Centre, small, palette::TEXT);
    let above = [EDGE, upper - 14.0];
    canvas.text("objective, square mm", above, Align::Left, small, palette::TEXT);
}
