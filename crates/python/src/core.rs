//! The session behind `supine.Session`.

use crate::arrays::{self, MeshParts, VolumeParts};
use crate::failure::{raise, raise_case};
use crate::taken::{self, Geometry, MeshArrays};
use crate::wait::wait;
use numpy::{PyArray2, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use serde_json::{Map, Value as Json, json};
use std::path::PathBuf;
use std::sync::Arc;
use supine_flow::commands::Clock;
use supine_flow::spec::{Kind, Parameter, TABLE};
use supine_flow::{Error, NodeId, Options, Request, RunFolder, Session, Spec, Start};

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
        Json::Object(self.session.case().canonical()).to_string()
    }

    fn ct<'py>(&self, py: Python<'py>, hear: Py<PyAny>) -> PyResult<VolumeParts<'py, i16>> {
        let ct = self.ask(py, &hear, |session, request| session.ct(request))?;
        arrays::volume(py, ct)
    }

    fn labels<'py>(&self, py: Python<'py>, hear: Py<PyAny>) -> PyResult<VolumeParts<'py, u8>> {
        let labels = self.ask(py, &hear, |session, request| session.labels(request))?;
        arrays::volume(py, labels)
    }

    fn deformed_ct<'py>(
        &self,
        py: Python<'py>,
        hear: Py<PyAny>,
    ) -> PyResult<VolumeParts<'py, i16>> {
        let ct = self.ask(py, &hear, |session, request| session.deformed_ct(request))?;
        arrays::volume(py, ct)
    }

    fn mesh<'py>(&self, py: Python<'py>, hear: Py<PyAny>) -> PyResult<MeshParts<'py>> {
        let mesh = self.ask(py, &hear, |session, request| session.mesh(request))?;
        arrays::mesh(py, &mesh)
    }

    /// The mesh, the vectors of its nodes and the order within a tetrahedron.
    fn deformation<'py>(
        &self,
        py: Python<'py>,
        hear: Py<PyAny>,
    ) -> PyResult<(MeshParts<'py>, Bound<'py, PyArray2<f64>>, u8)> {
        let found = self.ask(py, &hear, |session, request| session.deformation(request))?;
        let displacement = found.displacement();
        let vectors = arrays::vectors(py, displacement)?;
        Ok((arrays::mesh(py, found.mesh())?, vectors, displacement.order().number()))
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
    fn region(&self, py: Python<'_>, hear: Py<PyAny>) -> PyResult<([f64; 3], f64)> {
        let sphere = self.ask(py, &hear, |session, request| session.region(request))?;
        Ok((sphere.centre().coords.into(), sphere.radius()))
    }

    /// A whole run into a folder; its summary as JSON.
    fn run(
        &self,
        py: Python<'_>,
        hear: Py<PyAny>,
        out: PathBuf,
        overwrite: bool,
    ) -> PyResult<String> {
        let session = &self.session;
        let summary = wait(py, &hear, |observer| {
            session.spec().check_complete()?;
            session.refuse_overlap(&out)?;
            session.keep_in(Some(RunFolder::open(&out)?.overwriting(overwrite)))?;
            let done = supine_flow::run(session, Options::default(), observer);
            session.keep_in(None)?;
            Ok(serde_json::to_string(&done?)?)
        })?;
        Ok(summary)
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
        Ok(Self { session: session.with_start(start) })
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
