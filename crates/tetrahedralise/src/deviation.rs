//! How far the boundary of the mesh lies from the surfaces it follows.

use crate::boundary::Boundary;
use crate::complex::Complex;
use crate::fit::SAMPLES;
use supine_mesh::BoundaryTag;
use supine_record::SurfaceDistance;
use supine_space::Vector;

/// How far the faces of one tag lie from the surface they follow: that of the smoothed labels, or
/// of the mesh that was coarsened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// The tag.
    pub tag: BoundaryTag,
    /// Area of its faces, mm².
    pub area_mm2: f64,
    /// How far they lie.
    pub distance: SurfaceDistance,
}

/// Distance of the boundary faces of each tag to the field they follow.
pub(crate) fn deviations(mesh: &Complex, fields: &dyn Boundary) -> Vec<Deviation> {
    BoundaryTag::ALL.into_iter().filter_map(|tag| deviation(mesh, fields, tag)).collect()
}

fn deviation(mesh: &Complex, fields: &dyn Boundary, tag: BoundaryTag) -> Option<Deviation> {
    // Distance and the area it stands for.
    let mut samples: Vec<(f64, f64)> = Vec::new();
    for id in mesh.ids() {
        for corner in (0..4).filter(|&c| mesh.tags[id as usize][c] == tag.number()) {
            let p = mesh.face(id, corner).map(|v| mesh.points[v as usize]);
            let area = 0.5 * (p[1] - p[0]).cross(&(p[2] - p[0])).norm();
            for weights in SAMPLES {
                let at: Vector = p.iter().zip(weights).map(|(p, w)| p * w).sum();
                let level = fields.level(usize::from(tag.number() - 1), &at).abs();
                samples.push((level, area / SAMPLES.len() as f64));
            }
        }
    }
    samples.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let area_mm2: f64 = samples.iter().map(|s| s.1).sum();
    let max_mm = samples.last()?.0;
    let mut below = 0.0;
    let p95 = samples.iter().find(|s| {
        below += s.1;
        below >= 0.95 * area_mm2
    });
    Some(Deviation {
        tag,
        area_mm2,
        distance: SurfaceDistance {
            mean_mm: samples.iter().map(|s| s.0 * s.1).sum::<f64>() / area_mm2,
            p95_mm: p95.map_or(max_mm, |s| s.0),
            max_mm,
        },
    })
}
