//! Whether the place comes back with the applicator.

use crate::tissue::{follower, planned};
use anyhow::{Result, bail};
use nalgebra::UnitQuaternion;
use serde_json::{Value, json};
use std::path::Path;
use supine_navigate::trajectory::{Expect, Phase, Row, Trajectory};
use supine_navigate::{Followed, Follower, Renewing, Settings};
use supine_space::{Matrix, Pose, Vector};

/// A pose is followed again until it has settled, so often at most.
const TRIES: usize = 100;

/// Places at the planned pose before and after so many steps of the motion, and what lies between
/// them, mm.
pub(crate) fn measure(run: &Path, steps: usize) -> Result<Value> {
    let settings = Settings { renewal: Renewing::Between, ..Settings::default() };
    let (placed, _) = planned(run, &settings)?;
    let mut tissue = follower(run, &settings)?;
    let first = settled(&mut tissue, &placed)?;
    let motion = Trajectory::long().entering(&placed);
    let good = motion.rows().iter().filter(|row| row.expect == Expect::Accept);
    // It begins where the applicator is planned.
    let comes = |row: &&Row| matches!(row.phase, Phase::Approach | Phase::Insertion);
    let acting = good.skip_while(comes).take(steps);
    let (mut gone, mut predicted, mut moved_mm) = (0, 0, 0.0f64);
    for row in acting {
        let (followed, _) = tissue.follow(&pose(row))?;
        tissue.between()?;
        gone += 1;
        predicted += usize::from(!followed.settled);
        moved_mm = moved_mm.max(followed.moved.norm());
    }
    let last = settled(&mut tissue, &placed)?;
    Ok(json!({
        "steps": gone,
        "predicted": predicted,
        "moved_mm": moved_mm,
        "drift_mm": (last.target - first.target).norm(),
        "bound_mm": first.error_mm + last.error_mm,
    }))
}

/// Follows a pose until the tissue has come to rest.
fn settled(tissue: &mut Follower, pose: &Pose) -> Result<Followed> {
    for _ in 0..TRIES {
        let (followed, _) = tissue.follow(pose)?;
        tissue.between()?;
        if followed.settled {
            return Ok(followed);
        }
    }
    bail!("the tissue does not come to rest in {TRIES} answers")
}

/// The pose of a row that is one.
pub(crate) fn pose(row: &Row) -> Pose {
    let turn = Matrix::from_fn(|r, c| row.rows[r][c]);
    let shift = Vector::from_fn(|r, _| row.rows[r][3]);
    Pose::from_parts(shift.into(), UnitQuaternion::from_matrix(&turn))
}
