//! Volume and centroid of a solid that is drawn as contours.

use crate::contours::{ContourError, Overlap, SAME_PLANE_MM, fill_contours, widest_bridged_mm};
use crate::{Outlines, Rule, median};
use std::cmp::Ordering;
use supine_space::{Grid, Matrix, Point, Vector};

/// Pixels along the longer side of the contours: an area is then right to some thousandths.
const PIXELS: f64 = 256.0;
/// Most planes that the contours are looked at on.
const MAX_PLANES: f64 = 512.0;

/// Gaps wider than this many usual steps are told.
const USUAL_STEPS: f64 = 1.5;

/// A corner is a stray that lies this many times as far from the middle of its contour as half of
/// the corners do, ...
const STRAY: f64 = 4.0;
/// ... and this far at least, mm.
const STRAY_MM: f64 = 30.0;

/// A solid's volume and where it lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Enclosed {
    /// Centroid of the volume, LPS, mm.
    pub centroid: Point,
    /// Volume, mm³.
    pub volume_mm3: f64,
}

impl Enclosed {
    /// Radius of the sphere of the same volume, mm: (3 V / 4π)^(1/3).
    pub fn radius(&self) -> f64 {
        (self.volume_mm3 * 0.75 / std::f64::consts::PI).cbrt()
    }
}

/// What parallel closed contours enclose; LPS, mm.
///
/// The rules are those of [`fill_contours`], on pixels of 1/256 of the contours' width and on
/// planes as far apart as theirs: `rule` within a plane, missing planes interpolated, half a step
/// beyond the outermost ones.
///
/// # Errors
/// When no contour encloses anything, they lie in one plane alone, are not parallel, or planes are
/// missing.
pub fn enclosed(contours: &[Vec<Point>], rule: Rule) -> Result<Enclosed, ContourError> {
    let grid = grid_of(contours)?;
    let (mask, _) = fill_contours(&grid, contours, rule)?;
    let (mut voxels, mut sum) = (0usize, [0.0; 3]);
    for n in (0..grid.len()).filter(|&n| mask.data()[n]) {
        voxels += 1;
        sum.iter_mut().zip(grid.voxel(n)).for_each(|(sum, v)| *sum += v as f64);
    }
    if voxels == 0 {
        return Err(ContourError::Empty);
    }
    let centroid = grid.patient_from_index(sum.map(|s| s / voxels as f64));
    Ok(Enclosed { centroid, volume_mm3: voxels as f64 * grid.voxel_volume() })
}

/// Planes between others in which a structure is not drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Undrawn {
    /// How many planes are missing.
    pub planes: usize,
    /// A corner of the plane below the first gap, LPS, mm.
    pub below: [f64; 3],
    /// Widest distance of neighbouring planes, mm.
    pub widest_mm: f64,
    /// Usual distance of neighbouring planes: the median, mm.
    pub usual_mm: f64,
}

impl Undrawn {
    /// Whether each gap is filled from the planes beside it ([`fill_contours`]).
    pub fn is_bridged(&self) -> bool {
        self.widest_mm <= widest_bridged_mm(self.usual_mm)
    }
}

/// The planes that parallel closed contours leave out, if they leave out any; LPS, mm.
pub fn undrawn(contours: &[Vec<Point>]) -> Option<Undrawn> {
    let planes = planes(contours, axes(normal_of(contours)?).column(2).into_owned());
    let step = |pair: &[(f64, &Point)]| pair[1].0 - pair[0].0;
    let usual_mm = median(&mut planes.windows(2).map(step).collect::<Vec<_>>())?;
    let wide = |pair: &&[(f64, &Point)]| step(pair) > USUAL_STEPS * usual_mm;
    let below = planes.windows(2).find(wide)?[0].1.coords.into();
    let gaps: Vec<f64> = planes.windows(2).filter(wide).map(step).collect();
    let missing = |gap: &f64| ((gap / usual_mm).round() - 1.0).max(1.0) as usize;
    let widest_mm = gaps.iter().copied().fold(0.0, f64::max);
    Some(Undrawn { planes: gaps.iter().map(missing).sum(), below, widest_mm, usual_mm })
}

/// Where closed contours of one plane cross or lie upon each other, if any do; LPS, mm.
pub fn overlap(contours: &[Vec<Point>], rule: Rule) -> Option<Overlap> {
    let axes = axes(normal_of(contours)?);
    let flat = |contour: &Vec<Point>| -> Vec<[f64; 3]> {
        contour.iter().map(|p| axes.tr_mul(&p.coords).into()).collect()
    };
    let mut placed: Vec<Vec<[f64; 3]>> = closed(contours).map(flat).collect();
    placed.sort_by(|a, b| a[0][2].total_cmp(&b[0][2]));
    let planes = placed.chunk_by(|a, b| b[0][2] - a[0][2] <= SAME_PLANE_MM);
    let crossed = planes.filter(|plane| {
        let spots = plane.iter().map(|c| c.iter().map(|p| [p[0], p[1]]).collect());
        plane.len() > 1 && Outlines::new(spots.collect(), [1.0, 1.0], rule).overlap()
    });
    let mut crossed = crossed.map(|plane| axes * Vector::from(plane[0][0]));
    let at = crossed.next()?.into();
    Some(Overlap { planes: 1 + crossed.count(), at })
}

/// A corner that lies far from all others of its contour: a coordinate was mistyped, or lost its
/// decimal point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stray {
    /// Number of the contour, from 1.
    pub number: usize,
    /// The corner, LPS, mm.
    pub at: [f64; 3],
    /// The middle of the contour's corners, LPS, mm.
    pub from: [f64; 3],
}

/// The first corner that lies far from all others of its contour.
pub fn stray(contours: &[Vec<Point>]) -> Option<Stray> {
    let of_one = |(n, contour): (usize, &Vec<Point>)| {
        let middle = |axis: usize| median(&mut contour.iter().map(|p| p[axis]).collect::<Vec<_>>());
        let from = Point::new(middle(0)?, middle(1)?, middle(2)?);
        let far = |p: &Point| (p - from).norm();
        let usual = median(&mut contour.iter().map(far).collect::<Vec<_>>())?;
        let limit = (STRAY * usual).max(STRAY_MM);
        // What is no number is no place either.
        let at = contour.iter().find(|p| far(p).partial_cmp(&limit) != Some(Ordering::Less))?;
        Some(Stray { number: n + 1, at: at.coords.into(), from: from.coords.into() })
    };
    contours.iter().enumerate().filter(|(_, contour)| contour.len() >= 3).find_map(of_one)
}

fn closed(contours: &[Vec<Point>]) -> impl Iterator<Item = &Vec<Point>> {
    contours.iter().filter(|c| c.len() >= 3)
}

/// The normal of the largest contour whose corners lie in one plane; of the largest, where none's
/// do. One corner off its plane tilts the normal of its contour, and all others would seem oblique.
fn normal_of(contours: &[Vec<Point>]) -> Option<Vector> {
    let mut all: Vec<(Vector, &Vec<Point>)> = closed(contours).map(|c| (area(c), c)).collect();
    all.retain(|(a, _)| a.norm() > 0.0 && a.norm().is_finite());
    all.sort_by(|a, b| b.0.norm().total_cmp(&a.0.norm()));
    let is_flat = |(a, contour): &&(Vector, &Vec<Point>)| {
        let depths = contour.iter().map(|p| p.coords.dot(&a.normalize()));
        let ends =
            depths.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)]);
        ends[1] - ends[0] <= SAME_PLANE_MM
    };
    all.iter().find(is_flat).or(all.first()).map(|(a, _)| a.normalize())
}

/// The planes of closed contours along their normal, ascending: place, mm, and a corner of each.
fn planes(contours: &[Vec<Point>], normal: Vector) -> Vec<(f64, &Point)> {
    let placed = |contour: &'_ Vec<Point>| normal.dot(&contour[0].coords);
    let mut planes: Vec<(f64, &Point)> = closed(contours).map(|c| (placed(c), &c[0])).collect();
    planes.sort_by(|a, b| a.0.total_cmp(&b.0));
    planes.dedup_by(|b, a| b.0 - a.0 <= SAME_PLANE_MM);
    planes
}

/// Pixels that hold the contours, on their own planes.
fn grid_of(contours: &[Vec<Point>]) -> Result<Grid, ContourError> {
    if let Some(stray) = stray(contours) {
        return Err(ContourError::Stray(Box::new(stray)));
    }
    let closed = || closed(contours);
    let axes = axes(normal_of(contours).ok_or(ContourError::Empty)?);
    let place = |p: &Point, axis: usize| axes.column(axis).dot(&p.coords);
    let range = |axis: usize| {
        let all = closed().flatten().map(|p| place(p, axis));
        all.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)])
    };
    let [u, v, w] = [range(0), range(1), range(2)];
    let planes = planes(contours, axes.column(2).into_owned());
    let mut steps: Vec<f64> = planes.windows(2).map(|pair| pair[1].0 - pair[0].0).collect();
    let step = median(&mut steps).ok_or(ContourError::OnePlane)?;
    let step = step.max((w[1] - w[0]) / MAX_PLANES);
    let pixel = (u[1] - u[0]).max(v[1] - v[0]) / PIXELS;
    let size = [u, v].map(|[low, high]| ((high - low) / pixel).ceil() as usize + 1);
    let depth = ((w[1] - w[0]) / step).round() as usize + 1;
    let origin = Point::from(axes * Vector::new(u[0], v[0], planes[0].0));
    let spacing = Vector::new(pixel, pixel, step);
    Grid::new([size[0], size[1], depth], spacing, origin, axes).map_err(|_| ContourError::Empty)
}

/// Area of a contour along its normal, mm² (Newell's sum).
fn area(contour: &[Point]) -> Vector {
    let next = contour.iter().cycle().skip(1);
    let pairs = contour.iter().zip(next);
    0.5 * pairs.map(|(a, b)| a.coords.cross(&b.coords)).sum::<Vector>()
}

/// Axes of which the third is the normal, upwards.
fn axes(normal: Vector) -> Matrix {
    let normal = if normal[normal.iamax()] < 0.0 { -normal } else { normal };
    let first = Vector::ith(normal.iamin(), 1.0);
    let u = (first - normal * normal.dot(&first)).normalize();
    Matrix::from_columns(&[u, normal.cross(&u), normal])
}

#[cfg(test)]
mod tests {
    use super::*;

    const CENTRE: Point = Point::new(60.0, -212.3, -590.0);

    /// Circles of a sphere on planes `step` apart, turned by `turn`.
    fn sphere(radius: f64, step: f64, turn: Matrix) -> Vec<Vec<Point>> {
        let planes = (radius / step).floor() as i32;
        let circle = |n: i32| {
            let height = f64::from(n) * step;
            let r = (radius * radius - height * height).sqrt();
            (0..120)
                .map(|k| (f64::from(k) * 3.0).to_radians().sin_cos())
                .map(|(sin, cos)| CENTRE + turn * Vector::new(r * cos, r * sin, height))
                .collect()
        };
        (-planes..=planes).map(circle).collect()
    }

    fn turned() -> Matrix {
        let ((sa, ca), (sb, cb)) = (0.4f64.sin_cos(), 0.7f64.sin_cos());
        let about_x = Matrix::new(1.0, 0.0, 0.0, 0.0, ca, -sa, 0.0, sa, ca);
        Matrix::new(cb, -sb, 0.0, sb, cb, 0.0, 0.0, 0.0, 1.0) * about_x
    }

    #[test]
    fn a_sphere_has_its_centre_and_radius_in_any_direction() {
        for turn in [Matrix::identity(), turned()] {
            for (radius, step) in [(9.0, 3.0), (12.5, 2.5), (20.0, 1.0)] {
                let found = enclosed(&sphere(radius, step, turn), Rule::Joined).unwrap();
                assert!((found.centroid - CENTRE).norm() < 0.05, "{found:?}");
                assert!((found.radius() - radius).abs() < 0.02 * radius, "{}", found.radius());
            }
        }
    }

    #[test]
    fn the_contour_with_a_corner_off_its_plane_is_named_wherever_it_lies() {
        let given = sphere(20.0, 2.0, turned());
        let whole = enclosed(&given, Rule::Joined).unwrap();
        for wrong in [1, 10, 18] {
            let mut given = given.clone();
            given[wrong][7] += turned().column(2) * 2.0;
            let told = enclosed(&given, Rule::Joined).unwrap_err();
            let ContourError::NotParallel { number, spread_mm, at } = told else {
                panic!("{told:?}")
            };
            assert_eq!((number, Point::from(at)), (wrong + 1, given[wrong][7]));
            assert!((spread_mm - 2.0).abs() < 1e-6 && told.to_string().contains("its corner at ("));
        }
        assert!((whole.centroid - CENTRE).norm() < 0.05);
    }

    #[test]
    fn a_hole_is_not_part_of_the_volume() {
        let (outer, inner) =
            (sphere(20.0, 2.0, Matrix::identity()), sphere(10.0, 2.0, Matrix::identity()));
        let volume = |all: &[Vec<Point>]| enclosed(all, Rule::Joined).unwrap().volume_mm3;
        let ring = volume(&[outer.clone(), inner.clone()].concat());
        let expected = volume(&outer) - volume(&inner);
        assert!((ring - expected).abs() < 0.01 * expected, "{ring} {expected}");
    }

    #[test]
    fn one_plane_or_nothing_has_no_volume() {
        let all = sphere(9.0, 3.0, Matrix::identity());
        assert_eq!(enclosed(&all[2..3], Rule::Joined), Err(ContourError::OnePlane));
        assert_eq!(enclosed(&[], Rule::Joined), Err(ContourError::Empty));
        let line = vec![CENTRE; 5];
        assert_eq!(enclosed(&[line], Rule::Joined), Err(ContourError::Empty));
        let mut two = sphere(40.0, 3.0, Matrix::identity());
        assert_eq!(undrawn(&two), None);
        two.drain(10..12);
        assert!(enclosed(&two, Rule::Joined).is_ok());
        let gap = undrawn(&two).unwrap();
        assert!(gap.planes == 2 && (gap.usual_mm - 3.0).abs() < 1e-9, "{gap:?}");
        assert!((gap.widest_mm - 9.0).abs() < 1e-9 && gap.is_bridged(), "{gap:?}");
        let mut gap = sphere(40.0, 3.0, Matrix::identity());
        gap.drain(10..16);
        assert!(matches!(enclosed(&gap, Rule::Joined), Err(ContourError::Gap { .. })));
    }

    #[test]
    fn what_is_drawn_twice_counts_once_and_is_told() {
        let one = sphere(9.0, 3.0, turned());
        let twice = [one.clone(), one[2..5].to_vec()].concat();
        let [alone, double] = [&one, &twice].map(|all| enclosed(all, Rule::Joined).unwrap());
        assert_eq!(alone, double);
        assert_eq!(overlap(&one, Rule::Joined), None);
        let found = overlap(&twice, Rule::Joined).unwrap();
        assert_eq!(found.planes, 3);
        let height = turned().column(2).dot(&(Point::from(found.at) - CENTRE));
        assert!((height + 3.0).abs() < 1e-9, "{height}");
    }

    #[test]
    fn a_corner_that_strays_is_refused() {
        for value in [1e30, 1e9, -244_262.0, -2442.0, 594.0] {
            let mut all = sphere(9.0, 3.0, Matrix::identity());
            all[2][17].x = value;
            let error = enclosed(&all, Rule::Joined).unwrap_err();
            assert!(matches!(&error, ContourError::Stray(s) if s.number == 3), "{error}");
        }
        assert_eq!(stray(&sphere(9.0, 3.0, turned())), None);
    }
}
