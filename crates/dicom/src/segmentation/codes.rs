//! What segments are, in codes: SNOMED CT as DICOM lists it for segmentations (PS3.16 CID 7150
//! categories, CID 7151 and 7163 types).

use crate::data_set::DataSet;
use crate::derived::code;
use dicom_dictionary_std::tags;
use supine_volume::label;

/// What a segment or region of interest says it is, by its code or type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meaning {
    /// The whole patient within her skin.
    Body,
    /// One of [`supine_volume::label`].
    Label(u8),
}

/// Category and type of a label: value and meaning of each.
struct Codes {
    label: u8,
    category: (&'static str, &'static str),
    kind: (&'static str, &'static str),
    /// Other types that say the same.
    also: &'static [&'static str],
}

const TISSUE: (&str, &str) = ("85756007", "Tissue");
const STRUCTURE: (&str, &str) = ("91723000", "Anatomical Structure");
const OBJECT: (&str, &str) = ("260787004", "Physical object");
const ABNORMAL: (&str, &str) = ("49755003", "Morphologically Abnormal Structure");
/// "Entire body".
const BODY: &str = "38266002";

const CODES: [Codes; 10] = [
    Codes {
        label: label::SOFT_TISSUE,
        category: TISSUE,
        kind: ("87784001", "Soft tissue"),
        also: &[],
    },
    Codes {
        label: label::CHEST_WALL,
        category: STRUCTURE,
        kind: ("78904004", "Chest wall"),
        also: &[],
    },
    Codes { label: label::LUNG, category: STRUCTURE, kind: ("39607008", "Lung"), also: &[] },
    Codes { label: label::BONE, category: TISSUE, kind: ("3138006", "Bone"), also: &["272673000"] },
    Codes {
        label: label::MUSCLE,
        category: TISSUE,
        kind: ("91727004", "Muscle"),
        also: &["71616004", "127954009"],
    },
    Codes {
        label: label::FAT,
        category: TISSUE,
        kind: ("55603005", "Fat"),
        also: &["256674009", "89749009"],
    },
    Codes {
        label: label::GLAND,
        category: TISSUE,
        kind: ("279009002", "Glandular structure of breast"),
        also: &["1342375003"],
    },
    Codes { label: label::SKIN, category: TISSUE, kind: ("39937001", "Skin"), also: &["82038008"] },
    Codes {
        label: label::TUMOUR,
        category: ABNORMAL,
        kind: ("108369006", "Neoplasm"),
        also: &["372087000"],
    },
    Codes {
        label: label::IMPLANT,
        category: OBJECT,
        kind: ("2282003", "Breast implant, type not specified"),
        also: &[],
    },
];

/// What the type of a segment says.
pub(super) fn meaning(segment: &DataSet) -> Option<Meaning> {
    let kind = segment.items(tags::SEGMENTED_PROPERTY_TYPE_CODE_SEQUENCE).first()?;
    if kind.text(tags::CODING_SCHEME_DESIGNATOR) != "SCT" {
        return None;
    }
    let value = kind.text(tags::CODE_VALUE);
    if value == BODY {
        return Some(Meaning::Body);
    }
    let same = |c: &&Codes| c.kind.0 == value || c.also.contains(&value.as_str());
    CODES.iter().find(same).map(|c| Meaning::Label(c.label))
}

/// Puts category and type of a label.
pub(super) fn put(segment: &mut DataSet, label: u8) {
    let Some(codes) = CODES.iter().find(|c| c.label == label) else { return };
    let item = |(value, meaning): (&str, &str)| vec![code("SCT", value, meaning)];
    segment.put_items(tags::SEGMENTED_PROPERTY_CATEGORY_CODE_SEQUENCE, item(codes.category));
    segment.put_items(tags::SEGMENTED_PROPERTY_TYPE_CODE_SEQUENCE, item(codes.kind));
}
