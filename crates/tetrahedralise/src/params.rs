//! What the user decides.

use crate::Error;

/// Settings of the mesher.
#[derive(Clone, Debug, PartialEq)]
pub struct Params {
    /// Tetrahedra asked for.
    pub tetrahedra: usize,
    /// Standard deviation of the Gaussian that smooths the labels where their surfaces are not
    /// known between the voxels, mm; never below 0.9 of the largest voxel spacing. Labels rougher
    /// than voxels of a smooth shape are smoothed more widely, up to twice.
    pub smoothing_mm: f64,
    /// Standard deviation of the Gaussian that smooths the distances to known surfaces, mm.
    pub surface_smoothing_mm: f64,
    /// Growth of the edge length with depth below the boundary, mm per mm.
    pub growth: f64,
    /// Largest edge length inside, in units of that at the boundary; 1 or more.
    pub growth_limit: f64,
    /// Edge length on the rims in units of that on the surfaces; above 0, at most 1.
    pub rim_refinement: f64,
    /// Soft tissue between chest wall and skin that is thinner than this counts as chest wall,
    /// mm: wedges end in a face of this height with the tag of the chest wall.
    pub min_thickness_mm: f64,
    /// Which piece is meshed when there are several.
    pub piece: Piece,
}

/// Which of several separate pieces of soft tissue in the region is meshed; the others are told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Piece {
    /// The largest.
    #[default]
    Largest,
    /// The one that holds the sphere's centre.
    Centre,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            tetrahedra: 5000,
            smoothing_mm: 1.9,
            surface_smoothing_mm: 1.0,
            growth: 0.4,
            growth_limit: 1.7,
            rim_refinement: 0.58,
            min_thickness_mm: 1.0,
            piece: Piece::Largest,
        }
    }
}

/// More tetrahedra than this are not numbered. Chosen, not measured.
pub(crate) const MAX_TETRAHEDRA: usize = 5_000_000;

/// Refuses settings that are out of range.
pub(crate) fn check(params: &Params) -> Result<(), Error> {
    let settings = [
        ("smoothing_mm", params.smoothing_mm, 0.0..=20.0, "0 to 20"),
        ("surface_smoothing_mm", params.surface_smoothing_mm, 0.0..=20.0, "0 to 20"),
        ("growth", params.growth, 0.0..=2.0, "0 to 2"),
        ("growth_limit", params.growth_limit, 1.0..=5.0, "1 to 5"),
        ("rim_refinement", params.rim_refinement, 0.2..=1.0, "0.2 to 1"),
        ("min_thickness_mm", params.min_thickness_mm, 0.1..=10.0, "0.1 to 10"),
    ];
    for (name, value, allowed, range) in settings {
        if !allowed.contains(&value) {
            return Err(Error::Setting { name, value, range });
        }
    }
    Ok(())
}
