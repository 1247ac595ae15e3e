use super::*;
use crate::test_mesh::block;
use crate::{Load, Params, RestState, Tissue, sensitivity, solve};
use std::sync::Arc;
use supine_mesh::{BoundaryTag, Displacement, Edges, TetMesh};
use supine_space::{Point, Progress, sitting, supine};

const HEIGHT: f64 = 30.0;

/// A block whose top is bent to a paraboloid of 6 mm by moving all points in proportion to their
/// height.
fn bent(p: &Point) -> Vector {
    let (x, y) = (p.x / 30.0, p.y / 30.0);
    Vector::z() * (6.0 * p.z / HEIGHT * (4.0 * x * (1.0 - x) + 4.0 * y * (1.0 - y)))
}

fn dome(cells: usize) -> Arc<TetMesh> {
    let flat = block([cells; 3], HEIGHT / cells as f64, 0.0);
    let points = flat.points().iter().map(|p| p + bent(p)).collect();
    TetMesh::new(points, flat.tets().to_vec(), flat.boundary().to_vec()).unwrap().into()
}

/// Offsets of the mid-sides of its skin to the true surface.
fn offsets(cells: usize) -> Displacement {
    let flat = block([cells; 3], HEIGHT / cells as f64, 0.0);
    let edges = Edges::new(&flat);
    let mut values = vec![Vector::zeros(); flat.points().len() + edges.ends().len()];
    for face in flat.boundary().iter().filter(|f| f.tag == BoundaryTag::Skin) {
        let [a, b, c] = face.points;
        for (a, b) in [(a, b), (b, c), (c, a)] {
            let [p, q] = [a, b].map(|n| flat.points()[n as usize]);
            let chord = (bent(&p) + bent(&q)) / 2.0;
            let edge = edges.between(a, b).unwrap() as usize;
            values[flat.points().len() + edge] = bent(&(p + (q - p) * 0.5)) - chord;
        }
    }
    Displacement::new(&dome(cells), &edges, values).unwrap()
}

fn load() -> Load {
    Load { ct: supine(), target: sitting() }
}

fn tissue() -> Tissue {
    Tissue { young_kpa: 3.0, ..Tissue::default() }
}

/// Displacement in the middle of the top, an average over the points near it.
fn top(mesh: &TetMesh, u: &Displacement) -> Vector {
    let place = Point::new(15.0, 15.0, HEIGHT + 12.0);
    let near = (0..mesh.points().len())
        .min_by(|&a, &b| {
            let [a, b] = [a, b].map(|n| (mesh.points()[n] - place).norm());
            a.total_cmp(&b)
        })
        .unwrap();
    u.values()[near]
}

#[test]
fn no_offsets_change_nothing() {
    let mesh = dome(2);
    let edges = Edges::new(&mesh);
    let zero = vec![Vector::zeros(); mesh.points().len() + edges.ends().len()];
    let zero = Displacement::new(&mesh, &edges, zero).unwrap();
    let tissue = tissue();
    let body = Body::new(mesh.clone(), tissue);
    let curved = Body { curved: Some(zero), ..body.clone() };
    for rest in [RestState::Net, RestState::Unloaded] {
        let params = Params { rest, ..Params::default() };
        let run = |b: &Body| solve(b, &load(), &params, Progress::none()).unwrap();
        assert_eq!(run(&body), run(&curved));
    }
}

#[test]
fn curved_elements_come_nearer_to_a_fine_mesh() {
    let tissue = tissue();
    let run = |mesh: &Arc<TetMesh>, curved: Option<Displacement>| {
        let body = Body { curved, ..Body::new(mesh.clone(), tissue) };
        let (u, _) = solve(&body, &load(), &Params::default(), Progress::none()).unwrap();
        top(mesh, u.displacement())
    };
    let truth = run(&dome(8), Some(offsets(8)));
    let coarse = dome(2);
    let [straight, curved] = [None, Some(offsets(2))].map(|o| (run(&coarse, o) - truth).norm());
    assert!(curved < 0.5 * straight, "{curved} {straight} of {}", truth.norm());
}

/// Both rest states and the sensitivity take curved bodies.
#[test]
fn unloading_and_sensitivity_hold_on_a_curved_body() {
    let (mesh, offsets, step) = (dome(2), offsets(2), 1e-4);
    for rest in [RestState::Net, RestState::Unloaded] {
        let params = Params { rest, tolerance: 1e-12, ..Params::default() };
        let at = |young_kpa: f64| {
            let tissue = Tissue { young_kpa, ..tissue() };
            let body = Body { curved: Some(offsets.clone()), ..Body::new(mesh.clone(), tissue) };
            sensitivity(&body, &load(), &params, Progress::none()).unwrap()
        };
        let (_, slope, info) = at(3.0);
        let (up, down) = (at(3.0 + step).0, at(3.0 - step).0);
        let pairs =
            up.displacement().values().iter().zip(down.displacement().values()).zip(slope.values());
        let off = pairs.map(|((u, d), s)| ((u - d) / (2.0 * step) - s).norm()).fold(0.0, f64::max);
        assert!(off < 1e-5 * slope.max_norm(), "{rest:?} {off:e}");
        assert!(info.unloading.is_none_or(|u| u.reload_error_mm.unwrap() < 1e-6));
    }
}

#[test]
fn places_are_found_in_a_curved_element() {
    let mesh = dome(2);
    let edges = Edges::new(&mesh);
    let elements = element_nodes::<10>(&mesh, &edges);
    let mut positions: Vec<Vector> = mesh.points().iter().map(|p| p.coords).collect();
    positions.extend(edges.ends().iter().map(|[a, b]| {
        (mesh.points()[*a as usize].coords + mesh.points()[*b as usize].coords) / 2.0
    }));
    positions.iter_mut().zip(offsets(2).values()).for_each(|(p, o)| *p += o);
    for element in &elements {
        let l = [0.1, 0.2, 0.3, 0.4];
        let nodes = element.iter().zip(shape::<10>(l));
        let place: Vector = nodes.map(|(n, share)| positions[*n as usize] * share).sum();
        let found = parent_place(&positions, element, [0.25; 4], place).unwrap();
        assert!((0..4).all(|k| (found[k] - l[k]).abs() < 1e-10), "{found:?}");
    }
}

#[test]
fn offsets_of_corners_alone_are_refused() {
    let (mesh, tissue) = (dome(2), tissue());
    let linear = Displacement::zero(&mesh);
    let body = Body { curved: Some(linear.clone()), ..Body::new(mesh.clone(), tissue) };
    let refused = solve(&body, &load(), &Params::default(), Progress::none());
    assert!(matches!(refused, Err(Error::Curved)));
}
