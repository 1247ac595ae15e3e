//! What the page is told: one object, whole, after each change.

use crate::roots::Named;
use crate::show::FigureShown;
use crate::unsaved::UnsavedShown;
use serde::Serialize;
use supine_flow::{Case, CaseError, NodeId, PatientIdentity, SphereRecord};
use supine_space::{Grid, View};

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

/// A volume whose bytes the page may fetch.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct VolumeShown {
    pub(crate) id: &'static str,
    pub(crate) key: String,
    #[serde(rename = "type")]
    pub(crate) voxel: &'static str,
    pub(crate) size: [usize; 3],
    pub(crate) spacing_mm: [f64; 3],
    pub(crate) origin_mm: [f64; 3],
    /// Unit vectors of the grid's axes, LPS.
    pub(crate) axes: [[f64; 3]; 3],
    /// Whether it is no acquired CT.
    pub(crate) simulated: bool,
    /// First and last voxel of the patient along each axis, where that was looked for.
    pub(crate) body: Option<[[usize; 3]; 2]>,
    /// Whether it is of what is given now.
    pub(crate) fresh: bool,
    pub(crate) names: serde_json::Map<String, serde_json::Value>,
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

/// How the grid's own planes are shown in a view.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct ViewShown {
    name: &'static str,
    /// The grid's axis at right angles to the planes.
    normal: usize,
    right: AxisShown,
    down: AxisShown,
    /// At the left, right, upper and lower edge.
    letters: [&'static str; 4],
}

/// An axis of the grid along one side of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct AxisShown {
    axis: usize,
    /// Whether the index falls along it.
    flip: bool,
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
        Some("table") => Some("Give both angles in step 4, Table."),
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

impl ViewShown {
    /// Whether it has a name.
    pub(crate) fn is(&self, name: &str) -> bool {
        self.name == name
    }

    /// The grid's axis at right angles to its planes.
    pub(crate) fn normal(&self) -> usize {
        self.normal
    }

    /// The grid's axes along its right and down sides.
    pub(crate) fn sides(&self) -> [usize; 2] {
        [self.right.axis, self.down.axis]
    }
}

impl VolumeShown {
    /// A volume on a grid.
    pub(crate) fn on(grid: &Grid, id: &'static str, voxel: &'static str, key: String) -> Self {
        let axis = |a: usize| -> [f64; 3] { grid.direction().column(a).into_owned().into() };
        Self {
            id,
            key,
            voxel,
            size: grid.size(),
            spacing_mm: grid.spacing().into(),
            origin_mm: grid.origin().coords.into(),
            axes: [axis(0), axis(1), axis(2)],
            simulated: false,
            body: None,
            fresh: true,
            names: serde_json::Map::new(),
        }
    }
}

/// The views of a grid's own planes. Each direction of a picture is that axis of the grid that
/// comes nearest to it; no two directions share one.
pub(crate) fn views(grid: &Grid) -> Vec<ViewShown> {
    let order = nearest_axes(grid);
    let along = |direction: [f64; 3]| {
        let lps = (0..3).find(|a| direction[*a] != 0.0).unwrap_or(0);
        let axis = order[lps];
        let same = grid.direction()[(lps, axis)] * direction[lps] > 0.0;
        AxisShown { axis, flip: !same }
    };
    let shown = |view: View| ViewShown {
        name: view.name(),
        normal: order[view.axis()],
        right: along(view.right().into()),
        down: along(view.down().into()),
        letters: view.letters(),
    };
    View::ALL.map(shown).into()
}

/// Which axis of the grid runs nearest along x, y and z of LPS: of the six ways to pair them the
/// one with the largest sum of cosines.
fn nearest_axes(grid: &Grid) -> [usize; 3] {
    let ways = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let fit =
        |way: &[usize; 3]| (0..3).map(|lps| grid.direction()[(lps, way[lps])].abs()).sum::<f64>();
    let best = ways.into_iter().max_by(|a, b| fit(a).total_cmp(&fit(b)));
    best.unwrap_or([0, 1, 2])
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
            name: crate::roots::name_of(&object.path),
        };
        let objects = found.objects.iter().map(object).collect();
        Self { dir: dir.id, name: dir.name, series: series.collect(), objects }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Matrix, Point, Vector};

    fn grid(columns: [[f64; 3]; 3]) -> Grid {
        let direction = Matrix::from_columns(&columns.map(Vector::from));
        Grid::new([4, 5, 6], Vector::new(1.0, 1.0, 2.0), Point::origin(), direction).unwrap()
    }

    /// Where a picture's upper left, upper right and lower left corners lie, LPS.
    fn corners(grid: &Grid, view: &ViewShown) -> [Point; 3] {
        let at = |right: bool, down: bool| {
            let mut voxel = [0; 3];
            for (side, far) in [(view.right, right), (view.down, down)] {
                voxel[side.axis] = if side.flip == far { 0 } else { grid.size()[side.axis] - 1 };
            }
            grid.centre(voxel)
        };
        [at(false, false), at(true, false), at(false, true)]
    }

    #[test]
    fn pictures_lie_as_their_letters_say_on_grids_of_all_kinds() {
        let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
        let not = |v: [f64; 3]| v.map(|c: f64| -c);
        let tilted = [[0.995, 0.0998, 0.0], [-0.0998, 0.995, 0.0], z];
        // Axial, flipped rows, feet first, coronal, sagittal, slightly turned.
        for axes in [
            [x, y, z],
            [not(x), not(y), z],
            [not(x), y, not(z)],
            [x, not(z), y],
            [y, not(z), x],
            tilted,
        ] {
            let grid = grid(axes);
            for (shown, view) in views(&grid).iter().zip(View::ALL) {
                let [corner, right, down] = corners(&grid, shown);
                assert!((right - corner).dot(&view.right()) > 0.0, "{axes:?} {shown:?}");
                assert!((down - corner).dot(&view.down()) > 0.0, "{axes:?} {shown:?}");
                let used = [shown.normal, shown.right.axis, shown.down.axis];
                assert_eq!(used.iter().sum::<usize>(), 3, "{used:?}");
            }
        }
    }
}
