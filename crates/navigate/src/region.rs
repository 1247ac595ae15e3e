//! The CT around the tumour, carried by the tissue while the applicator moves.

use crate::Error;
use crate::departure::{hollow, left};
use std::sync::Arc;
use supine_mesh::{Deformation, Displacement, TetMesh};
use supine_space::{Grid, Matrix, Point, Vector};
use supine_volume::Ct;
use supine_warp::{Faded, Fading, Frames, Interpolation, Params};

/// Voxels along each axis of the region.
pub const VOXELS: usize = 128;
/// Their spacing, mm.
pub const SPACING_MM: f64 = 1.0;

/// What is seen lies so near to where the displacement of the tissue has it, mm: a tenth of a
/// voxel.
const OFF_MM: f64 = 0.1;

/// Carries a part of the CT by the displacements of a mesh, one after the other.
#[derive(Debug)]
pub struct LiveRegion {
    /// Of each node of the tissue that was not cut out, which node of the whole mesh it is.
    nodes: Vec<u32>,
    fading: Fading,
    params: Params,
    frames: Frames,
    frame: Ct,
    /// The largest displacement on the cut for which the width of the fade was sought, mm.
    sought_for_mm: Option<f64>,
}

/// The width of the fade is sought anew when the displacement on the cut is by this share larger
/// than it was.
const LARGER: f64 = 1.1;

impl LiveRegion {
    /// A cube of 128 voxels of 1 mm along the axes of the patient about `centre`, LPS, mm. `bears`:
    /// which tetrahedra are left when a cavity has been cut; it holds air.
    ///
    /// # Errors
    /// When the CT cannot be sampled, or no tissue is left.
    pub fn new(
        ct: Arc<Ct>,
        mesh: Arc<TetMesh>,
        bears: &[bool],
        centre: &Point,
    ) -> Result<Self, Error> {
        let bear = |tet: usize| bears.get(tet).is_none_or(|bears| *bears);
        let (left, nodes) = left(&mesh, bear)?;
        let cut = bears.contains(&false);
        let ct = if cut { Arc::new(hollow(&ct, &mesh, bears)) } else { ct };
        // Looked at for an instant; what is exported is interpolated as the case says.
        let interpolation = Interpolation::Linear;
        let params = Params { interpolation, curve_tolerance_mm: OFF_MM, ..Params::default() };
        let half = Vector::repeat(0.5 * (VOXELS - 1) as f64 * SPACING_MM);
        let spacing = Vector::repeat(SPACING_MM);
        let grid = Grid::new([VOXELS; 3], spacing, centre - half, Matrix::identity())
            .map_err(Error::Grid)?;
        let frames = Frames::onto(ct, &grid, Arc::new(left), &params)?;
        let frame = Ct::clone(frames.still());
        let fading = Fading::new(mesh);
        Ok(Self { nodes, fading, params, frames, frame, sought_for_mm: None })
    }

    /// The region under a displacement of the mesh, faded towards where the mesh is cut, HU.
    ///
    /// # Errors
    /// When it is a displacement of another mesh.
    pub fn carry(&mut self, deformation: &Deformation) -> Result<&Ct, Error> {
        let faded = self.faded(deformation)?;
        let values = faded.deformation.displacement().values();
        // Of a linear displacement the first nodes, which are points, have values.
        let values = self.nodes.iter().map_while(|node| values.get(*node as usize));
        let left = self.frames.mesh();
        let displacement = Displacement::new(left, self.frames.edges(), values.copied().collect())
            .map_err(supine_flow::Error::from)?;
        let carried =
            Deformation::new(Arc::clone(left), displacement).map_err(supine_flow::Error::from)?;
        self.frames.next(&carried, &mut self.frame)?;
        Ok(&self.frame)
    }

    /// The displacement with its fade. Its width is sought once, for that takes longer than the
    /// picture: the applicator moves the tissue where the mesh is cut but little.
    fn faded(&mut self, deformation: &Deformation) -> Result<Faded, Error> {
        let on_cut = self.fading.on_cut_mm(deformation.displacement());
        if self.sought_for_mm.is_none_or(|sought| on_cut > LARGER * sought) {
            self.sought_for_mm = Some(on_cut);
            self.params.fade_mm = None;
            let faded = self.fading.fade(deformation, &self.params)?;
            self.params.fade_mm = Some(faded.width_mm);
            return Ok(faded);
        }
        Ok(self.fading.fade(deformation, &self.params)?)
    }
}
