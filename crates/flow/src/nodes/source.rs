//! What exports may say of the CT's series: with the patient, or without her.

use super::Import;
use crate::case_state::CaseState;
use crate::graph::{Node, Outs};
use crate::shared::ExportSource;
use crate::work::Work;
use crate::{Error, NodeId};
use serde::{Serialize, Serializer};
use supine_dicom::Anonymiser;
use supine_space::Warning;

pub(crate) struct Source;

/// What no de-identification of headers takes away.
const BURNED_IN: &str = "the CT says of itself that text stands in its pixels (Burned In Annotation is YES), which may name \
    the patient: de-identification changes no pixels; look at the exported slices before they leave";

/// What takes the patient out; only its hash is ever written.
#[derive(Serialize)]
pub(crate) struct NodeInputs {
    #[serde(serialize_with = "hashed")]
    secret: Option<[u8; 32]>,
    /// Whether she has to be out.
    anonymise: bool,
}

fn hashed<S: Serializer>(secret: &Option<[u8; 32]>, to: S) -> Result<S::Ok, S::Error> {
    secret.map(|key| blake3::hash(&key).to_string()).serialize(to)
}

impl Node for Source {
    const ID: NodeId = NodeId::Source;
    const METHOD: u32 = 2;
    const KEPT: bool = false;
    type NodeInputs = NodeInputs;
    type Parents = (Import,);
    /// None when the CT did not come as DICOM.
    type Out = Option<ExportSource>;

    fn inputs(case_state: &CaseState) -> Result<NodeInputs, Error> {
        let anonymise = case_state.case.export.anonymise;
        Ok(NodeInputs { secret: case_state.secret.filter(|_| anonymise), anonymise })
    }

    fn run(inputs: &NodeInputs, (input,): Outs<Self>, work: &Work<'_>) -> Result<Self::Out, Error> {
        let marked = input.source.as_ref().is_some_and(supine_dicom::Source::has_burned_in_text);
        if inputs.anonymise && marked {
            work.warn(Warning::new("burned-in-text", BURNED_IN));
        }
        Ok(input.source.as_ref().map(|source| match inputs.secret {
            Some(key) => ExportSource::anonymised(source, Anonymiser::new(key)),
            None => ExportSource::named(source),
        }))
    }
}
