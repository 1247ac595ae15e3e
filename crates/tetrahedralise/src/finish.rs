//! From the mesh under work to the result in patient space.

use crate::boundary::Boundary;
use crate::complex::Complex;
use crate::fit::SAMPLES;
use crate::{Deviation, Error};
use supine_mesh::{BoundaryFace, BoundaryTag, TetMesh};
use supine_space::{Matrix, Point, Vector};

/// The mesh in patient space (LPS, mm), checked.
pub(crate) fn to_patient(
    mesh: &Complex,
    (origin, axes): &(Point, Matrix),
) -> Result<TetMesh, Error> {
    let points = mesh.points.iter().map(|p| origin + axes * p).collect();
    // A left-handed grid turns positive tetrahedra over.
    let mirrored = axes.determinant() < 0.0;
    let mut tets = Vec::with_capacity(mesh.count());
    for id in mesh.ids() {
        let mut tet = mesh.tets[id as usize];
        if mirrored {
            tet.swap(2, 3);
        }
        tets.push(tet);
    }
    Ok(TetMesh::new(points, tets, outer_faces(mesh))?)
}

/// The tagged faces, outwards in the mesher's frame.
pub(crate) fn outer_faces(mesh: &Complex) -> Vec<BoundaryFace> {
    let mut faces = Vec::new();
    for id in mesh.ids() {
        for corner in 0..4 {
            if let Some(tag) = BoundaryTag::from_number(mesh.tags[id as usize][corner]) {
                faces.push(BoundaryFace { points: mesh.face(id, corner), tag });
            }
        }
    }
    faces
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
        mean_mm: samples.iter().map(|s| s.0 * s.1).sum::<f64>() / area_mm2,
        p95_mm: p95.map_or(max_mm, |s| s.0),
        max_mm,
    })
}

/// Length of the edges where two tags meet, mm.
pub(crate) fn rim_length(mesh: &Complex) -> f64 {
    mesh.edges()
        .into_iter()
        .filter(|&[a, b]| {
            let both = mesh.class[a as usize] & mesh.class[b as usize];
            both.count_ones() > 1 && mesh.edge_class(&mesh.ring(a, b), a, b).0.count_ones() > 1
        })
        .map(|e| mesh.length(e))
        .sum()
}
