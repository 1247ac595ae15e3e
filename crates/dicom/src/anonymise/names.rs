//! Names of regions that may leave de-identified: plain words of anatomy and of planning, no free
//! text.
//!
//! PS3.15 E.1 lets the Basic Profile empty ROI Name, and Clean Descriptors clean it. A planner
//! needs the name, so it stays when every word of it is known here; otherwise all of it goes. Words
//! that remained of a longer name could say something else ("not the tumor").

use crate::data_set::DataSet;
use dicom_core::{Tag, VR};
use dicom_dictionary_std::tags;

/// Words of structures' names, lower case: those of AAPM Task Group 263 (2018) for chest, neck and
/// upper abdomen, kinds of targets, and what planners of breasts write beside them.
const WORDS: &str = "
    a abdomen air airway aka and angle anterior anus aorta arch areola areolar arm arteries artery artifact ascending
    atrium auricle ax avoid avoidance axilla axillary axial balloon band bed bladder block body bolus bone bones
    boost border borders bowel brachial brachialplexus brain brainstem breast breasts bronchi bronchus build canal carina
    carotid cartilage cavity central chain chest chestwall clavicle clavicles clavicular clip clips cns coil colon combined
    contour contralateral control cord coronary costal couch cricoid ctv ctvn ctvp ctvsb cut deep densities density
    descending diaphragm distal dose duodenum edge electrode elective esophagus eval evaluation expander external eye eyes
    fat femur fiducial fiducials field final fissure fixation foot gland glands glandular gtv gtvn gtvp guide head heart
    high hilar hilum hip hot humerus icru ictv igtv imn imns implant incision inferior inflow infra infraclavicular
    inner inside internal interpectoral intestine ipsilateral isocenter isocentre itv jejunum joint kidney kidneys l lad
    large larynx lateral laterality left level levels ligament line liver ln lnd lnn lns lobe low lower lt lumen lumpectomy lung lungs lymph
    lymphnode lymphnodes lymphatics main mammaria mammary mandible manubrium margin marker markers mass mastectomy medial
    mediastinum metal mid middle minus muscle muscles n neck necrosis nipple nodal node nodes normal oar oars oesophagus
    opposite optimisation optimization opt organ outer outside overlap p pacemaker pancreas parasternal part partial
    patient pec pectoral pectoralis pericardium planning plexus plus port post posterior postop pre preop prep
    prosthesis proximal prv ptv ptvn ptvp ptvsb pulmonary quadrant r region rest retro rib ribs right ring risk rotter rt sacrum scapula
    scar scars seed seeds seroma sib shell shoulder sib side simulation skin small soft spare spinal spinalcanal spinalcord
    spine spleen sternum stomach sub subclavian sup superior supine support supra supraclav supraclavicular surface
    surgical table target teeth thorax thoracic thymus thyroid tissue total trachea treated treatment tumor tumorbed tumour tumourbed
    tumors tumours upper v vein veins ventricle ventricles vertebra vertebrae vertebral vessel vessels volume wall whole wire wires zone
    gy cgy cc cm mm ct mr mri pet scl iv ii iii vi
    tissues structure structures anatomical neoplasm neoplasms primary secondary morphologically abnormal
    abnormality finding spatial relational concept physical object function property of the
";
/// Most digits of a number that is no dose: levels, sides of a series of targets, vertebrae.
const DIGITS: usize = 2;
/// Most digits of a dose (cGy).
const DOSE_DIGITS: usize = 4;

/// Whether nobody can be told by a name: every word is one of planning and none one of the
/// `patient`'s, and it has one number of two digits at most beside doses (`PTV_50.4Gy`).
pub(super) fn plain(name: &str, patient: &DataSet) -> bool {
    // The one unit with a capital within.
    let tokens = tokens(&name.replace("cGy", "gy"));
    let words = tokens.iter().filter(|t| !digits(t));
    let hers = hers(patient);
    let known = |word: &&String| {
        let word = word.to_lowercase();
        !hers.contains(&word) && WORDS.split_whitespace().any(|known| known == word)
    };
    let mut numbers = 0;
    let mut n = 0;
    while n < tokens.len() {
        if digits(&tokens[n]) {
            let whole = tokens[n].len();
            // A dose may have a part behind the point, 50.4Gy or 50p4Gy.
            let point = tokens.get(n + 1).is_some_and(|t| t == "p") as usize;
            let part = tokens.get(n + 1 + point).is_some_and(|t| digits(t) && t.len() <= DIGITS);
            let end = if part { n + 1 + point } else { n };
            let unit = tokens.get(end + 1).map(|t| t.to_lowercase());
            if unit.is_some_and(|u| u == "gy") && whole <= DOSE_DIGITS {
                n = end + 2;
                continue;
            }
            if whole > DIGITS {
                return false;
            }
            numbers += 1;
        }
        n += 1;
    }
    name.is_ascii() && numbers <= 1 && words.into_iter().all(|w| known(&w))
}

/// Runs of digits and of letters, these also cut where a capital follows a small letter.
fn tokens(name: &str) -> Vec<String> {
    let mut tokens: Vec<String> = Vec::new();
    let mut before = ' ';
    for c in name.chars() {
        let goes_on = c.is_ascii_digit() == before.is_ascii_digit()
            && before.is_alphanumeric()
            && !(before.is_lowercase() && c.is_uppercase());
        match tokens.last_mut() {
            Some(last) if goes_on && c.is_alphanumeric() => last.push(c),
            _ if c.is_alphanumeric() => tokens.push(c.into()),
            _ => {}
        }
        before = c;
    }
    tokens
}

fn digits(token: &str) -> bool {
    token.bytes().all(|b| b.is_ascii_digit())
}

/// Numbers by which a patient, or the scanner that she lay in, is found.
const NUMBERS: [Tag; 5] = [
    tags::PATIENT_ID,
    // Other Patient IDs, retired and still written.
    Tag(0x0010, 0x1000),
    tags::PATIENT_BIRTH_DATE,
    tags::ACCESSION_NUMBER,
    tags::DEVICE_SERIAL_NUMBER,
];

/// A number this long is found within a longer word too.
const TELLING: usize = 4;

/// Whether a text has a word of the name of anybody in the header, the patient or who treats her,
/// or one of her numbers.
pub(super) fn name_somebody(text: &str, header: &DataSet) -> bool {
    let people = header.elements().iter().filter(|e| e.vr == VR::PN).map(|e| e.tag);
    let known = words(people.chain(NUMBERS).map(|tag| header.text(tag)));
    let within = |tag: &Tag| {
        let number = header.text(*tag).to_lowercase();
        number.len() >= TELLING && text.to_lowercase().contains(&number)
    };
    words([text.to_owned()]).iter().any(|word| known.contains(word)) || NUMBERS.iter().any(within)
}

/// The words of texts that have more than one letter, lower case.
fn words(texts: impl IntoIterator<Item = String>) -> Vec<String> {
    let of = |text: String| {
        let text = text.to_lowercase();
        let words = text.split(|c: char| !c.is_alphanumeric());
        words.filter(|w| w.chars().count() > 1).map(str::to_owned).collect::<Vec<_>>()
    };
    texts.into_iter().flat_map(of).collect()
}

/// The words of the patient's name and ID, lower case: a patient may be called as a part of the
/// body is.
fn hers(patient: &DataSet) -> Vec<String> {
    words([tags::PATIENT_NAME, tags::PATIENT_ID].map(|tag| patient.text(tag)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_planning_stay_and_all_else_goes() {
        let nobody = DataSet::default();
        for name in [
            "BODY",
            "Tumor Bed",
            "Tumor Bed Block",
            "Lt Lung",
            "Lung_L",
            "A_LAD",
            "PTVp_High",
            "CTVsb",
            "GTVp1",
            "SpinalCord",
            "Chest Wall",
            "LN_Ax_L1",
            "PTV_50.4Gy",
            "PTV50p4Gy",
            "PTV 5040cGy",
            "Nodes level II",
            "External",
            "",
        ] {
            let lost: Vec<String> = tokens(name);
            assert!(plain(name, &nobody), "{name}: {lost:?}");
        }
        for name in [
            "Doe",
            "CTV Doe",
            "CTV JD",
            "CTV_4711",
            "PTV 12 03",
            "19600312",
            "Clip Höhle",
            "for Dr. House",
            "5040",
            "Breast 1960",
            "ROI 3",
            "PTV 47110815Gy",
            "Heart (copy of Jane)",
        ] {
            assert!(!plain(name, &nobody), "{name}");
        }
    }

    #[test]
    fn a_patient_called_as_a_part_of_the_body_is_not_named() {
        let mut patient = DataSet::default();
        patient.put_text(tags::PATIENT_NAME, VR::PN, "Wall^Jane");
        assert!(!plain("Chest Wall", &patient) && plain("Chest", &patient));
    }
}
