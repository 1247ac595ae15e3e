use super::*;
use crate::test_mesh::block;
use crate::{Cut, RestState, Tissue, sensitivity, solve};
use supine_mesh::{BoundaryTag, Displacement};
use supine_space::{TablePose, sitting, supine};

/// Stiff to soft, back, and to where it was before, kPa.
const PATH: [f64; 7] = [6.0, 4.0, 2.8, 2.2, 3.1, 7.0, 4.0];

fn tilt() -> Vector {
    TablePose { ap_deg: 9.0, lat_deg: -5.0 }.gravity()
}

/// A block whose skin is tagged as cut on one side, so that all kinds of cut count.
fn body() -> Body {
    let mesh = crate::test_mesh::tagged(&block([3, 2, 2], 12.0, 0.12), |face| {
        let on = |plane: fn(&supine_space::Point) -> bool| face.iter().all(plane);
        if on(|p| p.z < 1e-9) {
            BoundaryTag::ChestWall
        } else if on(|p| p.x < 1e-9) {
            BoundaryTag::Cut
        } else {
            BoundaryTag::Skin
        }
    });
    Body::new(mesh, Tissue { young_kpa: 3.0, ..Tissue::default() })
}

/// The same with a modulus for each tetrahedron.
fn mixed() -> Body {
    let body = body();
    let moduli = (0..body.mesh.tets().len()).map(|t| 2.0 + (t % 4) as f64).collect();
    Body { young_kpa: Some(moduli), ..body }
}

/// The same with its skin's mid-sides moved outwards.
fn curved() -> Body {
    let body = body();
    let edges = Edges::new(&body.mesh);
    let points = body.mesh.points();
    let mut values = vec![Vector::zeros(); points.len() + edges.ends().len()];
    for (n, [a, b]) in edges.ends().iter().enumerate() {
        let [p, q] = [a, b].map(|end| points[*end as usize]);
        let top = points.iter().map(|p| p.z).fold(0.0, f64::max);
        if p.z > top - 1e-9 && q.z > top - 1e-9 {
            values[points.len() + n] = Vector::z() * 0.5;
        }
    }
    let offsets = Displacement::new(&body.mesh, &edges, values).unwrap();
    Body { curved: Some(offsets), ..body }
}

fn apart(a: &Displacement, b: &Displacement) -> f64 {
    let pairs = a.values().iter().zip(b.values());
    pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

/// Walks the path under two targets; each solution is that of a cold one.
fn walk(body: &Body, params: &Params) {
    let mut sequence = Sequence::new(body, supine(), params).unwrap();
    for kpa in PATH {
        for target in [sitting(), tilt()] {
            let load = Load { ct: supine(), target };
            let found = sequence.at(kpa, target, true, Progress::none()).unwrap();
            let cold = sensitivity(&body.with_mean(kpa), &load, params, Progress::none()).unwrap();
            let off = apart(found.deformation.displacement(), cold.0.displacement());
            assert!(off < 1e-6, "{params:?} {kpa} kPa: {off:e} mm");
            let slope = found.slope.unwrap();
            let off = apart(&slope, &cold.1) / cold.1.max_norm();
            assert!(off < 1e-5, "{params:?} {kpa} kPa: the slope is {off:e} off");
            let plain = sequence.at(kpa, target, false, Progress::none()).unwrap();
            assert!(plain.slope.is_none());
            let off = apart(plain.deformation.displacement(), cold.0.displacement());
            assert!(off < 1e-6, "{params:?} {kpa} kPa again: {off:e} mm");
        }
    }
}

#[test]
fn each_solution_is_that_of_a_cold_one() {
    for order in [Order::Linear, Order::Quadratic] {
        for rest in RestState::ALL {
            for cut in Cut::ALL {
                walk(&body(), &Params { order, rest, cut, ..Params::default() });
            }
            walk(&mixed(), &Params { order, rest, ..Params::default() });
        }
    }
    for rest in RestState::ALL {
        walk(&curved(), &Params { rest, ..Params::default() });
        walk(&body(), &Params { rest, spring_kpa_mm: Some(0.02), ..Params::default() });
    }
}

#[test]
fn the_same_calls_give_the_same_bytes() {
    let body = body();
    let all = || {
        let params = Params { rest: RestState::Unloaded, ..Params::default() };
        let mut sequence = Sequence::new(&body, supine(), &params).unwrap();
        PATH.map(|kpa| sequence.at(kpa, sitting(), true, Progress::none()).unwrap().deformation)
    };
    assert_eq!(all(), all());
}

#[test]
fn after_a_modulus_without_a_shape_the_sequence_goes_on() {
    let body = body();
    let params = Params { rest: RestState::Unloaded, ..Params::default() };
    let mut sequence = Sequence::new(&body, supine(), &params).unwrap();
    sequence.at(4.0, sitting(), false, Progress::none()).unwrap();
    let error = sequence.at(0.02, sitting(), false, Progress::none()).unwrap_err();
    assert!(
        matches!(error, Error::NoUnloadedShape { exists_from_kpa: Some(kpa), .. } if kpa == 4.0),
        "{error}"
    );
    let load = Load { ct: supine(), target: sitting() };
    let found = sequence.at(3.0, sitting(), false, Progress::none()).unwrap();
    let (cold, _) = solve(&body.with_mean(3.0), &load, &params, Progress::none()).unwrap();
    assert!(apart(found.deformation.displacement(), cold.displacement()) < 1e-6);
}
