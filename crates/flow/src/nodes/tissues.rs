//! The finer tissues, when the case asks for them.

use super::import::Imported;
use super::region::Chosen;
use super::segment::Segmented;
use super::{Import, Region, Segment};
use crate::case_state::CaseState;
use crate::graph::{Node, Outs};
use crate::work::Work;
use crate::{Error, NodeId};
use serde::Serialize;
use std::sync::Arc;
use supine_exchange::{read_labels, write_labels};
use supine_report::SphereRecord;
use supine_report::{TissueVolume, Tissues as Facts};
use supine_segment::{TissueInfo, TissueShare};
use supine_space::{Progress, Sphere, Warning};
use supine_volume::{LabelMap, label};

pub(crate) struct Tissues;

#[derive(Serialize)]
pub(crate) struct NodeInputs {
    asked: bool,
    tumour: Option<SphereRecord>,
}

/// The finer labels and what they hold; none when the case does not ask.
#[derive(Debug, Default)]
pub(crate) struct Labelled {
    pub(crate) labels: Option<Arc<LabelMap>>,
    pub(crate) facts: Option<Facts>,
}

impl Node for Tissues {
    const ID: NodeId = NodeId::Tissues;
    const METHOD: u32 = 1;
    const KEPT: bool = true;
    type NodeInputs = NodeInputs;
    type Parents = (Import, Segment, Region);
    type Out = Labelled;

    fn inputs(case_state: &CaseState) -> Result<NodeInputs, Error> {
        let case = &case_state.case;
        let wanted = case.tissues && case.tumour.is_some();
        let tumour = wanted.then(|| case_state.tumour()).transpose()?;
        let tumour = tumour.map(|tumour| tumour.sphere.into());
        Ok(NodeInputs { asked: case.tissues, tumour })
    }

    fn not_asked(inputs: &NodeInputs) -> Option<Labelled> {
        (!inputs.asked).then(Labelled::default)
    }

    fn run(
        inputs: &NodeInputs,
        (input, segmented, region): Outs<Self>,
        work: &Work<'_>,
    ) -> Result<Labelled, Error> {
        let tumour = inputs.tumour.map(SphereRecord::sphere).transpose()?;
        let from = (&*input, &*segmented, &*region);
        let (labels, warnings) = labelled(from, tumour, work.progress)?;
        work.warn_all(warnings);
        Ok(labels)
    }

    fn save(out: &Labelled, work: &Work<'_>) -> Result<(), Error> {
        let Some(labels) = &out.labels else { return Ok(()) };
        write_labels(labels, &work.place("labels")?, Progress::none()).map_err(Error::product)
    }

    fn facts(out: &Labelled) -> Result<serde_json::Value, Error> {
        Ok(serde_json::to_value(&out.facts)?)
    }

    fn load(facts: serde_json::Value, work: &Work<'_>) -> Result<Labelled, Error> {
        let facts: Option<Facts> = serde_json::from_value(facts)?;
        let path = work.place("labels")?;
        let labels = facts.as_ref().map(|_| read_labels(&path, work.progress));
        let labels = labels.transpose().map_err(Error::product)?;
        Ok(Labelled { labels: labels.map(Arc::new), facts })
    }

    fn bytes(out: &Labelled) -> usize {
        out.labels.as_ref().map_or(0, |labels| labels.grid().len())
    }
}

/// The finer labels of a CT, and what a user must know of them.
///
/// # Errors
/// When they cannot be found, and when the user stops.
pub(crate) fn labelled(
    (input, segmented, region): (&Imported, &Segmented, &Chosen),
    tumour: Option<Sphere>,
    progress: Progress<'_>,
) -> Result<(Labelled, Vec<Warning>), Error> {
    let implants = segmented.implants.as_ref().map(|map| map.get(progress)).transpose()?;
    let (ct, coarse) = (&input.ct, &segmented.labels);
    let (fine, info) = supine_segment::tissues(ct, coarse, implants.as_deref(), tumour, progress)?;
    let here = supine_segment::tissue_shares(ct, &fine, region.sphere()?);
    let facts = Some(facts(&info, &here));
    Ok((Labelled { labels: Some(Arc::new(fine)), facts }, info.warnings))
}

fn facts(info: &TissueInfo, here: &[TissueShare]) -> Facts {
    let ml = |label: u8| here.iter().find(|s| s.label == label).map_or(0.0, |s| s.ml);
    let (gland, fat) = (ml(label::GLAND), ml(label::FAT));
    let name = |l: u8| label::ALL.iter().find(|(n, ..)| *n == l).map_or("", |(_, name, _)| *name);
    let volumes = here.iter().zip(&info.shares).map(|(here, whole)| TissueVolume {
        name: name(here.label).into(),
        region_ml: here.ml,
        mean_hu: (here.ml > 0.0).then_some(here.mean_hu),
        whole_ct_ml: whole.ml,
    });
    Facts {
        levels: info.levels,
        density_percent: (gland + fat > 0.0).then(|| 100.0 * gland / (gland + fat)),
        volumes: volumes.collect(),
    }
}
