//! Label maps.

use super::{Job, stopped, warped};
use crate::args;
use crate::failure::Failure;
use supine_exchange::{LabelLayers, write_label_layers};
use supine_space::Progress;
use supine_warp::{Origins, Params, carry_labels};

pub(super) fn carry(job: &Job<'_>, given: &LabelLayers) -> Result<u8, Failure> {
    let own = given.grid().ok_or_else(|| Failure::input("the file holds no label map"))?;
    let grid = match job.args.grid {
        args::CarryGrid::Own => own.clone(),
        args::CarryGrid::Ct => job.ct_for_grid()?.ct.grid().clone(),
    };
    let params = Params::default();
    let watch = |share| job.screen.share("carry", share);
    let progress = Progress::new(&watch);
    // A voxel of the label map reaches so far beyond the faces of the mesh.
    let layer_mm = own.spacing().norm().min(params.collar_mm);
    let origins = Origins::new(&grid, job.map(), &params, layer_mm, progress.part(0.0, 0.8))
        .map_err(warped)?;
    let layers: Result<Vec<_>, _> = given
        .layers
        .iter()
        .map(|layer| carry_labels(layer, &origins, progress.part(0.8, 1.0)))
        .collect();
    let carried = given.with_layers(layers.map_err(stopped)?);
    let out = &job.args.out;
    let watch = |share| job.screen.share("export", share);
    write_label_layers(&carried, out, Progress::new(&watch))?;
    let (before, after) = (given.volumes_ml(), carried.volumes_ml());
    let (mut rows, mut text) = (Vec::new(), format!("{}: labels", out.display()));
    for (&(layer, number), &before_ml) in &before {
        let after_ml = after.get(&(layer, number)).copied().unwrap_or(0.0);
        let known = given.names.iter().find(|(l, n, _)| (*l, *n) == (layer, number));
        let name = known.map(|(.., name)| name.as_str());
        let called = name.map_or_else(|| number.to_string(), str::to_owned);
        text += &format!("\n  {called}: {before_ml:.2} ml before, {after_ml:.2} ml after");
        rows.push(serde_json::json!({
            "layer": layer, "number": number, "name": name,
            "before_ml": before_ml, "after_ml": after_ml,
        }));
    }
    let json = serde_json::json!({ "kind": "labels", "out": out, "labels": rows });
    job.screen.result(&json, &text);
    Ok(0)
}
