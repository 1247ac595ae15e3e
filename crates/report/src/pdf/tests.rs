use super::*;
use crate::phantom::Phantom;
use crate::summary::tests::example;
use crate::{draw, verdict as judged};
use std::sync::OnceLock;
use supine_space::{Matrix, Point, Progress, Sphere, Vector};

const DATE: &str = "2026-03-01 12:00:00";

fn pictures() -> &'static Pictures {
    static DRAWN: OnceLock<Pictures> = OnceLock::new();
    DRAWN.get_or_init(|| {
        let phantom = Phantom::new(Matrix::identity(), Vector::new(2.0, 1.0, -3.0));
        let mut scene = phantom.scene();
        scene.tumour = Some(Sphere::new(Point::new(5.0, -10.0, 4.0), 8.0).unwrap());
        scene.tumour_after = Some(Point::new(7.0, -9.0, 1.0));
        draw(&(&example()).into(), &scene, Progress::none()).unwrap()
    })
}

fn judged_example() -> Summary {
    let mut summary = example();
    summary.verdict = judged(&summary, 2.0);
    summary
}

fn patient(name: &str) -> PatientIdentity {
    let [id, born] = ["4711", "1960-05-17"].map(String::from);
    PatientIdentity { name: name.into(), id, born, ..PatientIdentity::default() }
}

/// The texts on the sheets in their order, lines joined.
fn texts(summary: &Summary, whose: Option<&PatientIdentity>) -> String {
    let text = |op: &Op| match op {
        Op::Text { text, .. } => Some(text.trim_end().to_owned()),
        _ => None,
    };
    sheets((summary, whose), pictures(), DATE)
        .iter()
        .flatten()
        .filter_map(text)
        .collect::<Vec<String>>()
        .join(" ")
}

fn made(summary: &Summary, whose: Option<&PatientIdentity>) -> Vec<u8> {
    pdf((summary, whose), pictures(), DATE).unwrap()
}

#[test]
fn it_says_what_the_page_says_first() {
    let summary = judged_example();
    let text = texts(&summary, Some(&patient("Doe, Jane")));
    for wanted in [
        "Amber: look before use.",
        "Left breast on the operating table",
        "The tumour moves 3.7 mm (95 %: 1.1 to 8.2 mm)",
        "1. ",
        "to the patient's left",
        "What makes it uncertain, each alone",
        "AP 7.0°: head raised; LAT 5.0°: patient's left side lowered",
        "Young's modulus 0.609 kPa with rest state “net”",
        "Doe, Jane",
        "4711",
        "3f7a",
        "supine 0.1.0. Result 3f7a, 2026-03-01 12:00:00.",
        "DERIVED, SIMULATED IMAGES.",
        "Page 1 of ",
    ] {
        assert!(text.contains(wanted), "{wanted} in {text}");
    }
    let reasons = First::new(&summary).reasons.into_iter().map(|(reason, _)| reason);
    let places: Vec<usize> = reasons.map(|reason| text.find(&reason).expect(&reason)).collect();
    assert!(places.len() > 2 && places.is_sorted(), "reasons stand in their order: {places:?}");
    assert!(!text.contains('?'), "a sign of the report's own words is lacking: {text}");
}

#[test]
fn the_same_run_gives_the_same_bytes_on_two_sheets() {
    let summary = judged_example();
    let (a, b) = (made(&summary, None), made(&summary, None));
    assert_eq!(a, b);
    assert!(a.starts_with(b"%PDF-1.") && a.ends_with(b"%%EOF"));
    let has = |what: &str| a.windows(what.len()).any(|bytes| bytes == what.as_bytes());
    for what in ["<pdfaid:part>2<", "<pdfaid:conformance>A<", "/StructTreeRoot", "/FontFile2"] {
        assert!(has(what), "{what}");
    }
    assert!(!has("Helvetica"));
    let text = texts(&summary, None);
    assert!(text.contains("Page 2 of 2"), "{text}");
}

#[test]
fn a_patient_who_was_taken_out_is_not_named() {
    let text = texts(&judged_example(), None);
    assert!(!text.contains("Patient Doe") && !text.contains("4711") && !text.contains("Born"));
}

#[test]
fn letters_that_the_fonts_lack_are_said() {
    let summary = judged_example();
    let said = |name: &str| {
        let text = texts(&summary, Some(&patient(name)));
        (text.contains("cannot show"), text)
    };
    for name in ["Müller, Eva", "Łuszczyńska, Ewa", "Παπαδοπούλου, Ελένη", "Иванова, Анна"]
    {
        let (lacking, text) = said(name);
        assert!(!lacking && text.contains(name), "{text}");
    }
    assert!(said("Eva\u{202e}avE").1.contains("Eva⟨U+202E⟩avE"));
    let (lacking, text) = said("山田, 花子");
    assert!(lacking && text.contains("??, ??"), "{text}");
}

#[test]
fn many_uncertain_places_are_counted() {
    let mut summary = judged_example();
    let found = summary.segmentation.uncertainty.as_mut().unwrap();
    let patch = found.patches[0].clone();
    found.patches = vec![patch; 30];
    summary.verdict = judged(&summary, 2.0);
    let text = texts(&summary, None);
    assert!(text.contains("22 more, which do less to the tumour"), "{text}");
    // All 30 reasons are told, however many sheets that takes.
    assert!(text.contains("32. "), "{text}");
}

/// What each thing is, in the order of the sheets.
#[test]
fn what_is_opened_is_closed_and_no_text_stands_outside() {
    let mut open: Vec<Role> = Vec::new();
    for op in sheets((&judged_example(), None), pictures(), DATE).iter().flatten() {
        match op {
            Op::Open(role) => {
                let within = open.last().copied();
                let wanted = match role {
                    Role::Row => Some(Role::Table),
                    Role::ColumnHead | Role::RowHead | Role::Cell => Some(Role::Row),
                    Role::Item => Some(Role::List),
                    Role::Label | Role::Body => Some(Role::Item),
                    _ => within,
                };
                assert_eq!(within, wanted, "{role:?} in {open:?}");
                open.push(*role);
            }
            Op::Close => assert!(open.pop().is_some()),
            Op::Text { text, .. } => assert!(!open.is_empty(), "{text}"),
            Op::Picture { told, .. } => assert!(open.is_empty() && told.len() > 20, "{told}"),
            Op::Fill { .. } => {}
        }
    }
    assert!(open.is_empty());
}
