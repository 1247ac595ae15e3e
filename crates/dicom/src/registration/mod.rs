//! Registrations between the CT and its deformed export (PS3.3 A.39).

mod deformable;
mod rigid;

pub use deformable::{Deformable, read_deformable, write_deformable};
pub use rigid::write_chest_wall;

use crate::companion::{CompanionParams, put_texts};
use crate::data_set::DataSet;
use crate::derived::copy;
use crate::number::format_ds;
use crate::source::Source;
use dicom_core::VR;
use dicom_dictionary_std::tags;

/// The unit matrix, row by row.
const UNIT: [f64; 16] =
    [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];

/// The item of a matrix that changes nothing (PS3.3 C.20.2.1.1).
fn identity() -> DataSet {
    let mut item = DataSet::default();
    let numbers = UNIT.map(format_ds).join("\\");
    item.put_text(tags::FRAME_OF_REFERENCE_TRANSFORMATION_MATRIX, VR::DS, &numbers);
    item.put_text(tags::FRAME_OF_REFERENCE_TRANSFORMATION_MATRIX_TYPE, VR::CS, "RIGID");
    item
}

/// Content identification (PS3.3 table 10-12), and the side as the CT says it (type 2C of a paired
/// part).
fn put_content(
    set: &mut DataSet,
    (ct, params): (&Source, &CompanionParams),
    label: &str,
    description: &str,
) {
    for tag in [tags::BODY_PART_EXAMINED, tags::LATERALITY] {
        copy(set, tag, &ct.slices[0].header);
    }
    put_texts(
        set,
        &[
            (tags::CONTENT_DATE, VR::DA, &params.clock.date),
            (tags::CONTENT_TIME, VR::TM, &params.clock.time),
            (tags::CONTENT_LABEL, VR::CS, label),
            (tags::CONTENT_DESCRIPTION, VR::LO, description),
            (tags::CONTENT_CREATOR_NAME, VR::PN, ""),
        ],
    );
}
