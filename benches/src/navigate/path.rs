//! A path of the applicator on meshes of several sizes: how long a step takes, and what a coarse
//! mesh costs.

use crate::drift::pose;
use crate::tissue::{follower, planned};
use anyhow::{Context, Result};
use serde_json::{Value, json};
use std::path::Path;
use std::time::Instant;
use supine_navigate::trajectory::{Expect, Trajectory};
use supine_navigate::{Renewing, Settings};
use supine_space::{Point, Pose, Vector};

/// Tetrahedra and order; the last is the truth.
const MESHES: [(usize, u8); 4] = [(1581, 1), (1581, 2), (11_828, 1), (11_828, 2)];

/// The tumour along the path on one mesh.
struct Gone {
    tetrahedra: usize,
    order: u8,
    targets: Vec<Point>,
    /// By the applicator alone.
    moved: Vec<Vector>,
    touches: Vec<bool>,
    /// Of each step, with the renewal that follows it; ms.
    steps_ms: Vec<f64>,
}

/// Times of the steps, and how far each mesh has the tumour from where the finest one has it while
/// the applicator acts.
pub(crate) fn measure(run: &Path) -> Result<Value> {
    let (placed, _) = planned(run, &Settings::default())?;
    let motion = Trajectory::short().entering(&placed);
    let good = motion.rows().iter().filter(|row| row.expect == Expect::Accept);
    let poses: Vec<Pose> = good.map(pose).collect();
    let gone: Vec<Gone> =
        MESHES.iter().map(|(n, order)| go(run, (*n, *order), &poses)).collect::<Result<_>>()?;
    let finest = gone.last().context("no mesh")?;
    Ok(gone.iter().map(|one| told(one, finest)).collect())
}

fn go(run: &Path, (tetrahedra, order): (usize, u8), poses: &[Pose]) -> Result<Gone> {
    let settings =
        Settings { tetrahedra, order, renewal: Renewing::Between, ..Settings::default() };
    let (_, tetrahedra) = planned(run, &settings)?;
    let mut tissue = follower(run, &settings)?;
    let (targets, moved, touches, steps_ms) = (vec![], vec![], vec![], vec![]);
    let mut gone = Gone { tetrahedra, order, targets, moved, touches, steps_ms };
    for pose in poses {
        let start = Instant::now();
        let (followed, _) = tissue.follow(pose)?;
        tissue.between()?;
        gone.steps_ms.push(start.elapsed().as_secs_f64() * 1e3);
        gone.targets.push(followed.target);
        gone.moved.push(followed.moved);
        gone.touches.push(followed.touches);
    }
    Ok(gone)
}

fn told(one: &Gone, finest: &Gone) -> Value {
    let acts: Vec<usize> = (0..one.moved.len()).filter(|n| finest.touches[*n]).collect();
    let off = |of: &dyn Fn(usize) -> f64| {
        let all: Vec<f64> = acts.iter().map(|n| of(*n)).collect();
        let mean = all.iter().sum::<f64>() / all.len().max(1) as f64;
        [mean, all.iter().copied().fold(0.0, f64::max)]
    };
    let mut steps: Vec<f64> = acts.iter().map(|n| one.steps_ms[*n]).collect();
    steps.sort_by(f64::total_cmp);
    let share = |share: f64| steps.get((share * steps.len() as f64) as usize).copied();
    json!({
        "tetrahedra": one.tetrahedra,
        "order": one.order,
        "acting": acts.len(),
        "moved_mm": off(&|n| finest.moved[n].norm())[1],
        "median_ms": share(0.5),
        "p95_ms": share(0.95),
        "worst_ms": steps.last(),
        "place_off_mm": off(&|n| (one.targets[n] - finest.targets[n]).norm()),
        "motion_off_mm": off(&|n| (one.moved[n] - finest.moved[n]).norm()),
    })
}
