//! `supine mesh`: tetrahedra of the soft tissue in a sphere.

use super::{Gather, Outputs, SurfaceFrame, input, mesh_file, messages, session};
use crate::lazy::Lazy;
use crate::nodes::{Chosen, Mesh as MeshNode, Region, Segment, Segmented, beyond_region};
use crate::session::Request;
use crate::shared::{read_surfaces, statics};
use crate::spec::{Case, CaseError, Refinement, Spec};
use crate::{Error, NodeId, Observer};
use serde::{Serialize, Serializer};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use supine_exchange::{MeshFile, read_labels, read_surface, write_mesh, write_problem};
use supine_fem::Tissue;
use supine_mesh::{Displacement, Order, TetMesh, TriSurface};
use supine_report::Warning;
use supine_space::Sphere;
use supine_tetrahedralise::{Params, Solids};

/// Keys of the table that it takes; from the order on they say what moves, for `refine = "goal"`
/// alone.
pub const KEYS: &[&str] = &[
    "region.centre",
    "region.radius",
    "mesh.tetrahedra",
    "mesh.mesher",
    "mesh.piece",
    "mesh.refine",
    "tumour.centre",
    "tumour.radius",
    "mesh.tumour_edge",
    "mesh.tumour_growth",
    "mesh.order",
    "position",
    "tissue.young",
    "tissue.poisson",
    "tissue.density",
    "tissue.law",
    "tissue.stiffening",
    "tissue.fibres",
    "tissue.fibre_stiffening",
    "tissue.fibre_direction",
    "tissue.rest",
    "tissue.cut",
    "tissue.spring",
    "wall.hold",
    "wall.shear",
    "wall.radius",
    "wall.centre",
    "skin.young",
    "skin.thickness",
    "skin.stretch",
];

/// What is asked.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// Values for [`KEYS`], and the tilt of the operating table.
    pub spec: Spec,
    /// What is meshed.
    pub source: MeshSource,
    /// The file of the mesh.
    pub out: PathBuf,
    /// A folder for a page on its quality.
    pub report: Option<PathBuf>,
    /// Whether files that are there already may be replaced.
    pub overwrite: bool,
}

/// What is meshed.
#[derive(Clone, Debug)]
pub enum MeshSource {
    /// Labels.
    Labels {
        /// Their file.
        file: PathBuf,
        /// The folder of their surfaces between the voxels, as `supine segment` writes it.
        surfaces: Option<PathBuf>,
    },
    /// Closed surfaces.
    Solids {
        /// Of the body, or of its soft tissue alone.
        skin: PathBuf,
        /// Of the chest wall.
        chest_wall: PathBuf,
        /// Frame of files that do not say theirs.
        frame: SurfaceFrame,
    },
}

impl MeshSource {
    /// The files that are read.
    fn files(&self) -> impl Iterator<Item = &Path> {
        let (first, second) = match self {
            Self::Labels { file, .. } => (file, None),
            Self::Solids { skin, chest_wall, .. } => (skin, Some(chest_wall)),
        };
        std::iter::once(first).chain(second).map(PathBuf::as_path)
    }
}

/// What was made.
#[derive(Clone, Debug, Serialize)]
pub struct MeshDone {
    /// The file of the mesh.
    pub mesh: PathBuf,
    /// The folder of the page on its quality.
    pub report: Option<PathBuf>,
    /// What the mesh is like.
    #[serde(flatten, serialize_with = "without_unknowns")]
    pub facts: supine_report::Mesh,
    /// What made it, when it was not coarsened.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesher: Option<&'static str>,
    /// Whether it has a displacement, when it was coarsened.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub displacement: Option<bool>,
    /// What the user must know.
    #[serde(serialize_with = "messages")]
    pub warnings: Vec<Warning>,
}

/// Nothing is solved here.
fn without_unknowns<S: Serializer>(facts: &supine_report::Mesh, to: S) -> Result<S::Ok, S::Error> {
    let mut json = serde_json::to_value(facts).map_err(serde::ser::Error::custom)?;
    json.as_object_mut().map(|json| json.remove("unknowns"));
    json.serialize(to)
}

/// Makes tetrahedra of the soft tissue in a sphere.
///
/// # Errors
/// When an input cannot be used, the mesher fails, or a file cannot be written.
pub fn mesh(given: &Mesh, observer: &dyn Observer) -> Result<MeshDone, Error> {
    mesh_file(&given.out)?;
    Outputs::beside(given.spec.files().chain(given.source.files()))
        .file("--out", Some(&given.out))
        .folder("--report", given.report.as_deref())
        .check(given.overwrite)?;
    let session = session(&given.spec)?;
    let case = session.case();
    let missing = CaseError::Missing { key: "region.centre", what: "the sphere that is modelled" };
    let sphere = case.region.ok_or(missing)?;
    if case.mesh.refine != Refinement::Nowhere {
        beyond_region(session.case_state().tumour()?.sphere, sphere)?;
    }
    let gather = Gather::new(observer, &[NodeId::Segment, NodeId::Region]);
    let segmented = source(given, &case, sphere, &gather)?;
    session.give::<Segment>(segmented, "a file".into());
    session.give::<Region>(Chosen::given(sphere), "a sphere".into());
    let made = session.get::<MeshNode>(&Request { observer: &gather, ..Request::default() })?;
    write(&made.mesh, None, given.out.as_path(), &gather)?;
    let facts = made.facts.clone();
    let done = told(&made.mesh, facts, &gather, &given.out, given.report.as_deref())?;
    Ok(MeshDone { mesher: Some(case.mesh.mesher.name()), ..done })
}

/// Writes the page on a mesh into the folder `report`, when there is one; what is told of the mesh.
pub(super) fn told(
    mesh: &TetMesh,
    facts: supine_report::Mesh,
    gather: &Gather<'_>,
    out: &Path,
    report: Option<&Path>,
) -> Result<MeshDone, Error> {
    if let Some(folder) = report {
        let texts = gather.texts();
        gather.work(NodeId::Report, |progress| {
            Ok(supine_report::write_mesh(mesh, &facts, &texts, folder, progress)?)
        })?;
    }
    let (mesh, report) = (out.to_owned(), report.map(Path::to_owned));
    let warnings = gather.warnings();
    Ok(MeshDone { mesh, report, facts, mesher: None, displacement: None, warnings })
}

/// The labels, or the surfaces on a grid around the sphere.
fn source(
    given: &Mesh,
    case: &Case,
    sphere: Sphere,
    gather: &Gather<'_>,
) -> Result<Segmented, Error> {
    match &given.source {
        MeshSource::Labels { file, surfaces } => gather.work(NodeId::Import, |progress| {
            let labels = read_labels(file, progress.part(0.0, 0.5)).map_err(Error::product)?;
            let read = |folder: &PathBuf| {
                let read = read_surfaces(folder, &labels, progress.part(0.5, 1.0))?;
                read.ok_or_else(|| {
                    let folder = folder.display();
                    let what = "holds no skin.nrrd and chest_wall.nrrd: name a folder that";
                    input(format!("{folder} {what} `supine segment --surfaces` wrote"))
                })
            };
            let surfaces = surfaces.as_ref().map(read).transpose()?;
            Ok(Segmented::given(Arc::new(labels), surfaces.map(Lazy::held)))
        }),
        MeshSource::Solids { skin, chest_wall, frame } => {
            let skin = surface(skin, *frame, gather)?;
            let chest_wall = surface(chest_wall, *frame, gather)?;
            let params = Params { tetrahedra: case.mesh.tetrahedra, ..Params::default() };
            let solids = gather.work(NodeId::Import, |progress| {
                Ok(Solids::new(&skin, &chest_wall, sphere, &params, progress)?)
            })?;
            gather.warn_all(NodeId::Import, solids.warnings);
            let surfaces = Some(Lazy::shared(solids.surfaces));
            Ok(Segmented::given(solids.labels, surfaces))
        }
    }
}

/// A surface in LPS, mm; warns of what was taken for granted about it.
pub(super) fn surface(
    path: &Path,
    frame: SurfaceFrame,
    gather: &Gather<'_>,
) -> Result<TriSurface, Error> {
    let (surface, said) = read_surface(path, frame).map_err(Error::product)?;
    let name = path.display();
    let warn = |code, text| {
        gather.warn_all(NodeId::Import, [supine_space::Warning::new(code, text)]);
    };
    if said.is_none() {
        let frame = frame.name();
        let text = format!("{name} does not say its frame: taken as {frame} (--frame)");
        warn("surface-frame-assumed", text);
    }
    if surface.was_inside_out() {
        warn("surface-turned", format!("{name} was inside out and was turned"));
    }
    Ok(surface)
}

/// Writes a mesh in the format its name ends in; as a problem for another solver with the default
/// tissue and the weight of a patient on her back.
pub(super) fn write(
    mesh: &TetMesh,
    displacement: Option<&Displacement>,
    out: &Path,
    gather: &Gather<'_>,
) -> Result<(), Error> {
    match mesh_file(out)? {
        MeshFile::Result => write_mesh(mesh, displacement, out),
        MeshFile::Problem => {
            if displacement.is_some() {
                let text = format!("{} holds no displacement", out.display());
                let warning = supine_space::Warning::new("no-displacement-in-file", text);
                gather.warn_all(NodeId::Mesh, [warning]);
            }
            let gravity = supine_space::supine();
            let problem = statics(&Tissue::default(), gravity, Order::Linear, false);
            write_problem(mesh, &problem, &[], out)
        }
    }
    .map_err(Error::product)
}
