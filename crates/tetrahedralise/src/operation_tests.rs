//! Every operation, anywhere, any number of times, leaves a mesh.

use crate::collapse::CollapseRule;
use crate::complex::Complex;
use crate::domain::edge_for;
use crate::faults::{euler, faults};
use crate::fields::{Fields, Smoothing};
use crate::mesher::Mesher;
use crate::remesh::ANY;
use crate::sizing::Sizing;
use crate::start::start;
use crate::tests::{Shape, dome, labelled, sphere, wedge};
use crate::{Info, Params, labels};
use std::sync::Arc;
use supine_space::{Matrix, Progress, Vector};
use supine_volume::Region;

/// Operations on each mesh.
const OPERATIONS: usize = 500;

/// Repeatable random numbers.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % n as u64) as usize
    }
}

/// All that a rollback must restore; the order within a star does not count.
type Snapshot = (Vec<Vector>, Vec<u8>, Vec<(u32, [u32; 4], [u8; 4], f64)>, Vec<Vec<u32>>);

fn snapshot(mesh: &Complex) -> Snapshot {
    let tets = mesh.ids().map(|id| {
        let n = id as usize;
        (id, mesh.tets[n], mesh.tags[n], mesh.quality[n])
    });
    let mut stars = mesh.star.clone();
    stars.iter_mut().for_each(|star| star.sort_unstable());
    (mesh.points.clone(), mesh.class.clone(), tets.collect(), stars)
}

/// One operation of a random kind at a random place; its name.
fn operate(m: &mut Mesher<'_>, random: &mut Random) -> &'static str {
    let ids: Vec<u32> = m.mesh.ids().collect();
    let id = ids[random.below(ids.len())];
    let tet = m.mesh.tets[id as usize];
    let (a, b) = (random.below(4), random.below(3));
    let (a, b) = (tet[a], tet[(a + 1 + b) % 4]);
    match random.below(8) {
        0 => {
            m.split(a, b, 1e-3);
            "split"
        }
        1 | 2 => {
            let longest = if random.below(2) == 0 { 9.0 } else { f64::INFINITY };
            m.collapse_edge([a, b], CollapseRule { floor: 1e-3, longest });
            "collapse"
        }
        3 => {
            m.remove_edge(a, b, -1.0, &ANY);
            "edge removal"
        }
        4 => {
            m.flip_face(id, random.below(4), 1e-3);
            "face flip"
        }
        5 => {
            m.flip_edge([a, b], &ANY, |_| 1e-3, |_, _, _, _| true);
            "edge flip"
        }
        6 => {
            m.smooth(a, 2);
            "smoothing"
        }
        _ => {
            let push = [0; 3].map(|_: i32| random.below(100) as f64 / 50.0 - 1.0);
            m.draw(a, m.mesh.points[a as usize] + Vector::from(push));
            "move"
        }
    }
}

#[test]
fn every_operation_leaves_a_mesh_and_is_undone_to_the_bit() {
    for (shape, seed) in [(dome as Shape, 1), (wedge, 2), (dome, 3)] {
        let labels = labelled(Matrix::identity(), shape);
        let region = Region::new(Arc::new(labels.clone()), sphere()).unwrap();
        let kinds = labels::kinds(&region, crate::Piece::Largest, 7.5, &mut Info::new()).unwrap();
        let fields = Fields::new(&kinds, sphere(), Smoothing::Labels(1.5), 1.0).unwrap();
        let (complex, _, _) = start(&fields, 11.0, Progress::none()).unwrap().unwrap();
        let edge = edge_for(fields.volume, 300);
        let sizing = Sizing::new(&fields, &Params::default(), edge);
        let mut m = Mesher { mesh: complex, sizing };
        let mut random = Random(seed);
        let (number, mut counts) = (euler(&m.mesh), 0);
        for step in 0..OPERATIONS {
            let undone = random.below(4) == 0;
            let (before, count) = (undone.then(|| snapshot(&m.mesh)), m.mesh.count());
            if undone {
                m.mesh.begin();
            }
            let name = operate(&mut m, &mut random);
            if let Some(before) = before {
                m.mesh.rollback();
                assert!(snapshot(&m.mesh) == before, "step {step}: {name} is not undone");
            }
            counts += usize::from(m.mesh.count() != count);
            let faults = faults(&m.mesh);
            assert!(faults.is_empty(), "step {step}: {name}: {:?}", &faults[..faults.len().min(5)]);
            assert_eq!(euler(&m.mesh), number, "step {step}: {name} changed the topology");
        }
        assert!(counts > OPERATIONS / 10, "only {counts} operations did anything");
    }
}
