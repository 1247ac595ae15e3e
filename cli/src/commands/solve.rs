//! `supine solve`.

use crate::args;
use crate::failure::Failure;
use crate::screen::Screen;
use supine_exchange::{read_mesh, write_mesh, write_problem};
use supine_fem::{Body, Cut, Load, Params, RestState, Tissue};
use supine_mesh::Order;
use supine_pipeline::{RunError, statics};
use supine_space::{BedPose, Progress, Vector};

pub(crate) fn solve(args: &args::Solve, screen: &Screen) -> Result<u8, Failure> {
    let (mesh, _) = read_mesh(&args.mesh)?;
    let tissue = tissue(args)?;
    if args.problem.is_some() && matches!(args.rest, args::Rest::Unloaded) {
        return Err(Failure::usage(
            "--problem: the mesh is the stress-free shape with --rest net only",
        ));
    }
    let load = Load { ct: supine_space::supine(), target: gravity(args)? };
    let params = Params {
        order: if args.order == 1 { Order::Linear } else { Order::Quadratic },
        rest: match args.rest {
            args::Rest::Net => RestState::Net,
            args::Rest::Unloaded => RestState::Unloaded,
        },
        cut: match args.cut {
            args::Cut::Free => Cut::Free,
            args::Cut::Fixed => Cut::Fixed,
        },
        ..Params::default()
    };
    if let Some(path) = &args.problem {
        let net = load.target - load.ct;
        write_problem(&mesh, &statics(&tissue, net, params.order, params.cut), path)?;
    }
    let watch = |share| screen.share("solve", share);
    let (displacement, info) =
        supine_fem::solve(&Body::new(&mesh, &tissue), &load, &params, Progress::new(&watch))
            .map_err(RunError::from)?;
    write_mesh(&mesh, Some(&displacement), &args.out)?;
    screen.warn_all(&info.warnings);
    let gravity: [f64; 3] = load.target.into();
    let json = serde_json::json!({
        "deformed": args.out, "gravity": gravity, "young_kpa": tissue.young_kpa,
        "poisson": tissue.poisson, "density_kg_m3": tissue.density_kg_m3, "order": args.order,
        "iterations": info.iterations, "residual": info.residual, "min_det_f": info.min_det_f,
        "max_det_f": info.max_det_f, "max_displacement_mm": info.max_displacement_mm,
        "warnings": info.warnings,
    });
    let text = format!(
        "{}: largest displacement {:.2} mm, {} iterations, det F {:.2} to {:.2}",
        args.out.display(),
        info.max_displacement_mm,
        info.iterations,
        info.min_det_f,
        info.max_det_f
    );
    screen.result(&json, &text);
    Ok(0)
}

fn tissue(args: &args::Solve) -> Result<Tissue, Failure> {
    let default = Tissue::default();
    let tissue = Tissue {
        young_kpa: args.young.unwrap_or(default.young_kpa),
        poisson: args.poisson.unwrap_or(default.poisson),
        density_kg_m3: args.density.unwrap_or(default.density_kg_m3),
    };
    tissue.check().map_err(|e| Failure::usage(e.to_string()))?;
    Ok(tissue)
}

fn gravity(args: &args::Solve) -> Result<Vector, Failure> {
    if let Some(args::Two([ap_deg, lat_deg])) = args.bed {
        return Ok(BedPose { ap_deg, lat_deg }.gravity());
    }
    match args.gravity {
        Some(args::Three(g)) if Vector::from(g).norm() > 0.0 => Ok(Vector::from(g).normalize()),
        Some(_) => Err(Failure::usage("--gravity: 0,0,0 is no direction")),
        None => Ok(supine_space::sitting()),
    }
}
