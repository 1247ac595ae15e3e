//! A PDF of the patient as a DICOM object: Encapsulated PDF Storage (PS3.3 A.45.1).

use crate::companion::{CompanionParams, Kind, ObjectReference, common, put_texts, slices, write};
use crate::data_set::{DataSet, Value};
use crate::derived::{code, copy};
use crate::error::Error;
use crate::object::Object;
use crate::series::Place;
use crate::source::Source;
use dicom_core::VR;
use dicom_dictionary_std::{tags, uids};
use std::path::Path;

const KIND: Kind = Kind { class: uids::ENCAPSULATED_PDF_STORAGE, modality: "DOC", role: "report" };

/// A document about a CT.
#[derive(Clone, Copy)]
pub struct Document<'a> {
    /// The bytes of the PDF file.
    pub pdf: &'a [u8],
    /// Document Title, ASCII, 64 characters at most.
    pub title: &'a str,
    /// Whether the patient's name, number or date of birth can be read in it.
    pub names_patient: bool,
    /// The CT that it was made from, as exports may tell it.
    pub source: &'a Source,
}

impl std::fmt::Debug for Document<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Document({} bytes)", self.pdf.len())
    }
}

/// Writes a document about an exported CT into the file `path`.
///
/// Patient and study are those of `ct`, the series is its own with a number beside that of `ct`; it
/// has no frame of reference. Source Instance Sequence names every slice of the CT that the
/// document was made from. Concept Name is Radiology Report (LOINC 11528-7, one of CID 7020),
/// Conversion Type WSD, Burned In Annotation says whether the patient is named in the document
/// (PS3.3 C.8.6.1, C.24.1, C.24.2). A document of odd length gets one zero byte behind it and
/// Encapsulated Document Length tells its own. UIDs are 2.25 from the hash of all that is written.
/// The file appears only when it was read back equal.
///
/// # Errors
/// When the document is no PDF, a text does not fit its attribute, or the file cannot be written or
/// does not read back. Nothing is left then.
pub fn write_document(
    document: &Document<'_>,
    ct: &Source,
    params: &CompanionParams,
    path: &Path,
) -> Result<ObjectReference, Error> {
    let Document { pdf, title, names_patient, source } = *document;
    if !pdf.starts_with(b"%PDF-") {
        let (attribute, reason) = ("Encapsulated Document", "is no PDF file".into());
        return Err(Error::Text { attribute, reason });
    }
    crate::derived::check_text("Document Title", title, 64, !title.is_empty())?;
    let length = u32::try_from(pdf.len()).ok().filter(|length| *length < u32::MAX - 1);
    let length = length.ok_or(Error::Text {
        attribute: "Encapsulated Document",
        reason: format!("{} bytes, 2^32 - 2 fit", pdf.len()),
    })?;
    let mut set = common(ct, params, (&KIND, Place::Report))?;
    // It lies nowhere in the patient.
    set.remove(tags::FRAME_OF_REFERENCE_UID);
    set.remove(tags::POSITION_REFERENCE_INDICATOR);
    copy(&mut set, tags::IMAGE_LATERALITY, &ct.slices[0].header);
    put_texts(
        &mut set,
        &[
            (tags::CONVERSION_TYPE, VR::CS, "WSD"),
            (tags::CONTENT_DATE, VR::DA, &params.clock.date),
            (tags::CONTENT_TIME, VR::TM, &params.clock.time),
            (tags::ACQUISITION_DATE_TIME, VR::DT, ""),
            (tags::BURNED_IN_ANNOTATION, VR::CS, if names_patient { "YES" } else { "NO" }),
            (tags::DOCUMENT_TITLE, VR::ST, title),
            (tags::MIME_TYPE_OF_ENCAPSULATED_DOCUMENT, VR::LO, "application/pdf"),
        ],
    );
    let named = code("LN", "11528-7", "Radiology Report");
    set.put_items(tags::CONCEPT_NAME_CODE_SEQUENCE, vec![named]);
    set.put_items(tags::SOURCE_INSTANCE_SEQUENCE, slices(source));
    put_pdf(&mut set, pdf, length);
    write(set, params, &KIND, path, |written| {
        let read = Object::open(written).map_err(|e| e.to_string())?;
        let bytes = read.set.bytes(tags::ENCAPSULATED_DOCUMENT).unwrap_or_default();
        let same = bytes.get(..pdf.len()) == Some(pdf) && bytes.len() - pdf.len() < 2;
        if same { Ok(()) } else { Err("the document differs".into()) }
    })
}

fn put_pdf(set: &mut DataSet, pdf: &[u8], length: u32) {
    let mut even = pdf.to_vec();
    even.resize(pdf.len().next_multiple_of(2), 0);
    set.put(tags::ENCAPSULATED_DOCUMENT, VR::OB, Value::Bytes(even));
    let length = Value::Bytes(length.to_le_bytes().to_vec());
    set.put(tags::ENCAPSULATED_DOCUMENT_LENGTH, VR::UL, length);
}
