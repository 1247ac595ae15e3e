//! How far a scan lies from the skin of a CT as it was and as displacements move it.

use crate::{Carried, Part};
use supine_mesh::{Scan, ScanDistances, SurfaceDistances};
use supine_record::SkinDistances;
use supine_register::{Distances, Matches, Posed, Rigid};
use supine_space::{Point, Pose};

/// Distance of a scan's points from each other, mm: as fine as they are shown.
const SPACING_MM: f64 = 2.5;
/// Farther from a surface than this, mm, a point belongs to none of it.
const WITHIN_MM: f64 = 40.0;

/// A scan held against the skin with its points at each of some places, with a name each. Skin that
/// moves and is not modelled has no distances.
pub(crate) fn distances(
    scan: &Scan,
    pose: &Pose,
    carried: &Carried,
    surfaces: &[(&str, Vec<Point>)],
) -> ScanDistances {
    let scan = scan.thinned(SPACING_MM);
    let known = |w: &f64| if *w > 0.0 { 1.0 } else { 0.0 };
    let weights: Vec<f64> = carried.weights.iter().map(known).collect();
    let mut all = ScanDistances {
        places: scan.points().iter().map(|p| pose * p).collect(),
        normals: scan.normals().iter().map(|n| pose * n).collect(),
        breast: vec![false; scan.points().len()],
        surfaces: Vec::new(),
    };
    for (name, points) in surfaces {
        let (points, triangles) = (points.clone(), carried.triangles.clone());
        let posed = Posed::new(&Rigid { points, triangles, weights: weights.clone() }, &[]);
        let matches = Matches::new(&scan, pose, &posed, &weights, WITHIN_MM);
        let mut mm = vec![None; scan.points().len()];
        all.breast.fill(false);
        for m in &matches.0 {
            mm[m.of as usize] = Some(m.residual_mm);
            all.breast[m.of as usize] = carried.parts[m.nearest as usize] == Part::Breast;
        }
        all.surfaces.push(SurfaceDistances { name: (*name).into(), mm });
    }
    all.rounded()
}

/// What the distances of the points that count come to.
pub(crate) fn spread(
    all: &ScanDistances,
    surface: &SurfaceDistances,
    counts: impl Fn(usize) -> bool,
) -> SkinDistances {
    let own = surface.mm.iter().enumerate().filter(|(n, _)| counts(*n));
    own.filter_map(|(n, mm)| Some((all.places[n], (*mm)?))).collect::<Distances>().spread()
}
