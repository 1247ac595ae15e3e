//! The segmentation on variants of every patient, beside the script a practitioner would write.

use super::{Bench, number, output, patients, real, run};
use anyhow::{Context, Result};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What was measured on one variant of one patient; empty where it cannot be.
#[derive(Default)]
pub(crate) struct Cell {
    /// Against known labels: Dice and distances.
    pub(crate) truth: Option<Value>,
    /// Against contours read on a real CT.
    pub(crate) contours: Option<Value>,
    /// Distance to the boundary of the CT as it is, mean and 95 %, mm.
    pub(crate) moved: Option<Value>,
}

/// One variant of all patients, or one method on the CTs as they are.
pub(crate) struct Row {
    pub(crate) name: String,
    /// In the order of [`Study::patients`].
    pub(crate) cells: Vec<Cell>,
}

/// All that was measured.
pub(crate) struct Study {
    pub(crate) patients: Vec<String>,
    /// The first is the CT as it is.
    pub(crate) variants: Vec<Row>,
    /// Other methods on the CTs as they are.
    pub(crate) others: Vec<Row>,
}

struct Patient {
    name: &'static str,
    /// Folder with the truth; none for a real CT.
    truth: Option<PathBuf>,
    ct: PathBuf,
    /// Sphere in which boundaries are compared: centre and radius, mm.
    sphere: (String, f64),
}

const REAL: &str = "breast-flt013";
/// Both breasts of the real CT and the sternum between them.
const REAL_SPHERE: (&str, f64) = ("0,-190,-590", 130.0);
/// Variants of the real CT on which its contours still hold.
const SAME_PLACE: [&str; 7] = [
    "as it is",
    "noise +20 HU",
    "noise +40 HU",
    "soft kernel",
    "sharp kernel",
    "slices twice as thick",
    "80 kV",
];
const OTHERS: [&str; 2] = ["dilated", "midlevel"];

pub(crate) fn study(bench: &Bench<'_>) -> Result<Study> {
    let mut list = script(bench, "variants.py");
    let list: Value = serde_json::from_str(&output(list.arg("--list"))?)?;
    let names = |key: &str| -> Result<Vec<String>> {
        serde_json::from_value(list[key].clone()).with_context(|| format!("no {key}"))
    };
    let (variants, repeats) = (names("variants")?, names("repeats")?);
    let patients = all_patients(bench)?;
    for patient in &patients {
        let mut make = script(bench, "variants.py");
        match &patient.truth {
            Some(folder) => make.arg(folder),
            None => make.arg("-"),
        };
        run(make.arg(&patient.ct).arg(folder(bench, patient)))?;
    }
    let row = |name: &String| -> Result<Row> {
        let repeat = repeats.contains(name);
        let cells = patients.iter().map(|p| cell(bench, p, name, repeat)).collect::<Result<_>>()?;
        Ok(Row { name: name.clone(), cells })
    };
    Ok(Study {
        patients: patients.iter().map(|p| p.name.to_owned()).collect(),
        variants: variants.iter().map(row).collect::<Result<_>>()?,
        others: OTHERS.iter().map(|o| other(bench, &patients, o)).collect::<Result<_>>()?,
    })
}

fn all_patients(bench: &Bench<'_>) -> Result<Vec<Patient>> {
    let mut all = Vec::new();
    for (name, truth) in patients::folders(bench) {
        let ct = patients::unpacked(&truth, &bench.work.join(name))?;
        let facts = patients::read(&truth.join("patient.json"))?;
        let centre = facts["score_roi"]["centre_mm"].as_array().context("no score_roi")?;
        let centre: Vec<String> = centre.iter().map(ToString::to_string).collect();
        let sphere = (centre.join(","), number(&facts, "/score_roi/radius_mm")?);
        all.push(Patient { name, truth: Some(truth), ct, sphere });
    }
    let sphere = (REAL_SPHERE.0.to_owned(), REAL_SPHERE.1);
    all.push(Patient { name: REAL, truth: None, ct: real::unpacked(bench, REAL)?, sphere });
    Ok(all)
}

fn folder(bench: &Bench<'_>, patient: &Patient) -> PathBuf {
    bench.work.join("study").join(patient.name)
}

fn script(bench: &Bench<'_>, name: &str) -> Command {
    let mut command = Command::new(&bench.python);
    command.arg(bench.house.root.join("xtask/study").join(name));
    command
}

/// Segments one variant and measures what can be measured on it.
fn cell(bench: &Bench<'_>, patient: &Patient, name: &str, repeat: bool) -> Result<Cell> {
    let variants = folder(bench, patient);
    let variant = variants.join(name);
    if !variant.is_dir() {
        return Ok(Cell::default());
    }
    let labels = variant.join("labels.nrrd");
    let mut segment = Command::new(&bench.supine);
    segment.args(["segment", "--overwrite"]).arg("--ct").arg(variant.join("ct.nrrd"));
    segment.arg("--out").arg(&labels).arg("--surfaces").arg(&variant);
    run(segment.arg("--no-progress"))?;
    let mut cell = measured(bench, patient, &variant, &labels, SAME_PLACE.contains(&name))?;
    if repeat {
        let mut moved = script(bench, "moved.py");
        moved.arg(variants.join("as it is")).arg(&variant);
        moved.arg(&patient.sphere.0).arg(patient.sphere.1.to_string());
        cell.moved = Some(serde_json::from_str(&output(&mut moved)?)?);
    }
    Ok(cell)
}

fn measured(
    bench: &Bench<'_>,
    patient: &Patient,
    variant: &Path,
    labels: &Path,
    same_place: bool,
) -> Result<Cell> {
    let json = variant.join("score.json");
    let mut score = Command::new(&bench.python);
    if patient.truth.is_some() {
        score.arg(bench.shared.join("cohort/score.py")).arg(variant).arg("--labels").arg(labels);
        output(score.arg("--json").arg(&json))?;
        return Ok(Cell { truth: Some(patients::read(&json)?), ..Cell::default() });
    }
    if !same_place {
        return Ok(Cell::default());
    }
    let reference = bench.shared.join("reference/segment");
    score.arg(reference.join("score_contours.py"));
    score.arg(reference.join(format!("contours_{}.json", patient.name))).arg(labels);
    output(score.arg("--json").arg(&json))?;
    Ok(Cell { contours: Some(patients::read(&json)?), ..Cell::default() })
}

/// The practitioner's script on the CTs as they are.
fn other(bench: &Bench<'_>, patients: &[Patient], method: &str) -> Result<Row> {
    let mut cells = Vec::new();
    for patient in patients {
        let variant = folder(bench, patient).join("as it is");
        let labels = variant.join(format!("{method}.nrrd"));
        let mut baseline = Command::new(&bench.python);
        baseline.arg(bench.shared.join("reference/segment/baseline.py"));
        run(baseline.arg(&patient.ct).arg(&labels).args(["--variant", method]))?;
        cells.push(measured(bench, patient, &variant, &labels, true)?);
    }
    Ok(Row { name: method.to_owned(), cells })
}
