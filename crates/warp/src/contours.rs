//! Planar contours carried along: closed surface, map, contours in the slices of a CT.

mod shear;
mod unmoved;

use crate::outline::{Pixels, signed_distance};
use crate::{Carried, Error, Params, carry_surface, slices};
use rayon::prelude::*;
use supine_mesh::{Deformation, TriSurface};
use supine_space::{Grid, Point, Progress};
use supine_volume::{
    ContourError, Layers, Outlines, Rule, SAME_PLANE_MM, contours_by_plane, held_by, isosurface,
    widest_bridged_mm,
};

/// The surface is sampled at steps of a pixel of the CT within a plane, but of this at most, mm.
const STEP_MM: f64 = 1.0;
/// Steps on the thickness of what is thin, and the shortest step, mm.
const STEPS_ACROSS: f64 = 4.0;
const FINEST_MM: f64 = 0.25;
/// Half the thickness in which the ends of the solid are closed, mm.
const LID_MM: f64 = 0.01;

/// Closed contours parallel to the slices of `grid` (LPS, mm) in the operating position, in those
/// slices; `deformation` as the solver gave it, the fade is applied within.
///
/// Between planes the solid is where the signed distances to the contours beside, weighted by
/// nearness, are negative, each shifted towards the other where they then lie upon each other
/// better (a thin structure that slants would vanish between them: see `shear`); it ends half a
/// usual step beyond the outermost planes, and so does each part where planes lie further apart
/// than two usual steps and 10 mm. The surface of the solid moves as in [`carry_surface`] and is
/// cut by the slices; `rule` tells what contours of a plane hold together. In slices where nothing
/// of it moves, the contours are those that were given there; elsewhere none encloses less than 2
/// mm², unless one that was given does.
///
/// # Errors
/// When no contour encloses anything, one lies nowhere near the grid or is not parallel to the
/// slices, a parameter is out of range, or the user stopped.
pub fn carry_contours(
    contours: &[Vec<Point>],
    rule: Rule,
    grid: &Grid,
    deformation: &Deformation,
    params: &Params,
    progress: Progress<'_>,
) -> Result<(Vec<Vec<Point>>, Carried), Error> {
    held_by(grid, contours)?;
    let planes = planes(contours, rule, grid)?;
    let before = solid(&planes, grid)?;
    progress.at(0.3)?;
    let (after, facts) = carry_surface(&before, deformation, params, progress.part(0.3, 0.8))?;
    if facts.moved_points == 0 {
        return Ok((contours.to_vec(), facts));
    }
    let cut = [before, after].map(|solid| slices::contours(&solid, grid));
    progress.at(0.9)?;
    let contours = unmoved::put_back(contours, &planes, cut, grid);
    progress.at(1.0)?;
    Ok((contours, facts))
}

/// Contours of one plane, in mm along the axes of the grid.
struct Plane {
    level: f64,
    outlines: Outlines,
}

/// The contours by plane, ascending.
fn planes(contours: &[Vec<Point>], rule: Rule, grid: &Grid) -> Result<Vec<Plane>, ContourError> {
    let planes = contours_by_plane(grid, contours, grid.spacing())?;
    let outlined =
        |(level, contours)| Plane { level, outlines: Outlines::new(contours, [1.0, 1.0], rule) };
    Ok(planes.into_par_iter().map(outlined).collect())
}

/// How thick a structure is in its planes, mm: twice the area by the length of the outline, which
/// is the width of a long band and the radius of a disc, in the mean over its area.
fn thickness(planes: &[Plane]) -> f64 {
    let (mut area, mut weighed) = (0.0, 0.0);
    for contour in planes.iter().flat_map(|p| p.outlines.contours()) {
        let segments = (0..contour.len()).map(|n| (contour[n], contour[(n + 1) % contour.len()]));
        let (mut twice, mut length) = (0.0, 0.0);
        for ([a, b], [c, d]) in segments {
            twice += a * d - c * b;
            length += (c - a).hypot(d - b);
        }
        if length > 0.0 {
            area += twice.abs();
            weighed += twice.abs() * twice.abs() / length;
        }
    }
    if area > 0.0 { weighed / area } else { f64::INFINITY }
}

/// The solid that contours enclose.
fn solid(planes: &[Plane], grid: &Grid) -> Result<TriSurface, Error> {
    let spacing = grid.spacing();
    let mut steps: Vec<f64> = planes.windows(2).map(|p| p[1].level - p[0].level).collect();
    steps.sort_by(f64::total_cmp);
    let usual = steps.get(steps.len() / 2).copied().unwrap_or(spacing.z);
    let widest = widest_bridged_mm(usual);
    let step = spacing.x.min(spacing.y).min(STEP_MM).min(thickness(planes) / STEPS_ACROSS);
    let step = step.max(FINEST_MM);
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for part in planes.chunk_by(|a, b| b.level - a.level <= widest) {
        let (more, faces) = part_of_solid(part, usual, step, grid);
        let first = points.len() as u32;
        points.extend(more);
        triangles.extend(faces.into_iter().map(|t| t.map(|p| p + first)));
    }
    Ok(TriSurface::new(points, triangles)?)
}

/// The surface of a part without wide gaps.
fn part_of_solid(
    planes: &[Plane],
    usual: f64,
    step: f64,
    grid: &Grid,
) -> (Vec<Point>, Vec<[u32; 3]>) {
    let corners = planes.iter().flat_map(|p| p.outlines.contours().iter().flatten().copied());
    let pixels = Pixels::around(corners, step);
    let distances: Vec<Vec<f32>> =
        planes.par_iter().map(|p| signed_distance(&pixels, &p.outlines)).collect();
    // Beyond each end: the outline once more at half a step, and all outside behind.
    let (mut levels, mut values) = (Vec::new(), Vec::new());
    let outside = |outline: &Vec<f32>| outline.iter().map(|d| d.abs() + 1.0).collect::<Vec<f32>>();
    let (Some(first), Some(last)) = (distances.first(), distances.last()) else {
        return (vec![], vec![]);
    };
    let (low, high) = (planes[0].level - 0.5 * usual, planes[planes.len() - 1].level + 0.5 * usual);
    levels.extend([low - LID_MM, low + LID_MM]);
    values.extend([outside(first), first.clone()]);
    let between: Vec<Vec<(f64, Vec<f32>)>> = (1..planes.len())
        .into_par_iter()
        .map(|n| {
            let pair = [&planes[n - 1], &planes[n]];
            shear::layers(&pixels, pair, [&distances[n - 1], &distances[n]])
        })
        .collect();
    for (n, (plane, distance)) in planes.iter().zip(&distances).enumerate() {
        levels.push(plane.level);
        values.push(distance.clone());
        for (level, distance) in between.get(n).into_iter().flatten() {
            levels.push(*level);
            values.push(distance.clone());
        }
    }
    levels.extend([high - LID_MM, high + LID_MM]);
    values.extend([last.clone(), outside(last)]);
    let spacing = grid.spacing();
    let place = |[i, j, k]: [usize; 3]| {
        let mm = [pixels.low[0] + step * i as f64, pixels.low[1] + step * j as f64, levels[k]];
        grid.patient_from_index([0, 1, 2].map(|a| mm[a] / spacing[a]))
    };
    let (points, mut triangles) = isosurface(&Layers { size: pixels.size, values: &values }, place);
    if grid.direction().determinant() < 0.0 {
        triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    (points, triangles)
}
