//! What other meshers are given of a domain, and how their meshes are bettered.

use crate::boundary::Boundary;
use crate::coarsen::complex;
use crate::domain::{Domain, LATTICES, edge_for, finished, first_mesh, work};
use crate::exactly::{MIN_TETRAHEDRA, exactly};
use crate::finish::outer_faces;
use crate::mesher::Mesher;
use crate::patches::classify;
use crate::rims::rims;
use crate::sizing::Sizing;
use crate::start::keep_largest;
use crate::{Error, Info, Params};
use std::collections::BTreeMap;
use supine_mesh::{BoundaryFace, BoundaryTag, TetMesh};
use supine_space::{Point, Progress, Vector};

/// Rounds of split, collapse, swap and smooth for a boundary alone.
const SHELL_ROUNDS: usize = 3;

/// The boundary of the soft tissue as a closed surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Shell {
    /// Points, LPS, mm.
    pub points: Vec<Point>,
    /// Triangles, outwards.
    pub faces: Vec<BoundaryFace>,
    /// The curves where two tags meet, as chains of points (LPS, mm), finer than the triangles.
    /// They end where three tags meet; closed ones end where they begin.
    pub rims: Vec<Vec<Point>>,
}

impl Domain {
    /// Volume of the soft tissue by voxels, mm³, pieces apart included.
    pub fn volume_mm3(&self) -> f64 {
        self.fields.volume
    }

    /// The surface beyond which a place (LPS, mm) lies; `None` inside the soft tissue.
    pub fn beyond(&self, p: &Point) -> Option<BoundaryTag> {
        let levels = self.fields.levels(&self.fields.frame().of_patient(p));
        let farthest = (0..3).max_by(|&a, &b| levels[a].total_cmp(&levels[b]))?;
        if levels[farthest] > 0.0 { BoundaryTag::from_number(farthest as u8 + 1) } else { None }
    }

    /// The boundary with triangles of the size that suits so many tetrahedra.
    ///
    /// # Errors
    /// When there is nothing to mesh or the progress callback says stop.
    pub fn shell(&self, tetrahedra: usize, progress: Progress<'_>) -> Result<Shell, Error> {
        let tetrahedra = tetrahedra.max(MIN_TETRAHEDRA);
        let params = Params { tetrahedra, ..self.params.clone() };
        let mut info = self.info.clone();
        let part = progress.part(0.0, 0.5);
        let mut mesher = first_mesh(&self.fields, &params, LATTICES[0], &mut info, part)?;
        mesher.rounds(SHELL_ROUNDS, tetrahedra, progress.part(0.5, 1.0))?;
        let frame = self.fields.frame();
        let place = |p: &Vector| frame.to_patient(p);
        let rims = rims(&mesher).into_iter().map(|rim| rim.iter().map(place).collect()).collect();
        let (mut number, mut points) = (BTreeMap::new(), Vec::new());
        let mut faces = outer_faces(&mesher.mesh);
        for v in faces.iter_mut().flat_map(|face| &mut face.points) {
            *v = *number.entry(*v).or_insert_with(|| {
                points.push(place(&mesher.mesh.points[*v as usize]));
                points.len() as u32 - 1
            });
        }
        if frame.axes.determinant() < 0.0 {
            faces.iter_mut().for_each(|face| face.points.swap(1, 2));
        }
        progress.at(1.0)?;
        Ok(Shell { points, faces, rims })
    }

    /// A mesh of this soft tissue that was made elsewhere, bettered and with the asked number of
    /// tetrahedra. Its largest piece is kept; its boundary is put onto this domain's surfaces.
    ///
    /// # Errors
    /// When the number cannot be reached or the progress callback says stop.
    pub fn improve(
        &self,
        mesh: &TetMesh,
        tetrahedra: usize,
        progress: Progress<'_>,
    ) -> Result<(TetMesh, Info), Error> {
        let mut info = Info { asked: tetrahedra, ..self.info.clone() };
        let mut start = complex(mesh, self.fields.frame());
        let (parts, lost) = keep_largest(&mut start);
        info.dropped_components += parts;
        info.dropped_volume_mm3 += lost;
        let mut start = start.compact();
        classify(&mut start);
        let (mesher, joined) = exactly(tetrahedra, progress, |tetrahedra, progress| {
            let params = Params { tetrahedra, ..self.params.clone() };
            let edge = edge_for(self.fields.volume, tetrahedra);
            let sizing = Sizing::new(&self.fields, &params, edge);
            let mut mesher = Mesher { mesh: start.clone(), sizing };
            let joined_patches = mesher.join_small_patches();
            mesher.settle();
            work(&mut mesher, tetrahedra, progress)?;
            Ok((mesher, Info { joined_patches, ..Info::new() }))
        })?;
        info.joined_patches = joined.joined_patches;
        let made = finished(&mesher, self.fields.frame(), self.fields.volume, &mut info)?;
        progress.at(1.0)?;
        Ok((made, info))
    }
}
