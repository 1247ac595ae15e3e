//! Places of a recorded session against settled ones.

use crate::picture::Pictures;
use crate::tissue::patient;
use anyhow::Result;
use serde_json::{Value, json};
use std::path::Path;
use supine_navigate::{Line, Recording};
use supine_space::Progress;

/// So many poses are compared at most, spread evenly over those at which the applicator acts.
const COMPARED: usize = 20;
/// What is settled is itself right to about this, mm.
const ROUNDED_MM: f64 = 1e-6;
/// Relative residual of what knows nothing of the way: of tissue that is pressed rounding leaves
/// about as much.
const SETTLED: f64 = 1e-8;
/// Of so many poses one is pictured for its time.
const PICTURED: usize = 30;

/// Largest distances, mm, to what is settled from nothing: of the session's answers, and of those
/// of a follower that goes the same way without a clock.
pub(crate) fn measure(run: &Path, recording: &Path) -> Result<Value> {
    let recording = Recording::read(recording)?;
    let settings = &recording.head.settings;
    let mut replayed = vec![];
    let patient = patient(run, settings)?;
    let mut again = patient.follower(settings, Progress::none())?;
    let mut pictures = Pictures::new(&patient.ct(), &again)?;
    for (n, line) in recording.lines.iter().enumerate() {
        let (followed, deformation) = again.follow(&line.pose())?;
        if n % PICTURED == 0 {
            pictures.time(&deformation)?;
        }
        again.between()?;
        replayed.push((line, followed));
    }
    let acts: Vec<_> = replayed.iter().filter(|(l, f)| f.touches && is_settled(l)).collect();
    let compared = COMPARED.min(acts.len());
    let (mut live_mm, mut again_mm, mut bound_mm, mut beyond) = (0.0f64, 0.0f64, 0.0f64, 0);
    let (mut moved_mm, mut excess_mm) = (0.0f64, 0.0f64);
    for n in 0..compared {
        let (line, followed) = acts[(2 * n + 1) * acts.len() / (2 * compared)];
        let mut cold = patient.follower(settings, Progress::none())?;
        let settled = cold.settle(&line.pose(), SETTLED, Progress::none())?;
        pictures.compare(&cold.deformation()?)?;
        let off = (line.target() - settled).norm();
        live_mm = live_mm.max(off);
        again_mm = again_mm.max((followed.target - settled).norm());
        bound_mm = bound_mm.max(line.error);
        beyond += usize::from(off > line.error + ROUNDED_MM);
        excess_mm = excess_mm.max(off - line.error);
        moved_mm = moved_mm.max(followed.moved.norm());
    }
    Ok(json!({
        "answers": recording.lines.len(),
        "acting": acts.len(),
        "compared": compared,
        "live_mm": live_mm,
        "again_mm": again_mm,
        "bound_mm": bound_mm,
        "beyond": beyond,
        "excess_mm": excess_mm,
        "moved_mm": moved_mm,
        "pictures": pictures.told(),
    }))
}

fn is_settled(line: &Line) -> bool {
    line.state == "ok"
}
