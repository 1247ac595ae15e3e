//! Body, chest wall, breast and tumour in the operating position, as a structure set of the
//! exported series.

use crate::Error;
use std::f64::consts::TAU;
use std::path::Path;
use supine_dicom::{CompanionParams, Drawing, Named, ReadParams, Structures, write_structures};
use supine_mesh::{Deformation, TriSurface};
use supine_space::{Grid, Point, Progress, Sphere, Vector, Warning};
use supine_volume::{Ct, LabelMap, Rule, Volume, label};
use supine_warp::{
    Origins, Params, carry_contours, carry_labels, fade, mask_contours, surface_contours,
};

/// The regions, in the order in which they are written.
const REGIONS: [Named; 4] = [
    Named { name: "Body", interpreted_type: "EXTERNAL", colour: [0, 200, 0] },
    Named { name: "Chest wall", interpreted_type: "ORGAN", colour: [225, 94, 10] },
    Named { name: "Breast, simulated", interpreted_type: "ORGAN", colour: [64, 212, 255] },
    Named { name: "Tumour", interpreted_type: "GTV", colour: [220, 30, 140] },
];
/// Outlines of body and wall that enclose less are leftovers of fingers, tubes and the table, mm².
const LEAST_MM2: f64 = 100.0;
/// Corners of the tumour's outline in a slice.
const CORNERS: u32 = 72;

/// What the regions are found from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OwnRegions<'a> {
    pub(crate) ct: &'a Ct,
    pub(crate) labels: &'a LabelMap,
    /// As the solver gave it.
    pub(crate) deformation: &'a Deformation,
    /// Before deformation.
    pub(crate) tumour: Sphere,
}

/// Writes the regions as a structure set of an exported series; warnings.
///
/// # Errors
/// When the series cannot be read, the user stopped, or the file cannot be written or does not read
/// back.
pub(crate) fn write_own_regions(
    regions: &OwnRegions<'_>,
    series: &Path,
    path: &Path,
    progress: Progress<'_>,
) -> Result<Vec<Warning>, Error> {
    let read = supine_dicom::read_series(series, &ReadParams::default(), progress.part(0.0, 0.2));
    let (_, source, _) = read.map_err(Error::Export)?;
    let drawn = drawn(regions, progress.part(0.2, 0.9))?;
    let from = Structures::of_patient(&source, &REGIONS);
    let params = CompanionParams {
        series_description: "DEFORMED regions of the simulation [supine]".into(),
        derivation: "DERIVED: found by segmentation and moved by a simulated deformation. The CT:"
            .into(),
        clock: source.clock(),
        before: 0,
        software_version: env!("CARGO_PKG_VERSION").into(),
    };
    let written = write_structures(&drawn, &from, &source, &params, path).map_err(Error::Export)?;
    progress.at(1.0)?;
    Ok(written.warnings)
}

fn drawn(regions: &OwnRegions<'_>, progress: Progress<'_>) -> Result<Vec<Drawing>, Error> {
    let &OwnRegions { ct, labels, deformation, tumour } = regions;
    let (grid, params) = (ct.grid(), Params::default());
    // Voxels reach half their diagonal beyond the faces of the mesh.
    let layer_mm = grid.spacing().norm();
    let origins = Origins::new(grid, deformation, &params, layer_mm, progress.part(0.0, 0.4))?;
    let after = carry_labels(labels, &origins, progress.part(0.4, 0.6))?;
    let outlined = |belongs: fn(u8) -> bool| {
        mask_contours(&Volume::par_from_fn(grid.clone(), |v| belongs(after.at(v))), LEAST_MM2)
    };
    let body = outlined(|l| l != label::OUTSIDE);
    progress.at(0.75)?;
    let wall = outlined(label::is_chest_wall);
    let (tumour, _) = carry_contours(
        &outline(grid, tumour),
        Rule::Joined,
        grid,
        deformation,
        &params,
        progress.part(0.8, 1.0),
    )?;
    let all = [body, wall, surface_contours(&breast(deformation, &params)?, grid), tumour];
    Ok(all.map(|contours| Drawing { contours, lines: vec![] }).into())
}

/// The surface of the simulated tissue in the operating position.
fn breast(deformation: &Deformation, params: &Params) -> Result<TriSurface, Error> {
    let faded = fade(deformation, params)?.deformation;
    let (mesh, moved) = (faded.mesh(), faded.displacement().values());
    let points = mesh.points().iter().zip(moved).map(|(p, u)| p + u).collect();
    let faces = mesh.boundary().iter().map(|face| face.points).collect();
    TriSurface::new(points, faces).map_err(|e| Error::Warp(e.into()))
}

/// The tumour in the slices that it meets; in the nearest when it lies between two.
fn outline(grid: &Grid, tumour: Sphere) -> Vec<Vec<Point>> {
    let normal: Vector = grid.direction().column(2).into();
    let [row, column]: [Vector; 2] = [0, 1].map(|axis| grid.direction().column(axis).into());
    let depth = normal.dot(&(tumour.centre() - grid.origin()));
    let (step, slices) = (grid.spacing().z, grid.size()[2]);
    let circle = |k: usize, radius: f64| -> Vec<Point> {
        let middle = tumour.centre() + normal * (k as f64 * step - depth);
        let corner = |n: u32| {
            let (sin, cos) = (f64::from(n) * TAU / f64::from(CORNERS)).sin_cos();
            middle + (row * cos + column * sin) * radius
        };
        (0..CORNERS).map(corner).collect()
    };
    let radius = |k: usize| {
        let off = k as f64 * step - depth;
        (tumour.radius().powi(2) - off * off).max(0.0).sqrt()
    };
    let met = (0..slices).filter(|&k| radius(k) > 0.1 * tumour.radius());
    let contours: Vec<Vec<Point>> = met.map(|k| circle(k, radius(k))).collect();
    if contours.is_empty() {
        let nearest = (depth / step).round().clamp(0.0, (slices - 1) as f64) as usize;
        return vec![circle(nearest, tumour.radius())];
    }
    contours
}
