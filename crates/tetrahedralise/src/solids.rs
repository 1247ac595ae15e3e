//! Closed surfaces of skin and chest wall as labels and distances on a grid around a sphere.

use crate::error::SolidError;
use crate::winding::Winding;
use crate::{Error, Params};
use std::sync::Arc;
use supine_mesh::TriSurface;
use supine_space::{Grid, Matrix, Point, Progress, Sphere, Vector, Warning};
use supine_volume::{LabelMap, SignedDistance, Surfaces, Volume, label};

/// Spacing of the grid, in radii of the sphere, mm per mm; no finer and no coarser than these, mm.
const SPACING: f64 = 0.012;
const FINEST_MM: f64 = 0.6;
const COARSEST_MM: f64 = 2.0;
/// What is known beyond the sphere, mm: what the mesher asks for.
const MARGIN_MM: f64 = 12.0;
/// How far distances are told, mm.
const BAND_MM: f64 = 2.5;
/// A surface smaller than this share of the sphere's radius has other units.
const SMALL: f64 = 0.5;
/// Volumes smaller than this are not worth a warning, mm³.
const WORTH_MM3: f64 = 1000.0;

/// The labels that two closed surfaces bound, and these surfaces between the voxels, on a grid
/// around a sphere; and what a user should know.
///
/// `skin` bounds the whole body or the soft tissue alone, `chest_wall` what is rigid. Where both
/// claim a place it is chest wall; where a gap between them is narrower than
/// [`Params::min_thickness_mm`] too. What a surface encloses several times counts once.
#[derive(Debug)]
pub struct Solids {
    /// Outside, soft tissue and chest wall.
    pub labels: Arc<LabelMap>,
    /// The surfaces, on the grid of the labels.
    pub surfaces: Arc<Surfaces>,
    /// What a user should know.
    pub warnings: Vec<Warning>,
}

impl Solids {
    /// Puts two surfaces on a grid around the sphere.
    ///
    /// # Errors
    /// [`Error::Solid`] when a surface has other units than mm or lies beside the sphere, or when
    /// chest wall and soft tissue do not meet; and when the progress callback says stop.
    pub fn new(
        skin: &TriSurface,
        chest_wall: &TriSurface,
        sphere: Sphere,
        params: &Params,
        progress: Progress<'_>,
    ) -> Result<Self, Error> {
        for (which, surface) in [("skin", skin), ("chest wall", chest_wall)] {
            check_place(which, surface, sphere)?;
        }
        let grid = around(sphere)?;
        let mut warnings = Vec::new();
        let mut solid = |which, surface, progress: Progress<'_>| {
            let (distance, twice) = solid(surface, &grid, progress)?;
            if twice > WORTH_MM3 {
                let text = format!(
                    "the surface of the {which} crosses itself: {:.1} cm³ near the region are enclosed \
                     several times or inside out, and count once",
                    twice / 1000.0
                );
                warnings.push(Warning::new("surface-crosses-itself", text));
            }
            Ok::<_, Error>(distance)
        };
        let skin = solid("skin", skin, progress.part(0.0, 0.45))?;
        let wall = solid("chest wall", chest_wall, progress.part(0.45, 0.9))?;
        warnings.extend(bulge(&skin, &wall, sphere));
        let solids = Self::joined(&skin, &wall, params.min_thickness_mm, warnings);
        if !solids.meet(sphere) {
            return Err(SolidError::Apart { gap_mm: params.min_thickness_mm }.into());
        }
        progress.at(1.0)?;
        Ok(solids)
    }

    /// Body and chest wall of the two solids, with narrow gaps between them closed.
    fn joined(
        skin: &SignedDistance,
        wall: &SignedDistance,
        gap_mm: f64,
        warnings: Vec<Warning>,
    ) -> Self {
        let grid = skin.grid();
        let gap = (gap_mm * SignedDistance::PER_MM) as i32;
        let pairs = skin.values().data().iter().zip(wall.values().data());
        let (mut body, mut rigid) = (Vec::new(), Vec::new());
        for (&s, &w) in pairs {
            let (s, w) = (i32::from(s), i32::from(w));
            // In a gap, outside both, the way across is the sum of both distances.
            let held = match w.min((-s).max(s + w - gap)) {
                0 => 1,
                held => held,
            };
            rigid.push(held as i16);
            body.push(s.min(held) as i16);
        }
        let volume = |values: Vec<i16>| {
            SignedDistance::from_values(Volume::from_fn(grid.clone(), |v| values[grid.offset(v)]))
        };
        let surfaces = Surfaces { skin: volume(body), chest_wall: volume(rigid) };
        let labels = Volume::from_fn(grid.clone(), |v| {
            let n = grid.offset(v);
            if surfaces.chest_wall.is_inside(n) {
                label::CHEST_WALL
            } else if surfaces.skin.is_inside(n) {
                label::SOFT_TISSUE
            } else {
                label::OUTSIDE
            }
        });
        Self { labels: Arc::new(labels), surfaces: Arc::new(surfaces), warnings }
    }

    /// Whether chest wall touches soft tissue within the sphere.
    fn meet(&self, sphere: Sphere) -> bool {
        let (grid, data) = (self.labels.grid(), self.labels.data());
        let [ni, nj, _] = grid.size();
        [1, ni, ni * nj].into_iter().any(|stride| {
            let pairs = data.iter().zip(&data[stride..]).enumerate();
            let mut touching = pairs.filter(|(_, (a, b))| {
                let pair = [**a, **b];
                pair.contains(&label::SOFT_TISSUE) && pair.contains(&label::CHEST_WALL)
            });
            // Rows and slices end at the grid's border, outside the sphere.
            touching.any(|(n, _)| sphere.contains(&grid.centre(grid.voxel(n))))
        })
    }
}

/// Refuses surfaces that are of another size or place than the sphere.
fn check_place(
    which: &'static str,
    surface: &TriSurface,
    sphere: Sphere,
) -> Result<(), SolidError> {
    let (low, high) = surface.bounds();
    let (extent, radius) = ((high - low).max(), sphere.radius());
    if extent < SMALL * radius {
        let unit = if extent < SMALL * radius / 20.0 { "metres" } else { "centimetres" };
        return Err(SolidError::Units { which, extent, radius, unit });
    }
    let away = |low: Point, high: Point| {
        let centre = sphere.centre();
        (centre - centre.sup(&low).inf(&high)).norm() - radius
    };
    let missing = away(low, high);
    if missing <= 0.0 {
        return Ok(());
    }
    let turned = away(Point::new(-high.x, -high.y, low.z), Point::new(-low.x, -low.y, high.z));
    let advice =
        if turned <= 0.0 { "; with the other frame (LPS, RAS) it would reach into it" } else { "" };
    Err(SolidError::Beside { which, missing, advice })
}

/// A grid along the patient's axes that holds the sphere and what the mesher asks for around it.
fn around(sphere: Sphere) -> Result<Grid, Error> {
    let step = (SPACING * sphere.radius()).clamp(FINEST_MM, COARSEST_MM);
    let reach = ((sphere.radius() + MARGIN_MM) / step).ceil();
    let size = 2 * reach as usize + 1;
    let origin = sphere.centre() - Vector::repeat(reach * step);
    Ok(Grid::new([size; 3], Vector::repeat(step), origin, Matrix::identity())?)
}

/// Distance to a surface, and the volume that it encloses several times or inside out, mm³.
fn solid(
    surface: &TriSurface,
    grid: &Grid,
    progress: Progress<'_>,
) -> Result<(SignedDistance, f64), Error> {
    let winding = Winding::new(surface, grid);
    progress.at(0.4)?;
    let numbers = winding.numbers();
    progress.at(0.5)?;
    let crossing = |n, m| winding.leaves(grid.voxel(n), grid.voxel(m));
    let distance = SignedDistance::new(grid, BAND_MM, |n| numbers[n] > 0, crossing);
    progress.at(1.0)?;
    let twice = numbers.iter().filter(|n| !(0..=1).contains(*n)).count();
    Ok((distance, twice as f64 * grid.voxel_volume()))
}

/// Warns of chest wall that stands out of a skin that otherwise encloses it.
fn bulge(skin: &SignedDistance, wall: &SignedDistance, sphere: Sphere) -> Option<Warning> {
    let grid = skin.grid();
    let (mut within, mut out) = (0usize, 0usize);
    for n in (0..grid.len()).filter(|&n| wall.is_inside(n)) {
        if sphere.contains(&grid.centre(grid.voxel(n))) {
            *(if skin.is_inside(n) { &mut within } else { &mut out }) += 1;
        }
    }
    let out_mm3 = out as f64 * grid.voxel_volume();
    (out < within && out_mm3 > WORTH_MM3).then(|| {
        let cm3 = out_mm3 / 1000.0;
        let text = format!("{cm3:.1} cm³ of the chest wall in the region lie outside the skin");
        Warning::new("wall-outside-skin", text)
    })
}
