//! The pictures of a report, in rows as the report shows them.

mod bars;
mod compare;
mod curtain;
mod doubts;
mod jacobian;
mod labels;
mod mesh;
mod motion;
mod moving;
mod scans;
mod shape;
mod tissues;
pub(crate) mod uncertainty;

use crate::canvas::{Canvas, Pen, Rgb};
use crate::lettering::{Align, text_width};
use crate::palette;
use crate::tables::{self, Table};
use crate::{Ellipsoid, Error, Mesh, Scene, Shown};
use rayon::prelude::*;
use supine_mesh::{Edges, TetMesh};
use supine_space::{Plane, Point, Progress, Spot, Vector, View};

/// Pixels across the pictures of the region.
const SIZE: f64 = 520.0;
/// Height of capitals, pixels.
const LETTER: f64 = 14.0;
/// Distance of lettering from the edge, pixels.
const EDGE: f64 = 9.0;

/// One picture.
#[derive(Debug)]
pub(crate) struct Picture {
    /// Name of the file, without `.png`.
    pub(crate) name: String,
    /// What it shows, for the caption and for those who do not see it.
    pub(crate) caption: String,
    /// The picture.
    pub(crate) canvas: Canvas,
}

/// The part of the report in which a row stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Part {
    /// The first screen.
    First,
    /// Beside the uncertain places of the chest wall.
    Uncertain,
    /// Among the still pictures, which are closed until someone opens them.
    #[default]
    Still,
}

/// Pictures that stand side by side.
#[derive(Debug, Default)]
pub(crate) struct Row {
    /// Heading; empty when the row continues the one above.
    pub(crate) title: String,
    /// What to look at.
    pub(crate) text: String,
    /// The first two are before and after in one place, so that one may be laid over the other.
    pub(crate) pair: bool,
    /// Where in the report it stands.
    pub(crate) part: Part,
    /// The pictures.
    pub(crate) pictures: Vec<Picture>,
    /// Figures below the pictures.
    pub(crate) table: Option<Table>,
}

/// What all pictures of a scene share.
struct Studio<'a> {
    scene: &'a Scene<'a>,
    edges: Edges,
    /// Lower and upper corner of what is shown of the region, LPS, mm.
    frame: [Point; 2],
    /// Side of a pixel in the pictures of the region, mm.
    pixel_mm: f64,
    /// The place the planes go through, LPS, mm.
    focus: Point,
    /// What lies there.
    focus_name: &'static str,
    /// The chest wall is drawn as uncertain where it may be wrong by more than this, mm.
    uncertain_mm: f64,
}

impl<'a> Studio<'a> {
    fn new(scene: &'a Scene<'a>, uncertain_mm: f64) -> Self {
        let (focus, focus_name) = scene.focus();
        Self {
            scene,
            edges: Edges::new(scene.mesh()),
            frame: scene.frame(),
            pixel_mm: 2.0 * scene.reach() / SIZE,
            focus,
            focus_name,
            uncertain_mm,
        }
    }

    /// The plane of a view through a place, framed on the region.
    fn plane(&self, view: View, at: &Point) -> Plane {
        Plane::new(view, at, self.frame, self.pixel_mm)
    }

    /// The three planes through the focus.
    fn planes(&self) -> [Plane; 3] {
        View::ALL.map(|view| self.plane(view, &self.focus))
    }

    /// The outline of the region where the plane cuts it.
    fn outline_region(&self, canvas: &mut Canvas, plane: &Plane) {
        let sphere = self.scene.sphere;
        if let Some(radius) = plane.cut_radius(&sphere.centre(), sphere.radius()) {
            let pen = Pen::new(1.0, palette::REGION).alpha(0.55);
            canvas.circle(plane.spot(&sphere.centre()), radius, 48, pen);
        }
    }

    /// The tumour in the CT: a circle where the plane cuts it, dashed when it is only remembered.
    fn mark_before(&self, canvas: &mut Canvas, plane: &Plane, remembered: bool) {
        if let Some(tumour) = self.scene.tumour {
            let dashes = if remembered { 12 } else { 0 };
            ring(canvas, plane, &tumour.centre(), tumour.radius(), dashes, palette::BEFORE);
        }
    }

    /// Where the tumour's centre may lie: the ellipsoid as the plane's view sees it.
    fn mark_within(&self, canvas: &mut Canvas, plane: &Plane) {
        let Some(ellipsoid) = self.scene.tumour_within else { return };
        let centre = plane.spot(&Point::from(ellipsoid.centre_mm));
        canvas.ellipse(centre, silhouette(ellipsoid, plane), Pen::new(1.5, palette::TEXT));
    }

    /// The tumour on the operating table, as a sphere of the same radius.
    fn mark_after(&self, canvas: &mut Canvas, plane: &Plane) {
        if let (Some(tumour), Some(centre)) = (self.scene.tumour, self.scene.tumour_after) {
            ring(canvas, plane, &centre, tumour.radius(), 0, palette::AFTER);
        }
    }
}

/// The outline of an ellipsoid seen along a view's axis: the ellipse whose matrix is the sum of the
/// outer products of the semi-axes' projections. What takes a circle of radius 1 to it.
fn silhouette(ellipsoid: &Ellipsoid, plane: &Plane) -> [Spot; 2] {
    let axes = ellipsoid.semi_axes_mm.map(|axis| plane.along(&Vector::from(axis)));
    let sum = |i: usize, j: usize| axes.iter().map(|a| a[i] * a[j]).sum::<f64>();
    // The Cholesky factor, column by column.
    let a = sum(0, 0).max(1e-12).sqrt();
    let b = sum(0, 1) / a;
    [[a, b], [0.0, (sum(1, 1) - b * b).max(0.0).sqrt()]]
}

/// The chest wall is uncertain where it may be wrong by more than this, mm.
pub(crate) fn uncertain_mm(shown: &Shown<'_>) -> f64 {
    shown.segmentation.uncertainty.as_ref().map_or(f64::INFINITY, |u| u.limit_mm)
}

/// All rows of the report; groups of them are drawn at once.
///
/// # Errors
/// [`Error::Stopped`] when the user asked to stop.
pub(crate) fn rows(
    shown: &Shown<'_>,
    scene: &Scene<'_>,
    progress: Progress<'_>,
) -> Result<Vec<Row>, Error> {
    let studio = Studio::new(scene, uncertain_mm(shown));
    let groups: [Group<'_>; 5] = [
        &|progress| compare::rows(&studio, shown, progress),
        &|progress| segmentation(&studio, shown, progress),
        &|progress| of_model(&studio, shown, progress),
        &|progress| of_motion(&studio, shown, progress),
        &|progress| of_scans(&studio, shown, progress),
    ];
    let part = |n: usize| progress.part(n as f64 / 5.0, (n + 1) as f64 / 5.0);
    let drawn: Vec<Vec<Row>> =
        groups.par_iter().enumerate().map(|(n, group)| group(part(n))).collect::<Result<_, _>>()?;
    Ok(drawn.into_iter().flatten().collect())
}

/// Draws rows that belong together.
type Group<'a> = &'a (dyn Fn(Progress<'_>) -> Result<Vec<Row>, Error> + Sync);

fn segmentation(
    studio: &Studio<'_>,
    shown: &Shown<'_>,
    progress: Progress<'_>,
) -> Result<Vec<Row>, Error> {
    let (scene, found) = (studio.scene, shown.segmentation);
    let mut rows = vec![labels::row(studio, progress.part(0.0, 0.4))?];
    rows[0].table = tables::quality_checks(&found.quality_checks);
    if let Some(uncertainty) = &found.uncertainty {
        rows.push(uncertainty::row(studio, uncertainty, progress.part(0.4, 0.7))?);
        rows.extend(doubts::rows(studio, uncertainty, progress.part(0.7, 0.8))?);
    }
    if let (Some(found), Some(labels)) = (&found.tissues, scene.tissues) {
        rows.push(tissues::row(studio, labels, found, progress.part(0.8, 1.0))?);
    }
    Ok(rows)
}

fn of_model(
    studio: &Studio<'_>,
    shown: &Shown<'_>,
    progress: Progress<'_>,
) -> Result<Vec<Row>, Error> {
    let mut rows = mesh::rows(studio, progress.part(0.0, 0.5))?;
    let part = progress.part(0.5, 1.0);
    rows.extend(of_mesh(studio.scene.mesh(), shown.mesh, &studio.focus, part)?);
    Ok(rows)
}

/// Scans to which the modulus was fitted, and that on the operating table.
fn of_scans(
    studio: &Studio<'_>,
    shown: &Shown<'_>,
    progress: Progress<'_>,
) -> Result<Vec<Row>, Error> {
    let mut rows = Vec::new();
    if let Some(sitting) = shown.sitting {
        rows.push(scans::sitting(studio, sitting, progress.part(0.0, 0.5))?);
    }
    if let Some(intraop) = shown.intraop {
        rows.push(scans::intraop(studio, intraop, progress.part(0.5, 1.0))?);
    }
    Ok(rows)
}

/// Displacement and change of volume in the three planes through the focus.
fn of_motion(
    studio: &Studio<'_>,
    shown: &Shown<'_>,
    progress: Progress<'_>,
) -> Result<Vec<Row>, Error> {
    let mut planes = Vec::new();
    for (n, plane) in studio.planes().into_iter().enumerate() {
        progress.at(n as f64 / 6.0)?;
        planes.push(moving::Motion::new(studio, plane));
    }
    progress.at(0.5)?;
    let mut rows = vec![motion::displacement(studio, &planes)];
    rows.extend(jacobian::rows(studio, shown, &planes, progress.part(0.6, 1.0))?);
    Ok(rows)
}

/// The rows that show a mesh alone; the sections go through `focus` (LPS, mm).
///
/// # Errors
/// [`Error::Stopped`] when the user asked to stop.
pub(crate) fn of_mesh(
    mesh: &TetMesh,
    facts: &Mesh,
    focus: &Point,
    progress: Progress<'_>,
) -> Result<[Row; 2], Error> {
    let body = shape::body(mesh, progress.part(0.0, 0.5))?;
    Ok([body, shape::quality(mesh, facts, focus, progress.part(0.5, 1.0))?])
}

/// A circle where the plane cuts a sphere; a small cross where its centre lies.
fn ring(canvas: &mut Canvas, plane: &Plane, at: &Point, radius: f64, dashes: usize, rgb: Rgb) {
    if let Some(cut) = plane.cut_radius(at, radius) {
        canvas.circle(plane.spot(at), cut, dashes, Pen::new(1.8, rgb));
        if dashes == 0 {
            canvas.cross(plane.spot(at), 4.5, Pen::new(1.2, rgb));
        }
    }
}

/// The CT in grey; `light` dims it (1 for none).
fn paint(plane: &Plane, samples: &[f32], light: f64) -> Canvas {
    let mut canvas = Canvas::new(plane.width, plane.height);
    for (n, hu) in samples.iter().enumerate() {
        let rgb = if hu.is_nan() { palette::NOTHING } else { palette::grey(*hu) };
        canvas.mix(n, rgb, if hu.is_nan() { 1.0 } else { light });
    }
    canvas
}

/// Letters of the patient's directions, scale bar, where the plane lies and what is shown.
fn dress(canvas: &mut Canvas, plane: &Plane, what: &str) {
    letter(canvas, plane.view.letters());
    let w = plane.width as f64;
    let small = 0.8 * LETTER;
    let title = format!("{} {}", plane.view.name(), plane.position());
    canvas.text(&title, [EDGE, EDGE + small], Align::Left, small, palette::TEXT);
    canvas.text(what, [w - EDGE, EDGE + small], Align::Right, small, palette::TEXT);
    scale_bar(canvas, plane.pixel_mm);
}

/// Letters of the patient's directions at the left, right, upper and lower edge.
fn letter(canvas: &mut Canvas, [left, right, top, bottom]: [&str; 4]) {
    let (w, h) = (canvas.width() as f64, canvas.height() as f64);
    let middle = (h + LETTER) / 2.0;
    canvas.text(left, [EDGE, middle], Align::Left, LETTER, palette::TEXT);
    canvas.text(right, [w - EDGE, middle], Align::Right, LETTER, palette::TEXT);
    canvas.text(top, [w / 2.0, EDGE + LETTER], Align::Centre, LETTER, palette::TEXT);
    canvas.text(bottom, [w / 2.0, h - EDGE], Align::Centre, LETTER, palette::TEXT);
}

/// A bar at the lower right: 50 mm, or 20 mm where that would reach the middle.
fn scale_bar(canvas: &mut Canvas, pixel_mm: f64) {
    let (w, h) = (canvas.width() as f64, canvas.height() as f64);
    let mm = if 50.0 < 0.4 * w * pixel_mm { 50.0 } else { 20.0 };
    let length = mm / pixel_mm;
    let (left, right, y) = (w - EDGE - length, w - EDGE, h - EDGE - 4.0);
    let corner = [(left - 8.0).max(0.0) as usize, (y - 28.0).max(0.0) as usize];
    canvas.rectangle(corner, [length as usize + 12, 37], palette::PANEL, PANEL);
    let lines = [
        [[left, y], [right, y]],
        [[left, y - 4.0], [left, y + 4.0]],
        [[right, y - 4.0], [right, y + 4.0]],
    ];
    canvas.stroke_on_halo(&lines, Pen::new(1.8, palette::TEXT));
    let spot = [(left + right) / 2.0, y - 9.0];
    canvas.text(&format!("{mm:.0} mm"), spot, Align::Centre, 0.8 * LETTER, palette::TEXT);
}

/// A colour bar at the lower left.
struct Legend<'a> {
    /// Colour at a share 0..=1 of the bar.
    colour: &'a dyn Fn(f64) -> Rgb,
    /// Labels at the left end, the middle and the right end.
    ticks: [String; 3],
    /// Quantity and unit.
    title: &'a str,
}

/// Opacity of the panel behind a legend.
const PANEL: f64 = 0.72;
/// Width of a colour bar, pixels.
const BAR: usize = 150;

impl Legend<'_> {
    /// Draws the bar; the panel leaves `above` pixels free above its title. Gives the place of
    /// the free part's left end.
    fn draw(&self, canvas: &mut Canvas, above: usize) -> [f64; 2] {
        let small = 0.75 * LETTER;
        let width = (BAR + 24).max(text_width(self.title, small) as usize + 24);
        let height = 50 + above;
        let (left, top) = (5, canvas.height() - height - 5);
        canvas.rectangle([left, top], [width, height], palette::PANEL, PANEL);
        let (x, y) = (left + 12, top + above + 18);
        for n in 0..BAR {
            let rgb = (self.colour)(n as f64 / (BAR - 1) as f64);
            canvas.rectangle([x + n, y], [1, 10], rgb, 1.0);
        }
        let base = (y + 10) as f64 + 5.0 + small;
        for (n, label) in self.ticks.iter().enumerate() {
            let at = x as f64 + (BAR * n) as f64 / 2.0;
            let half = text_width(label, small) / 2.0;
            let at = at.max(left as f64 + 5.0 + half);
            canvas.text(label, [at, base], Align::Centre, small, palette::TEXT);
        }
        let spot = [x as f64, (y - 6) as f64];
        canvas.text(self.title, spot, Align::Left, small, palette::TEXT);
        [x as f64, top as f64 + above as f64 / 2.0]
    }
}

/// The smallest of 1, 1.5, 2, 3, 4, 5, 6, 8 times a power of ten that is not below `x`; 1 for 0.
pub(crate) fn round_up(x: f64) -> f64 {
    if x <= 0.0 || !x.is_finite() {
        return 1.0;
    }
    let power = 10f64.powf(x.log10().floor());
    let steps = [1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0];
    steps.iter().map(|s| s * power).find(|s| *s >= x * (1.0 - 1e-9)).unwrap_or(10.0 * power)
}

#[cfg(test)]
pub(crate) mod tests;
