//! The whole flow.

use crate::bench::{Bench, Watch};
use crate::stages::{carry, export, import, mesh, region, report, segment, solve, tissues, warp};
use crate::store::refuse_overlap;
use crate::{Case, Options, RunError, Stage};
use std::path::Path;
use supine_report::Summary;

/// Runs a case into the folder `out`; stages that are done for the same inputs are not redone.
///
/// Returns the summary, or `None` when `until` ended the run before the report.
///
/// # Errors
/// [`RunError`]; nothing half-written is left under a final name, and the stages that were done
/// stay done.
pub fn run(
    case: &Case,
    out: &Path,
    options: Options,
    watch: &dyn Watch,
) -> Result<Option<Summary>, RunError> {
    for (role, input) in case.inputs() {
        refuse_overlap(out, role, input)?;
    }
    let mut bench = Bench::open(out, options, watch)?;
    let until = |stage| options.until == Some(stage);

    let input = import::import(&mut bench, case)?;
    if until(Stage::Import) {
        return Ok(None);
    }
    carry::check(case, &input)?;
    let labels = segment::segment(&mut bench, case, &input)?;
    if until(Stage::Segment) {
        return Ok(None);
    }
    let region = region::region(&mut bench, case, &input, &labels)?;
    if until(Stage::Region) {
        return Ok(None);
    }
    let tissues = tissues::tissues(&mut bench, case, &input, &labels, &region)?;
    if until(Stage::Tissues) {
        return Ok(None);
    }
    let mesh = mesh::mesh(&mut bench, case, &labels, &region)?;
    if until(Stage::Mesh) {
        return Ok(None);
    }
    let solved = solve::solve(&mut bench, case, &mesh, (&input, &tissues))?;
    if until(Stage::Solve) {
        return Ok(None);
    }
    let warped = warp::warp(&mut bench, case, &input, &region, &mesh, &solved)?;
    if until(Stage::Warp) {
        return Ok(None);
    }
    let reach_mm = solved.facts.solve.max_displacement_mm;
    let map = (&mesh.product, &solved.product);
    let export = export::export(&mut bench, case, (&input, map), &warped, reach_mm)?;
    if until(Stage::Export) {
        return Ok(None);
    }
    let carried = carry::carry(&mut bench, case, (&input, map), &export)?;
    if until(Stage::Carry) {
        return Ok(None);
    }
    let flow =
        report::Flow { input, labels, region, mesh, solved, warped, export, carried, tissues };
    report::report(bench, case, &flow).map(Some)
}
