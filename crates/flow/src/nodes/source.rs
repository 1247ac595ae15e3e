//! What exports may say of the CT's series: with the patient, or without her.

use super::Import;
use crate::graph::{Node, Outs};
use crate::ground::Ground;
use crate::shared::ExportSource;
use crate::work::Work;
use crate::{Error, NodeId};
use serde::{Serialize, Serializer};
use supine_dicom::Anonymiser;

pub(crate) struct Source;

/// What takes the patient out; only its hash is ever written.
#[derive(Serialize)]
pub(crate) struct Own {
    #[serde(serialize_with = "hashed")]
    secret: Option<[u8; 32]>,
}

fn hashed<S: Serializer>(secret: &Option<[u8; 32]>, to: S) -> Result<S::Ok, S::Error> {
    secret.map(|key| blake3::hash(&key).to_string()).serialize(to)
}

impl Node for Source {
    const ID: NodeId = NodeId::Source;
    const METHOD: u32 = 1;
    const KEPT: bool = false;
    type Own = Own;
    type Parents = (Import,);
    /// None when the CT did not come as DICOM.
    type Out = Option<ExportSource>;

    fn own(ground: &Ground) -> Result<Own, Error> {
        Ok(Own { secret: ground.secret.filter(|_| ground.case.export.anonymise) })
    }

    fn run(own: &Own, (input,): Outs<Self>, _: &Work<'_>) -> Result<Self::Out, Error> {
        Ok(input.source.as_ref().map(|source| match own.secret {
            Some(key) => ExportSource::anonymised(source, Anonymiser::new(key)),
            None => ExportSource::named(source),
        }))
    }
}
