//! Patients for tests, and what the page promises.

use super::*;
use crate::summary::tests::example;
use crate::{Ended, RunError, RunPlace, TumourMoved};

/// One whose case has a typo.
pub(crate) fn failed(name: &str) -> RunStatus {
    RunStatus {
        schema: RunStatus::SCHEMA.into(),
        case: name.into(),
        case_file: Some("p2/case.toml".into()),
        out: Some("cohort/runs/p2".into()),
        exit: 1,
        status: Ended::Failed,
        colour: None,
        reasons: vec![],
        warnings: 0,
        error: Some(RunError {
            code: "case-value".into(),
            kind: "input".into(),
            exit: 1,
            message: "`breast`: \"lft\" is not one of left, right; did you mean `left`?".into(),
            place: RunPlace { key: Some("breast".into()), ..RunPlace::default() },
            advice: Some("did you mean `left`?".into()),
        }),
        seconds: 0.01,
        peak_memory_mb: None,
        voxels: None,
        threads: 2,
        tumour: None,
        version: "0.1.0".into(),
    }
}

/// One with a result that is flagged.
pub(crate) fn finished(name: &str) -> Patient {
    let mut summary = example();
    summary.verdict = crate::verdict(&summary, crate::TOLERANCE_MM);
    let status = RunStatus {
        exit: 0,
        status: Ended::Flagged,
        colour: Some(summary.verdict.colour),
        reasons: summary.verdict.reasons.iter().map(crate::Reason::told).collect(),
        warnings: summary.warnings.len(),
        error: None,
        seconds: 9.5,
        tumour: TumourMoved::of(&summary),
        ..failed(name)
    };
    Patient::new(status, Some(&summary))
}

fn cohort() -> Vec<Patient> {
    let mut all: Vec<Patient> = ["a", "b", "c"].map(finished).into();
    for patient in &mut all {
        patient.run = Some(format!("runs/{}", patient.status.case));
        patient.pictures = PICTURES.map(|(file, _)| file).into();
    }
    all.push(Patient::new(failed("<script>alert(1)</script>"), None));
    all
}

#[test]
fn the_page_asks_for_nothing_but_pictures_beside_it() {
    let page = cohort_page(&cohort(), "cohort.csv").unwrap();
    for foreign in ["http:", "https:", "<link", "@import", "import(", "fetch(", "url("] {
        assert!(!page.contains(foreign), "{foreign}");
    }
    assert_eq!([page.matches("<script").count(), page.matches("</script").count()], [1, 1]);
    assert_eq!(page.matches("loading=\"lazy\"").count(), 9);
    assert_eq!(page.matches("<article").count(), 4);
    assert!(page.contains("runs/a/report/index.html") && page.contains("href=\"cohort.csv\""));
    assert!(page.contains("did you mean `left`?"), "a failed case says what to do");
}

#[test]
fn it_is_the_same_each_time_and_grows_with_the_patients_alone() {
    let page = cohort_page(&cohort(), "cohort.csv").unwrap();
    assert_eq!(page, cohort_page(&cohort(), "cohort.csv").unwrap());
    assert!(cohort_page(&[], "cohort.csv").unwrap().contains("No patients yet"));
    let many: Vec<Patient> = (0..1000).map(|n| finished(&format!("p{n:04}"))).collect();
    let page = cohort_page(&many, "cohort.csv").unwrap();
    assert!(page.len() < 8_000_000, "{} bytes", page.len());
}

#[test]
fn codes_are_those_of_verdict_warnings_and_error() {
    assert_eq!(Patient::new(failed("x"), None).codes, ["case-value"]);
    let codes = finished("y").codes;
    assert!(codes.contains(&"tissue-is-a-guess".into()) && codes.is_sorted(), "{codes:?}");
}
