//! Tissue from which the tumour has been cut out.

use crate::support::{TUMOUR, block, ct, plan};
use supine_fem::{Body, Contact, Load, Params, Shaft, SphereOnShaft, Tissue};
use supine_navigate::{Follower, Plan, Tool};
use supine_space::{Point, Pose, Progress, Vector, supine};

const RADIUS_MM: f64 = 16.0;
const AIR_HU: i16 = -1000;

/// A cavity where the tumour was, open to the front, with an applicator in it that is smaller.
fn in_cavity() -> Follower {
    let front = Vector::new(0.0, -1.0, 0.0);
    let way = Shaft { direction: front, radius_mm: 12.0, length_mm: 60.0 };
    let cavity = SphereOnShaft { centre: TUMOUR, radius_mm: RADIUS_MM, shaft: Some(way) };
    let beside = plan(Contact::Unilateral);
    let plan = Plan {
        tool: Tool { radius_mm: 13.0, shaft_radius_mm: 5.0, shaft_mm: 100.0 },
        placed: Pose::from_parts(TUMOUR.coords.into(), beside.placed.rotation),
        cavity: Some(cavity),
        ..beside
    };
    let body = Body::new(block(), Tissue { young_kpa: 3.0, ..Tissue::default() });
    let load = Load { ct: supine(), target: supine() };
    Follower::new(&body, &load, &Params::default(), plan, &TUMOUR, Progress::none()).unwrap()
}

/// The pose of the applicator in the cavity, shifted.
fn at(shift: [f64; 3]) -> Pose {
    let beside = plan(Contact::Unilateral).placed;
    Pose::from_parts((TUMOUR.coords + Vector::from(shift)).into(), beside.rotation)
}

#[test]
fn its_wall_is_pushed_and_holds_air() {
    let mut follower = in_cavity();
    let mut region = follower.region(ct()).unwrap();
    let still = follower.deformation().unwrap();
    let hu = |ct: &supine_volume::Ct, place: Point| ct.at(ct.grid().voxel_at(&place).unwrap());
    let before = region.carry(&still).unwrap().clone();
    assert_eq!(hu(&before, TUMOUR), AIR_HU);
    let side = |mm: f64| TUMOUR + Vector::new(mm, 0.0, 0.0);
    assert_ne!(hu(&before, side(RADIUS_MM + 6.0)), AIR_HU);
    // To the left until it has pushed the wall by 5 mm.
    let mut pushed = None;
    for step in 1..=16 {
        pushed = Some(follower.follow(&at([0.5 * f64::from(step), 0.0, 0.0])).unwrap());
        follower.between().unwrap();
    }
    let (answer, deformation) = pushed.unwrap();
    assert!(answer.touches && answer.settled && answer.force_n.x < 0.0, "{answer:?}");
    let after = region.carry(&deformation).unwrap().clone();
    // Nothing is left where the applicator is now, and what was there is still some tissue farther
    // on.
    let air = |ct: &supine_volume::Ct| {
        (0..26).filter(|mm| hu(ct, side(f64::from(*mm))) == AIR_HU).count()
    };
    assert!(air(&after) >= air(&before) + 2, "{} {}", air(&before), air(&after));
    // The wall is as ragged as its tetrahedra are large.
    assert!((0..14).all(|mm| hu(&after, side(f64::from(mm))) == AIR_HU));
    assert_ne!(hu(&after, side(28.0)), AIR_HU);
}

#[test]
fn its_wall_is_part_of_the_surface() {
    let follower = in_cavity();
    let (surface, deformation) = (follower.surface().unwrap(), follower.deformation().unwrap());
    let mesh = deformation.mesh();
    let inner = |p: &u32| (mesh.points()[*p as usize] - TUMOUR).norm() < RADIUS_MM + 5.0;
    let walls = surface.iter().filter(|triangle| triangle.iter().all(inner)).count();
    assert!(walls > 20, "{walls}");
    // Closed: each edge is of two triangles, one way in each.
    let mut edges: Vec<[u32; 2]> =
        surface.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]).collect();
    edges.sort_unstable();
    assert!(edges.iter().all(|[a, b]| edges.binary_search(&[*b, *a]).is_ok()));
}
