//! What an archive lists.

use super::*;
use dicom_ul::pdu::{AbortRQSource, Pdu};

fn query(talk: &mut Talk<'_>, message: &Message) -> Identifier {
    Identifier::from_bytes(&data_of(talk, message), true).unwrap()
}

fn matches(talk: &mut Talk<'_>, message: &Message, found: &[Identifier], status: u16) {
    for one in found {
        let bytes = one.to_bytes(true);
        let pending = Command::answer(&message.command, 0xFF00).number(element::DATA_SET_TYPE, 1);
        talk.send(message.context, &pending, Some(Payload::of(&mut &bytes[..]))).unwrap();
    }
    reply(talk, message, status);
}

fn study(patient: &str, date: &str) -> Identifier {
    Identifier::default()
        .with(tags::STUDY_INSTANCE_UID, STUDY)
        .with(tags::PATIENT_ID, patient)
        .with(tags::STUDY_DATE, date)
}

fn series() -> Identifier {
    Identifier::default()
        .with(tags::STUDY_INSTANCE_UID, STUDY)
        .with(tags::SERIES_INSTANCE_UID, SERIES)
        .with(tags::SERIES_NUMBER, "7")
}

fn listed(archive: &Archive, spec: &QuerySpec) -> Result<Vec<crate::StudyEntry>, Error> {
    crate::list(&call(archive.port, 0), spec, Progress::none())
}

#[test]
fn what_is_listed_more_than_once_is_there_once() {
    let archive = Archive::start(|talk, message| {
        let asked = query(talk, message);
        let found = match asked.text(tags::QUERY_RETRIEVE_LEVEL).as_str() {
            // Once without the date, once without the patient, once with blanks and another date.
            "STUDY" => vec![
                study(PATIENT, "20260310"),
                study(PATIENT, ""),
                study("", "20260310"),
                study(" ZZ9 ", "20260311"),
            ],
            _ => vec![series(), series()],
        };
        matches(talk, message, &found, 0);
    });
    let spec = QuerySpec { study: Some(STUDY.into()), ..QuerySpec::default() };
    let studies = listed(&archive, &spec).unwrap();
    assert_eq!((studies.len(), studies[0].series.len()), (1, 1), "{studies:?}");
    assert_eq!(studies[0].series[0].number, "7");
}

#[test]
fn texts_are_read_in_the_character_set_of_their_answer_and_so_compared() {
    // As PS3.5 Annex H has it.
    let (japanese, meant) = ("\x1b$B;3ED\x1b(B", "山田");
    let archive = Archive::start(move |talk, message| {
        let asked = query(talk, message);
        let set = |one: Identifier| one.with(tags::SPECIFIC_CHARACTER_SET, "\\ISO 2022 IR 87");
        let found = match asked.text(tags::QUERY_RETRIEVE_LEVEL).as_str() {
            "STUDY" => {
                assert_eq!(asked.readable(tags::PATIENT_ID), meant);
                set(study(japanese, "20260310").with(tags::STUDY_DESCRIPTION, japanese))
            }
            _ => set(series().with(tags::SERIES_DESCRIPTION, japanese)),
        };
        matches(talk, message, &[found], 0);
    });
    let spec = QuerySpec { patient_id: Some(meant.into()), ..QuerySpec::default() };
    let studies = listed(&archive, &spec).unwrap();
    assert_eq!(studies[0].description, meant, "{studies:?}");
    assert_eq!(studies[0].series[0].description, meant, "{studies:?}");
}

#[test]
fn blanks_round_a_patient_id_are_none_of_it() {
    let archive = Archive::start(|talk, message| {
        let asked = query(talk, message);
        match asked.text(tags::QUERY_RETRIEVE_LEVEL).as_str() {
            // One that takes what it is asked for to the letter; another program wrote the ID with blanks.
            "STUDY" if asked.text(tags::PATIENT_ID) == PATIENT => {
                matches(talk, message, &[study(" ZZ9  ", "20260310")], 0);
            }
            "STUDY" => panic!("blanks are asked for"),
            _ => matches(talk, message, &[series()], 0),
        }
    });
    let spec = |id: &str| QuerySpec { patient_id: Some(id.into()), ..QuerySpec::default() };
    for id in [PATIENT, " ZZ9", "ZZ9 ", "  ZZ9  "] {
        assert_eq!(listed(&archive, &spec(id)).unwrap().len(), 1, "{id:?}");
    }
    // That would be the study of every patient.
    assert!(listed(&archive, &spec("  ")).is_err());
}

#[test]
fn a_series_alone_is_found_by_its_patient_or_its_study_is_asked_for() {
    for refusal in [0, 0xA900, 0xC000] {
        let archive = Archive::start(move |talk, message| {
            let asked = query(talk, message);
            let within = !asked.text(tags::STUDY_INSTANCE_UID).is_empty();
            match asked.text(tags::QUERY_RETRIEVE_LEVEL).as_str() {
                "STUDY" => matches(talk, message, &[study(PATIENT, "20260310")], 0),
                _ if within => matches(talk, message, &[series()], 0),
                // A hierarchical one (PS3.4 C.4.1.3.1.1).
                _ => matches(talk, message, &[], refusal),
            }
        });
        let alone = QuerySpec { series: Some(SERIES.into()), ..QuerySpec::default() };
        let said = match listed(&archive, &alone) {
            Ok(studies) if studies.is_empty() => alone.nothing_listed(&call(archive.port, 0).peer),
            Ok(studies) => panic!("{studies:?}"),
            Err(error) => error.to_string(),
        };
        assert!(said.contains("--study") && said.contains("--patient-id"), "{said}");
        let with = QuerySpec { patient_id: Some(PATIENT.into()), ..alone };
        assert_eq!(listed(&archive, &with).unwrap()[0].series[0].series, SERIES);
    }
}

#[test]
fn a_query_that_is_aborted_names_who_asks() {
    let archive = Archive::start(|talk, message| {
        query(talk, message);
        talk.link.send(&Pdu::AbortRQ { source: AbortRQSource::ServiceUser }).unwrap();
    });
    let spec = QuerySpec { study: Some(STUDY.into()), ..QuerySpec::default() };
    let error = listed(&archive, &spec).unwrap_err();
    assert!(error.to_string().contains("SUPINE, calling from 127.0.0.1"), "{error}");
    assert_eq!(error.kind(), Failure::Input);
}
