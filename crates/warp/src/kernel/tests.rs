//! Every kernel against the plain one, and that against f64.

use super::{Kernel, LANES, Local, Place, Source, scalar};
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

macro_rules! agrees {
    ($name:ident, $kernel:expr) => {
        proptest! {
            #[test]
            fn $name(deformed in corners(), rest in corners(), origin in prop::array::uniform3(0..9u32)) {
                let data = patterned_ct(SIZE, 5);
                let source = Source::new(&data, SIZE);
                let local = Local::new(&Pullback::new(deformed, rest), origin, &source);
                let places = places(12 * LANES);
                let (mut plain, mut fast) = (vec![0; places.len()], vec![1; places.len()]);
                scalar::sample(&source, &local, &places, &mut plain);
                $kernel.sample(&source, &local, &places, &mut fast);
                prop_assert_eq!(plain, fast);
            }
        }
    };
}

agrees!(the_fastest_gives_the_bits_of_the_plain_one, Kernel::best());
agrees!(the_plain_one_is_chosen_by_its_name, Kernel::Scalar);

proptest! {
    /// In f32 about a voxel near by, the value is that of f64 to a fiftieth of an HU and its rounding.
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
        let local = Local::new(&pullback, [2, 1, 1], &source);
        for place in places(12 * LANES) {
            let mut value = [0];
            scalar::sample(&source, &local, &[place], &mut value);
            let [i, j, k] = place.indices().map(f64::from);
            let exact = trilinear(&data, SIZE, pullback.at([i + 2.0, j + 1.0, k + 1.0]));
            prop_assert!((f64::from(value[0]) - exact).abs() <= 0.52, "{} {exact}", value[0]);
        }
    }
}

#[test]
fn halves_go_to_even() {
    let data = [0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 2, 1, 2, 1, 2, 1].map(|v: i16| v);
    let source = Source::new(&data, [2, 2, 4]);
    let at = [[0.5, 0.0, 0.0], [1.5, 0.0, 0.0], [0.5, 1.0, 0.0], [0.5, 0.0, 1.0]];
    let local = Local::new(&Pullback::new(at, at), [0; 3], &source);
    let values = Kernel::all().into_iter().map(|kernel| {
        let mut values = [9; LANES];
        kernel.sample(&source, &local, &[Place::new([0, 0, 0]); LANES], &mut values);
        values
    });
    // The place is held at i = 0.5: halfway between 0 and 1.
    assert!(values.into_iter().all(|v| v == [0; LANES]));
}
