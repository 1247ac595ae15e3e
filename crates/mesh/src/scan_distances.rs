//! Distances of a scan's points from surfaces.

use supine_space::{Point, Vector};

/// Points of a scan with their signed distances from surfaces.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScanDistances {
    /// Where the scan's points lie, LPS, mm.
    pub places: Vec<Point>,
    /// Their unit normals out of the body, LPS.
    pub normals: Vec<Vector>,
    /// Whether each lies on the breast, by the last surface.
    pub breast: Vec<bool>,
    /// The surfaces, with the distances of all points from each.
    pub surfaces: Vec<SurfaceDistances>,
}

/// Signed distances from one surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceDistances {
    /// What surface it is, in a word.
    pub name: String,
    /// Of each point, mm, positive outside the body; none where the point belongs to no part of the
    /// surface that is known.
    pub mm: Vec<Option<f64>>,
}

impl ScanDistances {
    /// All numbers to three decimals, as files have them.
    #[must_use]
    pub fn rounded(mut self) -> Self {
        let round = |x: f64| (x * 1000.0).round() / 1000.0;
        self.places.iter_mut().for_each(|p| p.coords = p.coords.map(round));
        self.normals.iter_mut().for_each(|n| *n = n.map(round));
        for surface in &mut self.surfaces {
            surface.mm.iter_mut().flatten().for_each(|mm| *mm = round(*mm));
        }
        self
    }
}
