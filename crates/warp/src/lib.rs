//! CT, mesh and displacement to the deformed CT.
//!
//! For every voxel centre inside a deformed tetrahedron the CT is sampled where that tetrahedron
//! came from (as [`Interpolation`] says, halves to even). Each voxel has exactly one owner, decided
//! by exact signs. Where the tissue was and no longer is there is air; all else is the CT, bit for
//! bit.
//!
//! The steps, one file each: [`fade`] holds the displacement back at the cut; `pieces` follows a
//! quadratic displacement by straight tetrahedra, which live frames have `kept`; `collar` adds the
//! air-side layer that carries the blurred skin edge; `map` converts all vertices to index space,
//! once; `raster` says which voxels each tetrahedron owns (`batch` and `sweep`: several at once;
//! `rows` and `predicate`: exact signs where that is not enough) in the `order` of a curve;
//! `resample` samples them by a `kernel` and keeps by `coverage` that each is written once;
//! `frames` does so again and again; `fields` and `points` carry vectors and points; `origins`
//! leads any grid back to the CT, for `labels`, `masks` and `dose`; `surface` and `contours` go
//! forward like points; `consistency` holds the two fields against each other; `resampling` crops
//! fields to what moves and leads them on into the air that the tissue left, for other programs;
//! `dense` keeps clips and wires whole; `beyond` counts what was never measured.
//!
//! ```
//! use std::sync::Arc;
//! use supine_mesh::{
//!     BoundaryFace, BoundaryTag, Deformation, Displacement, Edges, TET_FACES, TetMesh,
//! };
//! use supine_space::{Point, Vector};
//! use supine_warp::{Params, carry_points};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let corners = [[0.0, 0.0, 0.0], [20.0, 0.0, 0.0], [0.0, 20.0, 0.0], [0.0, 0.0, 20.0]];
//! let face = |f: usize, tag| BoundaryFace { points: TET_FACES[f].map(|p| p as u32), tag };
//! let skin = [0, 1, 2].map(|f| face(f, BoundaryTag::Skin));
//! let boundary = [&skin[..], &[face(3, BoundaryTag::ChestWall)]].concat();
//! let mesh = TetMesh::new(corners.map(Point::from).to_vec(), vec![[0, 1, 2, 3]], boundary)?;
//!
//! // The tip moves by 4 mm, a point half way to it by 2.
//! let mut values = vec![Vector::zeros(); 4];
//! values[3].x = 4.0;
//! let displacement = Displacement::new(&mesh, &Edges::new(&mesh), values)?;
//! let deformation = Deformation::new(Arc::new(mesh), displacement)?;
//! let moved = carry_points(&deformation, &Params::default(), &[Point::new(2.0, 2.0, 10.0)])?;
//! assert!(moved[0].is_some_and(|p| (p - Point::new(4.0, 2.0, 10.0)).norm() < 1e-9));
//! # Ok(())
//! # }
//! ```

mod air;
mod batch;
mod beside_skin;
mod beyond;
mod collar;
mod consistency;
mod contours;
mod coverage;
mod dense;
mod dose;
mod dose_volume;
mod element;
mod error;
mod fade;
mod fields;
mod filter;
mod frames;
mod kept;
mod kernel;
mod labels;
mod map;
mod mask_contours;
mod masks;
mod order;
mod origins;
mod outline;
mod params;
mod pieces;
mod points;
mod predicate;
mod pullback;
mod raster;
mod resample;
mod resampling;
mod rows;
mod rules;
mod slices;
mod slid;
mod surface;
mod sweep;
mod undeformed;

#[cfg(test)]
mod tests;

pub use beyond::beyond_field_mm3;
pub use consistency::{consistency, interpolation_error};
pub use contours::carry_contours;
pub use dense::keep_dense;
pub use dose::{BeyondGrid, CarriedDose, DoseTotals, carry_dose, density, dose_totals};
pub use dose_volume::DoseVolume;
pub use error::Error;
pub use fade::{Faded, Fading, fade};
pub use fields::{Fields, fields};
pub use filter::Interpolation;
pub use frames::Frames;
pub use labels::carry_labels;
pub use mask_contours::mask_contours;
pub use masks::carry_mask;
pub use origins::{Origin, Origins};
pub use params::Params;
pub use points::carry_points;
pub use resampling::{MovingPart, cell_mm, moving_part, resampling};
pub use slices::contours as surface_contours;
pub use supine_record::Consistency;
pub use surface::{Carried, carry_surface, carry_vertices};

use crate::{collar::Skin, fade::Prepared, map::Map, pieces::Pieces};
use supine_mesh::Deformation;
use supine_space::{Grid, Progress, Warning};
use supine_volume::Ct;

/// What happened in [`warp`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Info {
    /// What the user should know.
    pub warnings: Vec<Warning>,
    /// What is told of it, but for dense things and for how well the fields undo each other, which
    /// [`keep_dense`] and [`consistency`] find.
    pub facts: supine_record::Warp,
    /// Voxels beside the skin that now hold the CT's blurred skin edge.
    pub collar_voxels: usize,
    /// Tetrahedra with det F <= 0 somewhere, after the fade.
    pub inverted_tetrahedra: usize,
    /// Straight tetrahedra that were rasterised, without the collar.
    pub pieces: usize,
    /// Largest displacement of a node after the fade, mm.
    pub max_displacement_mm: f64,
}

/// Missing the curved map by less than this is not worth a word, mm: a tenth of a fine voxel.
const CURVE_WARNING_MM: f64 = 0.1;
/// Outside mesh and collar, voxels of the CT at or above this are tissue and stay.
const BODY_HU: i16 = -500;

/// The CT after deformation, on its own grid; `deformation` as the solver gave it, the fade is
/// applied within.
///
/// # Errors
/// When an axis of the CT has a single voxel, a parameter
/// is out of range, or the user stopped.
pub fn warp(
    ct: &Ct,
    deformation: &Deformation,
    params: &Params,
    progress: Progress<'_>,
) -> Result<(Ct, Info), Error> {
    warp_onto(ct.grid(), ct, deformation, params, progress)
}

/// As [`warp`], on any `grid`: what lies outside the mesh is interpolated as `params` say, averaged
/// where the grid is coarser than the CT, and air outside the CT. On the CT's own grid it stays bit
/// for bit.
///
/// # Errors
/// As [`warp`], for the grid as for the CT.
pub fn warp_onto(
    grid: &Grid,
    ct: &Ct,
    deformation: &Deformation,
    params: &Params,
    progress: Progress<'_>,
) -> Result<(Ct, Info), Error> {
    map::check_grid(ct.grid())?;
    map::check_grid(grid)?;
    let prepared = Prepared::new(deformation, params)?;
    progress.at(0.05)?;
    let curve = prepared.curve();
    let pieces = Pieces::new(&curve, params.curve_tolerance_mm, progress.part(0.05, 0.15))?;
    let collar = Skin::new(ct, &pieces, params.collar_mm).collar(&pieces);
    let map = Map::new([ct.grid(), grid], &pieces, &collar);
    progress.at(0.2)?;
    let resampling = frames::resampling(ct, grid, &map, params);
    let mut out = undeformed::onto(grid, ct, params, progress.part(0.2, 0.5))?;
    let source = frames::source(ct);
    let (_, counts) = resampling.run(source, &map, out.data_mut(), progress.part(0.5, 1.0))?;
    let (jacobian, inverted_tetrahedra) =
        element::statistics(curve.mesh, curve.edges, curve.displacement);
    let mut info = Info {
        facts: supine_record::Warp {
            fade_mm: prepared.faded.width_mm,
            moved_voxels: counts.mesh,
            vacated_voxels: counts.vacated,
            folded_voxels: counts.folded,
            jacobian,
            forward_then_backward: None,
            dense: vec![],
        },
        collar_voxels: counts.collar,
        inverted_tetrahedra,
        pieces: pieces.tets.len(),
        max_displacement_mm: curve.displacement.max_norm(),
        warnings: prepared.faded.warnings,
    };
    warn(&mut info, &map, grid, &pieces);
    Ok((out, info))
}

/// Adds the warnings that the finished volume gives rise to.
fn warn(info: &mut Info, map: &Map, grid: &Grid, pieces: &Pieces) {
    let mut warn = |code, text, value: (&'static str, f64)| {
        info.warnings.push(Warning::new(code, text).value(value.0, value.1));
    };
    if info.inverted_tetrahedra > 0 {
        let text = format!(
            "{} tetrahedra are turned inside out (smallest det F {:.2}): the volume is wrong there",
            info.inverted_tetrahedra, info.facts.jacobian.min
        );
        warn("inverted-tetrahedra", text, ("tetrahedra", info.inverted_tetrahedra as f64));
    }
    if info.facts.folded_voxels > 0 {
        let text = format!(
            "{} voxels lie in more than one part of the deformed mesh: it touches or folds over \
             itself there",
            info.facts.folded_voxels
        );
        warn("overlapping-voxels", text, ("voxels", info.facts.folded_voxels as f64));
    }
    let size = grid.size();
    let beyond = |v: &[f64; 3]| (0..3).any(|a| v[a] < -0.5 || v[a] > size[a] as f64 - 0.5);
    let vertices = map.before.iter().zip(&map.deformed).take(pieces.rest.len());
    let outside = vertices.filter(|(rest, deformed)| !beyond(rest) && beyond(deformed)).count();
    if outside > 0 {
        let text = format!(
            "the deformed tissue moves out of the volume ({outside} vertices): it is cut off there"
        );
        warn("tissue-leaves-volume", text, ("vertices", outside as f64));
    }
    if let Some(missed) = pieces.missed_mm.filter(|&missed| missed > CURVE_WARNING_MM) {
        let text = format!(
            "the quadratic displacement is followed to {missed:.2} mm only: finer pieces would be \
             too many"
        );
        warn("coarse-pieces", text, ("mm", missed));
    }
}
