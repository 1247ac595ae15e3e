//! Results that the caller has, in place of being made: a CT, labels, a mesh or a displacement of
//! her own.

use super::{Request, Session};
use crate::folder::{own_labels, was_read, whole};
use crate::nodes::{Import, Imported, Mesh, Meshed, Segment, Segmented, Solve, Solved};
use crate::shared::own_model::{check_displacement, check_mesh};
use crate::shared::told;
use crate::{Error, NodeId};
use serde_json::json;
use std::path::Path;
use std::sync::Arc;
use supine_exchange::write_labels;
use supine_mesh::{Deformation, TetMesh};
use supine_report::Input;
use supine_segment::take_labels;
use supine_space::{Failure, Progress, Vector, Warning};
use supine_volume::{Ct, LabelMap};

impl Session {
    /// Takes a CT (HU) in place of that of the case. It has no patient and no series: nothing is
    /// exported to DICOM.
    pub fn give_ct(&self, ct: Arc<Ct>) {
        let mut hash = hash_of_grid(ct.grid());
        for voxel in ct.data().chunks(1 << 16) {
            let bytes: Vec<u8> = voxel.iter().flat_map(|hu| hu.to_le_bytes()).collect();
            hash.update(&bytes);
        }
        let blake3 = hash.finalize().to_hex().to_string();
        let origin =
            Input { role: "ct".into(), form: "memory".into(), files: 0, blake3: blake3.clone() };
        self.give::<Import>(Imported::given(ct, origin), blake3);
    }

    /// Takes labels on the grid of the CT in place of the segmentation, numbered as `volume::label`
    /// has them; the observer hears what is doubtful about them.
    ///
    /// # Errors
    /// When the CT cannot be read, or they cannot be of it.
    pub fn give_labels(&self, labels: LabelMap, request: &Request<'_>) -> Result<(), Error> {
        let (labels, warnings) = take_labels(&*self.ct(request)?, labels)?;
        let mut hash = hash_of_grid(labels.grid());
        hash.update(labels.data());
        let key = hash.finalize().to_hex().to_string();
        self.give::<Segment>(Segmented::given(Arc::new(labels), None), key);
        self.tell(NodeId::Segment, &warnings, request);
        Ok(())
    }

    /// Takes a mesh in the CT shape in place of the mesher's; points LPS, mm. The observer hears
    /// what is doubtful about it.
    ///
    /// # Errors
    /// When there are no labels to look at it by, or it does not lie in their soft tissue.
    pub fn give_mesh(&self, mesh: Arc<TetMesh>, request: &Request<'_>) -> Result<(), Error> {
        let doubts = check_mesh(&mesh, &*self.labels(request)?)?;
        self.tell(NodeId::Mesh, &doubts, request);
        let key = hash_of_mesh(&mesh).finalize().to_hex().to_string();
        self.give::<Mesh>(Meshed::given(mesh), key);
        Ok(())
    }

    /// Takes a displacement (mm, LPS, from the CT shape) in place of the solver's, with its mesh in
    /// place of the mesher's. The observer hears what is doubtful about them.
    ///
    /// # Errors
    /// As [`Session::give_mesh`]; when the displacement is in another order, or turns tetrahedra
    /// inside out.
    pub fn give_deformation(
        &self,
        deformation: Deformation,
        request: &Request<'_>,
    ) -> Result<(), Error> {
        // Without a tilt nothing says which way the tissue should go.
        let pull = self.case().load().map_or(Vector::zeros(), |load| load.target - load.ct);
        let doubts = check_displacement(&deformation, &pull)?;
        self.give_mesh(Arc::clone(deformation.mesh()), request)?;
        self.tell(NodeId::Solve, &doubts, request);
        let mut hash = hash_of_mesh(deformation.mesh());
        let vectors = deformation.displacement().values();
        let bytes = vectors.iter().flat_map(|u| u.iter().flat_map(|c| c.to_le_bytes()));
        hash.update(&bytes.collect::<Vec<u8>>());
        let key = hash.finalize().to_hex().to_string();
        self.give::<Solve>(Solved::given(deformation), key);
        Ok(())
    }

    /// Where labels alone were given, a session of the same case that names them as a file in a
    /// run's folder: a whole run tells by its case what it rests on. The file is written by
    /// [`Session::write_own_labels`].
    ///
    /// # Errors
    /// When the path of the folder is no text, or there are no threads.
    pub fn with_own_labels(&self, root: &Path) -> Result<Option<Self>, Error> {
        if self.given() != [NodeId::Segment] {
            return Ok(None);
        }
        let file = own_labels(&whole(root));
        let file = file.to_str().ok_or_else(|| Error::Refused {
            kind: Failure::Usage,
            message: "the path of the folder is no text, and the case cannot name labels in it: choose another".into(),
        })?;
        let mut spec = (*self.spec()).clone();
        let named = json!({ "file": file, "body": null, "soft_tissue": null, "chest_wall": null });
        spec.merge(&serde_json::Map::from_iter([("labels".into(), named)]))?;
        let session = Self::new(spec, self.threads())?;
        Ok(Some(session.with_start(self.start().cloned())))
    }

    /// Writes the labels that were given to the file that [`Session::with_own_labels`] names, in
    /// place of those of a run before.
    ///
    /// # Errors
    /// When a stage fails, the observer ends the work, or the file cannot be written or is none
    /// that the run in the folder read.
    pub fn write_own_labels(&self, root: &Path, request: &Request<'_>) -> Result<(), Error> {
        let (labels, file) = (self.labels(request)?, own_labels(root));
        if file.exists() && !was_read(root, &file) {
            return Err(Error::Foreign { path: file });
        }
        write_labels(&labels, &file, Progress::none()).map_err(Error::product)
    }

    fn tell(&self, node: NodeId, doubts: &[Warning], request: &Request<'_>) {
        let nameless = self.case().export.anonymise;
        doubts
            .iter()
            .for_each(|doubt| request.observer.warning(node, &told(node, doubt, nameless)));
    }

    /// Lets a node make its result again.
    pub fn take_back(&self, node: NodeId) {
        let was = self.change(|case_state| case_state.given.remove(&node)).is_some();
        if was {
            self.forget(node);
        }
    }

    /// The nodes whose results were given, in the order of the flow.
    pub fn given(&self) -> Vec<NodeId> {
        self.case_state().given.keys().copied().collect()
    }

    /// That a whole run tells all it rests on: its case does not hold what was given in memory.
    ///
    /// # Errors
    /// [`Error::Given`].
    pub(crate) fn check_told(&self) -> Result<(), Error> {
        self.given().first().map_or(Ok(()), |node| Err(Error::Given { node: *node }))
    }
}

fn hash_of_grid(grid: &supine_space::Grid) -> blake3::Hasher {
    let mut hash = blake3::Hasher::new();
    let (spacing, origin): ([f64; 3], [f64; 3]) = (grid.spacing().into(), grid.origin().into());
    let numbers = spacing.into_iter().chain(origin).chain(grid.direction().iter().copied());
    grid.size().iter().for_each(|n| _ = hash.update(&(*n as u64).to_le_bytes()));
    numbers.for_each(|x: f64| _ = hash.update(&x.to_le_bytes()));
    hash
}

fn hash_of_mesh(mesh: &TetMesh) -> blake3::Hasher {
    let mut hash = blake3::Hasher::new();
    let points = mesh.points().iter().flat_map(|p| p.coords.iter().flat_map(|c| c.to_le_bytes()));
    hash.update(&points.collect::<Vec<u8>>());
    let corners = mesh.tets().iter().flatten().flat_map(|corner| corner.to_le_bytes());
    hash.update(&corners.collect::<Vec<u8>>());
    for face in mesh.boundary() {
        let corners = face.points.iter().flat_map(|corner| corner.to_le_bytes());
        hash.update(&corners.chain([face.tag.number()]).collect::<Vec<u8>>());
    }
    hash
}
