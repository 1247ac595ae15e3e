//! The patient's own doses, structures and segmentations, held against the CT before the long work is done.

use super::{Import, Source};
use crate::graph::{Node, Outs};
use crate::ground::Ground;
use crate::inputs::InputFile;
use crate::shared::CarriedKind;
use crate::shared::carry::CarryContext;
use crate::work::Work;
use crate::{Error, NodeId};
use serde::Serialize;

pub(crate) struct Objects;

#[derive(Serialize)]
pub(crate) struct Own {
    objects: Vec<(CarriedKind, InputFile)>,
}

/// The objects that a case names, with what they hold.
pub(crate) fn named(ground: &Ground) -> Result<Vec<(CarriedKind, InputFile)>, Error> {
    let one = |file: &crate::shared::CarriedFile| {
        Ok((file.kind, ground.file(file.kind.key(), &file.path)?))
    };
    ground.case.carried.iter().map(one).collect()
}

impl Node for Objects {
    const ID: NodeId = NodeId::Objects;
    const METHOD: u32 = 1;
    const KEPT: bool = true;
    type Own = Own;
    type Parents = (Import, Source);
    type Out = ();

    fn own(ground: &Ground) -> Result<Own, Error> {
        Ok(Own { objects: named(ground)? })
    }

    fn not_asked(own: &Own) -> Option<()> {
        own.objects.is_empty().then_some(())
    }

    fn run(own: &Own, (input, export_source): Outs<Self>, _: &Work<'_>) -> Result<(), Error> {
        let (Some(source), Some(named)) = (&input.source, export_source.as_ref()) else {
            return Err(Error::NoSeries);
        };
        let context = CarryContext::ahead(source, named);
        for (kind, file) in &own.objects {
            match kind {
                CarriedKind::Dose => context.dose(&file.path).map(drop),
                CarriedKind::Structures => context.structures(&file.path).map(drop),
                CarriedKind::Segmentation => {
                    context.segmentation(&file.path, input.ct.grid()).map(drop)
                }
            }?;
        }
        Ok(())
    }

    fn load(_: serde_json::Value, _: &Work<'_>) -> Result<(), Error> {
        Ok(())
    }
}
