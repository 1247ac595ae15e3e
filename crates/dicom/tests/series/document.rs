//! A PDF beside an exported CT.

use crate::dose::params;
use crate::support::{contents, folder, put, read, six, text};
use dicom_core::VR;
use dicom_dictionary_std::{tags, uids};
use dicom_object::open_file;
use std::path::Path;
use supine_dicom::{Document, Error, ObjectReference, Source, write_document};

fn document<'a>(pdf: &'a [u8], source: &'a Source) -> Document<'a> {
    Document { pdf, title: "DEFORMED: report", names_patient: true, source }
}

fn ct() -> Source {
    let mut slices = six();
    for slice in &mut slices {
        put(slice, tags::PATIENT_ID, VR::LO, "4711");
        put(slice, tags::IMAGE_LATERALITY, VR::CS, "L");
    }
    read(folder(&slices).path()).unwrap().1
}

fn written(document: &Document<'_>, ct: &Source, path: &Path) -> Result<ObjectReference, Error> {
    write_document(document, ct, &params(ct), path)
}

#[test]
fn a_pdf_is_kept_byte_for_byte_and_says_whose_it_is() {
    let (dir, ct) = (tempfile::tempdir().unwrap(), ct());
    let path = dir.path().join("report.dcm");
    for pdf in [&b"%PDF-1.7\nodd"[..], b"%PDF-1.7\neven", b"%PDF-1.7\n\0\0"] {
        let named = written(&document(pdf, &ct), &ct, &path).unwrap();
        let object = open_file(&path).unwrap();
        assert_eq!(named.class_uid, uids::ENCAPSULATED_PDF_STORAGE);
        for (tag, wanted) in [
            (tags::SOP_INSTANCE_UID, named.instance_uid.as_str()),
            (tags::PATIENT_ID, "4711"),
            (tags::MODALITY, "DOC"),
            (tags::CONVERSION_TYPE, "WSD"),
            (tags::BURNED_IN_ANNOTATION, "YES"),
            (tags::IMAGE_LATERALITY, "L"),
            (tags::MIME_TYPE_OF_ENCAPSULATED_DOCUMENT, "application/pdf"),
        ] {
            assert_eq!(text(&object, tag), wanted, "{tag}");
        }
        let length = object.element(tags::ENCAPSULATED_DOCUMENT_LENGTH).unwrap();
        assert_eq!(length.to_int::<usize>().unwrap(), pdf.len());
        let bytes = object.element(tags::ENCAPSULATED_DOCUMENT).unwrap().to_bytes().unwrap();
        assert!(bytes.len() % 2 == 0 && bytes[..pdf.len()] == *pdf && bytes.len() < pdf.len() + 2);
        let sources = object.element(tags::SOURCE_INSTANCE_SEQUENCE).unwrap().items().unwrap();
        assert_eq!(sources.len(), 6);
        assert!(object.element(tags::FRAME_OF_REFERENCE_UID).is_err());
        let number = |object| text(object, tags::SERIES_NUMBER).parse::<i64>().unwrap();
        assert_eq!(number(&object) - 4, number(&six()[0]));
    }
}

#[test]
fn what_goes_with_an_exported_ct_bears_the_short_name_of_its_result() {
    let (dir, pdf) = (tempfile::tempdir().unwrap(), b"%PDF-1.7\n");
    let path = dir.path().join("report.dcm");
    for (of_ct, name) in [
        ("DEFORMED AP 7 LAT 5 E 0.609 kPa net 3f7a", " 3f7a"),
        ("Thorax 3f7a", ""),
        ("DEFORMED net", ""),
    ] {
        let mut slices = six();
        slices.iter_mut().for_each(|s| put(s, tags::SERIES_DESCRIPTION, VR::LO, of_ct));
        let ct = read(folder(&slices).path()).unwrap().1;
        written(&document(pdf, &ct), &ct, &path).unwrap();
        let own = params(&ct).series_description;
        let told = text(&open_file(&path).unwrap(), tags::SERIES_DESCRIPTION);
        assert_eq!(told, own + name, "{of_ct}");
    }
}

#[test]
fn the_same_document_is_the_same_object_and_another_one_is_not() {
    let (dir, ct) = (tempfile::tempdir().unwrap(), ct());
    let [a, b, c] = ["a", "b", "c"].map(|name| dir.path().join(name));
    let first = written(&document(b"%PDF-1.7\n1", &ct), &ct, &a).unwrap();
    assert_eq!(first, written(&document(b"%PDF-1.7\n1", &ct), &ct, &b).unwrap());
    assert_eq!(std::fs::read(&a).unwrap(), std::fs::read(&b).unwrap());
    let other = written(&document(b"%PDF-1.7\n2", &ct), &ct, &c).unwrap();
    assert_ne!((first.instance_uid, first.series_uid), (other.instance_uid, other.series_uid));
}

#[test]
fn what_is_no_pdf_is_refused_and_leaves_nothing() {
    let (dir, ct) = (tempfile::tempdir().unwrap(), ct());
    let path = dir.path().join("report.dcm");
    let said = written(&document(b"<html>", &ct), &ct, &path).unwrap_err().to_string();
    assert!(said.contains("no PDF"), "{said}");
    let untitled = Document { title: "", ..document(b"%PDF-1.7\n", &ct) };
    let said = written(&untitled, &ct, &path).unwrap_err().to_string();
    assert!(said.contains("Document Title"), "{said}");
    assert!(contents(dir.path()).is_empty());
}
