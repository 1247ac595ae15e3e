//! Points.

use super::{Job, warped};
use crate::failure::Failure;
use supine_exchange::{NamedPoint, read_points, write_points};
use supine_warp::{Params, carry_points};

pub(super) fn carry(job: &Job<'_>) -> Result<u8, Failure> {
    let points = read_points(job.what)?;
    let positions: Vec<_> = points.iter().map(|p| p.position).collect();
    let (mesh, displacement) = job.map();
    let after = carry_points(mesh, displacement, &Params::default(), &positions).map_err(warped)?;
    let carried: Vec<NamedPoint> = points
        .iter()
        .zip(&after)
        .map(|(p, a)| NamedPoint { name: p.name.clone(), position: a.unwrap_or(p.position) })
        .collect();
    let out = &job.args.out;
    write_points(&carried, out)?;
    let outside: Vec<&str> = points
        .iter()
        .zip(&after)
        .filter(|(_, a)| a.is_none())
        .map(|(p, _)| p.name.as_str())
        .collect();
    if !outside.is_empty() {
        let names = outside.join(", ");
        job.screen.say(&format!("warning: outside the modelled tissue, not moved: {names}"));
    }
    let json = serde_json::json!({
        "kind": "points", "points": out, "carried": points.len() - outside.len(),
        "outside": outside,
    });
    let text = format!("{}: {} points", out.display(), points.len());
    job.screen.result(&json, &text);
    Ok(0)
}
