//! Doses, structure sets and segmentations of a patient, as objects of her de-identified CT may
//! name them.
//!
//! What an object of ours takes from one that was given is little: which regions there are, what a
//! dose means, and to what it refers. Of that little, this leaves what cannot name the patient.

use super::{Anonymiser, names::plain};
use crate::companion::same_patient;
use crate::data_set::{DataSet, Value};
use crate::dose::Dose;
use crate::error::Error;
use crate::number::parse_is;
use crate::segmentation::Segmentation;
use crate::source::Source;
use crate::structures::Structures;
use dicom_core::{Tag, VR};
use dicom_dictionary_std::tags;
use supine_space::Warning;

/// Defined terms of RT ROI Interpreted Type (PS3.3 C.8.8.8.1); any other is no code but a text.
const ROI_TYPES: [&str; 23] = [
    "EXTERNAL",
    "PTV",
    "CTV",
    "GTV",
    "TREATED_VOLUME",
    "IRRAD_VOLUME",
    "BOLUS",
    "AVOIDANCE",
    "ORGAN",
    "MARKER",
    "REGISTRATION",
    "ISOCENTER",
    "CONTRAST_AGENT",
    "CAVITY",
    "BRACHY_CHANNEL",
    "BRACHY_ACCESSORY",
    "BRACHY_SRC_APP",
    "BRACHY_CHNL_SHLD",
    "SUPPORT",
    "FIXATION",
    "DOSE_REGION",
    "CONTROL",
    "DOSE_MEASUREMENT",
];
/// Defined terms of Dose Summation Type (PS3.3 C.8.8.3).
const SUMMATIONS: [&str; 11] = [
    "PLAN",
    "MULTI_PLAN",
    "PLAN_OVERVIEW",
    "FRACTION",
    "BEAM",
    "BRACHY",
    "FRACTION_SESSION",
    "BEAM_SESSION",
    "BRACHY_SESSION",
    "CONTROL_POINT",
    "RECORD",
];
/// Within the reference to a plan: whole numbers, and sequences of the same.
const PLAN_NUMBERS: &[Tag] = &[
    tags::REFERENCED_FRACTION_GROUP_NUMBER,
    tags::REFERENCED_BEAM_NUMBER,
    tags::REFERENCED_BRACHY_APPLICATION_SETUP_NUMBER,
];
const PLAN_SEQUENCES: &[Tag] = &[
    tags::REFERENCED_FRACTION_GROUP_SEQUENCE,
    tags::REFERENCED_BEAM_SEQUENCE,
    tags::REFERENCED_BRACHY_APPLICATION_SETUP_SEQUENCE,
];
/// Coding schemes of which a code says what it is to everyone.
const SCHEMES: [&str; 6] = ["SCT", "SRT", "SNM3", "DCM", "FMA", "UMLS"];
/// Codes of a segment.
const CODES: [Tag; 3] = [
    tags::SEGMENTED_PROPERTY_CATEGORY_CODE_SEQUENCE,
    tags::SEGMENTED_PROPERTY_TYPE_CODE_SEQUENCE,
    tags::ANATOMIC_REGION_SEQUENCE,
];

/// What has to take the patient out of an object of `header` before it goes with the exported `ct`;
/// none where that still names her, and for objects that the run itself made.
///
/// # Errors
/// When the object is of another patient (the pseudonym of the CT is not hers), or the CT is
/// de-identified and `by` is missing.
fn cleaner<'a>(
    file: &str,
    header: &DataSet,
    ct: &Source,
    by: Option<&'a Anonymiser>,
) -> Result<Option<&'a Anonymiser>, Error> {
    let own = header.text(tags::PATIENT_ID);
    let wanted = ct.slices[0].header.text(tags::PATIENT_ID);
    if !ct.is_anonymised() || own == wanted {
        return same_patient(file, header, ct).map(|()| None);
    }
    let refused = |reason: &str| Err(Error::attribute(file, "Patient ID", reason));
    let Some(by) = by else {
        return refused("cannot be compared: the CT is de-identified, and the key of that is gone");
    };
    let mut unnumbered = header.clone();
    unnumbered.remove(tags::PATIENT_ID);
    let nobody = own.is_empty() && header.text(tags::PATIENT_NAME).is_empty();
    if nobody || [header, &unnumbered].iter().any(|h| by.pseudonym(h) == wanted) {
        return Ok(Some(by));
    }
    refused("is not that of the patient whom the de-identified CT stands for")
}

impl Anonymiser {
    /// The header as that of a slice, and the CT's pseudonym.
    fn object(&self, header: &DataSet, ct: &Source) -> DataSet {
        let mut clean = self.clean(header);
        for (tag, vr) in [(tags::PATIENT_ID, VR::LO), (tags::PATIENT_NAME, VR::PN)] {
            clean.put_text(tag, vr, &ct.slices[0].header.text(tag));
        }
        clean
    }

    /// A UID, unless it is one that the standard itself gives (PS3.6 annex A).
    fn mapped(&self, uid: &str) -> String {
        if uid.is_empty() || uid.starts_with("1.2.840.10008.") { uid.into() } else { self.uid(uid) }
    }

    /// A reference to an object with its numbers, whatever else it says.
    fn reference(&self, item: &DataSet) -> DataSet {
        let mut clean = DataSet::default();
        for tag in [tags::REFERENCED_SOP_CLASS_UID, tags::REFERENCED_SOP_INSTANCE_UID] {
            let uid = item.text(tag);
            if !uid.is_empty() {
                clean.put_text(tag, VR::UI, &self.mapped(&uid));
            }
        }
        put_numbers(&mut clean, item, PLAN_NUMBERS);
        for &tag in PLAN_SEQUENCES {
            let items = item.items(tag);
            if !items.is_empty() {
                clean.put_items(tag, items.iter().map(|i| self.reference(i)).collect());
            }
        }
        clean
    }
}

impl Dose {
    /// The dose as an object of the exported `ct` may name it; `by` is what took the patient out of
    /// a CT that is de-identified (PS3.15 E.1). Meaning and plan stay, the plan by its mapped UID.
    ///
    /// # Errors
    /// When it is of another patient than the CT.
    pub fn for_export(mut self, ct: &Source, by: Option<&Anonymiser>) -> Result<Self, Error> {
        let Some(by) = cleaner(&self.file, &self.header, ct, by)? else { return Ok(self) };
        let given = std::mem::take(&mut self.header);
        self.header = by.object(&given, ct);
        put_code(&mut self.header, &given, tags::DOSE_TYPE, &["PHYSICAL", "EFFECTIVE"]);
        put_code(&mut self.header, &given, tags::DOSE_SUMMATION_TYPE, &SUMMATIONS);
        let corrections = ["IMAGE", "ROI_OVERRIDE", "WATER"];
        put_code(&mut self.header, &given, tags::TISSUE_HETEROGENEITY_CORRECTION, &corrections);
        let plans = given.items(tags::REFERENCED_RT_PLAN_SEQUENCE);
        if !plans.is_empty() {
            let plans = plans.iter().map(|plan| by.reference(plan)).collect();
            self.header.put_items(tags::REFERENCED_RT_PLAN_SEQUENCE, plans);
        }
        Ok(self)
    }
}

impl Structures {
    /// The structures as an object of the exported `ct` may name them, and what a user has to know
    /// of it; `by` is what took the patient out of a CT that is de-identified (PS3.15 E.1).
    ///
    /// Numbers, colours, types and contours stay. A name of plain words of planning stays; any
    /// other becomes `ROI` and the number of the region, by which a planner finds it in the
    /// structure set that was given.
    ///
    /// # Errors
    /// When they are of another patient than the CT.
    pub fn for_export(
        mut self,
        ct: &Source,
        by: Option<&Anonymiser>,
    ) -> Result<(Self, Option<Warning>), Error> {
        let Some(by) = cleaner(&self.file, &self.header, ct, by)? else {
            return Ok((self, None));
        };
        let given = std::mem::take(&mut self.header);
        self.header = by.object(&given, ct);
        let mut renamed = Vec::new();
        let (mut named, mut observed) = (Vec::new(), Vec::new());
        for roi in &mut self.rois {
            roi.frame_of_reference = by.mapped(&roi.frame_of_reference);
            if !plain(&roi.name, &given) {
                roi.name = format!("ROI {}", roi.number);
                renamed.push(roi.number);
            }
            if !ROI_TYPES.contains(&roi.interpreted_type.as_str()) {
                roi.interpreted_type.clear();
            }
            let mut item = DataSet::default();
            let number = roi.number.to_string();
            item.put_text(tags::ROI_NUMBER, VR::IS, &number);
            item.put_text(tags::ROI_NAME, VR::LO, &roi.name);
            named.push(item);
            let of =
                |i: &&DataSet| parse_is(&i.text(tags::REFERENCED_ROI_NUMBER)) == Some(roi.number);
            if let Some(own) = given.items(tags::RTROI_OBSERVATIONS_SEQUENCE).iter().find(of) {
                let mut item = DataSet::default();
                put_numbers(&mut item, own, &[tags::OBSERVATION_NUMBER]);
                item.put_text(tags::REFERENCED_ROI_NUMBER, VR::IS, &number);
                item.put_text(tags::RTROI_INTERPRETED_TYPE, VR::CS, &roi.interpreted_type);
                observed.push(item);
            }
        }
        self.header.put_items(tags::STRUCTURE_SET_ROI_SEQUENCE, named);
        self.header.put_items(tags::RTROI_OBSERVATIONS_SEQUENCE, observed);
        Ok((self, told("region", "ROI", &renamed)))
    }
}

impl Segmentation {
    /// The segments as an object of the exported `ct` may name them, as in
    /// [`Structures::for_export`]; a segment whose name is no plain one becomes `Segment` and its
    /// number. Colours and codes of published schemes stay.
    ///
    /// # Errors
    /// When they are of another patient than the CT.
    pub fn for_export(
        mut self,
        ct: &Source,
        by: Option<&Anonymiser>,
    ) -> Result<(Self, Option<Warning>), Error> {
        let Some(by) = cleaner(&self.file, &self.header, ct, by)? else {
            return Ok((self, None));
        };
        let given = std::mem::take(&mut self.header);
        self.header = by.object(&given, ct);
        let (mut renamed, mut items) = (Vec::new(), Vec::new());
        for segment in &mut self.segments {
            if !plain(&segment.name, &given) {
                segment.name = format!("Segment {}", segment.number);
                renamed.push(i64::from(segment.number));
            }
            let mut item = DataSet::default();
            item.put_u16(tags::SEGMENT_NUMBER, VR::US, segment.number);
            item.put_text(tags::SEGMENT_LABEL, VR::LO, &segment.name);
            let of = |i: &&DataSet| i.u16(tags::SEGMENT_NUMBER) == Some(segment.number);
            if let Some(own) = given.items(tags::SEGMENT_SEQUENCE).iter().find(of) {
                put_codes(&mut item, own, &given);
                let colour = tags::RECOMMENDED_DISPLAY_CIE_LAB_VALUE;
                if let Some(lab) = own.bytes(colour).filter(|b| b.len() == 6) {
                    item.put(colour, VR::US, Value::Bytes(lab.to_vec()));
                }
            }
            items.push(item);
        }
        self.header.put_items(tags::SEGMENT_SEQUENCE, items);
        Ok((self, told("segment", "Segment", &renamed)))
    }
}

/// The warning that names were taken out, without the names.
fn told(what: &str, called: &str, renamed: &[i64]) -> Option<Warning> {
    let numbers: Vec<String> = renamed.iter().map(i64::to_string).collect();
    let numbers = numbers.join(", ");
    let text = format!(
        "the name of {what} {numbers} is not made of plain terms of planning and could name the patient: it is \
         called {called} and its number"
    );
    (!renamed.is_empty()).then(|| Warning::new("names-taken-out", text))
}

/// Copies a code if it is one of these.
fn put_code(set: &mut DataSet, given: &DataSet, tag: Tag, known: &[&str]) {
    let code = given.text(tag);
    if known.contains(&code.as_str()) {
        set.put_text(tag, VR::CS, &code);
    }
}

/// Copies whole numbers.
fn put_numbers(set: &mut DataSet, given: &DataSet, wanted: &[Tag]) {
    for &tag in wanted {
        if let Some(number) = parse_is(&given.text(tag)) {
            set.put_text(tag, VR::IS, &number.to_string());
        }
    }
}

/// Copies the codes of a segment. A meaning that is no plain words is replaced by the code itself.
fn put_codes(set: &mut DataSet, given: &DataSet, patient: &DataSet) {
    for tag in CODES {
        let clean = |item: &DataSet| {
            let [value, scheme, meaning] =
                [tags::CODE_VALUE, tags::CODING_SCHEME_DESIGNATOR, tags::CODE_MEANING]
                    .map(|tag| item.text(tag));
            let code =
                value.len() <= 16 && value.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'-');
            let known = code && !value.is_empty() && SCHEMES.contains(&scheme.as_str());
            let meaning =
                if plain(&meaning, patient) && !meaning.is_empty() { &meaning } else { &value };
            known.then(|| crate::derived::code(&scheme, &value, meaning))
        };
        let items: Vec<DataSet> = given.items(tag).iter().filter_map(clean).collect();
        if !items.is_empty() {
            set.put_items(tag, items);
        }
    }
}
