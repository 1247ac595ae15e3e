//! Rules C: where the voxels are.

use super::{Checks, Image, NEEDS_SOURCE, Reference};
use crate::geometry::straight_line;
use crate::number::{ROUNDING_MM, parse_ds, parse_ds_list, parse_is};
use crate::tilt::Lean;
use dicom_core::Tag;
use dicom_dictionary_std::tags;
use supine_space::{Point, Vector};

/// Positions and steps may be off by this much, mm.
const POSITION_MM: f64 = 0.01;
/// Numbers that are copied as strings may be off by this much.
const COPIED: f64 = 1e-6;

/// The plane of one image, as written.
struct Plane {
    position: Point,
    row: Vector,
    column: Vector,
    spacing: [f64; 2],
}

fn plane(image: &Image) -> Option<Plane> {
    let numbers = |tag: Tag| image.set.texts(tag);
    let position: [f64; 3] = parse_ds_list(&numbers(tags::IMAGE_POSITION_PATIENT))?;
    let [a, b, c, d, e, f] = parse_ds_list(&numbers(tags::IMAGE_ORIENTATION_PATIENT))?;
    let spacing = parse_ds_list(&numbers(tags::PIXEL_SPACING))?;
    Some(Plane {
        position: Point::from(position),
        row: Vector::new(a, b, c),
        column: Vector::new(d, e, f),
        spacing,
    })
}

/// Checks the geometry; the order of the images along the normal, or as they came when there is no
/// readable geometry.
pub(super) fn check(
    checks: &mut Checks,
    images: &[Image],
    reference: Option<&Reference<'_>>,
) -> Vec<usize> {
    let planes: Vec<Option<Plane>> = images.iter().map(plane).collect();
    let unreadable: Vec<String> = (0..images.len())
        .filter(|&n| planes[n].is_none())
        .map(|n| images[n].file.clone())
        .collect();
    checks.none_of("C0 position, orientation and spacing can be read", &unreadable);
    let planes: Vec<Plane> = planes.into_iter().flatten().collect();
    if !unreadable.is_empty() {
        return (0..images.len()).collect();
    }
    let normal = planes[0].row.cross(&planes[0].column);
    let place = |n: usize| planes[n].position.coords.dot(&normal);
    let mut order: Vec<usize> = (0..images.len()).collect();
    order.sort_by(|&a, &b| place(a).total_cmp(&place(b)).then(a.cmp(&b)));
    let places: Vec<f64> = order.iter().map(|&n| place(n)).collect();

    check_planes(checks, images, &planes, &order, &places, &normal);
    check_numbering(checks, images, &order, &places);
    // Type 2: the source may have none.
    let thickness = |i: &Image| match i.text(tags::SLICE_THICKNESS).as_str() {
        "" => f64::INFINITY,
        text => parse_ds(text).unwrap_or(0.0),
    };
    let thinnest = images.iter().map(thickness).fold(f64::INFINITY, f64::min);
    let spacing = planes.iter().flat_map(|p| p.spacing).fold(f64::INFINITY, f64::min);
    checks.say(
        "C7 spacing is positive, and thickness if there is one",
        thinnest > 0.0 && spacing > 0.0,
        format!("spacing {spacing} mm, thickness {thinnest} mm"),
    );
    against_source(checks, images, &planes, &order, reference);
    order
}

fn check_planes(
    checks: &mut Checks,
    images: &[Image],
    planes: &[Plane],
    order: &[usize],
    places: &[f64],
    normal: &Vector,
) {
    let crooked = |p: &Plane| {
        let off = (p.row.norm() - 1.0).abs().max((p.column.norm() - 1.0).abs());
        off.max(p.row.dot(&p.column).abs())
    };
    let worst = planes.iter().map(crooked).fold(0.0, f64::max);
    let rule = "C1 direction cosines are unit and orthogonal to 1e-4";
    checks.say(rule, worst < 1e-4, format!("off by {worst:.2e}"));

    let steps: Vec<f64> = places.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let smallest = steps.iter().copied().fold(f64::INFINITY, f64::min);
    let detail = format!("smallest step {smallest:.4} mm");
    checks.say("C2 positions are distinct", smallest > 1e-3, detail);

    let mut sorted = steps.clone();
    sorted.sort_by(f64::total_cmp);
    let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    let worst = (0..steps.len())
        .max_by(|&a, &b| (steps[a] - median).abs().total_cmp(&(steps[b] - median).abs()));
    let (even, detail) = match worst {
        // Positions that the scanner rounded to 0.1 mm are repeated, not repaired.
        Some(n) => (
            (steps[n] - median).abs() < POSITION_MM
                || straight_line(places).1 <= ROUNDING_MM + 1e-6,
            format!("step {median:.4} mm, {:.4} mm after {}", steps[n], images[order[n]].file),
        ),
        None => (false, "one image is no volume".into()),
    };
    checks.say("C3 steps are equal, no slice is missing", even, detail);

    // The same limits as when the source was read: what it is allowed, the export repeats.
    let positions: Vec<Point> = order.iter().map(|&n| planes[n].position).collect();
    let lean = Lean::of(&positions, normal);
    let rule = "C4 positions lie on the normal of the slices (no shear)";
    let detail = format!("{:.4} mm aside, {:.3} degrees", lean.farthest.mm, lean.degrees);
    checks.say(rule, !lean.is_tilted() && !lean.has_stray(), detail);
}

fn check_numbering(checks: &mut Checks, images: &[Image], order: &[usize], places: &[f64]) {
    let numbers: Option<Vec<i64>> =
        order.iter().map(|&n| parse_is(&images[n].text(tags::INSTANCE_NUMBER))).collect();
    let monotonic = numbers.is_some_and(|n| {
        n.windows(2).all(|pair| pair[0] < pair[1]) || n.windows(2).all(|pair| pair[0] > pair[1])
    });
    let rule = "C5 Instance Numbers are unique and monotonic along the normal";
    checks.say(rule, monotonic, if monotonic { "" } else { "they are not" });

    let rule = "C6 Slice Location follows the positions";
    let texts: Vec<String> = order.iter().map(|&n| images[n].text(tags::SLICE_LOCATION)).collect();
    if texts.iter().all(String::is_empty) {
        checks.say(rule, true, "absent");
        return;
    }
    let locations: Option<Vec<f64>> = texts.iter().map(|t| parse_ds(t)).collect();
    let Some(locations) = locations else {
        return checks.say(rule, false, "missing or unreadable in some images");
    };
    let off = |sign: f64| {
        let pairs = locations.windows(2).zip(places.windows(2));
        pairs.map(|(l, p)| (sign * (l[1] - l[0]) - (p[1] - p[0])).abs()).fold(0.0, f64::max)
    };
    let off = off(1.0).min(off(-1.0));
    checks.say(rule, off < POSITION_MM, format!("off by {off:.4} mm"));
}

fn against_source(
    checks: &mut Checks,
    images: &[Image],
    planes: &[Plane],
    order: &[usize],
    reference: Option<&Reference<'_>>,
) {
    let grid = "C8 the grid is that of the source";
    let direction = "C9 Instance Numbers run in the direction of the source's";
    let Some(reference) = reference else {
        checks.skip(grid, NEEDS_SOURCE);
        checks.skip(direction, NEEDS_SOURCE);
        return;
    };
    let source = &reference.source.slices;
    let mut differences = Vec::new();
    if source.len() != images.len() {
        differences.push(format!("{} slices, the source has {}", images.len(), source.len()));
    } else {
        let off =
            order.iter().zip(source).map(|(&n, s)| (planes[n].position - s.slice.position).norm());
        let off = off.fold(0.0, f64::max);
        if off > 1e-3 {
            differences.push(format!("positions differ by {off:.4} mm"));
        }
    }
    let first = &source[0].slice;
    for (image, plane) in images.iter().zip(planes) {
        let turned = (plane.row - first.row_direction).abs().max();
        if turned.max((plane.column - first.column_direction).abs().max()) > COPIED {
            differences.push(format!("{}: orientation", image.file));
        }
        let [row, column] = plane.spacing;
        if (row - first.row_spacing).abs().max((column - first.column_spacing).abs()) > COPIED {
            differences.push(format!("{}: spacing {row} x {column} mm", image.file));
        }
        let matrix = (image.set.u16(tags::ROWS), image.set.u16(tags::COLUMNS));
        if matrix != (Some(first.pixels.rows), Some(first.pixels.columns)) {
            differences.push(format!("{}: matrix", image.file));
        }
        let thickness = |text: String| parse_ds(&text);
        let theirs = thickness(reference.header(0).text(tags::SLICE_THICKNESS));
        if thickness(image.text(tags::SLICE_THICKNESS)) != theirs {
            differences.push(format!("{}: thickness", image.file));
        }
    }
    checks.none_of(grid, &differences);

    let number = |k: usize| source[k].slice.instance_number;
    let ours = |k: usize| parse_is(&images[order[k]].text(tags::INSTANCE_NUMBER));
    match (number(0), number(source.len() - 1), ours(0), ours(images.len() - 1)) {
        (Some(a), Some(b), Some(c), Some(d)) => {
            checks.say(direction, (a < b) == (c < d), "");
        }
        _ => checks.skip(direction, "Instance Numbers are missing"),
    }
}
