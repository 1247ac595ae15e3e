//! One object carried by the command that carries: with or without a CT, into DICOM or not.

use super::context::CarryContext;
use super::contours::{
    CarriedContours, carry_lines, carry_named_contours, closed_contours, write_carried_structures,
};
use super::dose::{carry_with_totals, dose_doubts, not_anew, write_carried_dose};
use super::segments::{CarriedSegments, carry_segments, write_carried_segments};
use crate::Error;
use crate::shared::contours_placed;
use std::path::Path;
use supine_dicom::{Dose, DoseInfo, Segmentation, SegmentationInfo, Structures, StructuresInfo};
use supine_exchange::NamedContours;
use supine_mesh::Deformation;
use supine_space::{Grid, Progress, Warning};
use supine_volume::{Ct, Volume};
use supine_warp::DoseTotals;

/// What objects are carried with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CarryJob<'a> {
    pub(crate) context: &'a CarryContext,
    /// How many objects of the kind were written before.
    pub(crate) before: usize,
    /// As the solver gave it.
    pub(crate) deformation: &'a Deformation,
}

/// A dose that was carried.
#[derive(Debug)]
pub(crate) struct CarriedDose {
    pub(crate) given: Dose,
    /// Gy.
    pub(crate) carried: Volume<f32>,
    pub(crate) totals: DoseTotals,
    /// What was written; none when no file was named.
    pub(crate) written: Option<DoseInfo>,
    pub(crate) warnings: Vec<Warning>,
}

/// A structure set that was carried.
#[derive(Debug)]
pub(crate) struct CarriedStructures {
    pub(crate) given: Structures,
    /// Its closed contours as given.
    pub(crate) closed: Vec<NamedContours>,
    pub(crate) carried: CarriedContours,
    /// What was written; none when no file was named.
    pub(crate) written: Option<StructuresInfo>,
    pub(crate) warnings: Vec<Warning>,
}

/// A segmentation that was carried.
#[derive(Debug)]
pub(crate) struct CarriedSegmentation {
    pub(crate) given: Segmentation,
    pub(crate) carried: CarriedSegments,
    pub(crate) written: SegmentationInfo,
    pub(crate) warnings: Vec<Warning>,
}

impl CarryJob<'_> {
    fn place(&self) -> (&CarryContext, usize) {
        (self.context, self.before)
    }

    /// Carries a dose, and writes it as one of the exported CT where a file is named; `ct`, before
    /// deformation, gives the density of the tissue.
    pub(crate) fn dose(
        &self,
        path: &Path,
        out: Option<&Path>,
        ct: Option<&Ct>,
        progress: Progress<'_>,
    ) -> Result<CarriedDose, Error> {
        let (given, mut warnings) = self.context.dose(path)?;
        let volume = given.volume();
        let (moved, totals) = carry_with_totals(volume, ct, self.deformation, progress)?;
        warnings.extend(dose_doubts(volume, &moved));
        let carried = moved.carried;
        let write = |out| write_carried_dose(&carried, &given, self.place(), out);
        let written = out.map(write).transpose()?;
        warnings.insert(0, not_anew());
        warnings.extend(written.iter().flat_map(|info| info.warnings.clone()));
        Ok(CarriedDose { given, carried, totals, written, warnings })
    }

    /// Carries a structure set onto the slices of a grid, and writes it as one of the exported CT
    /// where a file is named.
    pub(crate) fn structures(
        &self,
        path: &Path,
        out: Option<&Path>,
        grid: &Grid,
        progress: Progress<'_>,
    ) -> Result<CarriedStructures, Error> {
        let (given, mut warnings) = self.context.structures(path)?;
        given.refuse_unknown().map_err(Error::Carried)?;
        if out.is_none() {
            // Points and open lines come out in DICOM only: nothing would be left.
            given.refuse_open().map_err(Error::Carried)?;
        }
        let (closed, left_out) = closed_contours(&given);
        warnings.extend(left_out);
        warnings.extend(contours_placed(&closed, grid)?);
        let carried = carry_named_contours(&closed, grid, self.deformation, progress)?;
        let write = |out| {
            let lines = carry_lines(&given, self.deformation)?;
            write_carried_structures(&carried, lines, &given, self.place(), out)
        };
        let written = out.map(write).transpose()?;
        warnings.extend(written.iter().flat_map(|info| info.warnings.clone()));
        Ok(CarriedStructures { given, closed, carried, written, warnings })
    }

    /// Carries a segmentation on the voxels of a grid, and writes it as one of the exported CT.
    pub(crate) fn segmentation(
        &self,
        path: &Path,
        out: &Path,
        grid: &Grid,
        progress: Progress<'_>,
    ) -> Result<CarriedSegmentation, Error> {
        let (given, mut warnings) = self.context.segmentation(path, grid)?;
        let carried = carry_segments(&given, grid, self.deformation, progress)?;
        let (written, more) = write_carried_segments(&carried, &given, self.place(), out)?;
        warnings.extend(more);
        Ok(CarriedSegmentation { given, carried, written, warnings })
    }
}

impl CarriedDose {
    /// Largest dose before and after, Gy.
    pub(crate) fn max_gy(&self) -> [f64; 2] {
        [self.given.volume(), &self.carried].map(max_gy)
    }
}

/// Largest dose, Gy.
pub(crate) fn max_gy(dose: &Volume<f32>) -> f64 {
    f64::from(dose.data().iter().copied().fold(f32::MIN, f32::max))
}
