//! `supine carry`.

use crate::args;
use crate::failure::Failure;
use crate::screen::Screen;
use supine_exchange::{NamedPoint, read_points, read_vtu, write_points};
use supine_pipeline::RunError;
use supine_warp::Params;

pub(crate) fn carry(args: &args::Carry, screen: &Screen) -> Result<u8, Failure> {
    let path = args.run.join("mesh").join("deformed.vtu");
    let unfinished = || {
        let folder = args.run.display();
        Failure::input(format!("{folder} is not the folder of a finished run"))
    };
    if !path.is_file() {
        return Err(unfinished());
    }
    let (mesh, displacement) = read_vtu(&path)?;
    let displacement = displacement.ok_or_else(unfinished)?;
    let points = read_points(&args.points)?;
    let positions: Vec<_> = points.iter().map(|p| p.position).collect();
    let after = supine_warp::carry_points(&mesh, &displacement, &Params::default(), &positions)
        .map_err(RunError::from)?;
    let carried: Vec<NamedPoint> = points
        .iter()
        .zip(&after)
        .map(|(p, a)| NamedPoint { name: p.name.clone(), position: a.unwrap_or(p.position) })
        .collect();
    write_points(&carried, &args.out)?;
    let outside: Vec<&str> = points
        .iter()
        .zip(&after)
        .filter(|(_, a)| a.is_none())
        .map(|(p, _)| p.name.as_str())
        .collect();
    if !outside.is_empty() {
        let names = outside.join(", ");
        screen.say(&format!("warning: outside the modelled tissue, not moved: {names}"));
    }
    let json = serde_json::json!({
        "points": args.out, "carried": points.len() - outside.len(), "outside": outside,
    });
    let text = format!("{}: {} points", args.out.display(), points.len());
    screen.result(&json, &text);
    Ok(0)
}
