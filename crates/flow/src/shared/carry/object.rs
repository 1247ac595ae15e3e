//! One object of a case: read, moved, written.

use super::CarriedKind;
use super::context::CarryContext;
use super::contours::{
    CarriedContours, carry_lines, carry_named_contours, closed_contours, write_carried_structures,
};
use super::dose::{carry_with_totals, dose_doubts, not_anew, write_carried_dose};
use super::segments::{CarriedSegments, carry_segments, write_carried_segments};
use crate::Error;
use crate::shared::contours_placed;
use std::path::Path;
use supine_dicom::{Dose, Line, Segmentation, Structures};
use supine_exchange::NamedContours;
use supine_mesh::Deformation;
use supine_report::CarriedObject;
use supine_space::{Grid, Progress, Warning};
use supine_volume::Ct;
use supine_warp::{CarriedDose, DoseTotals};

/// An object as it was given, held against the CT.
#[derive(Debug)]
pub(crate) struct GivenObject {
    pub(crate) kind: CarriedKind,
    pub(crate) what: Given,
    /// What a user has to know of it.
    pub(crate) warnings: Vec<Warning>,
}

#[derive(Debug)]
pub(crate) enum Given {
    Dose(Dose),
    /// With its closed contours.
    Structures(Structures, Vec<NamedContours>),
    Segmentation(Segmentation),
}

/// The same where the tissue carries it.
#[derive(Debug)]
pub(crate) enum MovedObject {
    /// Gy.
    Dose(Box<CarriedDose>, DoseTotals),
    /// With points and open lines of its regions.
    Structures(CarriedContours, Vec<Vec<Line>>),
    Segmentation(CarriedSegments),
}

/// Names of files of objects, by their kind and number: the structure set of a run itself is the
/// first of its kind.
pub(crate) fn file_names(all: &[GivenObject]) -> Vec<String> {
    let name = |n: usize| {
        let kind = all[n].kind;
        let same = all[..=n].iter().filter(|one| one.kind == kind).count();
        format!("{}-{same}.dcm", kind.name())
    };
    (0..all.len()).map(name).collect()
}

impl GivenObject {
    /// Reads an object; `grid` is that of the CT.
    ///
    /// # Errors
    /// When it cannot be read, or belongs to another CT or patient.
    pub(crate) fn read(
        kind: CarriedKind,
        path: &Path,
        context: &CarryContext,
        grid: &Grid,
    ) -> Result<Self, Error> {
        let (what, warnings) = match kind {
            CarriedKind::Dose => {
                let (dose, mut warnings) = context.dose(path)?;
                warnings.insert(0, not_anew());
                (Given::Dose(dose), warnings)
            }
            CarriedKind::Structures => {
                let (given, mut warnings) = context.structures(path)?;
                let (closed, left_out) = closed_contours(&given);
                warnings.extend(left_out);
                warnings.extend(contours_placed(&closed, grid)?);
                (Given::Structures(given, closed), warnings)
            }
            CarriedKind::Segmentation => {
                let (given, warnings) = context.segmentation(path, grid)?;
                (Given::Segmentation(given), warnings)
            }
        };
        Ok(Self { kind, what, warnings })
    }

    /// The object in the operating position; `ct` before deformation, `deformation` as the solver
    /// gave it.
    ///
    /// # Errors
    /// When contours cannot be carried, or the user stopped.
    pub(crate) fn moved(
        &self,
        ct: &Ct,
        deformation: &Deformation,
        progress: Progress<'_>,
    ) -> Result<MovedObject, Error> {
        Ok(match &self.what {
            Given::Dose(dose) => {
                let (moved, totals) =
                    carry_with_totals(dose.volume(), Some(ct), deformation, progress)?;
                MovedObject::Dose(Box::new(moved), totals)
            }
            Given::Structures(given, closed) => {
                let carried = carry_named_contours(closed, ct.grid(), deformation, progress)?;
                MovedObject::Structures(carried, carry_lines(given, deformation)?)
            }
            Given::Segmentation(given) => {
                let carried = carry_segments(given, ct.grid(), deformation, progress)?;
                MovedObject::Segmentation(carried)
            }
        })
    }

    /// Writes it where the tissue carries it into the file `out`, shown as `file`, as an object of
    /// the exported CT; `place` says what it belongs to and how many of its kind were written
    /// before. Warnings are those of the writing.
    ///
    /// # Errors
    /// When there is no exported CT, or the file cannot be written or does not read back.
    pub(crate) fn write(
        &self,
        moved: &MovedObject,
        place: (&CarryContext, usize),
        (out, file): (&Path, &str),
    ) -> Result<(CarriedObject, Vec<Warning>), Error> {
        let object = |instance_uid: String| CarriedObject {
            kind: self.kind.name().into(),
            file: file.into(),
            instance_uid,
            max_gy: None,
            energy_mj: None,
            regions: vec![],
        };
        match (&self.what, moved) {
            (Given::Dose(given), MovedObject::Dose(moved, totals)) => {
                let carried = &moved.carried;
                let info = write_carried_dose(carried, given, place, out)?;
                let max_gy = Some([given.volume(), carried].map(super::max_gy));
                let energy_mj = totals.energy_mj;
                let told = object(info.object.instance_uid);
                let doubts = dose_doubts(given.volume(), moved);
                let warnings = info.warnings.into_iter().chain(doubts).collect();
                Ok((CarriedObject { max_gy, energy_mj, ..told }, warnings))
            }
            (Given::Structures(given, _), MovedObject::Structures(carried, lines)) => {
                let info = write_carried_structures(carried, lines.clone(), given, place, out)?;
                let told = object(info.object.instance_uid);
                Ok((CarriedObject { regions: carried.regions(), ..told }, info.warnings))
            }
            (Given::Segmentation(given), MovedObject::Segmentation(carried)) => {
                let (info, warnings) = write_carried_segments(carried, given, place, out)?;
                let regions = carried.regions.clone();
                Ok((CarriedObject { regions, ..object(info.instance_uid) }, warnings))
            }
            _ => unreachable!("an object is moved as what it is"),
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        match &self.what {
            Given::Dose(dose) => 4 * dose.volume().data().len(),
            Given::Structures(_, closed) => contour_bytes(closed),
            Given::Segmentation(given) => given.held_bytes(),
        }
    }
}

impl MovedObject {
    pub(crate) fn bytes(&self) -> usize {
        match self {
            Self::Dose(dose, _) => 2 * 4 * dose.carried.data().len(),
            Self::Structures(carried, _) => contour_bytes(&carried.structures),
            Self::Segmentation(carried) => carried.bytes(),
        }
    }
}

fn contour_bytes(all: &[NamedContours]) -> usize {
    let corners = all.iter().flat_map(|one| &one.contours).map(Vec::len);
    corners.sum::<usize>() * size_of::<supine_space::Point>()
}
