//! Cubic convolution: every kernel against the plain one, and that against f64.

use super::{LANE, SIMPLE, SIZE, corners, locals, places};
use crate::filter::{self, Interpolation};
use crate::kernel::{Kernel, LANES, Locals, Near, Place, Source, Spots, reach};
use crate::predicate::Index;
use crate::pullback::Pullback;
use crate::tests::fixture::patterned_ct;
use proptest::prelude::*;

/// As the brush does it.
fn sample(kernel: Kernel, source: &Source<'_>, locals: &Locals, places: &[Place]) -> Vec<i16> {
    let (mut spots, mut values) = (Spots::default(), vec![0; places.len()]);
    spots.grow(places.len());
    kernel.locate(locals, LANE, places, spots.some(0, places.len()));
    if !locals.within(LANE, source) {
        spots.near_edges(0..places.len());
    }
    kernel.cubic(source, &spots, &mut values);
    values
}

/// Corners whose places have two voxels on either side along each axis.
fn inner() -> impl Strategy<Value = [Index; 4]> {
    prop::array::uniform4([1.0..20.9f64, 1.0..16.9, 1.0..14.9])
}

/// Any voxels, as far apart as they can be.
fn any_values(seed: u64, count: usize) -> Vec<i16> {
    let mixed = |n: usize| {
        let n = (n as u64 + seed).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        (n ^ n >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 48
    };
    (0..count).map(|n| mixed(n) as u16 as i16).collect()
}

/// The kernels give the same, from the whole volume and from the part of it that is read.
fn all_agree(deformed: [Index; 4], rest: [Index; 4], data: &[i16], size: [usize; 3]) {
    let whole = Source::new(data, size);
    // With that of the other tetrahedra, whose maps are made with it.
    let near = Near::new(&whole, reach(&[rest, SIMPLE].concat(), size, 1)).unwrap();
    let places = places(12 * LANES);
    let of = |kernel: Kernel, source: &Source<'_>| {
        let (locals, _) = locals(deformed, rest, source);
        sample(kernel, source, &locals, &places)
    };
    let want = of(Kernel::Scalar, &whole);
    for kernel in Kernel::all() {
        assert_eq!(of(kernel, &whole), want, "{kernel:?}");
        assert_eq!(of(kernel, &near.source()), want, "{kernel:?}, from a part");
    }
}

proptest! {
    #[test]
    fn the_kernels_agree_at_and_off_the_edges(
        deformed in corners(), rest in corners(), seed in any::<u64>(),
    ) {
        all_agree(deformed, rest, &any_values(seed, SIZE.iter().product()), SIZE);
    }

    #[test]
    fn the_kernels_agree_within(deformed in corners(), rest in inner(), seed in any::<u64>()) {
        let data = any_values(seed, SIZE.iter().product());
        let source = Source::new(&data, SIZE);
        prop_assert!(locals(deformed, rest, &source).0.within(LANE, &source));
        all_agree(deformed, rest, &data, SIZE);
        all_agree(deformed, rest, &patterned_ct(SIZE, seed), SIZE);
    }

    #[test]
    fn the_kernels_agree_in_small_volumes(
        deformed in corners(), rest in corners(), size in prop::array::uniform3(2..6usize),
    ) {
        all_agree(deformed, rest, &any_values(3, size.iter().product()), size);
    }

    /// Flat tetrahedra and all.
    #[test]
    fn one_value_stays_that_value(
        deformed in corners(), rest in corners(), value in any::<i16>(),
    ) {
        let data = vec![value; SIZE.iter().product()];
        let source = Source::new(&data, SIZE);
        let (locals, _) = locals(deformed, rest, &source);
        for kernel in Kernel::all() {
            let got = sample(kernel, &source, &locals, &places(2 * LANES));
            prop_assert!(got.iter().all(|v| *v == value), "{kernel:?}");
        }
    }
}

/// A tetrahedron over some of the volume, and its places.
const DEFORMED: [Index; 4] =
    [[2.0, 1.0, 1.0], [14.0, 2.0, 1.0], [3.0, 13.0, 2.0], [2.0, 3.0, 12.0]];

#[test]
fn voxels_keep_their_values_at_whole_indices() {
    let data = any_values(1, SIZE.iter().product());
    let source = Source::new(&data, SIZE);
    for shift in [[0.0, 0.0, 0.0], [3.0, 2.0, -1.0]] {
        let rest = DEFORMED.map(|c| [0, 1, 2].map(|a| c[a] + shift[a]));
        let (pullback, (locals, first)) =
            (Pullback::new(DEFORMED, rest), locals(DEFORMED, rest, &source));
        let all = places(12 * LANES);
        for kernel in Kernel::all() {
            let got = sample(kernel, &source, &locals, &all);
            for (place, got) in all.iter().zip(got) {
                let place = place.indices().map(f64::from);
                let p = [0, 1, 2].map(|a: usize| first[a] + place[a]);
                let q = pullback.at(p).map(|v| v.round() as usize);
                assert_eq!(got, data[(q[2] * SIZE[1] + q[1]) * SIZE[0] + q[0]], "{q:?}");
            }
        }
    }
}

/// In f32 about a voxel near by, nearly all values are those of f64, and none differs by more than
/// one.
#[test]
fn the_plain_one_is_that_of_f64() {
    let data = patterned_ct(SIZE, 5);
    let source = Source::new(&data, SIZE);
    let (mut seen, mut differ) = (0, 0);
    for n in 0..400 {
        let of = |step: usize| (n * step % 101) as f64 / 101.0;
        let (shift, stretch) = ([of(7), of(13), of(29)], [of(17), of(3), of(11)]);
        // Over the lower edges at times.
        let at = |v: f64, a: usize| v * (0.6 + stretch[a]) + 4.0 * shift[a] - 2.0;
        let rest = DEFORMED.map(|c| [at(c[0], 0), at(c[1], 1), at(c[2] + 0.1 * c[1], 2)]);
        let pullback = Pullback::new(DEFORMED, rest);
        let (locals, first) = locals(DEFORMED, rest, &source);
        let all = places(12 * LANES);
        for (place, got) in all.iter().zip(sample(Kernel::Scalar, &source, &locals, &all)) {
            let place = place.indices().map(f64::from);
            let p = [0, 1, 2].map(|a: usize| first[a] + place[a]);
            let exact = filter::value(&source, Interpolation::Cubic, pullback.at(p));
            let by = (exact.round_ties_even() - f64::from(got)).abs();
            assert!(by <= 1.0, "{got} for {exact}");
            (seen, differ) = (seen + 1, differ + usize::from(by > 0.0));
        }
    }
    assert!(differ * 1000 < seen, "{differ} of {seen}");
}
