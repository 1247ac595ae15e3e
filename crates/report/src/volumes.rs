//! How the volume of each structure changes, from the mesh and its displacement.

use crate::pictures::round_up;
use crate::{Jacobian, Scene, VolumeChange};
use rayon::prelude::*;
use supine_mesh::det_f;
use supine_mesh::{Displacement, Edges, Locator};
use supine_space::{Point, Progress, Stopped, Vector};
use supine_volume::label;

/// Classes of det F.
const CLASSES: usize = 40;
/// Minimum and maximum of how far the classes reach from 1.
const SPAN: [f64; 2] = [0.02, 0.5];
/// Points of the tumour's sphere along its radius.
const ACROSS: i32 = 10;

/// What is told of the map that carries the CT: towards the cut it fades to nothing, and that
/// squeezes and stretches.
const EXPORTED: &str = "all of it in the exported CT, with the fade at the cut";

/// det F at a place of the CT that stands for a volume.
#[derive(Clone, Copy, Debug)]
struct Sample {
    det: f64,
    /// Volume in the CT, mm³.
    volume: f64,
    place: Point,
}

/// The change of volume of all soft tissue that is simulated, of the tumour's sphere, of each finer
/// label of the scene, and of all as the CT is carried, with the fade at the cut, in this order;
/// what there is nothing of is left out. All but the last are of the tissue itself.
///
/// The tissue is sampled at the 35 points of each tetrahedron whose barycentric coordinates are
/// quarters, alike in weight, and the sphere on a grid; of the sphere, what lies outside the mesh
/// does not change. A structure's volume before is that of its samples: some per cent off for one
/// as small as a tetrahedron, its ratio to the volume after much less.
///
/// # Errors
/// When the user asked to stop.
pub fn volume_changes(
    scene: &Scene<'_>,
    progress: Progress<'_>,
) -> Result<Vec<VolumeChange>, Stopped> {
    let edges = Edges::new(scene.mesh());
    progress.at(0.1)?;
    let all = tissue(scene, scene.tissue, &edges);
    progress.at(0.7)?;
    let mut structures = vec![
        ("all simulated soft tissue", all.clone()),
        ("tumour as given", tumour(scene, &edges)),
    ];
    progress.at(0.8)?;
    if let Some(labels) = scene.tissues {
        for (number, name, _) in label::ALL {
            let here = |s: &&Sample| {
                labels.grid().voxel_at(&s.place).is_some_and(|v| labels.at(v) == number)
            };
            structures.push((name, all.iter().filter(here).copied().collect()));
        }
    }
    structures.push((EXPORTED, tissue(scene, scene.displacement(), &edges)));
    structures.retain(|(_, samples)| !samples.is_empty());
    for (_, samples) in &mut structures {
        samples.sort_by(|a, b| a.det.total_cmp(&b.det));
    }
    let ends = [0.01, 0.99].map(|share| (percentile(&structures[0].1, share) - 1.0).abs());
    let span = round_up(ends[0].max(ends[1])).clamp(SPAN[0], SPAN[1]);
    Ok(structures.iter().map(|(name, samples)| change(name, samples, span)).collect())
}

/// Samples of every tetrahedron.
fn tissue(scene: &Scene<'_>, moved: &Displacement, edges: &Edges) -> Vec<Sample> {
    let mesh = scene.mesh();
    let quarters: Vec<[f64; 4]> = (0..=4u8)
        .flat_map(|a| (0..=4 - a).map(move |b| (a, b)))
        .flat_map(|(a, b)| (0..=4 - a - b).map(move |c| [a, b, c, 4 - a - b - c]))
        .map(|l| l.map(|n| f64::from(n) / 4.0))
        .collect();
    let sample = |tet: usize| {
        let (corners, volume) = (mesh.corners(tet), mesh.volume(tet) / quarters.len() as f64);
        let at = move |&l: &[f64; 4]| Sample {
            det: det_f(mesh, edges, moved, tet, l),
            volume,
            place: Point::from((0..4).map(|c| corners[c].coords * l[c]).sum::<Vector>()),
        };
        quarters.iter().map(at).collect::<Vec<_>>()
    };
    (0..mesh.tets().len()).into_par_iter().flat_map_iter(sample).collect()
}

/// Samples of the tumour's sphere; none when there is none.
fn tumour(scene: &Scene<'_>, edges: &Edges) -> Vec<Sample> {
    let Some(sphere) = scene.tumour else { return Vec::new() };
    let locator = Locator::new(std::sync::Arc::clone(scene.deformation.mesh()));
    let step = sphere.radius() / f64::from(ACROSS);
    let along = -ACROSS..=ACROSS;
    let mut samples = Vec::new();
    for k in along.clone() {
        for j in along.clone() {
            for i in along.clone() {
                let offset = Vector::new(f64::from(i), f64::from(j), f64::from(k)) * step;
                if offset.norm() > sphere.radius() {
                    continue;
                }
                let place = sphere.centre() + offset;
                let det = locator
                    .locate(&place)
                    .map_or(1.0, |at| det_f(scene.mesh(), edges, scene.tissue, at.tet, at.weights));
                samples.push(Sample { det, volume: 0.0, place });
            }
        }
    }
    let whole = 4.0 / 3.0 * std::f64::consts::PI * sphere.radius().powi(3);
    let each = whole / samples.len() as f64;
    samples.iter_mut().for_each(|s| s.volume = each);
    samples
}

/// The figures of a structure from its samples in ascending order, one at least.
fn change(name: &str, samples: &[Sample], span: f64) -> VolumeChange {
    let (min, max) = (samples[0], samples[samples.len() - 1]);
    let before: f64 = samples.iter().map(|s| s.volume).sum();
    let after: f64 = samples.iter().map(|s| s.volume * s.det).sum();
    let mut shares = vec![0.0; CLASSES];
    for s in samples {
        let class = ((s.det - 1.0) / span + 1.0) / 2.0 * CLASSES as f64;
        shares[class.floor().clamp(0.0, (CLASSES - 1) as f64) as usize] += s.volume / before;
    }
    VolumeChange {
        structure: name.into(),
        before_ml: before / 1000.0,
        after_ml: after / 1000.0,
        jacobian: Jacobian {
            min: min.det,
            p01: percentile(samples, 0.01),
            mean: after / before,
            p99: percentile(samples, 0.99),
            max: max.det,
        },
        min_mm: min.place.coords.into(),
        max_mm: max.place.coords.into(),
        span,
        shares,
    }
}

/// det F below which a share of the volume lies; samples in ascending order.
fn percentile(samples: &[Sample], share: f64) -> f64 {
    let whole: f64 = samples.iter().map(|s| s.volume).sum();
    let mut sum = 0.0;
    let reached = samples.iter().find(|s| {
        sum += s.volume;
        sum >= share * whole
    });
    reached.or(samples.last()).map_or(1.0, |s| s.det)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phantom::Phantom;
    use supine_mesh::{Deformation, Displacement};
    use supine_space::{Matrix, Sphere};

    /// The phantom, stretched along x at the patient's left and squeezed at her right.
    fn stretched() -> Phantom {
        let mut phantom = Phantom::new(Matrix::identity(), Vector::zeros());
        let u = |p: &Point| Vector::new(0.1 * p.x.abs(), 0.0, 0.0);
        let mesh = std::sync::Arc::clone(phantom.deformation.mesh());
        let values = mesh.points().iter().map(u).collect();
        let displacement = Displacement::new(&mesh, &Edges::new(&mesh), values).unwrap();
        phantom.deformation = Deformation::new(mesh, displacement).unwrap();
        phantom
    }

    #[test]
    fn halves_that_are_stretched_and_squeezed_are_told_apart() {
        let phantom = stretched();
        let mut scene = phantom.scene();
        scene.tumour = Some(Sphere::new(Point::new(10.0, 0.0, 0.0), 5.0).unwrap());
        let changes = volume_changes(&scene, Progress::none()).unwrap();
        let of = |name: &str| changes.iter().find(|c| c.structure.starts_with(name)).unwrap();
        let close = |a: f64, b: f64, within: f64| assert!((a - b).abs() < within, "{a} {b}");
        let all = of("all simulated");
        close(all.before_ml, 64.0, 1e-9);
        close(all.after_ml, 64.0, 1e-9);
        close(all.jacobian.min, 0.9, 1e-12);
        close(all.jacobian.p99, 1.1, 1e-12);
        assert!(all.min_mm[0] <= 0.0 && all.max_mm[0] >= 0.0, "{all:?}");
        close(all.shares.iter().sum(), 1.0, 1e-9);
        close(all.shares[0] + all.shares[39], 1.0, 1e-9);
        close(of("tumour").after_ml / of("tumour").before_ml, 1.1, 1e-12);
        close(of("tumour").before_ml, 4.0 / 3.0 * std::f64::consts::PI * 0.125, 1e-12);
        // Gland at the patient's left, in front of y = 5 mm: 20 x 25 x 40 mm of the block.
        close(of("gland").before_ml, 20.0, 3.0);
        assert!(of("gland").jacobian.mean > 1.09 && of("fat").jacobian.mean < 0.94);
        assert!(changes.iter().all(|c| c.structure != "implant"), "there is none");
    }

    #[test]
    fn the_fade_shows_in_the_exported_ct_alone() {
        let phantom = Phantom::new(Matrix::identity(), Vector::zeros());
        let mut scene = phantom.scene();
        let stretched = stretched();
        scene.tissue = stretched.deformation.displacement();
        let changes = volume_changes(&scene, Progress::none()).unwrap();
        let [tissue, exported] = [&changes[0], &changes[changes.len() - 1]];
        assert!(tissue.jacobian.max > 1.09 && tissue.jacobian.min < 0.91, "{tissue:?}");
        assert_eq!(exported.structure, EXPORTED);
        assert!((exported.jacobian.max - 1.0).abs() < 1e-9, "{exported:?}");
    }
}
