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
                let whose_it_is = !asked.text(tags::STUDY_INSTANCE_UID).is_empty();
                assert!(whose_it_is || asked.readable(tags::PATIENT_ID) == meant);
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
            // One that takes what it is asked for to the letter; another program wrote the ID with
            // blanks.
            "STUDY" if asked.text(tags::PATIENT_ID) == PATIENT => {
                matches(talk, message, &[study(" ZZ9  ", "20260310")], 0);
            }
            // Whose that study is.
            "STUDY" if asked.text(tags::STUDY_INSTANCE_UID) == STUDY => {
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

/// The UID of a series of another patient in the same study.
const OTHERS: &str = "1.2.1.2";

/// An archive that lists one study for two patients, with a series of each; `says` is whether it
/// tells in a query for series whose they are, or refuses to.
fn of_two_patients(says: bool) -> Archive {
    Archive::start(move |talk, message| {
        let bytes = data_of(talk, message);
        let asked = Identifier::from_bytes(&bytes, true).unwrap();
        let of = asked.text(tags::PATIENT_ID);
        // Patient ID in Little Endian.
        let whose = bytes.windows(4).any(|tag| tag == [0x10, 0, 0x20, 0]);
        match asked.text(tags::QUERY_RETRIEVE_LEVEL).as_str() {
            "STUDY" => {
                let both = [PATIENT, "EVIL"].into_iter().filter(|id| of.is_empty() || of == *id);
                let both: Vec<_> = both.map(|id| study(id, "20260310")).collect();
                matches(talk, message, &both, 0);
            }
            _ if whose && !says => reply(talk, message, 0xA900),
            _ => {
                let meant = asked.text(tags::SERIES_INSTANCE_UID);
                let both = [(SERIES, "ZZ9 "), (OTHERS, "EVIL")].into_iter();
                let both = both.filter(|(uid, _)| meant.is_empty() || meant == *uid);
                let both = both.map(|(uid, patient)| {
                    let one = Identifier::default().with(tags::STUDY_INSTANCE_UID, STUDY);
                    let one = one.with(tags::SERIES_INSTANCE_UID, uid);
                    if whose { one.with(tags::PATIENT_ID, patient) } else { one }
                });
                matches(talk, message, &both.collect::<Vec<_>>(), 0);
            }
        }
    })
}

#[test]
fn of_a_study_of_two_patients_each_has_her_own_series() {
    let uids = |says: bool, spec: &QuerySpec| -> Vec<Vec<String>> {
        let studies = listed(&of_two_patients(says), spec).unwrap().into_iter();
        studies.map(|study| study.series.into_iter().map(|one| one.series).collect()).collect()
    };
    let both = QuerySpec { study: Some(STUDY.into()), ..QuerySpec::default() };
    assert_eq!(uids(true, &both), [[OTHERS], [SERIES]], "sorted by patient");
    let hers = QuerySpec { patient_id: Some(PATIENT.into()), ..both.clone() };
    assert_eq!(uids(true, &hers), [[SERIES]]);
    let one = QuerySpec { series: Some(OTHERS.into()), ..both };
    assert_eq!(uids(true, &one), [[OTHERS]], "a series tells whose it is");
    // Of an archive that does not say it, all are listed: each object is looked at when it comes.
    assert_eq!(uids(false, &hers), [[SERIES, OTHERS]]);
}
