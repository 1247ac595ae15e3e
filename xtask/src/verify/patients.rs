//! The synthetic patients, whose truth is known.

use super::{Bench, image, number, output, run, run_case, texture};
use anyhow::{Context, Result};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// One patient, run with her true modulus and rest state.
pub(crate) struct Row {
    pub(crate) name: String,
    pub(crate) tissue: String,
    pub(crate) summary: Value,
    pub(crate) score: Value,
    pub(super) image: Vec<image::Errors>,
    pub(super) textures: Vec<texture::Texture>,
}

const COHORT: [&str; 3] = ["p1-net", "p2-full", "p3-hetero"];

pub(crate) fn all(bench: &Bench<'_>) -> Result<Vec<Row>> {
    folders(bench).into_iter().map(|(name, folder)| row(bench, name, &folder)).collect()
}

/// Name and folder of each patient.
pub(crate) fn folders(bench: &Bench<'_>) -> Vec<(&'static str, PathBuf)> {
    let cohort = COHORT.map(|name| (name, bench.shared.join("cohort").join(name)));
    let mut all = vec![("fixture", bench.house.root.join("fixtures/patient"))];
    all.extend(cohort);
    all
}

fn row(bench: &Bench<'_>, name: &str, patient: &Path) -> Result<Row> {
    let work = bench.work.join(name);
    let (case, ct) = case(&work, patient)?;
    let (young, rest) = tissue(&read(&patient.join("truth/truth.json"))?)?;
    let out = work.join("out");
    let summary = run_case(bench, &case, &out)?;
    let points = work.join("points.csv");
    let supine = patient.join("truth/points_supine.csv");
    let mut carry = Command::new(&bench.supine);
    carry.args(["carry", "--overwrite"]).arg("--run").arg(&out).arg("--points").arg(&supine);
    run(carry.arg("--out").arg(&points))?;
    let json = work.join("score.json");
    let mut score = Command::new(&bench.python);
    score.arg(bench.shared.join("cohort/score.py")).arg(patient);
    score.arg("--warped").arg(out.join("ct")).arg("--labels").arg(out.join("labels.seg.nrrd"));
    output(score.arg("--points").arg(&points).arg("--json").arg(&json))?;
    let tissue = format!("E {young} kPa, {rest}");
    let image = image::errors(bench, patient, &ct, &work)?;
    let textures = texture::textures(bench, patient, &ct, &work)?;
    Ok(Row { name: name.into(), tissue, summary, score: read(&json)?, image, textures })
}

/// The case files of all, each in a folder of the patient's name.
pub(crate) fn cases(bench: &Bench<'_>) -> Result<Vec<PathBuf>> {
    let one = |(name, patient): (&str, PathBuf)| Ok(case(&bench.work.join(name), &patient)?.0);
    folders(bench).into_iter().map(one).collect()
}

/// Writes a patient's case with her true tissue into a work folder; its file, and the folder of her
/// CT.
fn case(work: &Path, patient: &Path) -> Result<(PathBuf, PathBuf)> {
    std::fs::create_dir_all(work)?;
    let ct = unpacked(patient, work)?;
    let facts: Value = read(&patient.join("patient.json"))?;
    let (young, rest) = tissue(&read(&patient.join("truth/truth.json"))?)?;
    let file = work.join("case.toml");
    std::fs::write(&file, case_text(&ct, &facts, young, &rest)?)?;
    Ok((file, ct))
}

/// The folder of slices; the cohort's are packed.
pub(crate) fn unpacked(patient: &Path, work: &Path) -> Result<PathBuf> {
    let packed = patient.join("ct.tar.xz");
    if !packed.is_file() {
        return Ok(patient.join("ct"));
    }
    std::fs::create_dir_all(work)?;
    run(Command::new("tar").arg("xf").arg(&packed).arg("-C").arg(work))?;
    Ok(work.join("ct"))
}

/// The true modulus (the volume mean where there are several) and rest state.
fn tissue(truth: &Value) -> Result<(f64, String)> {
    let young = number(truth, "/E_kPa").or_else(|_| number(truth, "/E_volume_mean_breast_kPa"))?;
    let rest = truth["rest_state"].as_str().context("no rest_state in truth.json")?;
    Ok((young, rest.into()))
}

fn case_text(ct: &Path, facts: &Value, young: f64, rest: &str) -> Result<String> {
    let side = facts["side"].as_str().context("no side in patient.json")?;
    Ok(format!(
        "ct = {ct:?}\nbreast = {side:?}\ntable = {{ ap = {ap}, lat = {lat} }}\n\
         tumour = {{ centre = {centre}, radius = {radius} }}\n\
         tissue = {{ young = {young}, rest = {rest:?} }}\n",
        ct = std::path::absolute(ct)?,
        ap = number(facts, "/bed_deg/AP")?,
        lat = number(facts, "/bed_deg/LAT")?,
        centre = facts["tumour"]["centre_mm"],
        radius = number(facts, "/tumour/radius_mm")?,
    ))
}

pub(crate) fn read(path: &Path) -> Result<Value> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    Ok(serde_json::from_str(&text)?)
}
