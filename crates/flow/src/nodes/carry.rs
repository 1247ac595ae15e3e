//! The patient's own doses, structures and segmentations, beside the exported series they then
//! belong to.

use super::{Export, Import, MovedObjects, Objects, Registration};
use crate::case_state::CaseState;
use crate::graph::{Node, Outs};
use crate::inputs::InputFile;
use crate::nodes::objects::named;
use crate::shared::CarriedKind;
use crate::shared::carry::{CarryContext, ExportedFiles, file_names};
use crate::work::Work;
use crate::{Error, NodeId};
use serde::{Deserialize, Serialize};
use supine_report::{CarriedObject, DoseVolumeHistogram, Input};

pub(crate) struct Carry;

#[derive(Serialize)]
pub(crate) struct NodeInputs {
    objects: Vec<(CarriedKind, InputFile)>,
    /// Only that there is one decides; whose it is, the exported series says.
    #[serde(skip)]
    secret: Option<[u8; 32]>,
}

/// What was carried, in the order of the case.
#[derive(Serialize, Deserialize, Clone, Debug, Default)]
pub(crate) struct Carried {
    pub(crate) objects: Vec<CarriedObject>,
    pub(crate) inputs: Vec<Input>,
    pub(crate) histograms: Vec<DoseVolumeHistogram>,
}

impl Node for Carry {
    const ID: NodeId = NodeId::Carry;
    const METHOD: u32 = 11;
    const KEPT: bool = true;
    const WRITES: bool = true;
    type NodeInputs = NodeInputs;
    type Parents = (Import, Objects, MovedObjects, Export, Registration);
    type Out = Carried;

    fn inputs(case_state: &CaseState) -> Result<NodeInputs, Error> {
        let secret = case_state.secret.filter(|_| case_state.case.export.anonymise);
        Ok(NodeInputs { objects: named(case_state)?, secret })
    }

    fn not_asked(inputs: &NodeInputs) -> Option<Carried> {
        inputs.objects.is_empty().then(Carried::default)
    }

    fn run(
        inputs: &NodeInputs,
        (input, given, moved, exported, registered): Outs<Self>,
        work: &Work<'_>,
    ) -> Result<Carried, Error> {
        let (series, registration) = (exported.series.clone(), registered.deformable.clone());
        // What lies in the run's folder is judged by its verdict, which is not known yet.
        let files =
            ExportedFiles { series, registration, secret: inputs.secret, not_usable: false };
        let progress = work.progress;
        let context = CarryContext::of(&files, input.source.as_ref(), progress.part(0.0, 0.5))?;
        let shown = work.shelf.map_or("", |shelf| shelf.name("objects"));
        let mut carried = Carried::default();
        work.fill("objects", |folder| {
            for (n, (object, name)) in given.iter().zip(file_names(&given)).enumerate() {
                progress.at(0.5 + 0.5 * n as f64 / given.len() as f64)?;
                let (out, file) = (folder.join(&name), format!("{shown}/{name}"));
                // The structure set of the run itself is the first of its kind.
                let before = given[..=n].iter().filter(|one| one.kind == object.kind).count();
                let place = (&context, before);
                let (told, written) = object.write(&moved.objects[n], place, (&out, &file))?;
                let warnings = object.warnings.iter().cloned().chain(written);
                work.warn_all(warnings.map(|w| w.of(format!("{}: ", told.file))));
                carried.objects.push(told);
            }
            Ok(())
        })?;
        carried.inputs = inputs.objects.iter().map(|(kind, file)| file.told(kind.name())).collect();
        work.warn_all(moved.warnings.iter().cloned());
        carried.histograms = moved.histograms.clone();
        for of in &mut carried.histograms {
            (of.dose, of.structures) =
                (format!("{shown}/{}", of.dose), format!("{shown}/{}", of.structures));
        }
        Ok(carried)
    }

    fn facts(out: &Carried) -> Result<serde_json::Value, Error> {
        Ok(serde_json::to_value(out)?)
    }

    fn load(facts: serde_json::Value, _: &Work<'_>) -> Result<Carried, Error> {
        Ok(serde_json::from_value(facts)?)
    }
}
