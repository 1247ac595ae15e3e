//! Where the planes of a dose lie (PS3.3 C.7.6.2, C.8.8.3.2).

use crate::error::Error;
use crate::number::{parse_ds, parse_ds_list};
use crate::object::Object;
use dicom_core::Tag;
use dicom_dictionary_std::tags;
use supine_space::{Grid, Matrix, Point, Vector};

/// Spacings that are believed, mm.
const SPACING_MM: std::ops::RangeInclusive<f64> = 0.05..=50.0;
/// Steps between planes may differ from their median by this much, mm, or by this share of it.
const STEP_MM: f64 = 0.01;
const STEP_SHARE: f64 = 0.01;
/// The first offset of absolute positions is the position of the first plane, to its rounding, mm.
const SAME_MM: f64 = 1e-3;
/// Direction cosines may miss right angles and unit length by this.
const SKEW: f64 = 1e-4;
const OFFSETS: &str = "Grid Frame Offset Vector";

/// The grid, and the frames in its order of planes.
pub(super) struct Planes {
    pub(super) grid: Grid,
    pub(super) order: Vec<usize>,
}

impl Planes {
    /// The planes of `size` columns, rows and frames.
    pub(super) fn new(object: &Object, size: [usize; 3]) -> Result<Self, Error> {
        let position: [f64; 3] =
            numbers(object, tags::IMAGE_POSITION_PATIENT, "Image Position (Patient)")?;
        let [a, b, c, d, e, f] =
            numbers(object, tags::IMAGE_ORIENTATION_PATIENT, "Image Orientation (Patient)")?;
        let (row, column) = (Vector::new(a, b, c), Vector::new(d, e, f));
        let off = [row.dot(&column), row.norm() - 1.0, column.norm() - 1.0];
        if off.iter().any(|v| v.abs() > SKEW) {
            let reason = "is not two unit vectors at right angles";
            return object.fail("Image Orientation (Patient)", reason);
        }
        let row = row.normalize();
        let column = (column - row * row.dot(&column)).normalize();
        let [down, across] = numbers(object, tags::PIXEL_SPACING, "Pixel Spacing")?;
        if !SPACING_MM.contains(&down) || !SPACING_MM.contains(&across) {
            let reason = format!("is {down} x {across} mm, outside 0.05 to 50 mm");
            return object.fail("Pixel Spacing", reason);
        }
        let offsets = offsets(object, size[2], position[2], (row, column))?;
        let mut order: Vec<usize> = (0..offsets.len()).collect();
        order.sort_by(|&a, &b| offsets[a].total_cmp(&offsets[b]));
        let step = even_step(object, &order, &offsets)?;
        let normal = row.cross(&column);
        let origin = Point::from(position) + normal * offsets[order[0]];
        let direction = Matrix::from_columns(&[row, column, normal]);
        let grid = Grid::new(size, Vector::new(across, down, step), origin, direction)?;
        Ok(Self { grid, order })
    }
}

/// Distance of each frame from the first along the normal, mm.
///
/// Form a: the first value is 0 and all are such distances. Form b: the first value is the z of the
/// first plane and all are z of planes; only for planes along the patient's axes (C.8.8.3.2).
fn offsets(
    object: &Object,
    frames: usize,
    z: f64,
    (row, column): (Vector, Vector),
) -> Result<Vec<f64>, Error> {
    let texts = object.set.texts(tags::GRID_FRAME_OFFSET_VECTOR);
    if texts.len() != frames {
        let reason = format!("has {} values for {frames} frames", texts.len());
        return object.fail(OFFSETS, reason);
    }
    let values: Option<Vec<f64>> = texts.iter().map(|t| parse_ds(t)).collect();
    let Some(values) = values else { return object.fail(OFFSETS, "is not a list of numbers") };
    let distances = || values.iter().map(|v| v - values[0]).collect();
    // Programs that subtract positions leave 1e-14 for 0.
    if values[0].abs() <= SAME_MM {
        return Ok(distances());
    }
    let axial = (row - Vector::x()).norm() < SKEW && (column - Vector::y()).norm() < SKEW;
    if !axial {
        let reason = format!(
            "starts with {} and not with 0: absolute positions are for the orientation \
             1\\0\\0\\0\\1\\0 only",
            values[0]
        );
        return object.fail(OFFSETS, reason);
    }
    if (values[0] - z).abs() > SAME_MM {
        let reason = format!(
            "starts with {}, which is neither 0 nor the z of Image Position (Patient), {z}",
            values[0]
        );
        return object.fail(OFFSETS, reason);
    }
    Ok(distances())
}

/// The distance of neighbouring planes, mm.
fn even_step(object: &Object, order: &[usize], offsets: &[f64]) -> Result<f64, Error> {
    let steps: Vec<f64> = order.windows(2).map(|p| offsets[p[1]] - offsets[p[0]]).collect();
    let mut sorted = steps.clone();
    sorted.sort_by(f64::total_cmp);
    let median = sorted[sorted.len() / 2];
    let frames = |n: usize| format!("frames {} and {}", order[n] + 1, order[n + 1] + 1);
    if let Some(n) = steps.iter().position(|s| *s < SAME_MM) {
        return object.fail(OFFSETS, format!("puts {} at one place", frames(n)));
    }
    if !SPACING_MM.contains(&median) {
        return object.fail(OFFSETS, format!("has steps of {median} mm, outside 0.05 to 50 mm"));
    }
    let tolerance = STEP_MM.max(STEP_SHARE * median);
    if let Some(n) = steps.iter().position(|s| (s - median).abs() > tolerance) {
        let reason = format!(
            "has unequal steps: {:.3} mm between {}, elsewhere {median:.3} mm; export the dose on \
             a regular grid",
            steps[n],
            frames(n)
        );
        return object.fail(OFFSETS, reason);
    }
    Ok(steps.iter().sum::<f64>() / steps.len() as f64)
}

/// Exactly `N` decimal strings of an attribute.
pub(super) fn numbers<const N: usize>(
    object: &Object,
    tag: Tag,
    name: &'static str,
) -> Result<[f64; N], Error> {
    let texts = object.set.texts(tag);
    if texts.is_empty() {
        return object.fail(name, "is missing");
    }
    let text = texts.join("\\");
    parse_ds_list(&texts)
        .map_or_else(|| object.fail(name, format!("is {text:?}, not {N} decimal number(s)")), Ok)
}
