//! The labels as a DICOM segmentation of the CT they belong to.

use super::{Segment, Source};
use crate::graph::{Node, Outs};
use crate::ground::Ground;
use crate::shared::write_dicom_labels;
use crate::work::Work;
use crate::{Error, NodeId};

pub(crate) struct LabelsObject;

impl Node for LabelsObject {
    const ID: NodeId = NodeId::LabelsObject;
    const METHOD: u32 = 2;
    const KEPT: bool = true;
    const WRITES: bool = true;
    type Own = ();
    type Parents = (Source, Segment);
    type Out = ();

    fn own(_: &Ground) -> Result<(), Error> {
        Ok(())
    }

    fn run((): &(), (named, segmented): Outs<Self>, work: &Work<'_>) -> Result<(), Error> {
        let Some(named) = named.as_ref() else { return Ok(()) };
        let path = work.place("labels")?;
        write_dicom_labels(&segmented.labels, &named.source, segmented.facts.origin, &path)
    }

    fn load(_: serde_json::Value, _: &Work<'_>) -> Result<(), Error> {
        Ok(())
    }
}
