//! What the page is told: one object, whole, after each change.

use crate::draw::planes::ViewShown;
use crate::draw::voxels::VolumeShown;
use crate::roots::Named;
use crate::show::FigureShown;
use crate::unsaved::UnsavedShown;
use serde::Serialize;
use supine_flow::{Case, CaseError, NodeId, PatientIdentity, SphereRecord};

/// All that the page shows, but the voxels.
#[derive(Clone, Debug, Serialize, Default)]
pub(crate) struct State {
    /// Counts the changes of the case.
    pub(crate) revision: u64,
    pub(crate) version: &'static str,
    pub(crate) case: Option<CaseShown>,
    /// Whose CT is open.
    pub(crate) patient: Option<PatientIdentity>,
    pub(crate) phase: Phase,
    pub(crate) problem: Option<Problem>,
    pub(crate) volumes: Vec<VolumeShown>,
    pub(crate) views: Vec<ViewShown>,
    pub(crate) surfaces: Vec<SurfaceShown>,
    /// Volumes whose planes have lines between the voxels.
    pub(crate) lines: Vec<LinesShown>,
    pub(crate) live: LiveShown,
    pub(crate) preview_bed: PreviewShown,
    pub(crate) preview_applicator: PreviewShown,
    pub(crate) stages: Vec<StageShown>,
    pub(crate) job: Option<Job>,
    pub(crate) warnings: Vec<WarningShown>,
    pub(crate) patches: Vec<PatchShown>,
    /// Whether they are of what was given before.
    pub(crate) patches_old: bool,
    pub(crate) inspection: Option<InspectionShown>,
    /// Cases that were changed here before and are in no file.
    pub(crate) unsaved: Vec<UnsavedShown>,
    /// What was kept of others and went at this start, since it was too old or too much.
    pub(crate) unsaved_gone: usize,
    /// How far the tumour moves; nothing that is of what was given before.
    pub(crate) tumour: Option<TumourShown>,
    /// The patient's own structures and doses, where the case names some.
    pub(crate) own: Option<OwnShown>,
    /// Objects that lie in the CT's folder, or that the case names.
    pub(crate) beside: Vec<BesideShown>,
    /// What a run left in a folder.
    pub(crate) result: Option<ResultShown>,
    /// Mesh, mechanics and map in a few figures.
    pub(crate) figures: Vec<FigureShown>,
    /// Archives that were named at the start.
    pub(crate) nodes: Vec<NodeShown>,
    pub(crate) sent: Option<SentShown>,
    /// The command line that does the same.
    pub(crate) command: String,
}

/// How far the opening is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Phase {
    #[default]
    Empty,
    Reading,
    Ready,
}

/// The case that is open.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct CaseShown {
    pub(crate) name: String,
    /// Whether a file holds what is shown.
    pub(crate) saved: bool,
    /// Whether its changes, which no file holds, are kept for the next start.
    pub(crate) kept: bool,
    /// Why what another program wrote into its file could not be taken over: what is shown is of
    /// the case before.
    pub(crate) astray: Option<String>,
    /// Whether a change can be taken back, and made again.
    pub(crate) can_undo: bool,
    pub(crate) can_redo: bool,
    /// Values by key, as they are given or by default.
    pub(crate) values: serde_json::Map<String, serde_json::Value>,
    pub(crate) tumour: Option<SphereRecord>,
    pub(crate) region: Option<SphereRecord>,
    /// Whether the side was proposed from the tumour's place, and nobody has set it since.
    pub(crate) side_proposed: bool,
}

/// What went wrong last.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Problem {
    pub(crate) message: String,
    pub(crate) advice: Option<String>,
}

/// A surface whose bytes the page may fetch.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct SurfaceShown {
    pub(crate) part: &'static str,
    pub(crate) key: String,
    /// `ct`, `deformed` or `both`.
    pub(crate) shape: &'static str,
    /// `triangles` or `arrows`.
    pub(crate) kind: &'static str,
}

/// A volume whose planes have lines.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct LinesShown {
    pub(crate) volume: &'static str,
    pub(crate) key: String,
}

/// What goes on beside the work that was asked for.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct LiveShown {
    /// `none`, `preparing` or `ready`: whether labels can follow a brush.
    pub(crate) segmenter: Readiness,
    pub(crate) share: Option<f64>,
    /// Labels are being made anew.
    pub(crate) following: bool,
    /// Labels, or what is known of their border, are being made anew.
    pub(crate) busy: bool,
    pub(crate) problem: Option<Problem>,
}

/// The live picture of the table.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct PreviewShown {
    pub(crate) state: Readiness,
    pub(crate) share: Option<f64>,
    pub(crate) message: Option<String>,
    pub(crate) tetrahedra: Option<usize>,
    /// How far off the tumour is from where the planning mesh has it, mm.
    pub(crate) final_mm: Option<f64>,
}

/// Whether something is ready.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Readiness {
    #[default]
    None,
    Preparing,
    Ready,
    Failed,
}

/// A stage of the flow.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct StageShown {
    pub(crate) name: &'static str,
    /// `none`, `running`, `done`, `stale` or `failed`.
    pub(crate) state: &'static str,
    pub(crate) share: Option<f64>,
    pub(crate) seconds: Option<f64>,
    pub(crate) found: Option<String>,
}

/// What is worked on.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Job {
    pub(crate) what: String,
    pub(crate) share: f64,
    pub(crate) can_cancel: bool,
}

/// How far the tumour moves, mm, never without how sure that is.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct TumourShown {
    pub(crate) distance_mm: f64,
    /// Interval of that distance, and how far off its place may be; nothing where they could not be
    /// found.
    pub(crate) length_mm: Option<[f64; 2]>,
    pub(crate) within_mm: Option<f64>,
    /// Why no verdict on it can be green, if so.
    pub(crate) reason: Option<String>,
    /// Probability of both.
    pub(crate) level: Option<f64>,
}

/// The patient's own structures and doses.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct OwnShown {
    /// Whether what was carried is of what is given now.
    pub(crate) fresh: bool,
    pub(crate) structures: Vec<OwnStructureShown>,
    pub(crate) doses: Vec<OwnDoseShown>,
    pub(crate) histograms: Vec<HistogramShown>,
    /// What the user must know.
    pub(crate) notes: Vec<String>,
}

/// A region.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct OwnStructureShown {
    pub(crate) name: String,
    pub(crate) file: String,
    /// Its colour in its file, `#rrggbb`.
    pub(crate) colour: Option<String>,
    /// Before and after; nothing before it was carried.
    pub(crate) volume_ml: Option<[f64; 2]>,
}

/// A dose.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct OwnDoseShown {
    pub(crate) file: String,
    /// Before and after.
    pub(crate) max_gy: [Option<f64>; 2],
    /// Isodoses that are drawn, the highest first.
    pub(crate) levels_gy: Vec<f64>,
}

/// An object beside the CT.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct BesideShown {
    pub(crate) id: String,
    /// `structures`, `dose` or `segmentation`.
    pub(crate) kind: &'static str,
    pub(crate) name: String,
    /// Whether the case carries it along.
    pub(crate) on: bool,
    /// Regions that can be the tumour.
    pub(crate) regions: Vec<String>,
}

/// What a run left.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct ResultShown {
    /// The folder's name.
    pub(crate) name: String,
    /// Whether it is of the case before a change.
    pub(crate) old: bool,
    /// Whether warnings were ticked since: its report does not tell that.
    pub(crate) lacks_ticks: bool,
    /// `green`, `amber` or `red`.
    pub(crate) verdict: supine_flow::commands::Colour,
    /// What stands first in the report.
    pub(crate) headline: String,
    pub(crate) reasons: Vec<String>,
    /// Files and folders, relative to it.
    pub(crate) outputs: Vec<String>,
    /// What the check of the written files found.
    pub(crate) verified: Option<VerifiedShown>,
    /// What the user types before any of it is sent, where it is not green.
    pub(crate) confirm: Option<String>,
}

/// What the check of the written files found.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct VerifiedShown {
    pub(crate) ok: bool,
    pub(crate) text: String,
}

/// An archive.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct NodeShown {
    pub(crate) id: String,
    pub(crate) name: String,
    /// `AET@HOST:PORT`.
    pub(crate) address: String,
}

/// What became of what was sent.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct SentShown {
    pub(crate) to: String,
    pub(crate) text: String,
    pub(crate) ok: bool,
}

/// What the user must know.
#[derive(Clone, Debug, Serialize, PartialEq)]
pub(crate) struct WarningShown {
    /// By what the case knows it.
    pub(crate) id: String,
    pub(crate) ticked: bool,
    /// Whether its stage was made of what was given before.
    pub(crate) old: bool,
    /// LPS, mm in the CT, where there is one place.
    pub(crate) place_mm: Option<[f64; 3]>,
    pub(crate) stage: String,
    pub(crate) code: String,
    pub(crate) message: String,
}

/// An uncertain place of the chest wall.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct PatchShown {
    pub(crate) centre_mm: [f64; 3],
    pub(crate) area_cm2: f64,
    pub(crate) error_mm: f64,
    pub(crate) name: String,
}

/// What a folder of DICOM holds.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct InspectionShown {
    pub(crate) dir: String,
    pub(crate) name: String,
    pub(crate) series: Vec<SeriesShown>,
    /// Structure sets, doses and segmentations.
    pub(crate) objects: Vec<ObjectShown>,
}

/// An object that is no CT.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct ObjectShown {
    pub(crate) kind: &'static str,
    pub(crate) name: String,
}

/// A series of it.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct SeriesShown {
    pub(crate) id: String,
    /// The patient's name.
    pub(crate) patient: String,
    /// Her ID, date of birth and study, in one line.
    pub(crate) known: String,
    pub(crate) description: String,
    pub(crate) modality: &'static str,
    pub(crate) size: Option<[usize; 3]>,
    pub(crate) spacing_mm: Option<[f64; 3]>,
    pub(crate) files: usize,
    pub(crate) usable: bool,
    pub(crate) problems: Vec<String>,
    /// Whether there is one.
    pub(crate) picture: bool,
}

/// The dose in a structure.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct HistogramShown {
    #[serde(flatten)]
    of: supine_flow::DoseVolumeHistogram,
    /// The share beyond the grid of the dose, where it is too much for a dose to be told.
    outside: Option<f64>,
}

impl HistogramShown {
    pub(crate) fn of(of: &supine_flow::DoseVolumeHistogram) -> Self {
        Self { of: of.clone(), outside: of.outside() }
    }
}

impl Problem {
    /// An error in words for people.
    pub(crate) fn of(error: &crate::Error) -> Self {
        Self { message: error.to_string(), advice: advice(error).map(Into::into) }
    }
}

/// Where in the page that is given which is missing.
fn advice(error: &crate::Error) -> Option<&'static str> {
    let crate::Error::Flow(supine_flow::Error::Case(CaseError::Missing { key, .. })) = error else {
        return None;
    };
    match key.split('.').next() {
        Some("breast") => Some("Choose left or right in step 2, Mark."),
        Some("tumour") => Some("Place it in step 2, Mark."),
        Some("bed") => Some("Give both angles in step 4, Bed."),
        _ => None,
    }
}

/// Stages that a planner knows, in their order.
const STAGES: [NodeId; 10] = [
    NodeId::Import,
    NodeId::Segment,
    NodeId::Region,
    NodeId::Mesh,
    NodeId::Solve,
    NodeId::Interval,
    NodeId::Warp,
    NodeId::Export,
    NodeId::Pictures,
    NodeId::Report,
];

/// The stages of a case, none done yet: those that only some cases have where this one has them.
pub(crate) fn stages(case: &Case) -> Vec<StageShown> {
    let some = [
        (NodeId::Tissues, case.tissues || case.stiffness.is_some()),
        (NodeId::Fit, case.fit_scans().is_some()),
        (NodeId::Evaluation, case.scans.as_ref().is_some_and(|scans| scans.intraop.is_some())),
        (NodeId::MovedObjects, !case.carried.is_empty()),
        (NodeId::Carry, !case.carried.is_empty()),
    ];
    let shown = |node: &NodeId| {
        STAGES.contains(node) || some.iter().any(|(known, has)| known == node && *has)
    };
    let stage = |node: NodeId| StageShown {
        name: node.name(),
        state: "none",
        share: None,
        seconds: None,
        found: None,
    };
    NodeId::ALL.into_iter().filter(shown).map(stage).collect()
}

impl InspectionShown {
    /// Of a folder's report; `id` names each series.
    pub(crate) fn of(
        dir: Named,
        found: &supine_flow::commands::dicom::Inspection,
        id: impl Fn(usize) -> String,
    ) -> Self {
        let series = found.series.iter().enumerate().map(|(n, series)| SeriesShown {
            id: id(n),
            patient: series.whose.name.clone(),
            known: series.whose.beside_name(),
            description: series.description.clone(),
            modality: "CT",
            size: series.grid.as_ref().map(|grid| grid.size),
            spacing_mm: series.grid.as_ref().map(|grid| grid.spacing),
            files: series.slices,
            usable: series.usable,
            problems: series
                .reason
                .iter()
                .cloned()
                .chain(series.warnings.iter().map(ToString::to_string))
                .collect(),
            picture: series.usable,
        });
        let object = |object: &supine_flow::commands::dicom::PlanObject| ObjectShown {
            kind: object.kind.name(),
            name: crate::names::name_of(&object.path),
        };
        let objects = found.objects.iter().map(object).collect();
        Self { dir: dir.id, name: dir.name, series: series.collect(), objects }
    }
}
