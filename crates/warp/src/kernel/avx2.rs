//! Eight rows or voxels at once, on processors with AVX2 and FMA.
//!
//! `unsafe` is needed twice: to call what only such processors have, and to read pairs of voxels as one
//! number without asking for each whether it lies in the volume. The twin is [`super::scalar`].
#![allow(unsafe_code, reason = "vector instructions and unchecked reads, see above")]

use super::{Ends, LANES, Locals, Place, Source, Spots, SpotsMut};
use crate::batch::{Crossing, SIDES};
use std::arch::x86_64::*;

/// Whether this processor can.
#[inline(always)]
pub(super) fn is_there() -> bool {
    is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
}

#[inline(always)]
pub(super) fn ends(crossing: &Crossing, at: &[[f32; 4]; 2], row: f32, ends: &mut Ends) -> bool {
    assert!(is_there());
    // SAFETY: the processor was asked.
    unsafe { eight_ends(crossing, at, row, ends) }
}

#[inline(always)]
pub(super) fn locate(locals: &Locals, lane: usize, places: &[Place], spots: SpotsMut<'_>) {
    assert!(is_there());
    // SAFETY: the processor was asked.
    unsafe { locate_all(locals, lane, places, spots) }
}

pub(super) fn blend(source: &Source<'_>, spots: &Spots, values: &mut [i16]) {
    assert!(is_there());
    // SAFETY: the processor was asked.
    unsafe { blend_all(source, spots, values) }
}

/// Asks the memory for `values`.
#[inline(always)]
pub(super) fn prefetch(values: &[i16]) {
    // SAFETY: an address is only looked at, and every processor of this kind can.
    unsafe { _mm_prefetch::<_MM_HINT_T0>(values.as_ptr().cast::<i8>()) }
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn eight_ends(crossing: &Crossing, at: &[[f32; 4]; 2], row: f32, ends: &mut Ends) -> bool {
    let Crossing { low, high, last, blur } = crossing;
    let y = _mm256_setr_ps(0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0);
    let y = _mm256_add_ps(y, _mm256_set1_ps(row));
    let (before, after) = (_mm256_set1_ps(-0.5), _mm256_set1_ps(last + 0.5));
    let (mut from, mut to) = (before, after);
    for f in 0..SIDES {
        let of =
            |slope: f32, at: f32| _mm256_fmadd_ps(y, _mm256_set1_ps(slope), _mm256_set1_ps(at));
        from = _mm256_max_ps(from, of(low[1][f], at[0][f]));
        to = _mm256_min_ps(to, of(high[1][f], at[1][f]));
    }
    let (from, to) = (_mm256_min_ps(from, after), _mm256_max_ps(to, before));
    let one = _mm256_set1_ps(1.0);
    let (first, end) = (_mm256_ceil_ps(from), _mm256_add_ps(_mm256_floor_ps(to), one));
    let above = [
        _mm256_sub_ps(from, _mm256_sub_ps(first, one)),
        _mm256_sub_ps(to, _mm256_sub_ps(end, one)),
    ];
    let (near, far) = (_mm256_set1_ps(*blur), _mm256_set1_ps(1.0 - blur));
    let least = _mm256_min_ps(above[0], above[1]);
    let most = _mm256_max_ps(above[0], above[1]);
    let sure = _mm256_and_ps(
        _mm256_cmp_ps::<_CMP_GT_OQ>(least, near),
        _mm256_cmp_ps::<_CMP_LT_OQ>(most, far),
    );
    ends.some = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(first, end)) as u32;
    store(&mut ends.from, _mm256_cvtps_epi32(first));
    store(&mut ends.to, _mm256_cvtps_epi32(end));
    _mm256_movemask_ps(sure) == 0xff
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn store(to: &mut [u32; LANES], numbers: __m256i) {
    // SAFETY: there is room for eight, and writes need not be aligned.
    unsafe { _mm256_storeu_si256(to.as_mut_ptr().cast::<__m256i>(), numbers) }
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn store_f32(to: &mut [f32; LANES], numbers: __m256) {
    // SAFETY: there is room for eight, and writes need not be aligned.
    unsafe { _mm256_storeu_ps(to.as_mut_ptr(), numbers) }
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn load_f32(from: &[f32; LANES]) -> __m256 {
    // SAFETY: there are eight, and reads need not be aligned.
    unsafe { _mm256_loadu_ps(from.as_ptr()) }
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn locate_all(locals: &Locals, lane: usize, places: &[Place], spots: SpotsMut<'_>) {
    let (places, _) = places.as_chunks::<LANES>();
    let (cells, _) = spots.cells.as_chunks_mut::<LANES>();
    let [x, y, z] = spots.within;
    let (x, y, z) = (x.as_chunks_mut().0, y.as_chunks_mut().0, z.as_chunks_mut().0);
    for ((((places, cells), x), y), z) in places.iter().zip(cells).zip(x).zip(y).zip(z) {
        locate_eight(locals, lane, places, cells, [x, y, z]);
    }
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn locate_eight(
    locals: &Locals,
    lane: usize,
    places: &[Place; LANES],
    cells: &mut [u32; LANES],
    within: [&mut [f32; LANES]; 3],
) {
    // SAFETY: `Place` is one u32, and reads need not be aligned.
    let places = unsafe { _mm256_loadu_si256(places.as_ptr().cast::<__m256i>()) };
    let [bits_i, bits_j, _] = super::PLACE_BITS;
    const { assert!(super::PLACE_BITS[0] == 13 && super::PLACE_BITS[1] == 13) };
    let i = _mm256_and_si256(places, _mm256_set1_epi32((1 << bits_i) - 1));
    let j = _mm256_and_si256(_mm256_srli_epi32::<13>(places), _mm256_set1_epi32((1 << bits_j) - 1));
    let k = _mm256_srli_epi32::<26>(places);
    let p = [_mm256_cvtepi32_ps(i), _mm256_cvtepi32_ps(j), _mm256_cvtepi32_ps(k)];
    let mut cell = [i; 3];
    for (a, within) in within.into_iter().enumerate() {
        let all = |numbers: &[f32; LANES]| _mm256_set1_ps(numbers[lane]);
        let [x, y, z] = &locals.slopes[a];
        let (x, y, z) = (all(x), all(y), all(z));
        let q = _mm256_fmadd_ps(p[0], x, all(&locals.constant[a]));
        let q = _mm256_fmadd_ps(p[2], z, _mm256_fmadd_ps(p[1], y, q));
        // The second argument is the result where the first is NaN.
        let q = _mm256_max_ps(q, all(&locals.low[a]));
        let q = _mm256_min_ps(q, all(&locals.high[a]));
        cell[a] = _mm256_min_epi32(_mm256_cvttps_epi32(q), _mm256_set1_epi32(locals.last[a][lane]));
        store_f32(within, _mm256_sub_ps(q, _mm256_cvtepi32_ps(cell[a])));
    }
    let [row, slice] = locals.steps;
    let at = _mm256_add_epi32(
        _mm256_add_epi32(cell[0], _mm256_mullo_epi32(cell[1], _mm256_set1_epi32(row))),
        _mm256_mullo_epi32(cell[2], _mm256_set1_epi32(slice)),
    );
    store(cells, _mm256_add_epi32(at, _mm256_set1_epi32(locals.start[lane] as i32)));
}

#[target_feature(enable = "avx2,fma")]
fn blend_all(source: &Source<'_>, spots: &Spots, values: &mut [i16]) {
    let (cells, _) = spots.cells.as_chunks::<LANES>();
    let [x, y, z] = &spots.within;
    let (x, y, z) = (x.as_chunks().0, y.as_chunks().0, z.as_chunks().0);
    let (values, _) = values.as_chunks_mut::<LANES>();
    for ((((cells, x), y), z), values) in cells.iter().zip(x).zip(y).zip(z).zip(values) {
        blend_eight(source, cells, [x, y, z], values);
    }
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn blend_eight(
    source: &Source<'_>,
    cells: &[u32; LANES],
    [x, y, z]: [&[f32; LANES]; 3],
    values: &mut [i16; LANES],
) {
    let [_, row, slice] = source.steps;
    let mut held = [0; LANES];
    // SAFETY: there are eight, and reads need not be aligned.
    let cells = unsafe { _mm256_loadu_si256(cells.as_ptr().cast::<__m256i>()) };
    store(&mut held, _mm256_min_epu32(cells, _mm256_set1_epi32(source.last_cell() as i32)));
    let t = [load_f32(x), load_f32(y), load_f32(z)];
    // SAFETY: no cell is behind the last that has others beside, below and behind it.
    let [a, b, c, d] = unsafe {
        let from = source.data.as_ptr();
        [
            between(pairs(from, &held), t[0]),
            between(pairs(from.add(row), &held), t[0]),
            between(pairs(from.add(slice), &held), t[0]),
            between(pairs(from.add(slice + row), &held), t[0]),
        ]
    };
    let value = between([between([a, b], t[1]), between([c, d], t[1])], t[2]);
    let value = _mm256_cvtps_epi32(value);
    let (low, high) = (_mm256_castsi256_si128(value), _mm256_extracti128_si256::<1>(value));
    // SAFETY: `values` has room for eight.
    unsafe { _mm_storeu_si128(values.as_mut_ptr().cast::<__m128i>(), _mm_packs_epi32(low, high)) }
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn between([a, b]: [__m256; 2], t: __m256) -> __m256 {
    _mm256_fmadd_ps(t, _mm256_sub_ps(b, a), a)
}

/// The voxels `cells` after `from`, and those after them.
///
/// # Safety
/// All of them lie in one allocation.
#[target_feature(enable = "avx2,fma")]
#[inline]
unsafe fn pairs(from: *const i16, cells: &[u32; LANES]) -> [__m256; 2] {
    // One by one: gathering is slower on many processors.
    let mut pair = [0; LANES];
    for (pair, cell) in pair.iter_mut().zip(cells) {
        // SAFETY: as the caller says; reads need not be aligned.
        *pair = unsafe { from.add(*cell as usize).cast::<i32>().read_unaligned() };
    }
    let [a, b, c, d, e, f, g, h] = pair;
    let both = _mm256_setr_epi32(a, b, c, d, e, f, g, h);
    let first = _mm256_srai_epi32::<16>(_mm256_slli_epi32::<16>(both));
    [_mm256_cvtepi32_ps(first), _mm256_cvtepi32_ps(_mm256_srai_epi32::<16>(both))]
}
