//! `supine solve`.

use crate::args;
use crate::failure::Failure;
use crate::screen::Screen;
use supine_exchange::{read_mesh, write_mesh_fields, write_problem};
use supine_fem::{Between, Body, Cut, Info, Load, Params, RestState, Tissue, between, sensitivity};
use supine_mesh::{Displacement, Order};
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
            args::Cut::Spring => Cut::Spring,
        },
        spring_kpa_mm: args.spring,
        ..Params::default()
    };
    if args.spring.is_some() && params.cut != Cut::Spring {
        return Err(Failure::usage("--spring: only with --cut spring"));
    }
    if let Some(path) = &args.problem {
        if params.cut == Cut::Spring {
            return Err(Failure::usage(
                "--problem: such files hold no springs at the cut; add --cut free or --cut fixed",
            ));
        }
        let net = load.target - load.ct;
        write_problem(&mesh, &statics(&tissue, net, params.order, params.cut == Cut::Fixed), path)?;
    }
    let body = Body::new(&mesh, &tissue);
    check_interval(args.young_interval, &tissue)?;
    let asked = Asked { sensitivity: args.sensitivity, interval_kpa: args.young_interval };
    let found = asked.solve(&body, &load, &params, screen)?;
    write_mesh_fields(&mesh, &found.fields(), &args.out)?;
    let info = &found.info;
    screen.warn_all(&info.warnings);
    let gravity: [f64; 3] = load.target.into();
    let mut json = serde_json::json!({
        "deformed": args.out, "gravity": gravity, "young_kpa": tissue.young_kpa,
        "poisson": tissue.poisson, "density_kg_m3": tissue.density_kg_m3, "order": args.order,
        "iterations": info.iterations, "residual": info.residual, "min_det_f": info.min_det_f,
        "max_det_f": info.max_det_f, "spring_kpa_mm": info.spring_kpa_mm,
        "max_displacement_mm": info.max_displacement_mm,
        "warnings": info.warnings,
    });
    let mut text = format!(
        "{}: largest displacement {:.2} mm, {} iterations, det F {:.2} to {:.2}",
        args.out.display(),
        info.max_displacement_mm,
        info.iterations,
        info.min_det_f,
        info.max_det_f
    );
    if let Some(slope) = &found.slope {
        let most = slope.max_norm();
        json["max_displacement_mm_per_kpa"] = most.into();
        text += &format!(", at most {most:.2} mm per kPa");
    }
    if let (Some(between), Some(args::Two([low, high]))) = (&found.between, args.young_interval) {
        let [of_low, of_high] = [&between.low, &between.high].map(Displacement::max_norm);
        json["young_interval"] = serde_json::json!({
            "young_kpa": [low, high], "max_displacement_mm": [of_low, of_high],
            "overshoot_mm": between.overshoot_mm,
        });
        text += &format!(", {of_low:.2} mm at {low} kPa, {of_high:.2} mm at {high} kPa");
    }
    screen.result(&json, &text);
    Ok(0)
}

/// What is wanted beside the displacement.
#[derive(Clone, Copy)]
struct Asked {
    sensitivity: bool,
    interval_kpa: Option<args::Two>,
}

/// What was found.
struct Found {
    displacement: Displacement,
    slope: Option<Displacement>,
    between: Option<Between>,
    info: Info,
}

impl Asked {
    fn solve(
        &self,
        body: &Body<'_>,
        load: &Load,
        params: &Params,
        screen: &Screen,
    ) -> Result<Found, Failure> {
        let watch = |share| screen.share("solve", share);
        let progress = Progress::new(&watch);
        let part = progress.part(0.0, if self.interval_kpa.is_some() { 0.3 } else { 1.0 });
        let (displacement, slope, mut info) = if self.sensitivity {
            let (u, slope, info) = sensitivity(body, load, params, part).map_err(RunError::from)?;
            (u, Some(slope), info)
        } else {
            let (u, info) = supine_fem::solve(body, load, params, part).map_err(RunError::from)?;
            (u, None, info)
        };
        let between = match self.interval_kpa {
            None => None,
            Some(args::Two(ends)) => {
                let part = progress.part(0.3, 1.0);
                let found = between(body, load, params, ends, part).map_err(RunError::from)?;
                info.warnings.extend(found.warnings.iter().cloned());
                Some(found)
            }
        };
        Ok(Found { displacement, slope, between, info })
    }
}

impl Found {
    fn fields(&self) -> Vec<(&'static str, &Displacement)> {
        let mut fields = vec![("displacement", &self.displacement)];
        fields.extend(self.slope.iter().map(|s| ("displacement_per_kpa", s)));
        if let Some(between) = &self.between {
            fields.push(("displacement_low_modulus", &between.low));
            fields.push(("displacement_high_modulus", &between.high));
        }
        fields
    }
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

fn check_interval(ends: Option<args::Two>, tissue: &Tissue) -> Result<(), Failure> {
    let Some(args::Two([low, high])) = ends else { return Ok(()) };
    if low.is_nan() || high.is_nan() || low >= high {
        return Err(Failure::usage(format!("--young-interval: {low} is not below {high}")));
    }
    let check = |young_kpa| Tissue { young_kpa, ..*tissue }.check();
    [low, high].into_iter().try_for_each(check).map_err(|e| Failure::usage(e.to_string()))
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
