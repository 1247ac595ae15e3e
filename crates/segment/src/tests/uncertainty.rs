//! How sure the boundary is said to be.

use super::phantom::{Thorax, Truth};
use super::{ready, run};
use crate::{Seeds, UNCERTAIN_MM, wall_uncertainty};
use supine_record::UncertainPatch;
use supine_space::{Matrix, Point, Progress, Side, Sphere};
use supine_volume::label;

#[test]
fn the_map_lies_along_the_boundary_and_holds_the_error() {
    let thorax = Thorax::default();
    let ct = thorax.ct(Matrix::identity());
    let segmenter = ready(&ct);
    let (made, _) = segmenter.segment(&Seeds::default(), Progress::none()).unwrap();
    let map = segmenter.uncertainty(&made);
    let region = Sphere::new(Point::new(75.0, -75.0, 0.0), 75.0).unwrap();
    let grid = made.labels.grid();
    let (mut wrong, mut said) = (0, 0);
    for n in 0..grid.len() {
        let p = grid.centre(grid.voxel(n));
        let (truth, got) = (thorax.truth(&p), made.labels.data()[n]);
        if truth == Truth::Outside || got == label::OUTSIDE {
            continue;
        }
        if (truth == Truth::Wall) != label::is_chest_wall(got) && region.contains(&p) {
            wrong += 1;
            said += usize::from(map.data()[n] > 0);
        }
    }
    assert!(wrong > 50 && said * 10 > wrong * 9, "{said} of {wrong} wrong voxels in the map");
    let found = wall_uncertainty(&made.labels, &map, region, (&region.centre(), Side::Left));
    assert!((80.0..250.0).contains(&found.boundary_cm2), "{found:?}");
    assert!(found.share() < 0.3, "{}", found.share());
}

/// Gland of the muscle's own density over the whole front: no edge shows.
#[test]
fn a_boundary_without_an_edge_is_uncertain_until_the_seeds_that_are_proposed_make_it_sure() {
    let thorax = Thorax::default();
    let mut ct = thorax.ct(Matrix::identity());
    let grid = ct.grid().clone();
    let middle = Point::new(60.0, -90.0, 0.0);
    for n in 0..grid.len() {
        let p = grid.centre(grid.voxel(n));
        if thorax.truth(&p) == Truth::Soft && (p - middle).norm() < 26.0 {
            ct.data_mut()[n] = 52;
        }
    }
    let region = Sphere::new(middle, 60.0).unwrap();
    let segmenter = ready(&ct);
    let with = |seeds: &Seeds| {
        let (made, _) = segmenter.segment(seeds, Progress::none()).unwrap();
        (segmenter.uncertainty(&made), made.labels)
    };
    let (plain, labels) = with(&Seeds::default());
    let found = wall_uncertainty(&labels, &plain, region, (&middle, Side::Left));
    let first = found.patches.first().expect("a uncertain place");
    assert!(first.area_cm2 > 8.0 && first.error_mm > UNCERTAIN_MM, "{first:?}");
    let points = |patch: &UncertainPatch| -> Vec<[Point; 2]> {
        patch.seeds_mm.iter().map(|pair| pair.map(Point::from)).collect()
    };
    let own = points(first);
    let pairs = own.len();
    assert!((pairs as f64) < 2.5 * first.area_cm2, "{pairs} pairs for {} cm²", first.area_cm2);
    let of = |side: usize, pairs: &[[Point; 2]]| pairs.iter().map(|pair| pair[side]).collect();
    let seeds = |pairs: &[[Point; 2]]| Seeds {
        chest_wall: of(0, pairs),
        soft_tissue: of(1, pairs),
        ..Seeds::default()
    };
    let [wall, soft] = own[0];
    let here = grid.voxel_at(&(wall + (soft - wall) / 2.0)).unwrap();
    assert!(plain.at(here) > 20, "{}", plain.at(here));
    let local = with(&seeds(&own[..1])).0.at(here);
    assert!(local <= 20, "{local} at {here:?} with {:?}", own[0]);
    let all: Vec<[Point; 2]> = found.patches.iter().flat_map(points).collect();
    let (map, labels) = with(&seeds(&all));
    let after = wall_uncertainty(&labels, &map, region, (&middle, Side::Left));
    let left: f64 = after.patches.iter().map(|patch| patch.area_cm2).sum();
    assert!(left < 0.3 * found.uncertain_cm2, "{left} of {}", found.uncertain_cm2);
}

#[test]
fn a_thorax_as_it_should_be_has_no_warning() {
    let (_, info) = run(&Thorax::default().ct(Matrix::identity()));
    // But for its wire on the skin.
    let other = info.warnings.iter().filter(|warning| warning.code() != "object-on-skin");
    assert_eq!(other.count(), 0, "{:?}", info.warnings);
}
