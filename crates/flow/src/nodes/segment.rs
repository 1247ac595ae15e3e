//! Labels of chest wall and soft tissue: found, or supplied.

use super::{Import, Imported, Prepare, Prepared};
use crate::case_state::CaseState;
use crate::graph::{Node, Outs};
use crate::inputs::InputFile;
use crate::lazy::Lazy;
use crate::shared::{
    LabelOrigin, RegionNames, SuppliedLabels, read_supplied, read_surfaces, write_surfaces,
};
use crate::spec::stroke_json;
use crate::work::Work;
use crate::{Error, NodeId};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use supine_exchange::{
    is_points_name, read_labels, read_seeds, read_tenths, write_labels, write_tenths,
};
use supine_report::{Input, QualityCheck};
use supine_space::{Grid, Point, Progress};
use supine_volume::{LabelMap, SeedKind, Seeds, Stroke, Surfaces, Volume};

pub(crate) struct Segment;

#[derive(Serialize)]
pub(crate) struct NodeInputs {
    supplied: Option<(InputFile, RegionNames)>,
    seed_files: Vec<InputFile>,
    /// What the places are, and where, LPS, mm.
    seed_points: Vec<(&'static str, [f64; 3])>,
    #[serde(serialize_with = "as_written")]
    seed_strokes: Vec<Stroke>,
}

/// Labels and what is known beside them.
#[derive(Debug)]
pub(crate) struct Segmented {
    pub(crate) labels: Arc<LabelMap>,
    /// Skin and chest wall as every picture draws them.
    drawn: Lazy<Surfaces>,
    /// Whether those are known between the voxels; of supplied labels they lie half way.
    is_between: bool,
    /// How far the boundary of the chest wall may be wrong, tenths of mm; none of supplied labels.
    uncertainty: Option<Lazy<Volume<u8>>>,
    /// The implants that were found, if any.
    pub(crate) implants: Option<Lazy<LabelMap>>,
    pub(crate) facts: Facts,
}

impl Segmented {
    /// Labels that are given in place of being made, with what is known of them between the voxels.
    pub(crate) fn given(labels: Arc<LabelMap>, surfaces: Option<Lazy<Surfaces>>) -> Self {
        let facts = Facts {
            origin: LabelOrigin::Supplied,
            fat_hu: None,
            muscle_hu: None,
            checks: vec![],
            inputs: vec![],
        };
        let (drawn, is_between) = drawn(&labels, surfaces);
        Self { labels, drawn, is_between, uncertainty: None, implants: None, facts }
    }

    /// Skin and chest wall as every picture draws them: between the voxels where that is known,
    /// else half way between these.
    ///
    /// # Errors
    /// When they cannot be made or read, or the callback asked to stop.
    pub(crate) fn drawn(&self, progress: Progress<'_>) -> Result<Arc<Surfaces>, Error> {
        self.drawn.get(progress)
    }

    /// The same if they are in memory.
    pub(crate) fn peek_drawn(&self) -> Option<Arc<Surfaces>> {
        self.drawn.peek().cloned()
    }

    /// Skin and chest wall between the voxels; none of supplied labels.
    ///
    /// # Errors
    /// As [`Self::drawn`].
    pub(crate) fn surfaces(&self, progress: Progress<'_>) -> Result<Option<Arc<Surfaces>>, Error> {
        self.is_between.then(|| self.drawn(progress)).transpose()
    }

    /// The same if it is in memory.
    pub(crate) fn peek_uncertainty(&self) -> Option<Arc<Volume<u8>>> {
        self.uncertainty.as_ref()?.peek().cloned()
    }

    /// How far the boundary of the chest wall may be wrong, tenths of mm; none of supplied labels.
    ///
    /// # Errors
    /// When it cannot be read, or the callback asked to stop.
    pub(crate) fn uncertainty(
        &self,
        progress: Progress<'_>,
    ) -> Result<Option<Arc<Volume<u8>>>, Error> {
        self.uncertainty.as_ref().map(|map| map.get(progress)).transpose()
    }
}

/// What is drawn of labels, and whether it is known between the voxels.
fn drawn(labels: &Arc<LabelMap>, between: Option<Lazy<Surfaces>>) -> (Lazy<Surfaces>, bool) {
    let (labels, is_between) = (Arc::clone(labels), between.is_some());
    let half_way = move || Lazy::made(move |_| Ok(Surfaces::half_way(&labels)));
    (between.unwrap_or_else(half_way), is_between)
}

/// What is known of the segmentation beside the labels.
#[derive(Serialize, Deserialize, Debug, Clone)]
pub(crate) struct Facts {
    pub(crate) origin: LabelOrigin,
    pub(crate) fat_hu: Option<f64>,
    pub(crate) muscle_hu: Option<f64>,
    /// What the whole CT was judged by; nothing when labels were supplied.
    pub(crate) checks: Vec<QualityCheck>,
    /// Files of the case that went in: labels or seeds.
    pub(crate) inputs: Vec<Input>,
}

impl Node for Segment {
    const ID: NodeId = NodeId::Segment;
    const METHOD: u32 = 15;
    const KEPT: bool = true;
    type NodeInputs = NodeInputs;
    type Parents = (Import, Prepare);
    type Out = Segmented;

    fn inputs(case_state: &CaseState) -> Result<NodeInputs, Error> {
        let case = &case_state.case;
        if let Some(SuppliedLabels { file, names }) = &case.labels {
            let supplied = Some((case_state.file("labels.file", file)?, names.clone()));
            return Ok(NodeInputs {
                supplied,
                seed_files: vec![],
                seed_points: vec![],
                seed_strokes: vec![],
            });
        }
        let points = case.seeds.points.iter();
        Ok(NodeInputs {
            supplied: None,
            seed_files: case_state.files("seeds.file", &case.seeds.files)?,
            seed_points: points.map(|(kind, at)| (name(*kind), at.coords.into())).collect(),
            seed_strokes: case.seeds.strokes.clone(),
        })
    }

    fn run(
        inputs: &NodeInputs,
        (input, ready): Outs<Self>,
        work: &Work<'_>,
    ) -> Result<Segmented, Error> {
        match &inputs.supplied {
            Some((file, names)) => supplied(file, names, &input, work),
            None => found(inputs, &ready, work),
        }
    }

    fn save(out: &Segmented, work: &Work<'_>) -> Result<(), Error> {
        let progress = Progress::none();
        write_labels(&out.labels, &work.place("labels")?, progress).map_err(Error::product)?;
        if let Some(surfaces) = out.surfaces(progress)? {
            write_surfaces(&surfaces, &work.place("surfaces")?, progress)?;
        }
        if let Some(uncertainty) = out.uncertainty(progress)? {
            write_tenths(&uncertainty, &work.place("uncertainty")?, progress)
                .map_err(Error::product)?;
        }
        if let Some(implants) = &out.implants {
            write_labels(&*implants.get(progress)?, &work.place("implants")?, progress)
                .map_err(Error::product)?;
        }
        Ok(())
    }

    fn facts(out: &Segmented) -> Result<serde_json::Value, Error> {
        Ok(serde_json::to_value(&out.facts)?)
    }

    fn load(facts: serde_json::Value, work: &Work<'_>) -> Result<Segmented, Error> {
        let facts: Facts = serde_json::from_value(facts)?;
        let shelf = work.shelf.ok_or(Error::NoFolder)?;
        let labels = read_labels(&shelf.path("labels"), work.progress);
        let labels = Arc::new(labels.map_err(Error::product)?);
        let there = |artifact| Some(shelf.path(artifact)).filter(|path| path.exists());
        let uncertainty = there("uncertainty").map(|path| {
            Lazy::made(move |progress| read_tenths(&path, progress).map_err(Error::product))
        });
        let surfaces = there("surfaces").map(|path| {
            let labels = Arc::clone(&labels);
            Lazy::made(move |progress| {
                let read = read_surfaces(&path, &labels, progress)?;
                read.ok_or(Error::NotKept { node: NodeId::Segment })
            })
        });
        let implants = there("implants").map(|path| {
            Lazy::made(move |progress| read_labels(&path, progress).map_err(Error::product))
        });
        let (drawn, is_between) = drawn(&labels, surfaces);
        Ok(Segmented { labels, drawn, is_between, uncertainty, implants, facts })
    }

    fn bytes(out: &Segmented) -> usize {
        let voxels = out.labels.grid().len();
        let surfaces = out.peek_drawn().map_or(0, |_| 4 * voxels);
        let uncertainty = out.uncertainty.as_ref().and_then(Lazy::peek).map_or(0, |_| voxels);
        voxels + surfaces + uncertainty
    }
}

fn name(kind: SeedKind) -> &'static str {
    match kind {
        SeedKind::ChestWall => "chest_wall",
        SeedKind::SoftTissue => "soft_tissue",
        SeedKind::Exclude => "exclude",
    }
}

fn supplied(
    file: &InputFile,
    names: &RegionNames,
    input: &Imported,
    work: &Work<'_>,
) -> Result<Segmented, Error> {
    let labels = SuppliedLabels { file: file.path.clone(), names: names.clone() };
    let source = input.source.as_ref();
    let (labels, warnings) = read_supplied(&labels, &input.ct, source, work.progress)?;
    file.check_unchanged()?;
    work.warn_all(warnings);
    let mut segmented = Segmented::given(Arc::new(labels), None);
    segmented.facts.inputs.push(file.told("labels"));
    Ok(segmented)
}

/// That the seeds of a case that are points lie in its CT. Maps are left to the run: reading them
/// takes its time.
///
/// # Errors
/// When one does not, or a list of points cannot be read.
pub(crate) fn check_seeds(case_state: &CaseState, grid: &Grid) -> Result<(), Error> {
    let mut inputs = Segment::inputs(case_state)?;
    inputs.seed_files.retain(|file| is_points_name(&file.path));
    let seeds = seeds(&inputs, Progress::none())?;
    Ok(supine_segment::check_seeds_lie_in(grid, &seeds)?)
}

/// All seeds of the case together.
fn seeds(inputs: &NodeInputs, progress: Progress<'_>) -> Result<Seeds, Error> {
    let mut seeds = Seeds { strokes: inputs.seed_strokes.clone(), ..Seeds::default() };
    for (kind, at) in &inputs.seed_points {
        let list = match *kind {
            "chest_wall" => &mut seeds.chest_wall,
            "soft_tissue" => &mut seeds.soft_tissue,
            _ => &mut seeds.exclude,
        };
        list.push(Point::from(*at));
    }
    for file in &inputs.seed_files {
        let read = read_seeds(&file.path, progress).map_err(|e| Error::file("seeds.file", e))?;
        file.check_unchanged()?;
        seeds.chest_wall.extend(read.chest_wall);
        seeds.soft_tissue.extend(read.soft_tissue);
        seeds.exclude.extend(read.exclude);
        seeds.painted.extend(read.painted);
    }
    Ok(seeds)
}

fn found(inputs: &NodeInputs, ready: &Prepared, work: &Work<'_>) -> Result<Segmented, Error> {
    let progress = work.progress;
    let segmenter = ready.segmenter.as_ref().ok_or(Error::NotKept { node: NodeId::Prepare })?;
    let seeds = seeds(inputs, progress.part(0.0, 0.1))?;
    let (made, info) = segmenter.segment(&seeds, progress.part(0.1, 0.4))?;
    work.warn_all(info.warnings);
    let automatic = inputs.seed_files.is_empty()
        && inputs.seed_points.is_empty()
        && inputs.seed_strokes.is_empty();
    let facts = Facts {
        origin: if automatic { LabelOrigin::Automatic } else { LabelOrigin::Seeded },
        fat_hu: Some(info.fat_hu),
        muscle_hu: Some(info.muscle_hu),
        checks: info.checks.clone(),
        inputs: inputs.seed_files.iter().map(|file| file.told("seeds")).collect(),
    };
    let labels = Arc::clone(&made.labels);
    let (of, what) = (Arc::clone(segmenter), made.clone());
    let surfaces = Lazy::made(move |progress| Ok(of.surfaces(&what, progress)?));
    let of = Arc::clone(segmenter);
    let uncertainty = Lazy::made(move |_| Ok(of.uncertainty(&made)));
    // What is written is made now; else when somebody looks at it: the labels follow a brush.
    if work.shelf.is_some() {
        surfaces.get(progress.part(0.4, 0.9))?;
        uncertainty.get(progress.part(0.9, 1.0))?;
    }
    Ok(Segmented {
        labels,
        drawn: surfaces,
        is_between: true,
        uncertainty: Some(uncertainty),
        implants: segmenter.implants().map(Lazy::held),
        facts,
    })
}

/// Strokes in the words of a case file.
fn as_written<S: serde::Serializer>(strokes: &[Stroke], to: S) -> Result<S::Ok, S::Error> {
    to.collect_seq(strokes.iter().map(stroke_json))
}
