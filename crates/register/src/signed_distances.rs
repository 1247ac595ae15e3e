//! How far a scan lies from a surface.

use crate::{Matches, Posed};
use supine_mesh::Scan;
use supine_record::SkinDistances;
use supine_space::{Point, Pose, Sphere};

/// Signed distances of the points of a scan from a surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Distances {
    /// Where the scan's points lie, LPS, mm.
    pub places: Vec<Point>,
    /// Distance of each, positive outside, mm.
    pub mm: Vec<f64>,
}

/// Signed distances of a scan's points, in a pose, from the planes through the nearest points of a
/// surface no farther than `within_mm`; points that have none, or face another way, or are nearest
/// to a point without weight are left out.
pub fn signed_distances(
    scan: &Scan,
    pose: &Pose,
    surface: &Posed,
    weights: &[f64],
    within_mm: f64,
) -> Distances {
    let matches = Matches::new(scan, pose, surface, weights, within_mm);
    matches.0.iter().map(|m| (m.place, m.residual_mm)).collect()
}

impl FromIterator<(Point, f64)> for Distances {
    fn from_iter<I: IntoIterator<Item = (Point, f64)>>(all: I) -> Self {
        let (places, mm) = all.into_iter().unzip();
        Self { places, mm }
    }
}

impl Distances {
    /// Those of the points within a sphere.
    #[must_use]
    pub fn within(&self, sphere: &Sphere) -> Self {
        let all = self.places.iter().copied().zip(self.mm.iter().copied());
        all.filter(|(place, _)| sphere.contains(place)).collect()
    }

    /// What they come to.
    pub fn spread(&self) -> SkinDistances {
        if self.mm.is_empty() {
            return SkinDistances::default();
        }
        let n = self.mm.len() as f64;
        let mut sizes: Vec<f64> = self.mm.iter().map(|d| d.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        SkinDistances {
            points: self.mm.len(),
            mean_mm: self.mm.iter().sum::<f64>() / n,
            rms_mm: (self.mm.iter().map(|d| d * d).sum::<f64>() / n).sqrt(),
            p95_mm: sizes[((sizes.len() - 1) as f64 * 0.95).round() as usize],
            max_mm: sizes[sizes.len() - 1],
        }
    }
}
