//! The patient's own doses, structures and segmentations, beside the exported series they then belong to.

use super::{Export, Import, Objects, Registration, Solve};
use crate::graph::{Node, Outs};
use crate::ground::Ground;
use crate::inputs::InputFile;
use crate::nodes::objects::named;
use crate::shared::CarriedKind;
use crate::shared::carry::{CarryContext, CarryJob, ExportedFiles, Held};
use crate::work::Work;
use crate::{Error, NodeId};
use serde::{Deserialize, Serialize};
use supine_report::{CarriedObject, DoseVolumeHistogram, Input};

pub(crate) struct Carry;

#[derive(Serialize)]
pub(crate) struct Own {
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
    const METHOD: u32 = 7;
    const KEPT: bool = true;
    const WRITES: bool = true;
    type Own = Own;
    type Parents = (Import, Objects, Solve, Export, Registration);
    type Out = Carried;

    fn own(ground: &Ground) -> Result<Own, Error> {
        let secret = ground.secret.filter(|_| ground.case.export.anonymise);
        Ok(Own { objects: named(ground)?, secret })
    }

    fn not_asked(own: &Own) -> Option<Carried> {
        own.objects.is_empty().then(Carried::default)
    }

    fn run(
        own: &Own,
        (input, _, solved, exported, registered): Outs<Self>,
        work: &Work<'_>,
    ) -> Result<Carried, Error> {
        let (series, registration) = (exported.series.clone(), registered.deformable.clone());
        let files = ExportedFiles { series, registration, secret: own.secret };
        let progress = work.progress;
        let context = CarryContext::of(&files, input.source.as_ref(), progress.part(0.0, 0.1))?;
        let folder = work.place("objects")?;
        let shown = work.shelf.map_or("", |shelf| shelf.name("objects"));
        std::fs::create_dir_all(&folder)
            .map_err(|source| Error::Output { path: folder.clone(), source })?;
        let (mut carried, mut held) = (Carried::default(), Held::default());
        for (n, (kind, file)) in own.objects.iter().enumerate() {
            let share = |n: usize| 0.1 + 0.8 * n as f64 / own.objects.len() as f64;
            let same = own.objects[..=n].iter().filter(|(k, _)| k == kind).count();
            let name = format!("{}-{same}.dcm", kind.name());
            let part = progress.part(share(n), share(n + 1));
            let path = folder.join(&name);
            // The structure set of the run itself is the first of its kind.
            let (before, deformation) = (same, &solved.deformation);
            let job = CarryJob { context: &context, before, deformation };
            let (from, to) = ((*kind, file.path.as_path()), format!("{shown}/{name}"));
            let (object, warnings) = job.one(from, (&path, &to), &input.ct, &mut held, part)?;
            file.check_unchanged()?;
            work.warn_all(warnings.into_iter().map(|w| w.of(format!("{}: ", object.file))));
            carried.objects.push(object);
            carried.inputs.push(file.told(kind.name()));
        }
        let part = progress.part(0.9, 1.0);
        let (histograms, warnings) = held.histograms(input.ct.grid(), part)?;
        work.warn_all(warnings);
        carried.histograms = histograms;
        Ok(carried)
    }

    fn facts(out: &Carried) -> Result<serde_json::Value, Error> {
        Ok(serde_json::to_value(out)?)
    }

    fn load(facts: serde_json::Value, _: &Work<'_>) -> Result<Carried, Error> {
        Ok(serde_json::from_value(facts)?)
    }
}
