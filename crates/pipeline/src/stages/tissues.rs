//! The finer tissues, when the case asks for them. Mesh, mechanics and CT know nothing of them.

use super::import::Imported;
use super::region::Chosen;
use super::segment::{Facts as SegmentFacts, IMPLANTS};
use crate::bench::{Bench, Done, Made};
use crate::store::Store;
use crate::{Case, RunError, Stage};
use supine_exchange::{read_labels, write_labels};
use supine_report::{TissueVolume, Tissues};
use supine_segment::{TissueInfo, TissueShare};
use supine_space::Progress;
use supine_volume::{LabelMap, label};

/// The finer labels and what they hold; none when the case does not ask.
pub(crate) type Labelled = Done<Option<LabelMap>, Option<Tissues>>;

const LABELS: &str = "tissues.seg.nrrd";

pub(crate) fn tissues(
    bench: &mut Bench<'_>,
    case: &Case,
    input: &Imported,
    labels: &Done<LabelMap, SegmentFacts>,
    region: &Chosen,
) -> Result<Labelled, RunError> {
    if !case.tissues {
        return bench.stage(
            Stage::Tissues,
            &["none"],
            |_, _| Ok(None),
            |_, _| Ok(Made { product: None, facts: None, warnings: vec![] }),
        );
    }
    let decided = format!("{:?} {:?}", case.tumour, region.sphere);
    bench.stage(
        Stage::Tissues,
        &[&labels.key, &decided],
        |store, progress| {
            read_labels(&store.path(LABELS)?, progress).map(Some).map_err(RunError::product)
        },
        |store, progress| {
            let ct = &input.input.ct;
            let implants = implants(store, progress.part(0.0, 0.05))?;
            let (coarse, tumour) = (&labels.product, Some(case.tumour));
            let part = progress.part(0.05, 0.85);
            let made = supine_segment::tissues(ct, coarse, implants.as_ref(), tumour, part)?;
            let (fine, info) = made;
            write_labels(&fine, &store.path(LABELS)?, progress.part(0.85, 1.0))
                .map_err(RunError::product)?;
            let here = supine_segment::tissue_shares(ct, &fine, region.sphere);
            let facts = Some(facts(&info, &here));
            Ok(Made { product: Some(fine), facts, warnings: info.warnings })
        },
    )
}

/// The implants that the segmentation found.
fn implants(store: &Store, progress: Progress<'_>) -> Result<Option<LabelMap>, RunError> {
    let path = store.path(IMPLANTS)?;
    path.exists().then(|| read_labels(&path, progress).map_err(RunError::product)).transpose()
}

fn facts(info: &TissueInfo, here: &[TissueShare]) -> Tissues {
    let ml = |label: u8| here.iter().find(|s| s.label == label).map_or(0.0, |s| s.ml);
    let (gland, fat) = (ml(label::GLAND), ml(label::FAT));
    let name = |l: u8| label::ALL.iter().find(|(n, ..)| *n == l).map_or("", |(_, name, _)| *name);
    let volumes = here.iter().zip(&info.shares).map(|(here, whole)| TissueVolume {
        name: name(here.label).into(),
        region_ml: here.ml,
        mean_hu: (here.ml > 0.0).then_some(here.mean_hu),
        whole_ct_ml: whole.ml,
    });
    Tissues {
        fat_hu: info.fat_hu,
        gland_hu: info.gland_hu,
        tumour_grown: info.tumour_grown,
        density_percent: (gland + fat > 0.0).then(|| 100.0 * gland / (gland + fat)),
        volumes: volumes.collect(),
    }
}
