//! De-identification of what is written (PS3.15 E.1, Basic Application Level Confidentiality
//! Profile with the Clean Descriptors Option).
//!
//! Nothing is searched for and struck out: a header keeps only the elements listed here, which hold
//! no identity, and everything else is gone. UIDs are replaced by keyed hashes, the same for the
//! same UID wherever it stands. What says DEFORMED and from what is written by this crate in its
//! own words, so that it survives.

mod names;
mod objects;

use crate::data_set::{DataSet, Value};
use crate::deformed::{MANUFACTURER, MODEL};
use crate::derived::code;
use crate::source::{Source, SourceSlice};
use dicom_core::{Tag, VR};
use dicom_dictionary_std::tags;
use hmac::{Hmac, Mac as _};
use sha2::Sha256;

/// Geometry, pixels and the physics of the scan: no identity, and what an export inherits.
const KEPT: &[Tag] = &[
    tags::SPECIFIC_CHARACTER_SET,
    tags::SOP_CLASS_UID,
    tags::IMAGE_TYPE,
    tags::MODALITY,
    tags::MANUFACTURER,
    tags::MANUFACTURER_MODEL_NAME,
    tags::SOFTWARE_VERSIONS,
    tags::SERIES_NUMBER,
    tags::ACQUISITION_NUMBER,
    tags::INSTANCE_NUMBER,
    tags::BODY_PART_EXAMINED,
    tags::LATERALITY,
    tags::PATIENT_POSITION,
    tags::SLICE_THICKNESS,
    tags::KVP,
    tags::DATA_COLLECTION_DIAMETER,
    tags::RECONSTRUCTION_DIAMETER,
    tags::ROTATION_DIRECTION,
    tags::FILTER_TYPE,
    tags::CONVOLUTION_KERNEL,
    tags::TABLE_HEIGHT,
    tags::WINDOW_CENTER,
    tags::WINDOW_WIDTH,
    tags::IMAGE_POSITION_PATIENT,
    tags::IMAGE_ORIENTATION_PATIENT,
    tags::SLICE_LOCATION,
    tags::PIXEL_SPACING,
    tags::SAMPLES_PER_PIXEL,
    tags::PHOTOMETRIC_INTERPRETATION,
    tags::ROWS,
    tags::COLUMNS,
    tags::BITS_ALLOCATED,
    tags::BITS_STORED,
    tags::HIGH_BIT,
    tags::PIXEL_REPRESENTATION,
    tags::PIXEL_PADDING_VALUE,
    tags::PIXEL_PADDING_RANGE_LIMIT,
    tags::RESCALE_INTERCEPT,
    tags::RESCALE_SLOPE,
    tags::RESCALE_TYPE,
    tags::LOSSY_IMAGE_COMPRESSION,
    tags::LOSSY_IMAGE_COMPRESSION_RATIO,
    tags::LOSSY_IMAGE_COMPRESSION_METHOD,
    tags::BURNED_IN_ANNOTATION,
];

/// Of these what a site may have typed: kept unless it names the patient.
const TYPED: &[Tag] = &[
    tags::MANUFACTURER,
    tags::MANUFACTURER_MODEL_NAME,
    tags::SOFTWARE_VERSIONS,
    tags::FILTER_TYPE,
    tags::CONVOLUTION_KERNEL,
];

/// Parts of the body that a CT of a breast is said to be of (PS3.16 annex L); any other word of
/// Body Part Examined goes.
const BODY_PARTS: &[&str] = &[
    "ABDOMEN",
    "ABDOMENPELVIS",
    "AXILLA",
    "BREAST",
    "CHEST",
    "CHESTABDOMEN",
    "CHESTABDPELVIS",
    "CLAVICLE",
    "HEART",
    "HEADNECK",
    "LUNG",
    "MEDIASTINUM",
    "NECK",
    "NECKCHEST",
    "NECKCHESTABDOMEN",
    "NECKCHESTABDPELV",
    "RIB",
    "SHOULDER",
    "SPINE",
    "STERNUM",
    "THORAX",
    "TSPINE",
    "WHOLEBODY",
];

/// Action U: replaced.
const REPLACED: &[Tag] = &[
    tags::SOP_INSTANCE_UID,
    tags::STUDY_INSTANCE_UID,
    tags::SERIES_INSTANCE_UID,
    tags::FRAME_OF_REFERENCE_UID,
];

/// What was done, for De-identification Method Code Sequence (PS3.16 CID 7050).
const METHODS: [(&str, &str); 2] = [
    ("113100", "Basic Application Confidentiality Profile"),
    ("113105", "Clean Descriptors Option"),
];

/// Takes the patient out of what is written.
#[derive(Clone)]
pub struct Anonymiser {
    key: [u8; 32],
}

impl std::fmt::Debug for Anonymiser {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // Whoever has the key can test whether a UID is that of a patient he knows.
        f.write_str("Anonymiser")
    }
}

impl Anonymiser {
    /// With a secret key: the same key gives the same UIDs and pseudonym to the same patient.
    pub fn new(key: [u8; 32]) -> Self {
        Self { key }
    }

    /// The keyed hash of a text in a role, 16 bytes (HMAC-SHA-256, RFC 2104, cut).
    fn hash(&self, role: &str, text: &str) -> [u8; 16] {
        // A key of any length is taken.
        let mut mac = match Hmac::<Sha256>::new_from_slice(&self.key) {
            Ok(mac) => mac,
            Err(_) => unreachable!("HMAC takes keys of every length"),
        };
        for part in [role.as_bytes(), &[0], text.as_bytes()] {
            mac.update(part);
        }
        let mut short = [0; 16];
        short.copy_from_slice(&mac.finalize().into_bytes()[..16]);
        short
    }

    /// What stands for a UID: `2.25.` and a UUID (RFC 9562 version 8) in decimal.
    pub fn uid(&self, uid: &str) -> String {
        let uuid = uuid::Builder::from_custom_bytes(self.hash("uid", uid)).into_uuid();
        format!("2.25.{}", uuid.as_u128())
    }

    /// What stands for the patient, who is told by her ID alone where she has one: objects of other
    /// systems write her name in other ways.
    fn pseudonym(&self, header: &DataSet) -> String {
        let (id, name) = (header.text(tags::PATIENT_ID), header.text(tags::PATIENT_NAME));
        let who = if id.is_empty() { format!("name {name}") } else { format!("id {id}") };
        let number = self.hash("patient", &who)[..5].iter().fold(0, |n, &b| n << 8 | u64::from(b));
        format!("ANON-{number:010X}")
    }

    /// A header without the patient.
    pub(crate) fn clean(&self, header: &DataSet) -> DataSet {
        let mut clean = DataSet::default();
        for &tag in KEPT {
            let leaves = match tag {
                tags::BODY_PART_EXAMINED => BODY_PARTS.contains(&header.text(tag).as_str()),
                _ => !(TYPED.contains(&tag) && names::name_somebody(&header.text(tag), header)),
            };
            if let Some(element) = header.get(tag)
                && matches!(element.value, Value::Bytes(_))
                && leaves
            {
                clean.put(tag, element.vr, element.value.clone());
            }
        }
        for &tag in REPLACED {
            let uid = header.text(tag);
            if !uid.is_empty() {
                clean.put_text(tag, VR::UI, &self.uid(&uid));
            }
        }
        let pseudonym = self.pseudonym(header);
        clean.put_text(tags::PATIENT_NAME, VR::PN, &pseudonym);
        clean.put_text(tags::PATIENT_ID, VR::LO, &pseudonym);
        put_method(&mut clean);
        clean
    }
}

/// What was done, in words; by it an export of ours is known.
const METHOD: &str = "supine: PS3.15 Basic Profile, Clean Descriptors";

/// Says that and how it was done (PS3.15 E.1.1, PS3.3 C.12.1.1.7).
fn put_method(set: &mut DataSet) {
    set.put_text(tags::PATIENT_IDENTITY_REMOVED, VR::CS, "YES");
    set.put_text(tags::DEIDENTIFICATION_METHOD, VR::LO, METHOD);
    let codes = METHODS.map(|(value, meaning)| code("DCM", value, meaning)).to_vec();
    set.put_items(tags::DEIDENTIFICATION_METHOD_CODE_SEQUENCE, codes);
    set.put_text(tags::LONGITUDINAL_TEMPORAL_INFORMATION_MODIFIED, VR::CS, "REMOVED");
    let mut equipment = DataSet::default();
    equipment.put_text(tags::MANUFACTURER, VR::LO, MANUFACTURER);
    equipment.put_text(tags::MANUFACTURER_MODEL_NAME, VR::LO, MODEL);
    let purpose = code("DCM", "109104", "De-identifying Equipment");
    equipment.put_items(tags::PURPOSE_OF_REFERENCE_CODE_SEQUENCE, vec![purpose]);
    set.put_items(tags::CONTRIBUTING_EQUIPMENT_SEQUENCE, vec![equipment]);
}

impl Source {
    /// The source as a de-identified export may name it: its headers lack the patient, its UIDs are
    /// replaced. Only for writing; what is compared with other objects of the patient needs the
    /// original.
    #[must_use]
    pub fn anonymised(&self, anonymiser: &Anonymiser) -> Self {
        let slice = |source: &SourceSlice| SourceSlice {
            header: anonymiser.clean(&source.header),
            slice: source.slice.clone(),
        };
        Self { slices: self.slices.iter().map(slice).collect(), padding: self.padding.clone() }
    }

    /// Whether a slice says that text which identifies the patient may stand in its pixels (PS3.3
    /// C.7.6.1.1.10).
    pub fn has_burned_in_text(&self) -> bool {
        let says_yes = |s: &SourceSlice| s.header.text(tags::BURNED_IN_ANNOTATION) == "YES";
        self.slices.iter().any(says_yes)
    }

    /// Whether the series was de-identified by this software: its UIDs were mapped by a key.
    pub fn is_anonymised(&self) -> bool {
        let header = &self.slices[0].header;
        header.text(tags::PATIENT_IDENTITY_REMOVED) == "YES"
            && header.text(tags::DEIDENTIFICATION_METHOD) == METHOD
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The header of a patient.
    fn jane() -> DataSet {
        let mut header = DataSet::default();
        header.put_text(tags::PATIENT_NAME, VR::PN, "Doe^Jane");
        header.put_text(tags::PATIENT_ID, VR::LO, "4711");
        header.put_text(tags::PATIENT_BIRTH_DATE, VR::DA, "19600101");
        header
    }

    #[test]
    fn uids_are_mapped_by_the_key_and_only_by_it() {
        let (a, b) = (Anonymiser::new([1; 32]), Anonymiser::new([2; 32]));
        assert_eq!(a.uid("1.2.3"), a.uid("1.2.3"));
        assert_ne!(a.uid("1.2.3"), a.uid("1.2.4"));
        assert_ne!(a.uid("1.2.3"), b.uid("1.2.3"));
        assert!(crate::uid::is_uid(&a.uid("1.2.3")));
        assert!(!format!("{a:?}").contains('1'), "the key is not shown");
    }

    #[test]
    fn a_patient_is_told_by_her_number_however_her_name_is_written() {
        let anonymiser = Anonymiser::new([1; 32]);
        let called = |name: &str, id: &str| {
            let mut header = DataSet::default();
            header.put_text(tags::PATIENT_NAME, VR::PN, name);
            header.put_text(tags::PATIENT_ID, VR::LO, id);
            anonymiser.pseudonym(&header)
        };
        assert_eq!(called("Doe^Jane", "4711"), called("DOE^JANE^^", "4711"));
        assert_ne!(called("Doe^Jane", "4711"), called("Doe^Jane", "4712"));
        assert_ne!(called("Doe^Jane", ""), called("Roe^Jane", ""));
    }

    #[test]
    fn what_a_site_typed_stays_unless_it_names_somebody() {
        let mut header = jane();
        header.put_text(tags::OPERATORS_NAME, VR::PN, "Roe^Richard");
        header.put_text(tags::DEVICE_SERIAL_NUMBER, VR::LO, "66123");
        let cleaned = |tag: Tag, text: &str| {
            let mut header = header.clone();
            header.put_text(tag, VR::SH, text);
            Anonymiser::new([1; 32]).clean(&header).text(tag)
        };
        for (tag, text) in [
            (tags::CONVOLUTION_KERNEL, "B30f"),
            (tags::FILTER_TYPE, "BODY FILTER"),
            (tags::SOFTWARE_VERSIONS, "syngo CT 2012B"),
            (tags::MANUFACTURER_MODEL_NAME, "Sensation 40"),
            (tags::BODY_PART_EXAMINED, "CHEST"),
        ] {
            assert_eq!(cleaned(tag, text), text);
        }
        for (tag, text) in [
            (tags::CONVOLUTION_KERNEL, "B30f for DOE"),
            (tags::FILTER_TYPE, "4711"),
            (tags::SOFTWARE_VERSIONS, "as Richard set it"),
            (tags::MANUFACTURER_MODEL_NAME, "CT 19600101"),
            (tags::SOFTWARE_VERSIONS, "VB42 SN66123"),
            (tags::SOFTWARE_VERSIONS, "66123"),
            (tags::BODY_PART_EXAMINED, "BREAST DOE"),
            (tags::BODY_PART_EXAMINED, "MRS DOE"),
        ] {
            assert_eq!(cleaned(tag, text), "", "{text}");
        }
    }

    #[test]
    fn what_is_not_listed_is_gone() {
        let mut header = jane();
        header.put_text(tags::STUDY_DESCRIPTION, VR::LO, "Doe, left breast");
        header.put_text(Tag(0x0009, 0x1001), VR::LO, "private");
        header.put_text(tags::STUDY_INSTANCE_UID, VR::UI, "1.2.3");
        header.put_text(tags::KVP, VR::DS, "120");
        header.put_items(tags::REQUEST_ATTRIBUTES_SEQUENCE, vec![DataSet::default()]);
        let anonymiser = Anonymiser::new([1; 32]);
        let clean = anonymiser.clean(&header);
        assert_eq!(clean.text(tags::KVP), "120");
        assert_eq!(clean.text(tags::STUDY_INSTANCE_UID), anonymiser.uid("1.2.3"));
        assert!(clean.text(tags::PATIENT_NAME).starts_with("ANON-"));
        for element in clean.elements() {
            let shown = format!("{element:?}");
            for secret in ["Doe", "4711", "19600101", "private"] {
                assert!(!shown.contains(&format!("{:?}", secret.as_bytes())), "{shown}");
            }
        }
        assert!(clean.get(tags::STUDY_DESCRIPTION).is_none());
        assert!(clean.get(tags::REQUEST_ATTRIBUTES_SEQUENCE).is_none());
    }
}
