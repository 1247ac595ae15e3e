//! Where the boundary of the chest wall is sure and where not.

use super::{LETTER, Part, Picture, Row, Studio, dress};
use crate::canvas::{Canvas, Pen, Rgb, Spot};
use crate::lettering::{Align, text_width};
use crate::summary::WallUncertainty;
use crate::words::fixed;
use crate::{Error, palette};
use rayon::prelude::*;
use supine_space::{Plane, View};
use supine_space::{Point, Progress, Vector};
use supine_volume::contour;
use supine_volume::{Volume, sample_trilinear};

/// Width of the stripes on uncertain places, pixels.
const STRIPE: usize = 5;
/// Length of a dash and of the gap after it, pixels.
const DASH: f64 = 8.0;
/// Step along the line of sight, mm.
const STEP_MM: f64 = 1.5;
/// The slope is taken between pixels this far to both sides.
const NEAR: usize = 4;
/// Brightness of the wall outside the region.
const DIM: f64 = 0.35;

/// Draws skin and chest wall: the wall firm where it is sure, dashed where it is not. Outside the
/// region nothing depends on it.
pub(super) fn outlines(studio: &Studio<'_>, canvas: &mut Canvas, plane: &Plane) {
    let surfaces = studio.scene.surfaces;
    let skin = supine_volume::sample_plane(surfaces.skin.values(), plane);
    canvas.stroke_on_halo(&contour(&skin, plane.width, 0.0), Pen::new(1.5, palette::SKIN));
    let wall = supine_volume::sample_plane(surfaces.chest_wall.values(), plane);
    let lines = contour(&wall, plane.width, 0.0);
    let uncertain = |[a, b]: &[Spot; 2]| {
        let middle = [0, 1].map(|n| 0.5 * (a[n] + b[n]));
        studio.scene.is_uncertain(studio.uncertain_mm, &plane.patient(middle))
    };
    let (uncertain, sure): (Vec<[Spot; 2]>, Vec<[Spot; 2]>) =
        lines.into_iter().partition(uncertain);
    canvas.stroke_on_halo(&sure, Pen::new(1.5, palette::CHEST_WALL));
    canvas.stroke(&uncertain, Pen::new(5.6, palette::BLACK));
    canvas.stroke(&uncertain, Pen::new(3.0, palette::UNCERTAIN).dashed(DASH));
}

/// The chest wall from the front and from the side of the breast, with its uncertain places.
pub(super) fn row(
    studio: &Studio<'_>,
    uncertainty: &WallUncertainty,
    progress: Progress<'_>,
) -> Result<Row, Error> {
    let mut pictures = Vec::new();
    for (n, (view, side)) in
        [(View::Coronal, "front"), (View::Sagittal, "side")].into_iter().enumerate()
    {
        progress.at(n as f64 / 2.0)?;
        let plane = studio.plane(view, &studio.scene.sphere.centre());
        let mut canvas = relief(studio, &plane);
        studio.outline_region(&mut canvas, &plane);
        if let Some(tumour) = studio.scene.tumour {
            let (at, radius) = (plane.spot(&tumour.centre()), tumour.radius() / plane.pixel_mm);
            canvas.circle(at, radius, 0, Pen::new(1.8, palette::BEFORE));
        }
        if let Some(nipple) = studio.scene.nipple {
            canvas.cross(plane.spot(&nipple), 9.0, Pen::new(1.8, palette::BEFORE));
        }
        dress(&mut canvas, &plane, "");
        key(&mut canvas, studio.uncertain_mm);
        pictures.push(Picture {
            name: format!("chest_wall_{side}"),
            caption: format!("The chest wall behind the breast, from the {side}"),
            canvas,
        });
    }
    Ok(Row {
        title: "How sure the chest wall is".into(),
        text: sentence(uncertainty),
        part: Part::Uncertain,
        pictures,
        ..Row::default()
    })
}

/// The chest wall as it is seen along the plane's axis, striped where it is uncertain.
fn relief(studio: &Studio<'_>, plane: &Plane) -> Canvas {
    let scene = studio.scene;
    let wall = scene.surfaces.chest_wall.values();
    let mut towards = Vector::zeros();
    // From the front, or from the side of the breast.
    towards[plane.view.axis()] = if plane.view == View::Coronal { 1.0 } else { -scene.side.sign() };
    let (grid, reach) = (wall.grid(), scene.sphere.radius());
    let index = |p: &Point| Vector::from(grid.index_from_patient(p));
    let step = index(&(Point::origin() + STEP_MM * towards)) - index(&Point::origin());
    let last = grid.size().map(|n| n as f64 - 1.0);
    let is_wall = |at: &Vector| {
        let inside = (0..3).all(|a| at[a] >= 0.0 && at[a] <= last[a]);
        inside && wall.at([0, 1, 2].map(|a| (at[a] + 0.5) as usize)) < 0
    };
    let walls = extent(wall);
    // Nothing but soft tissue lies farther out than the breast does.
    let (first, steps) = (-2.0 * reach / STEP_MM, (3.0 * reach / STEP_MM) as usize);
    let seen = |n: usize| -> Option<Point> {
        let spot = [(n % plane.width) as f64, (n / plane.width) as f64];
        let start = index(&plane.patient(spot)) + first * step;
        let (enters, leaves) = crossed(walls?, start, step);
        let mut within = enters.max(0.0) as usize..steps.min(leaves.max(0.0) as usize);
        let hit = within.find(|&m| is_wall(&(start + m as f64 * step)))? as f64;
        let depth = |m: f64| -f64::from(sample_trilinear(wall, (start + m * step).into()));
        let places = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|d| hit + d);
        let between = places.windows(2).find_map(|w| {
            let (a, b) = (depth(w[0]), depth(w[1]));
            (a <= 0.0 && b > 0.0).then(|| w[0] + a / (a - b))
        });
        Some(grid.patient_from_index((start + between.unwrap_or(hit) * step).into()))
    };
    let points: Vec<Option<Point>> =
        (0..plane.width * plane.height).into_par_iter().map(seen).collect();
    let mut canvas = Canvas::new(plane.width, plane.height);
    for (n, point) in points.iter().enumerate() {
        let Some(p) = point else {
            canvas.mix(n, palette::NOTHING, 1.0);
            continue;
        };
        let inside = scene.sphere.contains(p);
        let light = lambert(&points, plane, n) * if inside { 1.0 } else { DIM };
        let rgb = if scene.is_uncertain(studio.uncertain_mm, p) {
            striped(n % plane.width, n / plane.width)
        } else {
            palette::CHEST_WALL.map(|c| (f64::from(c) * light) as u8)
        };
        canvas.mix(n, rgb, 1.0);
    }
    canvas
}

/// First and last voxel of the wall along each axis; `None` when there is none.
fn extent(wall: &Volume<i16>) -> Option<[[usize; 3]; 2]> {
    let size = wall.grid().size();
    let mut extent = None;
    for (n, row) in wall.data().chunks_exact(size[0]).enumerate() {
        let Some(first) = row.iter().position(|v| *v < 0) else { continue };
        let last = row.iter().rposition(|v| *v < 0).unwrap_or(first);
        let (j, k) = (n % size[1], n / size[1]);
        let [low, high] = extent.get_or_insert([[first, j, k], [last, j, k]]);
        *low = [low[0].min(first), low[1].min(j), low[2].min(k)];
        *high = [high[0].max(last), high[1].max(j), high[2].max(k)];
    }
    extent
}

/// The steps of a line (voxels) between which it may meet voxels within an extent, with one to
/// spare at both ends.
fn crossed([low, high]: [[usize; 3]; 2], start: Vector, step: Vector) -> (f64, f64) {
    let (mut enters, mut leaves) = (0.0_f64, f64::INFINITY);
    for a in 0..3 {
        let ends = [low[a] as f64 - 1.0, high[a] as f64 + 1.0];
        if step[a].abs() < 1e-9 {
            if start[a] < ends[0] || start[a] > ends[1] {
                return (0.0, 0.0);
            }
            continue;
        }
        let [b, c] = ends.map(|end| (end - start[a]) / step[a]);
        enters = enters.max(b.min(c) - 1.0);
        leaves = leaves.min(b.max(c) + 2.0);
    }
    (enters, leaves)
}

/// A pixel of the stripes on uncertain places.
fn striped(x: usize, y: usize) -> Rgb {
    [palette::UNCERTAIN, palette::BLACK][(x + y) / STRIPE % 2]
}

/// Brightness of a surface lit from the eye and from above, 0..=1.
fn lambert(points: &[Option<Point>], plane: &Plane, n: usize) -> f64 {
    let axis = plane.view.axis();
    let slope = |a: Option<&Option<Point>>, b: Option<&Option<Point>>| match (a, b) {
        (Some(Some(a)), Some(Some(b))) => {
            (b[axis] - a[axis]).abs() / (2.0 * NEAR as f64 * plane.pixel_mm)
        }
        _ => 0.0,
    };
    let across = slope(n.checked_sub(NEAR).and_then(|m| points.get(m)), points.get(n + NEAR));
    let row = NEAR * plane.width;
    let along = slope(n.checked_sub(row).and_then(|m| points.get(m)), points.get(n + row));
    0.15 + 0.8 / (1.0 + across * across + along * along).sqrt()
}

/// What the colours mean.
fn key(canvas: &mut Canvas, uncertain_mm: f64) {
    let small = 0.8 * LETTER;
    let top = canvas.height() - 52;
    let lines = [("sure".to_string(), false), (format!("may be off > {uncertain_mm:.1} mm"), true)];
    let width = 48 + text_width(&lines[1].0, small) as usize;
    canvas.rectangle([5, top], [width, 47], palette::PANEL, super::PANEL);
    for (row, (text, uncertain)) in lines.into_iter().enumerate() {
        let y = top + 6 + 20 * row;
        for x in 0..24 {
            for dy in 0..14 {
                let rgb = if uncertain { striped(x, dy) } else { palette::CHEST_WALL };
                canvas.rectangle([12 + x, y + dy], [1, 1], rgb, 1.0);
            }
        }
        canvas.text(&text, [44.0, (y + 12) as f64], Align::Left, small, palette::TEXT);
    }
}

/// What the pictures say, in words.
pub(crate) fn sentence(uncertainty: &WallUncertainty) -> String {
    let limit = fixed(uncertainty.limit_mm, 1);
    let Some(patch) = uncertainty.patches.first() else {
        return format!(
            "Within the region the boundary between chest wall and soft tissue shows everywhere in \
             the CT: nowhere is an error of more than {limit} mm expected."
        );
    };
    let share = 100.0 * uncertainty.uncertain_cm2 / uncertainty.boundary_cm2.max(1e-9);
    format!(
        "{} of {} cm² ({} %) of the boundary between chest wall and soft tissue within the region are \
         uncertain (striped): it may lie more than {limit} mm off there. The largest such place has {} \
         cm²: {}, about {} mm. Look at it in the CT; seeds on both sides of the boundary make it sure.",
        fixed(uncertainty.uncertain_cm2, 1),
        fixed(uncertainty.boundary_cm2, 0),
        fixed(share, 0),
        fixed(patch.area_cm2, 1),
        patch.place,
        fixed(patch.error_mm, 0),
    )
}
