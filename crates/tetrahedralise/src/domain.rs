//! The soft tissue to be meshed, and its meshes.

use crate::base_length::base_length;
use crate::exactly::exactly;
use crate::fields::{Fields, Smoothing};
use crate::frame::Frame;
use crate::mesher::Mesher;
use crate::params::check;
use crate::refinement::Refinement;
use crate::sizing::Sizing;
use crate::{Error, Info, Params, finish, labels, start};
use supine_mesh::TetMesh;
use supine_space::{Progress, Warning};
use supine_volume::Region;

/// Volume of a tetrahedron with edges of length L is about L³ / 8.5 in a good mesh.
const CUBE_SHARE: f64 = 8.5;
/// The start lattice is no coarser than this, mm, or small shapes are lost.
const COARSEST_MM: f64 = 12.0;
/// A lattice coarser than this (mm) whose cut is off the labels' volume by this share has missed
/// shapes: one finer by this factor is taken.
const FINER_MM: f64 = 6.0;
const MISSED: f64 = 0.01;
const FINER: f64 = 1.5;
/// The margin of labels around the sphere that the smoothing needs, in its standard deviations.
const MARGIN: f64 = 4.0;
/// Cells of the start lattice in units of the usual: where one lattice meets the surfaces so that
/// the mesh jams, another is tried.
pub(crate) const LATTICES: [f64; 3] = [1.0, 0.91, 0.83];
/// A mesh with a tetrahedron worse than this (sine of 20°) has jammed.
const JAMMED: f64 = 0.342;
/// Passes that bring the boundary of the cut lattice onto its surfaces.
const SETTLING: usize = 2;
/// Least rounds of split, collapse, swap and smooth.
const ROUNDS: usize = 3;
/// Tetrahedra worse than this (sine of 33.6°) are worked on to the end.
const GOAL: f64 = 0.553;
/// The last fit keeps tetrahedra this much better than the goal.
const MARGIN_CLOSING: f64 = 0.02;
/// Most passes of the last betterment and fit.
const FINISHES: usize = 3;
/// Another pass is worth its time when the last bettered the worst tetrahedron by this much.
const FINISH_GAIN: f64 = 0.01;

/// The soft tissue inside a sphere as level functions of skin, chest wall and sphere: from it come
/// meshes of any number of tetrahedra, which all follow the same surfaces.
#[derive(Debug)]
pub struct Domain {
    pub(crate) fields: Fields,
    pub(crate) params: Params,
    /// What is known before there is a mesh.
    pub(crate) info: Info,
    /// Smallest spacing of the voxels, mm.
    voxel_mm: f64,
}

impl Domain {
    /// Makes the level functions from the labels around the region's sphere.
    ///
    /// # Errors
    /// When a setting or a label is not usable, there is nothing to mesh, or the progress callback
    /// says stop.
    pub fn new(region: &Region, params: &Params, progress: Progress<'_>) -> Result<Self, Error> {
        check(params)?;
        let mut info = Info::new();
        progress.at(0.0)?;
        let spacing = region.labels().grid().spacing();
        let sigma = params.smoothing_mm.max(0.9 * spacing.max());
        let kinds = labels::kinds(region, params.piece, MARGIN * sigma, &mut info)?;
        progress.at(0.4)?;
        let smoothing = match region.surfaces() {
            Some(surfaces) => Smoothing::Known(surfaces.as_ref(), params.surface_smoothing_mm),
            None => Smoothing::Labels(sigma),
        };
        let fields = Fields::new(&kinds, region.sphere(), smoothing, params.min_thickness_mm)?;
        progress.at(1.0)?;
        Ok(Self { fields, params: params.clone(), info, voxel_mm: spacing.min() })
    }

    /// The same tissue, to be meshed finer in some places.
    ///
    /// # Errors
    /// When a number of the refinement is out of range.
    pub fn refined(mut self, refinement: Refinement) -> Result<Self, Error> {
        refinement.check()?;
        self.fields.refinement = refinement;
        Ok(self)
    }

    /// A mesh of the asked number of tetrahedra, whatever [`Params::tetrahedra`] says.
    ///
    /// Boundary faces are tagged skin, chest wall or cut; where tags meet, edges of the mesh follow
    /// the rim. Deterministic: the same bits for any number of threads.
    ///
    /// # Errors
    /// When the number is too small for the shape (the error names the smallest found that works),
    /// there is nothing to mesh, or the progress callback says stop.
    pub fn mesh(
        &self,
        tetrahedra: usize,
        progress: Progress<'_>,
    ) -> Result<(TetMesh, Info), Error> {
        let attempt = |tetrahedra, progress: Progress<'_>| {
            self.attempts(&Params { tetrahedra, ..self.params.clone() }, progress)
        };
        let (mesher, mut info) = exactly(tetrahedra, progress.part(0.0, 0.99), attempt)?;
        let edge = mesher.sizing.base;
        if edge < self.voxel_mm {
            let text = format!(
                "{tetrahedra} tetrahedra make edges of {edge:.2} mm, shorter than a voxel: the \
                 surface gains nothing from them"
            );
            info.warnings.push(Warning::new("mesh-short-edges", text));
        }
        let mesh = finished(&mesher, self.fields.frame(), self.fields.volume, &mut info)?;
        progress.at(1.0)?;
        Ok((mesh, info))
    }

    /// The best of the meshes from the lattices that had to be tried.
    fn attempts(
        &self,
        params: &Params,
        progress: Progress<'_>,
    ) -> Result<(Mesher<'_>, Info), Error> {
        let goal = params.tetrahedra;
        let mut best: Option<(Mesher<'_>, Info)> = None;
        for (attempt, scale) in LATTICES.into_iter().enumerate() {
            let (from, to) = if attempt == 0 { (0.0, 0.9) } else { (0.9, 1.0) };
            let part = progress.part(from, to);
            let mut info = Info { asked: goal, ..self.info.clone() };
            let mut mesher =
                first_mesh(&self.fields, params, scale, &mut info, part.part(0.0, 0.15))?;
            work(&mut mesher, goal, part.part(0.15, 1.0))?;
            let rank = |m: &Mesher<'_>| (m.mesh.count() == goal, m.mesh.worst());
            let (exact, worst) = rank(&mesher);
            if best.as_ref().is_none_or(|(best, _)| (exact, worst) > rank(best)) {
                best = Some((mesher, info));
            }
            if exact && worst >= JAMMED {
                break;
            }
        }
        best.ok_or(Error::NothingToMesh { thickness_mm: params.min_thickness_mm })
    }
}

/// Edge length at which a volume (mm³) comes to that many tetrahedra, mm.
pub(crate) fn edge_for(volume: f64, tetrahedra: usize) -> f64 {
    (CUBE_SHARE * volume / tetrahedra as f64).cbrt()
}

/// The mesh in patient space and what is told of it. `volume`: that of the tissue it was made of,
/// mm³.
pub(crate) fn finished(
    mesher: &Mesher<'_>,
    frame: &Frame,
    volume: f64,
    info: &mut Info,
) -> Result<TetMesh, Error> {
    let complex = mesher.mesh.compact();
    let mesh = finish::to_patient(&complex, frame)?;
    info.describe(&complex, &mesh, mesher.fields(), volume, mesher.sizing.base);
    Ok(mesh)
}

/// The cut lattice, with cells of `scale` times the usual size, and the base length that should
/// give the asked count.
pub(crate) fn first_mesh<'a>(
    fields: &'a Fields,
    params: &Params,
    scale: f64,
    info: &mut Info,
    progress: Progress<'_>,
) -> Result<Mesher<'a>, Error> {
    let nothing = Error::NothingToMesh { thickness_mm: params.min_thickness_mm };
    let edge = edge_for(fields.volume, params.tetrahedra);
    if edge.is_nan() || edge <= 0.0 {
        return Err(nothing);
    }
    let edge = base_length(fields, params, edge)?;
    let mut cell = scale * edge.min(COARSEST_MM.max(0.4 * edge));
    let (mesh, parts, lost) = loop {
        let Some((mesh, parts, lost)) = start::start(fields, cell, progress.part(0.0, 0.5))? else {
            return Err(nothing);
        };
        let whole = (mesh.volume() + lost) / fields.volume;
        if cell < FINER_MM || (whole - 1.0).abs() < MISSED {
            break (mesh, parts, lost);
        }
        cell /= FINER;
    };
    info.dropped_components += parts;
    info.dropped_volume_mm3 += lost;
    let sizing = Sizing::new(fields, params, edge);
    let mut mesher = Mesher { mesh, sizing };
    info.joined_patches = mesher.join_small_patches();
    for _ in 0..SETTLING {
        mesher.settle();
        mesher.unfold_rims();
        mesher.relax_rims();
    }
    mesher.settle();
    mesher.aim(params.tetrahedra);
    mesher.coarsen(cell.min(mesher.sizing.base), progress.part(0.5, 1.0))?;
    Ok(mesher)
}

/// From the first mesh to the last.
pub(crate) fn work(
    mesher: &mut Mesher<'_>,
    goal: usize,
    progress: Progress<'_>,
) -> Result<(), Error> {
    mesher.rounds(ROUNDS, goal, progress.part(0.0, 0.5))?;
    if !mesher.reach(goal, f64::INFINITY, progress.part(0.5, 0.6))? {
        return Ok(());
    }
    mesher.polish(GOAL, 4, progress.part(0.6, 0.7))?;
    mesher.fit(GOAL, progress.part(0.7, 0.8))?;
    // Each betters what the other leaves: other angles, other places.
    for finish in 0..FINISHES {
        let part = progress.part(0.8 + 0.2 * finish as f64 / FINISHES as f64, 1.0);
        let before = mesher.mesh.worst();
        mesher.polish(GOAL, 12, part.part(0.0, 0.2))?;
        mesher.trade(goal, GOAL, 12, part.part(0.2, 0.4))?;
        mesher.close(GOAL + MARGIN_CLOSING, part.part(0.4, 0.5))?;
        let worst = mesher.mesh.worst();
        if worst >= GOAL || worst < before + FINISH_GAIN {
            break;
        }
    }
    Ok(())
}
