//! What segments are, in codes of SNOMED CT: those of [`supine_volume::label::terms`], and others
//! that say the same.

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

/// "Entire body".
const BODY: &str = "38266002";

/// Types that say the same as those of [`label::terms`].
const ALSO: [(u8, &[&str]); 6] = [
    (label::BONE, &["272673000"]),
    (label::MUSCLE, &["71616004", "127954009"]),
    (label::FAT, &["256674009", "89749009"]),
    (label::GLAND, &["1342375003"]),
    (label::SKIN, &["82038008"]),
    (label::TUMOUR, &["372087000"]),
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
    let own = label::ALL
        .iter()
        .map(|l| l.0)
        .find(|&l| label::terms(l).is_some_and(|[_, (code, _)]| code == value));
    let also = || ALSO.iter().find(|(_, codes)| codes.contains(&value.as_str())).map(|(l, _)| *l);
    own.or_else(also).map(Meaning::Label)
}

/// Puts category and type of a label.
pub(super) fn put(segment: &mut DataSet, number: u8) {
    let Some([category, kind]) = label::terms(number) else { return };
    let item = |(value, meaning): (&str, &str)| vec![code("SCT", value, meaning)];
    segment.put_items(tags::SEGMENTED_PROPERTY_CATEGORY_CODE_SEQUENCE, item(category));
    segment.put_items(tags::SEGMENTED_PROPERTY_TYPE_CODE_SEQUENCE, item(kind));
}
