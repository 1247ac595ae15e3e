//! The canonical form of a case.

use super::case::{Case, Refinement, TumourSpec};
use super::stroke;
use super::table::{CLIPPED, SAME_FRAME, TABLE};
use super::tissue;
use crate::shared::{CarriedKind, cut_name};
use serde_json::{Map, Value as Json};
use std::path::PathBuf;
use supine_space::Sphere;
use supine_volume::SeedKind;

/// The values of a case by table and key, in the order of the parameters; what does not apply is left out.
pub(super) fn object(case: &Case) -> Map<String, Json> {
    let mut object = Map::new();
    for parameter in TABLE {
        let found = value(case, parameter.key);
        if found.is_null() {
            continue;
        }
        let (table, name) = parameter.path();
        match table {
            None => drop(object.insert(name.into(), found)),
            Some(table) => {
                let inner = object.entry(table).or_insert_with(|| Json::Object(Map::new()));
                if let Json::Object(inner) = inner {
                    inner.insert(name.into(), found);
                }
            }
        }
    }
    object
}

/// The value that a case has for a key; null where it does not apply.
fn value(case: &Case, key: &str) -> Json {
    match key {
        "ct" => case.ct.as_ref().map(|p| p.to_string_lossy()).into(),
        "series" => case.series.as_deref().into(),
        "exclude" => listed(&case.exclude),
        "assume_hu" => case.accept.assume_hu.into(),
        "equalise_steps" => case.accept.equalise_steps.into(),
        "breast" => case.breast.map(|side| side.to_string()).into(),
        "bed.ap" => case.bed.map(|bed| bed.ap_deg).into(),
        "bed.lat" => case.bed.map(|bed| bed.lat_deg).into(),
        _ if key.starts_with("tumour.") => tumour(case, key),
        "region.centre" => centre(case.region),
        "region.radius" => case.region.map(|s| s.radius()).into(),
        "tolerance" => case.tolerance_mm.into(),
        "report.seen" => listed(&case.seen),
        "tissues" => case.tissues.into(),
        "warp.interpolation" => case.interpolation.name().into(),
        "carry.points" => paths(&case.points),
        _ if key.starts_with("mesh.") => mesh(case, key),
        _ if key.starts_with("tissue.") => of_tissue(case, key),
        _ if key.starts_with("scans.") => scans(case, key),
        _ if key.starts_with("seeds.") => seeds(case, key),
        _ if key.starts_with("labels.") => labels(case, key),
        _ if key.starts_with("carry.") => carried(case, key),
        _ => export(case, key),
    }
}

fn tumour(case: &Case, key: &str) -> Json {
    match (&case.tumour, key) {
        (Some(TumourSpec::Sphere(sphere)), "tumour.centre") => centre(Some(*sphere)),
        (Some(TumourSpec::Sphere(sphere)), "tumour.radius") => sphere.radius().into(),
        (Some(TumourSpec::Structure { name, .. }), "tumour.structure") => name.as_str().into(),
        (Some(TumourSpec::Structure { file, .. }), "tumour.file") => file.to_string_lossy().into(),
        _ => Json::Null,
    }
}

fn centre(sphere: Option<Sphere>) -> Json {
    sphere.map(|s| <[f64; 3]>::from(s.centre().coords).to_vec()).into()
}

fn paths(all: &[PathBuf]) -> Json {
    if all.is_empty() { Json::Null } else { all.iter().map(|p| p.to_string_lossy()).collect() }
}

fn mesh(case: &Case, key: &str) -> Json {
    let lengths = match case.mesh.refine {
        Refinement::Tumour { edge_mm, growth } => Some([edge_mm, growth]),
        Refinement::Nowhere | Refinement::Goal => None,
    };
    match key {
        "mesh.tetrahedra" => case.mesh.tetrahedra.into(),
        "mesh.order" => case.mesh.order.number().into(),
        "mesh.geometry" => if case.mesh.curved { "curved" } else { "straight" }.into(),
        "mesh.mesher" => case.mesh.mesher.name().into(),
        "mesh.piece" => if case.mesh.centre_piece { "centre" } else { "largest" }.into(),
        "mesh.refine" => case.mesh.refine.name().into(),
        "mesh.tumour_edge" => lengths.map(|l| l[0]).into(),
        "mesh.tumour_growth" => lengths.map(|l| l[1]).into(),
        _ => Json::Null,
    }
}

fn of_tissue(case: &Case, key: &str) -> Json {
    // Proportions are those of the method: what was asked is their mean alone.
    let moduli = case.stiffness.filter(|s| s.given).map(|s| s.kpa);
    if let Some(n) = tissue::KEYS.iter().position(|k| *k == key) {
        return moduli.map(|kpa| kpa[n]).into();
    }
    match key {
        "tissue.young" if moduli.is_some() || case.fit_scans().is_some() => Json::Null,
        "tissue.young" => case.tissue.young_kpa.into(),
        "tissue.poisson" => case.tissue.poisson.into(),
        "tissue.density" => case.tissue.density_kg_m3.into(),
        "tissue.rest" if case.fit_scans().is_some_and(|s| s.states.len() > 1) => Json::Null,
        "tissue.rest" => case.rest.name().into(),
        "tissue.cut" => cut_name(case.cut).into(),
        "tissue.spring" => case.spring_kpa_mm.into(),
        "tissue.map" => case.stiffness.map_or("none", |s| s.map.name()).into(),
        "tissue.young_interval" => case.young_interval_kpa.map(|ends| ends.to_vec()).into(),
        _ => Json::Null,
    }
}

fn scans(case: &Case, key: &str) -> Json {
    let Some(scans) = &case.scans else { return Json::Null };
    let path = |path: &Option<PathBuf>| path.as_ref().map(|p| p.to_string_lossy()).into();
    match key {
        "scans.sitting" => path(&scans.fit.as_ref().map(|fit| fit.sitting.clone())),
        "scans.supine" => path(&scans.fit.as_ref().and_then(|fit| fit.supine.clone())),
        "scans.intraop" => path(&scans.intraop),
        "scans.landmarks" => path(&scans.landmarks),
        "scans.unit" => scans.unit.unwrap_or("auto").into(),
        _ => Json::Null,
    }
}

fn seeds(case: &Case, key: &str) -> Json {
    let points = |wanted: SeedKind| -> Json {
        let of_kind = case.seeds.points.iter().filter(|(kind, _)| *kind == wanted);
        let all: Vec<Json> =
            of_kind.map(|(_, p)| <[f64; 3]>::from(p.coords).to_vec().into()).collect();
        if all.is_empty() { Json::Null } else { all.into() }
    };
    match key {
        "seeds.file" => paths(&case.seeds.files),
        "seeds.chest_wall" => points(SeedKind::ChestWall),
        "seeds.soft_tissue" => points(SeedKind::SoftTissue),
        "seeds.exclude" => points(SeedKind::Exclude),
        "seeds.strokes" if case.seeds.strokes.is_empty() => Json::Null,
        "seeds.strokes" => case.seeds.strokes.iter().map(stroke::to_json).collect(),
        _ => Json::Null,
    }
}

fn labels(case: &Case, key: &str) -> Json {
    let Some(labels) = &case.labels else { return Json::Null };
    let names = |all: &[String]| -> Json {
        if all.is_empty() { Json::Null } else { all.iter().map(String::as_str).collect() }
    };
    match key {
        "labels.file" => labels.file.to_string_lossy().into(),
        "labels.body" => names(&labels.names.body),
        "labels.soft_tissue" => names(&labels.names.soft_tissue),
        "labels.chest_wall" => names(&labels.names.chest_wall),
        _ => Json::Null,
    }
}

fn listed(names: &[String]) -> Json {
    if names.is_empty() { Json::Null } else { names.into() }
}

fn carried(case: &Case, key: &str) -> Json {
    let Some(kind) = CarriedKind::ALL.into_iter().find(|kind| kind.key() == key) else {
        return Json::Null;
    };
    let of_kind = case.carried.iter().filter(|c| c.kind == kind);
    paths(&of_kind.map(|c| c.path.clone()).collect::<Vec<_>>())
}

fn export(case: &Case, key: &str) -> Json {
    let spec = &case.export;
    match key {
        "export.anonymise" => spec.anonymise.into(),
        "export.study" => if spec.policy.new_study { "new" } else { "source" }.into(),
        "export.equipment" => if spec.policy.keep_equipment { "scanner" } else { "supine" }.into(),
        "export.frame" => if spec.policy.same_frame { SAME_FRAME } else { "new" }.into(),
        "export.padding" => if spec.policy.clip_padding { CLIPPED } else { "source" }.into(),
        "export.registration" => spec.registration.into(),
        "export.structures" => spec.structures.into(),
        "export.pdf" => spec.pdf.into(),
        "export.clock" => spec.clock.as_ref().map(ToString::to_string).into(),
        _ => Json::Null,
    }
}
