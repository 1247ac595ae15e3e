//! The session behind `supine.Session`.

use crate::arrays::{self, MeshParts, Triple, VolumeParts};
use crate::carried::{CarriedParts, carried};
use crate::failure::{raise, raise_case};
use crate::taken::{self, Geometry, MeshArrays};
use crate::wait::wait;
use numpy::{PyArray2, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use serde_json::{Map, Value as Json, json};
use std::path::PathBuf;
use std::sync::Arc;
use supine_flow::commands::{Clock, given_deformation, given_mesh};
use supine_flow::spec::{Kind, Parameter, TABLE};
use supine_flow::{Error, NodeId, Options, Request, RunFolder, Session, Spec, Start};
use supine_mesh::Deformation;

/// The results that stay in memory after a run: those that Python may ask for and all that they
/// rest on, without what only the folder has and without the fields, which take much memory and
/// little time.
const HELD: [NodeId; 17] = [
    NodeId::Import,
    NodeId::Source,
    NodeId::Objects,
    NodeId::Tumour,
    NodeId::Prepare,
    NodeId::Segment,
    NodeId::Region,
    NodeId::Tissues,
    NodeId::Mesh,
    NodeId::Moduli,
    NodeId::Fit,
    NodeId::Solve,
    NodeId::Interval,
    NodeId::Warp,
    NodeId::Points,
    NodeId::Evaluation,
    NodeId::MovedObjects,
];

/// A mesh, the vectors of its nodes and the order within a tetrahedron.
type Vectors<'py> = (MeshParts<'py>, Bound<'py, PyArray2<f64>>, u8);

/// A session of the flow; values of the case come and go as JSON.
#[pyclass(frozen)]
pub(crate) struct Core {
    session: Session,
}

#[pymethods]
impl Core {
    #[new]
    fn new(
        py: Python<'_>,
        values: &str,
        folder: PathBuf,
        threads: usize,
        clock: &str,
        command: Vec<String>,
    ) -> PyResult<Self> {
        let start = Clock::parse(clock).map(|clock| Start { clock, command });
        Self::of(py, Spec::new(folder), values, threads, start)
    }

    /// A session of a case file or of the summary of a run.
    #[staticmethod]
    fn read(
        py: Python<'_>,
        case: PathBuf,
        values: &str,
        threads: usize,
        clock: &str,
        command: Vec<String>,
    ) -> PyResult<Self> {
        let spec = Spec::read(&case).map_err(|error| raise_case(py, error))?;
        let start = Clock::parse(clock).map(|clock| Start { clock, command });
        Self::of(py, spec, values, threads, start)
    }

    /// Changes values; the stages whose results are stale now.
    fn merge(&self, py: Python<'_>, values: &str) -> PyResult<Vec<&'static str>> {
        let mut spec = (*self.session.spec()).clone();
        spec.merge(&object(values)?).map_err(|error| raise_case(py, error))?;
        let stale = self.session.set_all(spec).map_err(|error| raise(py, &error))?;
        Ok(stale.into_iter().map(NodeId::name).collect())
    }

    /// The value that was given for a key, as JSON; `null` without one.
    fn value(&self, key: &str) -> String {
        self.session.spec().get(key).map_or(Json::Null, |value| value.json()).to_string()
    }

    /// The whole case with its defaults, as JSON.
    fn case(&self) -> String {
        Json::Object(self.session.case().canonical().clone()).to_string()
    }

    fn ct<'py>(&self, py: Python<'py>, hear: Py<PyAny>) -> PyResult<VolumeParts<'py>> {
        let ct = self.ask(py, &hear, |session, request| session.ct(request))?;
        arrays::volume(py, ct)
    }

    fn labels<'py>(&self, py: Python<'py>, hear: Py<PyAny>) -> PyResult<VolumeParts<'py>> {
        let labels = self.ask(py, &hear, |session, request| session.labels(request))?;
        arrays::volume(py, labels)
    }

    fn deformed_ct<'py>(&self, py: Python<'py>, hear: Py<PyAny>) -> PyResult<VolumeParts<'py>> {
        let ct = self.ask(py, &hear, |session, request| session.deformed_ct(request))?;
        arrays::volume(py, ct)
    }

    fn mesh<'py>(&self, py: Python<'py>, hear: Py<PyAny>) -> PyResult<MeshParts<'py>> {
        let mesh = self.ask(py, &hear, |session, request| session.mesh(request))?;
        arrays::mesh(py, &mesh)
    }

    fn deformation<'py>(&self, py: Python<'py>, hear: Py<PyAny>) -> PyResult<Vectors<'py>> {
        let deformation = self.ask(py, &hear, |session, request| session.deformation(request))?;
        vectors(py, &deformation)
    }

    /// From the table to the CT for resamplers, from the CT to the table, and the Jacobian.
    fn fields<'py>(
        &self,
        py: Python<'py>,
        hear: Py<PyAny>,
    ) -> PyResult<(VolumeParts<'py>, VolumeParts<'py>, VolumeParts<'py>)> {
        let map = self.ask(py, &hear, |session, request| session.fields(request))?;
        Ok((
            arrays::held_field(py, &map, |map| &map.resampling)?,
            arrays::held_field(py, &map, |map| &map.points)?,
            arrays::held_volume(py, &map, |map| Some(map.fields.jacobian()))?,
        ))
    }

    fn tissues<'py>(&self, py: Python<'py>, hear: Py<PyAny>) -> PyResult<Option<VolumeParts<'py>>> {
        let labels = self.ask(py, &hear, |session, request| session.tissues(request))?;
        labels.map(|labels| arrays::volume(py, labels)).transpose()
    }

    /// The nipple's movement and the case's points, as JSON.
    fn points(&self, py: Python<'_>, hear: Py<PyAny>) -> PyResult<String> {
        let told = self.ask(py, &hear, |session, request| {
            let points = session.points(request)?;
            Ok(json!({ "nipple": session.nipple(request)?, "points": points }))
        })?;
        Ok(told.to_string())
    }

    /// Doses, structures and segments before and after.
    fn carried<'py>(&self, py: Python<'py>, hear: Py<PyAny>) -> PyResult<CarriedParts<'py>> {
        let objects = self.ask(py, &hear, |session, request| session.objects(request))?;
        carried(py, objects)
    }

    /// As the summary tells it, as JSON.
    fn fit(&self, py: Python<'_>, hear: Py<PyAny>) -> PyResult<String> {
        let told = self.ask(py, &hear, |session, request| Ok(json!(session.fit(request)?)))?;
        Ok(told.to_string())
    }

    /// As the summary tells it, as JSON.
    fn evaluation(&self, py: Python<'_>, hear: Py<PyAny>) -> PyResult<String> {
        let told =
            self.ask(py, &hear, |session, request| Ok(json!(session.evaluation(request)?)))?;
        Ok(told.to_string())
    }

    /// Movement and interval, as JSON.
    fn tumour(&self, py: Python<'_>, hear: Py<PyAny>) -> PyResult<String> {
        let told = self.ask(py, &hear, |session, request| {
            let movement = session.tumour(request)?;
            Ok(json!({ "movement": movement, "interval": session.tumour_interval(request)? }))
        })?;
        Ok(told.to_string())
    }

    /// The same without the interval.
    fn movement(&self, py: Python<'_>, hear: Py<PyAny>) -> PyResult<String> {
        let told = self.ask(py, &hear, |session, request| Ok(json!(session.tumour(request)?)))?;
        Ok(told.to_string())
    }

    /// Centre and radius, mm.
    fn region(&self, py: Python<'_>, hear: Py<PyAny>) -> PyResult<(Triple, f64)> {
        let sphere = self.ask(py, &hear, |session, request| session.region(request))?;
        Ok((arrays::triple(sphere.centre().coords), sphere.radius()))
    }

    /// A whole run into a folder; its summary as JSON.
    fn run(
        &self,
        py: Python<'_>,
        hear: Py<PyAny>,
        out: PathBuf,
        overwrite: bool,
    ) -> PyResult<String> {
        wait(py, &hear, |observer| {
            let labelled = self.session.with_own_labels(&out)?;
            let session = labelled.as_ref().unwrap_or(&self.session);
            session.spec().check_complete()?;
            session.refuse_overlap(&out)?;
            session.keep_in(Some(RunFolder::open(&out)?.overwriting(overwrite)))?;
            let request = Request { observer, ..Request::default() };
            let written = match labelled {
                Some(_) => self.session.write_own_labels(&out, &request),
                None => Ok(()),
            };
            let run = |()| supine_flow::run(session, Options::default(), observer);
            let done = written.and_then(run);
            session.keep_in(None)?;
            Ok(serde_json::to_string(&done?)?)
        })
    }

    fn give_ct(&self, array: PyReadonlyArray3<'_, i16>, geometry: Geometry) -> PyResult<()> {
        self.session.give_ct(Arc::new(taken::volume(&array, geometry)?));
        Ok(())
    }

    fn give_labels(
        &self,
        py: Python<'_>,
        hear: Py<PyAny>,
        array: PyReadonlyArray3<'_, u8>,
        geometry: Geometry,
    ) -> PyResult<()> {
        let labels = taken::volume(&array, geometry)?;
        let session = &self.session;
        wait(py, &hear, |observer| {
            session.give_labels(labels, &Request { observer, ..Request::default() })
        })
    }

    fn give_mesh(&self, py: Python<'_>, hear: Py<PyAny>, mesh: MeshArrays<'_>) -> PyResult<()> {
        let mesh = Arc::new(taken::mesh(&mesh)?);
        let session = &self.session;
        wait(py, &hear, |observer| {
            session.give_mesh(mesh, &Request { observer, ..Request::default() })
        })
    }

    fn give_deformation(
        &self,
        py: Python<'_>,
        hear: Py<PyAny>,
        mesh: MeshArrays<'_>,
        vectors: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<()> {
        let mesh = Arc::new(taken::mesh(&mesh)?);
        let deformation = taken::deformation(mesh, &vectors)?;
        let session = &self.session;
        wait(py, &hear, |observer| {
            session.give_deformation(deformation, &Request { observer, ..Request::default() })
        })
    }

    /// Drops what was given for a stage; it is made again.
    fn take_back(&self, stage: &str) -> PyResult<()> {
        let node = NodeId::ALL.into_iter().find(|node| node.name() == stage);
        let node = node.ok_or_else(|| {
            PyValueError::new_err(format!("{stage:?} is no stage: import, segment, mesh or solve"))
        })?;
        self.session.take_back(node);
        Ok(())
    }

    /// Stages whose results were given.
    fn given(&self) -> Vec<&'static str> {
        self.session.given().into_iter().map(NodeId::name).collect()
    }

    /// Bytes that results hold.
    fn bytes(&self) -> usize {
        self.session.bytes()
    }
}

impl Core {
    fn of(
        py: Python<'_>,
        mut spec: Spec,
        values: &str,
        threads: usize,
        start: Option<Start>,
    ) -> PyResult<Self> {
        spec.merge(&object(values)?).map_err(|error| raise_case(py, error))?;
        let session = Session::new(spec, threads).map_err(|error| raise(py, &error))?;
        Ok(Self { session: session.with_start(start).holding(&HELD) })
    }

    fn ask<T: Send>(
        &self,
        py: Python<'_>,
        hear: &Py<PyAny>,
        what: impl FnOnce(&Session, &Request<'_>) -> Result<T, Error> + Send,
    ) -> PyResult<T> {
        let session = &self.session;
        wait(py, hear, |observer| what(session, &Request { observer, ..Request::default() }))
    }
}

/// A deformation as arrays.
fn vectors<'py>(py: Python<'py>, of: &Deformation) -> PyResult<Vectors<'py>> {
    let vectors = arrays::vectors(py, of.displacement())?;
    Ok((arrays::mesh(py, of.mesh())?, vectors, of.displacement().order().number()))
}

/// The mesh of a file.
#[pyfunction]
pub(crate) fn read_mesh(py: Python<'_>, path: PathBuf) -> PyResult<MeshParts<'_>> {
    let mesh = given_mesh(&path).map_err(|error| raise(py, &error))?;
    arrays::mesh(py, &mesh)
}

/// The mesh of a file with its displacement.
#[pyfunction]
pub(crate) fn read_deformation(py: Python<'_>, path: PathBuf) -> PyResult<Vectors<'_>> {
    let deformation = given_deformation(&path).map_err(|error| raise(py, &error))?;
    vectors(py, &deformation)
}

fn object(values: &str) -> PyResult<Map<String, Json>> {
    serde_json::from_str(values).map_err(|error| PyValueError::new_err(error.to_string()))
}

/// Every parameter, as JSON: its key, kind, words or range, unit, default in words and help.
#[pyfunction]
pub(crate) fn parameters() -> String {
    let row = |p: &Parameter| {
        let (kind, within) = kind(&p.kind);
        json!({
            "key": p.key, "kind": kind, "within": within, "unit": p.unit,
            "default": p.default_text(), "help": p.help,
        })
    };
    Json::from(TABLE.iter().map(row).collect::<Vec<_>>()).to_string()
}

/// The name of a kind, and the words or the ends of the range that it may have.
fn kind(kind: &Kind) -> (&'static str, Json) {
    match kind {
        Kind::Switch => ("switch", Json::Null),
        Kind::Number { min, max } => ("number", json!([min, max])),
        Kind::Whole { min, max } => ("whole", json!([min, max])),
        Kind::Choice(words) => ("choice", json!(words)),
        Kind::Text => ("text", Json::Null),
        Kind::Point => ("point", Json::Null),
        Kind::Points => ("points", Json::Null),
        Kind::Strokes => ("strokes", Json::Null),
        Kind::Interval { min, max } => ("interval", json!([min, max])),
        Kind::File => ("file", Json::Null),
        Kind::Files => ("files", Json::Null),
        Kind::Names => ("names", Json::Null),
    }
}

/// The version of the program.
#[pyfunction]
pub(crate) fn version() -> &'static str {
    env!("CARGO_PKG_VERSION")
}
