//! A given mesh with fewer tetrahedra.

use crate::complex::Complex;
use crate::domain::{edge_for, finished, work};
use crate::exactly::exactly;
use crate::faces::Faces;
use crate::frame::Frame;
use crate::mesher::Mesher;
use crate::patches::classify;
use crate::refinement::Refinement;
use crate::sizing::Sizing;
use crate::{Error, Info, Params};
use std::collections::BTreeMap;
use supine_mesh::{TET_FACES, TetMesh};
use supine_space::{Matrix, Point, Progress};

/// A mesh of the asked number of tetrahedra, fewer than `mesh` has, on the same surfaces.
///
/// The boundary follows the faces of the given mesh tag by tag; its rims and corners stay where
/// they are. Of a mesh that was made here, [`crate::Domain::mesh`] makes a coarser one that is
/// nearer to the patient. Where `refinement` says so it is finer, and coarser elsewhere.
/// Deterministic: the same bits for any number of threads.
///
/// # Errors
/// When the number is not smaller than that of `mesh` or cannot be reached, a number of the
/// refinement is out of range, or the progress callback says stop.
pub fn coarsen(
    mesh: &TetMesh,
    tetrahedra: usize,
    refinement: &Refinement,
    progress: Progress<'_>,
) -> Result<(TetMesh, Info), Error> {
    refinement.check()?;
    let has = mesh.tets().len();
    if tetrahedra >= has {
        return Err(Error::NotCoarser { asked: tetrahedra, has });
    }
    let frame = Frame { origin: middle(mesh), axes: Matrix::identity() };
    let mut start = complex(mesh, &frame);
    classify(&mut start);
    progress.at(0.0)?;
    let faces = Faces::new(&start)?.refined_in(refinement.clone(), frame);
    progress.at(0.1)?;
    let volume = mesh.total_volume();
    let (mesher, _) = exactly(tetrahedra, progress.part(0.1, 1.0), |tetrahedra, progress| {
        if tetrahedra >= has {
            return Err(Error::NotCoarser { asked: tetrahedra, has });
        }
        let edge = edge_for(volume, tetrahedra);
        let sizing = Sizing::new(&faces, &Params::default(), edge);
        let mut mesher = Mesher { mesh: start.clone(), sizing };
        mesher.coarsen(edge_for(volume, has), progress.part(0.0, 0.4))?;
        work(&mut mesher, tetrahedra, progress.part(0.4, 1.0))?;
        Ok((mesher, Info::new()))
    })?;
    let mut info = Info { asked: tetrahedra, ..Info::new() };
    let made = finished(&mesher, &frame, volume, &mut info)?;
    progress.at(1.0)?;
    Ok((made, info))
}

/// The middle of the box round a mesh.
fn middle(mesh: &TetMesh) -> Point {
    let (low, high) = mesh.bounds();
    low + 0.5 * (high - low)
}

/// The mesh under work, in millimetres from the origin of a frame along its axes.
pub(crate) fn complex(mesh: &TetMesh, frame: &Frame) -> Complex {
    let key = |mut face: [u32; 3]| {
        face.sort_unstable();
        face
    };
    let tags: BTreeMap<[u32; 3], u8> =
        mesh.boundary().iter().map(|f| (key(f.points), f.tag.number())).collect();
    let mut complex = Complex::default();
    for p in mesh.points() {
        complex.add_vertex(frame.of_patient(p), 0);
    }
    // A left-handed frame turns positive tetrahedra over.
    let mirrored = frame.axes.determinant() < 0.0;
    for mut tet in mesh.tets().iter().copied() {
        if mirrored {
            tet.swap(2, 3);
        }
        let tag = |face: [usize; 3]| tags.get(&key(face.map(|c| tet[c]))).copied().unwrap_or(0);
        complex.add(tet, TET_FACES.map(tag));
    }
    complex
}
