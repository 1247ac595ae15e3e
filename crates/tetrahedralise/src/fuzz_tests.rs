//! Label maps of any content.

use crate::tests::{dome, euler, labelled, noise, sphere, wedge};
use crate::{Error, Params, tetrahedralise};
use proptest::prelude::*;
use proptest::test_runner::{RngAlgorithm, TestRng, TestRunner};
use std::sync::Arc;
use supine_space::{Matrix, Progress, Vector};
use supine_volume::{Region, label};

/// Label maps that are tried.
const CASES: u32 = 16;

/// A ball of one label.
type Blob = ([f64; 3], f64, u8);

fn blobs() -> impl Strategy<Value = Vec<Blob>> {
    let kind = prop_oneof![Just(label::OUTSIDE), Just(label::SOFT_TISSUE), Just(label::CHEST_WALL)];
    // A radius below a voxel's makes one-voxel holes, bridges and specks.
    prop::collection::vec((prop::array::uniform3(-30.0..30.0), 0.4f64..13.0, kind), 0..14)
}

/// Either a mesh that is right in all respects or an error that says why not.
#[test]
fn any_labels_give_a_mesh_or_an_error() {
    let config = ProptestConfig { cases: CASES, failure_persistence: None, ..Default::default() };
    let seed = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
    let mut runner = TestRunner::new_with_rng(config, seed);
    let shares = prop_oneof![Just(0.0), Just(0.002), Just(0.1)];
    let inputs = (blobs(), 0u8..4, shares, 0.0f64..100.0, 250usize..900);
    let outcome = runner.run(&inputs, |(blobs, base, flipped, salt, tetrahedra)| {
        let at = |p: &Vector| {
            if noise(p, salt) < flipped {
                return (noise(p, salt + 1.0) * 3.0) as u8;
            }
            let inside = |(c, r, _): &&Blob| (p - Vector::from(*c)).norm() < *r;
            match (blobs.iter().rev().find(inside), base) {
                (Some(&(_, _, kind)), _) => kind,
                (None, 0) => label::OUTSIDE,
                (None, 1) => wedge(p),
                (None, _) => dome(p),
            }
        };
        let labels = labelled(Matrix::identity(), at);
        let Ok(region) = Region::new(Arc::new(labels.clone()), sphere()) else { return Ok(()) };
        let params = Params { tetrahedra, ..Params::default() };
        match tetrahedralise(&region, &params, Progress::none()) {
            Ok((mesh, info)) => {
                prop_assert_eq!(mesh.tets().len(), tetrahedra);
                prop_assert!(info.quality.min_dihedral_deg > 0.0);
                // Panics at an edge of the boundary that has not two faces.
                prop_assert_eq!(euler(&mesh) % 2, 0);
            }
            Err(Error::NothingToMesh { .. } | Error::TooFew { .. }) => {}
            Err(other) => return Err(TestCaseError::fail(other.to_string())),
        }
        Ok(())
    });
    outcome.unwrap();
}
