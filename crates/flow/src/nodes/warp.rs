//! The CT on the table.

use super::{Import, Imported, Segment, Solve};
use crate::case_state::CaseState;
use crate::graph::{Node, Outs};
use crate::work::Work;
use crate::{Error, NodeId};
use std::sync::Arc;
use supine_mesh::Deformation;
use supine_report::{DenseFate, DenseThing};
use supine_space::{Progress, Warning};
use supine_volume::Ct;
use supine_warp::{Interpolation, Params};

pub(crate) struct Warp;

/// The deformed CT.
#[derive(Debug)]
pub(crate) struct Warped {
    /// HU.
    pub(crate) ct: Arc<Ct>,
    /// The displacement that carried it: that of the tissue, faded towards the cut.
    pub(crate) carried: Arc<Deformation>,
    pub(crate) facts: supine_report::Warp,
}

impl Node for Warp {
    const ID: NodeId = NodeId::Warp;
    const METHOD: u32 = 4;
    /// Made again in less time than it is read.
    const KEPT: bool = false;
    /// The interpolation.
    type NodeInputs = &'static str;
    type Parents = (Import, Segment, Solve);
    type Out = Warped;

    fn inputs(case_state: &CaseState) -> Result<&'static str, Error> {
        Ok(case_state.case.interpolation.name())
    }

    fn run(
        inputs: &&'static str,
        (input, segmented, solved): Outs<Self>,
        work: &Work<'_>,
    ) -> Result<Warped, Error> {
        let named = Interpolation::ALL.into_iter().find(|i| i.name() == *inputs);
        let params = Params { interpolation: named.unwrap_or_default(), ..Params::default() };
        let (deformation, part) = (&solved.deformation, work.progress.part(0.0, 0.9));
        let (mut ct, info) = supine_warp::warp(&input.ct, deformation, &params, part)?;
        let labels = &segmented.labels;
        let dense = supine_warp::keep_dense(&input.ct, labels, &mut ct, deformation, &params)?;
        work.warn_all(info.warnings);
        work.warn_all(dense_warnings(&dense));
        let facts = supine_report::Warp { dense, ..info.facts };
        let part = work.progress.part(0.9, 1.0);
        work.warn_all(beyond_field(&input, deformation, &params, part)?);
        let carried = Arc::new(supine_warp::fade(deformation, &params)?.deformation);
        Ok(Warped { ct: Arc::new(ct), carried, facts })
    }

    fn bytes(out: &Warped) -> usize {
        2 * out.ct.grid().len()
    }
}

/// Tissue from beyond what was measured that is worth a word, cm³: less than a tumour's worth.
/// Chosen, not measured.
const BEYOND_CM3: f64 = 0.1;

/// What a planner has to know of tissue that was never measured.
///
/// # Errors
/// As the warp's.
pub(crate) fn beyond_field(
    input: &Imported,
    deformation: &Deformation,
    params: &Params,
    progress: Progress<'_>,
) -> Result<Option<Warning>, Error> {
    let (ct, field) = (&input.ct, &input.field);
    let mm3 = supine_warp::beyond_field_mm3(ct, field, deformation, params, progress)?;
    let cm3 = mm3 / 1000.0;
    let text = format!(
        "{cm3:.1} cm³ of soft tissue come from beyond the field that the scanner reconstructed: nothing was measured \
         there, and air stands in their place; make the region smaller or use a CT with a larger field"
    );
    let told = || Warning::new("tissue-beyond-field", text).value("volume_cm3", cm3);
    Ok((cm3 > BEYOND_CM3).then(told))
}

/// What a planner has to know of metal.
fn dense_warnings(dense: &[DenseThing]) -> Vec<Warning> {
    let count = |fate| dense.iter().filter(|d| d.fate == fate).count();
    let told = [
        (
            DenseFate::Whole,
            "metal-moved-whole",
            "dense thing(s) in the breast (clip, wire, calcification) were moved whole: their place is known to half a voxel",
        ),
        (
            DenseFate::Deformed,
            "metal-deformed",
            "large dense thing(s) in the breast deformed with the tissue, which metal does not",
        ),
        (
            DenseFate::OutsideBody,
            "metal-outside-body",
            "dense thing(s) on the breast (bra wire, clasp, marker) stayed where they were: the volume shows them, the \
             operating table will not",
        ),
    ];
    let said = told.into_iter().map(|(fate, code, text)| (count(fate), code, text));
    let said = said.filter(|(n, ..)| *n > 0);
    said.map(|(n, code, text)| Warning::new(code, format!("{n} {text}"))).collect()
}
