//! Rigid Spatial Registration (PS3.3 A.39.1): the chest wall lies where it lay.

use super::{identity, put_content};
use crate::companion::{CompanionParams, Kind, ObjectReference, common, put_series, slices, write};
use crate::data_set::DataSet;
use crate::error::Error;
use crate::series::Place;
use crate::source::Source;
use dicom_core::VR;
use dicom_dictionary_std::{tags, uids};
use std::path::Path;

const KIND: Kind =
    Kind { class: uids::SPATIAL_REGISTRATION_STORAGE, modality: "REG", role: "rigid registration" };

/// Writes the identity between the frames of reference of the CT and its deformed export into the
/// file `path`; it is labelled CHEST WALL ONLY, since only there does it hold.
///
/// Each item's matrix maps its frame to the object's, which is that of the deformed CT
/// (C.20.2.1.1): both are identities.
///
/// # Errors
/// When a text does not fit its attribute, or the file cannot be written or does not read back.
pub fn write_chest_wall(
    source: &Source,
    deformed: &Source,
    params: &CompanionParams,
    path: &Path,
) -> Result<ObjectReference, Error> {
    let mut set = common(deformed, params, (&KIND, Place::RigidRegistration))?;
    put_content(
        &mut set,
        (deformed, params),
        "CHEST_WALL_ONLY",
        "identity, valid on the chest wall only",
    );
    let item = |ct: &&Source| {
        let mut matrix = DataSet::default();
        matrix.put_items(tags::REGISTRATION_TYPE_CODE_SEQUENCE, Vec::new());
        let comment = "CHEST WALL ONLY: soft tissue moves as the deformable one says";
        matrix.put_text(tags::FRAME_OF_REFERENCE_TRANSFORMATION_COMMENT, VR::LO, comment);
        matrix.put_items(tags::MATRIX_SEQUENCE, vec![identity()]);
        let mut item = DataSet::default();
        item.put_text(tags::FRAME_OF_REFERENCE_UID, VR::UI, &ct.frame_of_reference_uid());
        item.put_items(tags::REFERENCED_IMAGE_SEQUENCE, slices(ct));
        item.put_items(tags::MATRIX_REGISTRATION_SEQUENCE, vec![matrix]);
        item
    };
    let both = [deformed, source];
    set.put_items(tags::REGISTRATION_SEQUENCE, both.iter().map(item).collect());
    put_series(&mut set, &both);
    write(set, params, &KIND, path, |_| Ok(()))
}
