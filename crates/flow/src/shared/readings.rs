//! Places that may be in other axes or in another unit than LPS, mm.

use crate::Error;
use supine_exchange::NamedContours;
use supine_mesh::TetMesh;
use supine_space::{Failure, Grid, Point, Warning};

/// A point as another program may have meant it.
type Reading = fn(Point) -> Point;

/// What else points can be, and how they are put right.
const READINGS: [(&str, Reading); 4] = [
    ("in RAS: change the sign of x and y", |p| Point::new(-p.x, -p.y, p.z)),
    ("in metres: multiply it by 1000", |p| p * 1000.0),
    ("in centimetres: multiply it by 10", |p| p * 10.0),
    ("in metres and RAS: multiply it by 1000, and x and y by -1", |p| {
        Point::new(-p.x, -p.y, p.z) * 1000.0
    }),
];
/// Contours that measure less in all are none of a patient in mm, mm from corner to corner.
const LEAST_MM: f64 = 2.0;
/// Planes of contours this many times nearer to each other than slices are said to be in
/// centimetres, give or take a share.
const IN_CM: f64 = 10.0;
const GIVE: f64 = 0.2;
/// Contours nearer than this lie in one plane, mm: a tenth of what they may when they are in mm.
const SAME_PLANE_MM: f64 = 0.01;

/// The reading for which something fits: what it would be, in words.
pub(crate) fn other_reading(mut fits: impl FnMut(Reading) -> bool) -> Option<&'static str> {
    READINGS.iter().find(|(_, read)| fits(*read)).map(|(words, _)| *words)
}

/// The corners of the box around points, lowest and highest, if there are any.
pub(crate) fn bounds<'a>(mut points: impl Iterator<Item = &'a Point>) -> Option<[Point; 2]> {
    let first = *points.next()?;
    Some(points.fold([first; 2], |[low, high], p| [low.inf(p), high.sup(p)]))
}

/// The reading by which all of some points would lie in the box around a mesh.
pub(crate) fn would_lie_in(points: &[Point], mesh: &TetMesh) -> Option<&'static str> {
    let [low, high] = bounds(mesh.points().iter())?;
    let within = |p: Point| (0..3).all(|a| low[a] <= p[a] && p[a] <= high[a]);
    let all = |read: Reading| points.iter().all(|p| within(read(*p)));
    if points.is_empty() { None } else { other_reading(all) }
}

/// What is doubtful about where closed contours lie, drawn on the slices of a grid.
///
/// # Errors
/// When all of them together are as small as a patient in metres is in mm.
pub(crate) fn contours_placed(given: &[NamedContours], grid: &Grid) -> Result<Vec<Warning>, Error> {
    let corners = || given.iter().flat_map(|s| s.contours.iter().flatten());
    let Some([low, high]) = bounds(corners()) else { return Ok(vec![]) };
    let size = (high - low).norm();
    let lie_there = |read: Reading| corners().all(|p| grid.voxel_at(&read(*p)).is_some());
    // A single clip is as small, and lies in the CT as it is.
    if size < LEAST_MM && (!lie_there(|p| p) || lie_there(|p| p * 1000.0)) {
        let message = format!(
            "the contours measure {size:.2} mm in all, from corner to corner: they are in metres, or of nothing; positions are in mm"
        );
        return Err(Error::Refused { kind: Failure::Input, message });
    }
    let mut doubts = vec![];
    let steps = given.iter().filter_map(|s| usual_step(s, grid));
    let (near, all) = steps.fold((0, 0), |(near, all), step| {
        let share = IN_CM * step / grid.spacing().z;
        (near + usize::from((share - 1.0).abs() < GIVE), all + 1)
    });
    if all > 0 && 2 * near > all {
        let text = "the contours lie a tenth of the slices' distance apart: are they in centimetres? Positions are in mm";
        doubts.push(Warning::new("contours-in-cm", text));
    }
    if corners().all(|p| grid.voxel_at(p).is_none()) {
        let hint = other_reading(lie_there)
            .map_or("is it of this patient, in mm, and are its axes right?".into(), |reading| {
                format!("the set would lie there if it is {reading}")
            });
        let text = format!("no contour lies in the CT, so that nothing of them moves: {hint}");
        doubts.push(Warning::new("contours-beside", text));
    }
    Ok(doubts)
}

/// Half of a structure's planes are this far apart or less, mm; none of one plane.
fn usual_step(structure: &NamedContours, grid: &Grid) -> Option<f64> {
    let depth = |p: &Point| grid.index_from_patient(p)[2] * grid.spacing().z;
    let mut planes: Vec<f64> =
        structure.contours.iter().filter_map(|c| c.first()).map(depth).collect();
    planes.sort_by(f64::total_cmp);
    planes.dedup_by(|b, a| *b - *a <= SAME_PLANE_MM);
    supine_volume::median(&mut planes.windows(2).map(|p| p[1] - p[0]).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Matrix, Vector};
    use supine_volume::Rule;

    fn grid() -> Grid {
        let spacing = Vector::new(1.0, 1.0, 3.0);
        Grid::new([100, 100, 40], spacing, Point::new(20.0, -150.0, 900.0), Matrix::identity())
            .unwrap()
    }

    /// A box of 20 mm on every slice of 18 mm, every coordinate times `unit`.
    fn drawn(unit: f64) -> Vec<NamedContours> {
        let plane = |k: u8| {
            let z = 930.0 + 3.0 * f64::from(k);
            let corners = [[50.0, -100.0], [70.0, -100.0], [70.0, -80.0], [50.0, -80.0]];
            corners.map(|[x, y]| Point::new(x, y, z) * unit).to_vec()
        };
        let contours = (0..6).map(plane).collect();
        vec![NamedContours { name: "GTV".into(), contours, rule: Rule::Joined }]
    }

    #[test]
    fn contours_in_another_unit_are_refused_or_told_and_those_in_mm_are_not() {
        assert_eq!(contours_placed(&drawn(1.0), &grid()).unwrap(), vec![]);
        let told = contours_placed(&drawn(1e-3), &grid()).unwrap_err().to_string();
        assert!(told.contains("metres") && told.contains("0.03 mm"), "{told}");
        let told = contours_placed(&drawn(0.1), &grid()).unwrap();
        let codes: Vec<&str> = told.iter().map(Warning::code).collect();
        assert_eq!(codes, ["contours-in-cm", "contours-beside"]);
        assert!(told[1].to_string().contains("in centimetres: multiply it by 10"), "{told:?}");
    }

    #[test]
    fn the_contour_of_a_clip_is_as_small_as_a_patient_in_metres_and_is_taken() {
        let corner = |x: f64, y: f64| Point::new(60.0 + x, -100.0 + y, 930.0);
        let contours = vec![vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0)]];
        let clip = NamedContours { name: "clip".into(), contours, rule: Rule::Joined };
        assert_eq!(contours_placed(&[clip], &grid()).unwrap(), vec![]);
    }

    #[test]
    fn contours_beside_the_ct_are_told_with_the_axes_in_which_they_would_lie_there() {
        let mut mirrored = drawn(1.0);
        for p in mirrored.iter_mut().flat_map(|s| s.contours.iter_mut().flatten()) {
            *p = Point::new(-p.x, -p.y, p.z);
        }
        let told = contours_placed(&mirrored, &grid()).unwrap();
        assert_eq!(told.len(), 1);
        assert!(told[0].to_string().contains("in RAS"), "{told:?}");
    }
}
