//! Slices in order along their normal, and the grid they make.

use crate::accept::Accept;
use crate::acquisitions::{differing_acquisition, excluding, in_order};
use crate::equalise::EqualSteps;
use crate::error::Error;
use crate::number::ROUNDING_MM;
use crate::slice::Slice;
use crate::source::Source;
use crate::tilt::Lean;
use std::collections::BTreeSet;
use supine_space::{Grid, Matrix, Point, Posture, Vector, Warning};

/// Fewest slices that make a volume.
pub(crate) const MIN_SLICES: usize = 3;

/// Steps may differ from the median by this much, mm, or by [`STEP_SHARE`] of it. Chosen, not
/// measured: far above the rounding of positions with three decimals, far below a missing slice.
const STEP_MM: f64 = 0.01;
const STEP_SHARE: f64 = 0.01;
/// Slices closer than this lie at the same place, mm.
const SAME_PLACE_MM: f64 = 1e-3;
/// Components of direction cosines may differ by this much within a series.
const SAME_DIRECTION: f64 = 1e-4;
/// Spacings may differ by this share within a series.
const SAME_SPACING: f64 = 1e-5;

/// The order of the slices and their grid.
#[derive(Debug)]
pub(crate) struct Stack {
    /// Indices of the slices, ascending along row direction x column direction.
    pub(crate) order: Vec<usize>,
    /// Of the volume that is made.
    pub(crate) grid: Grid,
    /// How the slices become that volume when their steps are unequal, and that is accepted.
    pub(crate) equalised: Option<EqualSteps>,
    pub(crate) warnings: Vec<Warning>,
}

/// Checks that the slices make one regular volume.
pub(crate) fn stack(series: &str, slices: &[&Slice], accept: Accept) -> Result<Stack, Error> {
    if slices.len() < MIN_SLICES {
        return Err(Error::TooFewSlices { series: series.to_owned(), slices: slices.len() });
    }
    let each_its_own = each_its_own_frame(slices);
    for slice in slices {
        must_agree(slices[0], slice, each_its_own)?;
    }
    let (row, column) = orthonormal(slices[0]);
    let normal = row.cross(&column);
    let along = |n: usize| slices[n].position.coords.dot(&normal);
    let mut order: Vec<usize> = (0..slices.len()).collect();
    order.sort_by(|&a, &b| along(a).total_cmp(&along(b)).then(a.cmp(&b)));

    let mut warnings = Vec::new();
    let places: Vec<f64> = order.iter().map(|&n| along(n)).collect();
    let names: Vec<&Slice> = order.iter().map(|&n| slices[n]).collect();
    in_order(&places, &names)?;
    let even = even_step(&places, &names, &mut warnings);
    let (step, count, equalised) = match even {
        Ok(step) => (step, slices.len(), None),
        Err(error) => {
            let steps = equal_steps(error, &places, accept, &mut warnings)?;
            (steps.step(), steps.count(), Some(steps))
        }
    };
    not_tilted(&names, &normal)?;
    warn_about_position(names[0], &mut warnings);
    if each_its_own {
        let text = "each slice has a Frame of Reference UID of its own; patient, study, acquisition and geometry are those of \
                    one series, and it is taken for one";
        warnings.push(Warning::new("frame-of-reference-per-slice", text));
    }

    let first = names[0];
    let size = [first.pixels.columns.into(), first.pixels.rows.into(), count];
    let spacing = Vector::new(first.column_spacing, first.row_spacing, step);
    let direction = Matrix::from_columns(&[row, column, normal]);
    let grid = Grid::new(size, spacing, first.position, direction)?;
    Ok(Stack { order, grid, equalised, warnings })
}

/// Row and column direction with the rounding of the written cosines taken out.
fn orthonormal(slice: &Slice) -> (Vector, Vector) {
    let row = slice.row_direction.normalize();
    let column = slice.column_direction - row * row.dot(&slice.column_direction);
    (row, column.normalize())
}

/// Whether no two slices have the same Frame of Reference UID, as some programs write every file
/// anew. Two frames in a series of many slices are two scans.
fn each_its_own_frame(slices: &[&Slice]) -> bool {
    let frames: BTreeSet<&str> = slices.iter().map(|s| s.frame_of_reference.as_str()).collect();
    frames.len() == slices.len() && !frames.contains("")
}

/// Checks that two slices are of one series; with `frames_apart` their acquisition must be the same
/// in place of their frame of reference.
fn must_agree(a: &Slice, b: &Slice, frames_apart: bool) -> Result<(), Error> {
    let differs = |attribute, values: String| {
        Err(Error::Differs { attribute, a: a.file.clone(), b: b.file.clone(), values })
    };
    for ((attribute, x), (_, y)) in a.identity.iter().zip(&b.identity) {
        if x != y {
            return differs(attribute, String::new());
        }
    }
    if !frames_apart && a.frame_of_reference != b.frame_of_reference {
        return differs("Frame of Reference UID", String::new());
    }
    let turn = (a.row_direction - b.row_direction).abs().max();
    if turn.max((a.column_direction - b.column_direction).abs().max()) > SAME_DIRECTION {
        let values = format!(
            " ({:?} {:?} and {:?} {:?})",
            a.row_direction.as_slice(),
            a.column_direction.as_slice(),
            b.row_direction.as_slice(),
            b.column_direction.as_slice()
        );
        return differs("Image Orientation (Patient)", values);
    }
    let same = |x: f64, y: f64| (x - y).abs() <= SAME_SPACING * x;
    if !same(a.row_spacing, b.row_spacing) || !same(a.column_spacing, b.column_spacing) {
        let values = format!(
            " ({} x {} mm and {} x {} mm)",
            a.row_spacing, a.column_spacing, b.row_spacing, b.column_spacing
        );
        return differs("Pixel Spacing", values);
    }
    if (a.pixels.rows, a.pixels.columns) != (b.pixels.rows, b.pixels.columns) {
        let size = |s: &Slice| format!("{} x {}", s.pixels.rows, s.pixels.columns);
        return differs("Rows x Columns", format!(" ({} and {})", size(a), size(b)));
    }
    if a.patient_position != b.patient_position {
        let values = format!(" ({:?} and {:?})", a.patient_position, b.patient_position);
        return differs("Patient Position", values);
    }
    for (attribute, x, y) in differing_acquisition(a, b) {
        if frames_apart || matches!(attribute, "KVP" | "Convolution Kernel") {
            return differs(attribute, format!(" ({x:?} and {y:?}): not one reconstruction"));
        }
    }
    Ok(())
}

/// The distance of neighbouring slices, mm.
fn even_step(places: &[f64], slices: &[&Slice], warnings: &mut Vec<Warning>) -> Result<f64, Error> {
    let steps: Vec<f64> = places.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let name = |n: usize| slices[n].file.clone();
    if let Some(n) = steps.iter().position(|s| *s < SAME_PLACE_MM) {
        let hint = why_twice(slices[n], slices[n + 1]);
        return Err(Error::DuplicatePosition { a: name(n), b: name(n + 1), hint });
    }
    let mut sorted = steps.clone();
    sorted.sort_by(f64::total_cmp);
    let median = sorted[sorted.len() / 2];
    let tolerance = STEP_MM.max(STEP_SHARE * median);
    let count = steps.len() as f64;
    let span = places[places.len() - 1] - places[0];
    let worst = (0..steps.len())
        .max_by(|&a, &b| (steps[a] - median).abs().total_cmp(&(steps[b] - median).abs()));
    let Some(worst) = worst.filter(|&n| (steps[n] - median).abs() > tolerance) else {
        return Ok(span / count);
    };
    // Positions rounded to 0.1 mm jitter by half of that around a straight line.
    let (slope, residual) = straight_line(places);
    if residual <= ROUNDING_MM + 1e-6 {
        let text = format!(
            "the slice positions are rounded: steps of {:.3} to {:.3} mm are taken as {slope:.3} mm",
            sorted[0],
            sorted[sorted.len() - 1]
        );
        warnings.push(Warning::new("rounded-positions", text));
        return Ok(slope);
    }
    let (a, b, found_mm) = (name(worst), name(worst + 1), steps[worst]);
    let multiple = (found_mm / median).round();
    if multiple >= 2.0 && (found_mm - multiple * median).abs() <= multiple * tolerance {
        return Err(Error::Gap { a, b, gap_mm: found_mm, step_mm: median, hint: String::new() });
    }
    // Two that nearly coincide: one of them comes from elsewhere.
    let hint = if found_mm < 0.5 * median { leave_out(&b) } else { String::new() };
    Err(Error::UnequalSteps { a, b, found_mm, step_mm: median, hint })
}

/// Makes the best of unequal steps, where that is accepted.
fn equal_steps(
    mut error: Error,
    places: &[f64],
    accept: Accept,
    warnings: &mut Vec<Warning>,
) -> Result<EqualSteps, Error> {
    let (told, hint) = match &mut error {
        Error::Gap { a, b, gap_mm, step_mm, hint } => {
            let text =
                format!("gap of {gap_mm:.3} mm, the step is {step_mm:.3} mm: a slice is missing");
            (between(text, a, b), hint)
        }
        Error::UnequalSteps { a, b, found_mm, step_mm, hint } => {
            let text = "the slices are not equally spaced";
            let text = format!("{text}: {found_mm:.3} mm, elsewhere {step_mm:.3} mm");
            (between(text, a, b), hint)
        }
        _ => return Err(error),
    };
    let Some(steps) = EqualSteps::of(places) else {
        *hint += "; that is too far, or too unequal, to be interpolated";
        return Err(error);
    };
    if !accept.equalise_steps {
        *hint += "; `equalise_steps = true` in the case file, or --equalise-steps, interpolates linearly";
        return Err(error);
    }
    let (count, step) = (steps.count(), steps.step());
    warnings.push(told.text(format!(
        "; interpolated linearly from {} to {count} slices {step:.3} mm apart, as was asked",
        places.len()
    )));
    Ok(steps)
}

/// Said of steps that were made equal, with the slices between which they are not.
fn between(text: String, a: &str, b: &str) -> Warning {
    Warning::new("steps-equalised", text + " (").name(a).text(" and ").name(b).text(")")
}

/// What explains two slices at one place.
fn why_twice(a: &Slice, b: &Slice) -> String {
    if a.instance == b.instance && a.frame == b.frame {
        return ": they are the same image (SOP Instance UID); remove one copy".to_owned();
    }
    let acquisition = differing_acquisition(a, b).next().map(|(attribute, x, y)| {
        format!(
            ": they differ in {attribute} ({x:?} and {y:?}), so the series holds several \
             acquisitions; export the wanted one by itself"
        )
    });
    acquisition.unwrap_or_default()
}

/// How to read the series without a file.
pub(crate) fn leave_out(file: &str) -> String {
    format!("; to leave a file out: {}", excluding(&[file]))
}

/// Least-squares step of places over their index, and the largest distance from that line.
pub(crate) fn straight_line(places: &[f64]) -> (f64, f64) {
    let n = places.len() as f64;
    let (mid, mean) = ((n - 1.0) / 2.0, places.iter().sum::<f64>() / n);
    let offset = |k: usize| k as f64 - mid;
    let moment: f64 = places.iter().enumerate().map(|(k, p)| offset(k) * (p - mean)).sum();
    let slope = moment * 12.0 / (n * (n * n - 1.0));
    let residuals = places.iter().enumerate().map(|(k, p)| (p - mean - slope * offset(k)).abs());
    (slope, residuals.fold(0.0, f64::max))
}

/// The slices must lie along their normal, but for the rounding of their positions.
fn not_tilted(slices: &[&Slice], normal: &Vector) -> Result<(), Error> {
    let positions: Vec<Point> = slices.iter().map(|s| s.position).collect();
    let lean = Lean::of(&positions, normal);
    let file = |n: usize| slices[n].file.clone();
    if lean.is_tilted() {
        let (degrees, farthest) = (lean.degrees, lean.farthest);
        return Err(Error::Tilted { file: file(farthest.slice), degrees, lateral_mm: farthest.mm });
    }
    if lean.has_stray() {
        return Err(Error::Stray { file: file(lean.strayed.slice), lateral_mm: lean.strayed.mm });
    }
    Ok(())
}

/// Why a CT in a Patient Position is none of a patient in the posture that is taken; none when it
/// is, or when the position says nothing that is known. There is none for a patient who is upright:
/// of her every one is taken.
pub fn lay_otherwise(position: &str, taken: Posture) -> Option<String> {
    if taken == Posture::Upright {
        return None;
    }
    let told = Posture::of_patient_position(position).filter(|told| *told != taken)?;
    Some(format!(
        "its Patient Position is {position}: the patient {}, and gravity is taken as of one who {}; say position = \"{}\", or give \
         another CT",
        told.told(),
        taken.told(),
        told.name()
    ))
}

/// Says that the posture is not known, or none of those that are.
fn warn_about_position(slice: &Slice, warnings: &mut Vec<Warning>) {
    match slice.patient_position.as_str() {
        known if Posture::of_patient_position(known).is_some() => {}
        "" => {
            let text = "Patient Position is missing; the patient is taken to lie as `position` says, on her back unless that is given";
            warnings.push(Warning::new("patient-position-missing", text));
        }
        other => {
            let text = format!(
                "Patient Position is {other}, which is not known here: check that gravity pulled as \
                 `position` says, towards her back unless that is given"
            );
            warnings.push(Warning::new("patient-position-unknown", text));
        }
    }
    if slice.frame_of_reference.is_empty() {
        let text = "Frame of Reference UID is missing";
        warnings.push(Warning::new("frame-of-reference-missing", text));
    }
}

/// The grid of a source that was read before.
pub(crate) fn grid_of(source: &Source) -> Result<Grid, Error> {
    let slices: Vec<&Slice> = source.slices.iter().map(|s| &s.slice).collect();
    Ok(stack(&source.series_uid(), &slices, Accept::default())?.grid)
}

/// A volume to be written must lie on the grid of its source.
pub(crate) fn same_grid(volume: &Grid, source: &Grid) -> Result<(), Error> {
    let differs = |reason: String| Err(Error::OtherGrid { reason });
    if volume.size() != source.size() {
        return differs(format!("{:?} voxels, the source has {:?}", volume.size(), source.size()));
    }
    let last = volume.size().map(|s| s - 1);
    let shift = |corner| (volume.centre(corner) - source.centre(corner)).norm();
    let off =
        [[0; 3], last, [last[0], 0, 0], [0, last[1], 0]].map(shift).into_iter().fold(0.0, f64::max);
    if off > 1e-3 {
        return differs(format!("a corner lies {off:.3} mm from that of the source"));
    }
    Ok(())
}
