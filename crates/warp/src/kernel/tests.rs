//! Every kernel against the plain one, and that against f64.

mod cubic;

use super::{Kernel, LANES, Locals, Place, Source, Spots};
use crate::batch::{Batch, gathered};
use crate::predicate::Index;
use crate::pullback::{Pullback, trilinear};
use crate::tests::fixture::patterned_ct;
use proptest::prelude::*;

const SIZE: [usize; 3] = [23, 19, 17];

/// Corners anywhere in and around the volume; flat ones among them.
fn corners() -> impl Strategy<Value = [Index; 4]> {
    let free = prop::array::uniform4(prop::array::uniform3(-6.0..28.0f64));
    let lattice = prop::array::uniform4(prop::array::uniform3(-2..20i32))
        .prop_map(|all| all.map(|c| c.map(f64::from)));
    prop_oneof![free, lattice]
}

fn places(n: usize) -> Vec<Place> {
    (0..n as u32).map(|n| Place::new([n % 13, n / 13 % 11, n % 7])).collect()
}

/// Where the tetrahedron stands that is looked at.
const LANE: usize = 3;

/// The map of one tetrahedron among others, and where its places begin.
fn locals(deformed: [Index; 4], rest: [Index; 4], source: &Source<'_>) -> (Locals, Index) {
    let corners = |own: [Index; 4]| {
        let vertices: Vec<Index> = SIMPLE.into_iter().chain(own).collect();
        let mut some = [0; LANES];
        some[LANE] = 1;
        gathered(&vertices, &[[0, 1, 2, 3], [4, 5, 6, 7]], &some)
    };
    let batch = Batch::new(corners(deformed), SIZE);
    let locals = Locals::new(&batch, corners(rest), 0, source);
    (locals, batch.first.map(|first| first.0[LANE]))
}

fn sample(kernel: Kernel, source: &Source<'_>, locals: &Locals, places: &[Place]) -> Vec<i16> {
    let (mut spots, mut values) = (Spots::default(), vec![0; places.len()]);
    spots.grow(places.len());
    kernel.locate(locals, LANE, places, spots.some(0, places.len()));
    kernel.blend(source, &spots, &mut values);
    values
}

const SIMPLE: [Index; 4] = [[1.0, 1.0, 1.0], [4.0, 1.0, 1.0], [1.0, 4.0, 1.0], [1.0, 1.0, 4.0]];

macro_rules! agrees {
    ($name:ident, $kernel:expr) => {
        proptest! {
            #[test]
            fn $name(deformed in corners(), rest in corners()) {
                let data = patterned_ct(SIZE, 5);
                let source = Source::new(&data, SIZE);
                let (locals, _) = locals(deformed, rest, &source);
                let places = places(12 * LANES);
                prop_assert_eq!(
                    sample(Kernel::Scalar, &source, &locals, &places),
                    sample($kernel, &source, &locals, &places)
                );
            }
        }
    };
}

agrees!(the_fastest_gives_the_bits_of_the_plain_one, Kernel::best());
agrees!(the_plain_one_is_chosen_by_its_name, Kernel::Scalar);

proptest! {
    /// In f32 about a voxel near by, the value is that of f64 to a fiftieth of an HU and its
    /// rounding.
    #[test]
    fn the_plain_one_is_near_f64(
        shift in prop::array::uniform3(-2.0..2.0f64),
        stretch in prop::array::uniform3(0.6..1.6f64),
    ) {
        let deformed = [[2.3, 1.7, 1.2], [14.1, 2.2, 1.9], [3.0, 13.5, 2.4], [2.1, 3.3, 12.9]];
        let rest = deformed.map(|c| [0, 1, 2].map(|a| c[a] * stretch[a] + shift[a]));
        let data = patterned_ct(SIZE, 5);
        let source = Source::new(&data, SIZE);
        let pullback = Pullback::new(deformed, rest);
        let (locals, first) = locals(deformed, rest, &source);
        for place in places(12 * LANES) {
            let value = sample(Kernel::Scalar, &source, &locals, &[place]);
            let place = place.indices().map(f64::from);
            let p = [0, 1, 2].map(|a: usize| first[a] + place[a]);
            let exact = trilinear(&data, SIZE, pullback.at(p));
            prop_assert!((f64::from(value[0]) - exact).abs() <= 0.52, "{} {exact}", value[0]);
        }
    }
}

#[test]
fn halves_go_to_even() {
    let data = [0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 2, 1, 2, 1, 2, 1].map(|v: i16| v);
    let source = Source::new(&data, [2, 2, 4]);
    let at = [[0.5, 0.0, 0.0], [1.5, 0.0, 0.0], [0.5, 1.0, 0.0], [0.5, 0.0, 1.0]];
    let (locals, _) = locals(at.map(|[x, y, z]| [x + 0.5, y, z]), at, &source);
    let values = Kernel::all()
        .into_iter()
        .map(|kernel| sample(kernel, &source, &locals, &[Place::new([0, 0, 0]); LANES]));
    // The place is i = 0.5: halfway between 0 and 1.
    assert!(values.into_iter().all(|v| v == [0; LANES]));
}
