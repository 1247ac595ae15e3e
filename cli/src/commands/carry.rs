//! `supine carry`.

use crate::End;
use crate::args;
use crate::failure::Failure;
use crate::screen::Screen;
use std::fmt::Display;
use std::path::Path;
use supine_flow::commands::carry::{self, CarryDone};
use supine_space::Failure as Kind;

pub(crate) fn carry(args: args::Carry, screen: &Screen) -> Result<End, Failure> {
    let points = args.points.is_some();
    let (Some(from), Some(what)) = (args.run.clone().or(args.from), args.points.or(args.what))
    else {
        let message = "a run or mesh, and what is to be carried, are needed";
        return Err(Failure::new(Kind::Usage, message));
    };
    let done = carry::carry(
        &carry::Carry {
            spec: args.given.spec,
            from,
            what,
            points,
            ct_grid: args.grid.into(),
            kind: args.kind.map(Into::into),
            frame: args.frame.into(),
            out: args.out.clone(),
            overwrite: args.over.overwrite,
        },
        screen,
    )?;
    screen.result(&done, &text(&done, &args.out));
    Ok(End::Done)
}

fn text(done: &CarryDone, out: &Path) -> String {
    let out = out.display();
    let row = |name: &dyn Display, before: f64, after: f64| {
        format!("\n  {name}: {before:.2} ml before, {after:.2} ml after")
    };
    match done {
        CarryDone::Points { carried, outside, .. } => {
            format!("{out}: {} points", carried + outside.len())
        }
        CarryDone::Labels { labels, .. } => {
            let rows = labels.iter().map(|label| {
                let name = label.name.clone().unwrap_or_else(|| label.number.to_string());
                row(&name, label.before_ml, label.after_ml)
            });
            format!("{out}: labels{}", rows.collect::<String>())
        }
        CarryDone::Segments { segments, .. } => {
            let rows =
                segments.iter().map(|s| &s.region).map(|s| row(&s.name, s.before_ml, s.after_ml));
            format!("{out}: segments{}", rows.collect::<String>())
        }
        CarryDone::Contours { structures, .. } => {
            let rows = structures.iter().map(|s| {
                let still = if s.moved { "" } else { " (not moved: as given)" };
                row(&s.name, s.before_ml, s.after_ml) + still
            });
            format!("{out}: contours{}", rows.collect::<String>())
        }
        CarryDone::Dose(dose) => {
            let ([max, max_after], [sum, sum_after]) = (dose.max_gy, dose.integral_gy_ml);
            let mass = dose.energy_mj.map(|[before, after]| {
                format!("; weighted with mass {before:.1} mJ before, {after:.1} mJ after")
            });
            format!(
                "{out}: dose, maximum {max:.2} Gy before, {max_after:.2} Gy after; integral {sum:.1} Gy ml before, \
                 {sum_after:.1} Gy ml after (in the file {:.1}: there the tissue's dose goes on into the air beside the skin){}",
                dose.written_gy_ml,
                mass.unwrap_or_default()
            )
        }
        CarryDone::Surface(s) => format!(
            "{out}: surface, {} of {} points moved, up to {:.2} mm; {:.2} ml before, {:.2} ml after",
            s.moved_points, s.points, s.max_displacement_mm, s.before_ml, s.after_ml
        ),
    }
}
