//! A structure set of regions that no other object names.

use super::{Roi, Structures};
use crate::data_set::DataSet;
use crate::derived::{PATIENT_AND_STUDY, copy};
use crate::source::Source;
use dicom_core::VR;
use dicom_dictionary_std::tags;

/// A region that is to be drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Named {
    /// ROI Name, ASCII.
    pub name: &'static str,
    /// RT ROI Interpreted Type (PS3.3 C.8.8.8).
    pub interpreted_type: &'static str,
    /// ROI Display Color.
    pub colour: [u8; 3],
}

impl Structures {
    /// Regions of the patient of `ct` without contours yet, numbered from 1: what
    /// [`write_structures`](super::write_structures) takes names, types and colours from.
    pub fn of_patient(ct: &Source, regions: &[Named]) -> Self {
        let mut header = DataSet::default();
        for &tag in PATIENT_AND_STUDY {
            copy(&mut header, tag, &ct.slices[0].header);
        }
        let (mut rois, mut named, mut observed) = (Vec::new(), Vec::new(), Vec::new());
        for (number, region) in (1..).zip(regions) {
            let mut item = DataSet::default();
            item.put_text(tags::ROI_NUMBER, VR::IS, &number.to_string());
            item.put_text(tags::ROI_NAME, VR::LO, region.name);
            named.push(item);
            let mut item = DataSet::default();
            item.put_text(tags::REFERENCED_ROI_NUMBER, VR::IS, &number.to_string());
            item.put_text(tags::RTROI_INTERPRETED_TYPE, VR::CS, region.interpreted_type);
            observed.push(item);
            rois.push(Roi {
                number,
                name: region.name.into(),
                interpreted_type: region.interpreted_type.into(),
                colour: Some(region.colour),
                frame_of_reference: ct.frame_of_reference_uid(),
                rule: supine_volume::Rule::Joined,
                contours: vec![],
                lines: vec![],
                unknown_contours: 0,
            });
        }
        header.put_items(tags::STRUCTURE_SET_ROI_SEQUENCE, named);
        header.put_items(tags::RTROI_OBSERVATIONS_SEQUENCE, observed);
        Self { file: String::new(), rois, header, warnings: vec![] }
    }
}
