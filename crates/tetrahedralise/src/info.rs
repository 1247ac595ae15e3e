//! What is told of a mesh.

use crate::boundary::Boundary;
use crate::complex::Complex;
use crate::deviation::{Deviation, deviations};
use crate::finish;
use supine_mesh::{BoundaryTag, Quality, TetMesh, quality};
use supine_space::Warning;

/// A volume this far off the labels' (share) is worth a warning.
const VOLUME_OFF: f64 = 0.03;

/// What happened.
#[derive(Clone, Debug)]
pub struct Info {
    /// What the user should know.
    pub warnings: Vec<Warning>,
    /// Tetrahedra asked for.
    pub asked: usize,
    /// Tetrahedra made.
    pub tetrahedra: usize,
    /// Points made.
    pub points: usize,
    /// Shape of the mesh.
    pub quality: Quality,
    /// Edge length wanted at the surface, mm.
    pub edge_mm: f64,
    /// Separate pieces of soft tissue in the region that were left out.
    pub dropped_components: usize,
    /// Their volume, mm³.
    pub dropped_volume_mm3: f64,
    /// Patches of skin, chest wall or cut smaller than a face that took their neighbour's tag.
    pub joined_patches: usize,
    /// Distance of the boundary to the surfaces it follows, for each tag that there is.
    pub deviation: Vec<Deviation>,
    /// Length of the rims, where two tags meet, mm.
    pub rim_mm: f64,
    /// Volume of the mesh, mm³.
    pub volume_mm3: f64,
    /// Volume of what it was made of, mm³: the voxels of soft tissue in the sphere, without dropped
    /// pieces, or the mesh that was coarsened.
    pub label_volume_mm3: f64,
}

impl Info {
    pub(crate) fn new() -> Self {
        let quality = Quality {
            min_dihedral_deg: 0.0,
            max_dihedral_deg: 0.0,
            min_radius_ratio: 0.0,
            mean_radius_ratio: 0.0,
            worst: 0,
            mean_edge: 0.0,
        };
        Self {
            warnings: Vec::new(),
            asked: 0,
            tetrahedra: 0,
            points: 0,
            quality,
            edge_mm: 0.0,
            dropped_components: 0,
            dropped_volume_mm3: 0.0,
            joined_patches: 0,
            deviation: Vec::new(),
            rim_mm: 0.0,
            volume_mm3: 0.0,
            label_volume_mm3: 0.0,
        }
    }

    pub(crate) fn describe(
        &mut self,
        complex: &Complex,
        mesh: &TetMesh,
        boundary: &dyn Boundary,
        volume: f64,
        edge_mm: f64,
    ) {
        self.tetrahedra = mesh.tets().len();
        self.points = mesh.points().len();
        self.quality = quality(mesh);
        self.edge_mm = edge_mm;
        self.deviation = deviations(complex, boundary);
        self.rim_mm = finish::rim_length(complex);
        (self.volume_mm3, self.label_volume_mm3) = (mesh.total_volume(), volume);
        let gain = self.volume_mm3 / self.label_volume_mm3 - 1.0;
        if gain.abs() > VOLUME_OFF {
            let text = format!(
                "the volume of the mesh is {:+.1} % off that of the soft tissue it was made of: thin parts or \
                 narrow gaps are lost at this number of tetrahedra",
                100.0 * gain
            );
            self.warnings.push(Warning::new("mesh-volume", text).value("percent", 100.0 * gain));
        }
        for tag in BoundaryTag::ALL {
            if self.deviation.iter().all(|d| d.tag != tag) {
                let what = match tag {
                    BoundaryTag::ChestWall => ": nothing holds the tissue there",
                    BoundaryTag::Skin => ": the region lies inside the body",
                    BoundaryTag::Cut => ": the region holds a whole piece of tissue",
                };
                let text = format!("the mesh has no {} faces{what}", tag.name());
                self.warnings.push(Warning::new("mesh-lacks-boundary", text));
            }
        }
        if self.quality.min_dihedral_deg < 10.0 {
            let text = format!(
                "the worst tetrahedron has a dihedral angle of {:.1}°",
                self.quality.min_dihedral_deg
            );
            let degrees = self.quality.min_dihedral_deg;
            self.warnings
                .push(Warning::new("mesh-flat-tetrahedron", text).value("degrees", degrees));
        }
    }
}
