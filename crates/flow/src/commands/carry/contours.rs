//! Contours and structure sets.

use super::{CarryDone, ContoursFacts, Job};
use crate::commands::usage;
use crate::shared::carry::{CarriedContours, carry_named_contours};
use crate::shared::contours_placed;
use crate::{Error, NodeId};
use supine_dicom::oddly_drawn;
use supine_exchange::{NamedContours, read_contours, write_contours};
use supine_space::Warning;

impl Job<'_> {
    /// Contours of a CSV.
    pub(super) fn contours(&self) -> Result<CarryDone, Error> {
        if self.to_dicom() {
            return Err(usage(
                "a structure set (.dcm) is made from a structure set: name a .csv file",
            ));
        }
        let given = read_contours(&self.given.what).map_err(Error::product)?;
        let odd = given.iter().flat_map(|s| oddly_drawn(&s.name, &s.contours, s.rule));
        self.gather.warn_all(NodeId::Carry, odd);
        let grid = self.grid(self.ct()?.as_ref())?;
        self.gather.warn_all(NodeId::Carry, contours_placed(&given, &grid)?);
        let carried = self.gather.work(NodeId::Carry, |progress| {
            carry_named_contours(&given, &grid, &self.deformation, progress)
        })?;
        write_contours(&carried.structures, self.out()).map_err(Error::product)?;
        Ok(self.told(&given, &carried, None))
    }

    /// A structure set: points and open lines of it come out in DICOM only.
    pub(super) fn structures(&self) -> Result<CarryDone, Error> {
        let ct = self.ct()?;
        let context = self.context(ct.as_ref())?;
        // An object's contours go on the slices of the CT that it belongs to.
        let exported = context.exported().filter(|_| self.to_dicom() || ct.is_none());
        let grid = match exported {
            Some((exported, _)) => exported.grid().clone(),
            None => self.grid(ct.as_ref())?,
        };
        let out = self.to_dicom().then(|| self.out());
        let done = self.gather.work(NodeId::Carry, |progress| {
            self.with(&context).structures(&self.given.what, out, &grid, progress)
        })?;
        self.gather.warn_all(NodeId::Carry, done.warnings);
        if out.is_none() {
            let left_out = done.given.rois().iter().filter(|roi| !roi.lines.is_empty());
            let left_out = left_out.map(|roi| {
                let text = format!(
                    ": {} points and open lines are left out of the .csv file",
                    roi.lines.len()
                );
                Warning::new("lines-left-out", "").name(&roi.name).text(text)
            });
            self.gather.warn_all(NodeId::Carry, left_out);
            let drawn = done.carried.structures.iter().filter(|s| !s.contours.is_empty());
            let drawn: Vec<NamedContours> = drawn.cloned().collect();
            let same =
                |(n, s): &(usize, &NamedContours)| drawn[..*n].iter().any(|t| t.name == s.name);
            if let Some((_, twice)) = drawn.iter().enumerate().find(same) {
                return Err(usage(format!(
                    "two regions are called {:?}, and a .csv file tells them apart by their names alone: name a .dcm file",
                    twice.name
                )));
            }
            write_contours(&drawn, self.out()).map_err(Error::product)?;
        }
        let instance_uid = done.written.map(|written| written.object.instance_uid);
        Ok(self.told(&done.closed, &done.carried, instance_uid))
    }

    fn told(
        &self,
        given: &[NamedContours],
        carried: &CarriedContours,
        instance_uid: Option<String>,
    ) -> CarryDone {
        let structures = carried.moved.iter().map(|(n, facts)| {
            let NamedContours { name, contours, .. } = &carried.structures[*n];
            let [before_ml, after_ml] = facts.volume_ml;
            ContoursFacts {
                name: name.clone(),
                before_ml,
                after_ml,
                moved: facts.moved_points > 0,
                max_displacement_mm: facts.max_displacement_mm,
                contours: [given[*n].contours.len(), contours.len()],
            }
        });
        CarryDone::Contours {
            out: self.out().into(),
            structures: structures.collect(),
            instance_uid,
            warnings: self.gather.warnings(),
        }
    }
}
