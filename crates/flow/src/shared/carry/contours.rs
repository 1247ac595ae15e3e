//! Contours and structure sets.

use super::context::CarryContext;
use crate::Error;
use std::path::Path;
use supine_dicom::{Drawing, Line, LineKind, Structures, StructuresInfo, write_structures};
use supine_exchange::NamedContours;
use supine_mesh::Deformation;
use supine_report::CarriedRegion;
use supine_space::{Grid, Point, Progress, Warning};
use supine_volume::Rule;
use supine_warp::{Carried, Params, carry_contours, carry_vertices};

/// Structures in the operating position.
#[derive(Debug, Default)]
pub(crate) struct CarriedContours {
    /// All of them, in their order; those without contours stay so.
    pub(crate) structures: Vec<NamedContours>,
    /// What became of those with contours: how many they had, and what the surface did.
    pub(crate) moved: Vec<(usize, Carried)>,
}

impl CarriedContours {
    /// Volumes of those with contours.
    pub(crate) fn regions(&self) -> Vec<CarriedRegion> {
        let facts = self.moved.iter().map(|(n, carried)| {
            let [before_ml, after_ml] = carried.volume_ml;
            CarriedRegion { name: self.structures[*n].name.clone(), before_ml, after_ml }
        });
        facts.collect()
    }
}

/// Structures on the slices of a grid. `deformation` as the solver gave it.
///
/// # Errors
/// When the contours of a structure enclose nothing or are not parallel to the slices, or the user
/// stopped.
pub(crate) fn carry_named_contours(
    given: &[NamedContours],
    grid: &Grid,
    deformation: &Deformation,
    progress: Progress<'_>,
) -> Result<CarriedContours, Error> {
    let mut carried = CarriedContours::default();
    for (n, structure) in given.iter().enumerate() {
        let all = given.len() as f64;
        let progress = progress.part(n as f64 / all, (n + 1) as f64 / all);
        let NamedContours { name, contours, rule } = structure;
        if contours.is_empty() {
            carried.structures.push(structure.clone());
            continue;
        }
        let (contours, facts) =
            carry_contours(contours, *rule, grid, deformation, &Params::default(), progress)
                .map_err(|error| match Error::from(error) {
                    Error::Warp(source) => Error::Structure { name: name.clone(), source },
                    other => other,
                })?;
        carried.moved.push((n, facts));
        let (name, rule) = (name.clone(), Rule::Joined);
        carried.structures.push(NamedContours { name, contours, rule });
    }
    Ok(carried)
}

/// Points and open lines of the regions of a structure set in the operating position, in their
/// order. A planar line that moves is planar no longer.
///
/// # Errors
/// When the displacement belongs to another mesh.
pub(crate) fn carry_lines(
    structures: &Structures,
    deformation: &Deformation,
) -> Result<Vec<Vec<Line>>, Error> {
    let lines = || structures.rois().iter().flat_map(|roi| &roi.lines);
    let given: Vec<Point> = lines().flat_map(|line| line.points.iter().copied()).collect();
    if given.is_empty() {
        return Ok(structures.rois().iter().map(|_| vec![]).collect());
    }
    let mut moved = carry_vertices(&given, deformation, &Params::default())?.into_iter();
    let mut one = |line: &Line| {
        let points: Vec<Point> = moved.by_ref().take(line.points.len()).collect();
        let kind = match line.kind {
            LineKind::OpenPlanar if points != line.points => LineKind::OpenNonplanar,
            kind => kind,
        };
        Line { kind, points }
    };
    Ok(structures.rois().iter().map(|roi| roi.lines.iter().map(&mut one).collect()).collect())
}

/// The closed contours of a structure set, and what of it is left out.
pub(crate) fn closed_contours(structures: &Structures) -> (Vec<NamedContours>, Vec<Warning>) {
    let (mut warnings, mut given) = (Vec::new(), Vec::new());
    for roi in structures.rois() {
        let name = &roi.name;
        if roi.unknown_contours > 0 {
            let n = roi.unknown_contours;
            let text = format!(": {n} contours of unknown types are left out");
            warnings.push(Warning::new("contours-unknown", "").name(name).text(text));
        }
        let mut contours = roi.contours.clone();
        if !contours.is_empty() && contours.iter().all(|c| c.len() < 3) {
            let text = ": no contour has three corners; it is left empty";
            warnings.push(Warning::new("contours-too-small", "").name(name).text(text));
            contours.clear();
        }
        warnings.extend(roi.oddly_drawn());
        given.push(NamedContours { name: name.clone(), contours, rule: roi.rule });
    }
    (given, warnings)
}

/// Writes carried structures as a structure set of the exported CT.
///
/// `lines` are those of [`carry_lines`].
///
/// # Errors
/// When there is no exported CT, they are of another patient, or the file cannot be written or does
/// not read back.
pub(crate) fn write_carried_structures(
    carried: &CarriedContours,
    lines: Vec<Vec<Line>>,
    from: &Structures,
    (context, before): (&CarryContext, usize),
    path: &Path,
) -> Result<StructuresInfo, Error> {
    let source = context.source()?;
    let drawn: Vec<Drawing> = carried
        .structures
        .iter()
        .zip(lines)
        .map(|(s, lines)| Drawing { contours: s.contours.clone(), lines })
        .collect();
    let params = context.params("structures", before)?;
    write_structures(&drawn, from, source, &params, path).map_err(Error::Carried)
}
