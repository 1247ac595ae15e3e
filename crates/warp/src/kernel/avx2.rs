//! Eight voxels at once, on processors with AVX2 and FMA.
//!
//! `unsafe` is needed twice: to call what only such processors have, and to read pairs of voxels as one
//! number without asking for each whether it lies in the volume. The twin is [`super::scalar`].
#![allow(unsafe_code, reason = "vector instructions and unchecked reads, see above")]

use super::{LANES, Local, Place, Source};
use std::arch::x86_64::{
    __m128i, __m256, __m256i, _MM_HINT_T0, _mm_packs_epi32, _mm_prefetch, _mm_storeu_si128,
    _mm256_add_epi32, _mm256_and_si256, _mm256_castsi256_si128, _mm256_cvtepi32_ps,
    _mm256_cvtps_epi32, _mm256_cvttps_epi32, _mm256_extracti128_si256, _mm256_fmadd_ps,
    _mm256_loadu_si256, _mm256_max_ps, _mm256_min_epi32, _mm256_min_ps, _mm256_mullo_epi32,
    _mm256_set1_epi32, _mm256_set1_ps, _mm256_setr_epi32, _mm256_slli_epi32, _mm256_srai_epi32,
    _mm256_srli_epi32, _mm256_storeu_si256, _mm256_sub_ps,
};

/// Whether this processor can.
pub(super) fn is_there() -> bool {
    is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
}

pub(super) fn sample(source: &Source<'_>, local: &Local, places: &[Place], values: &mut [i16]) {
    assert!(is_there() && places.len() == values.len() && places.len().is_multiple_of(LANES));
    // SAFETY: the processor was asked.
    unsafe { all(source, local, places, values) }
}

/// Asks the memory for `values`.
#[inline(always)]
pub(super) fn prefetch(values: &[i16]) {
    // SAFETY: an address is only looked at, and every processor of this kind can.
    unsafe { _mm_prefetch::<_MM_HINT_T0>(values.as_ptr().cast::<i8>()) }
}

#[target_feature(enable = "avx2,fma")]
fn all(source: &Source<'_>, local: &Local, places: &[Place], values: &mut [i16]) {
    let (places, _) = places.as_chunks::<LANES>();
    let (values, _) = values.as_chunks_mut::<LANES>();
    for (places, values) in places.iter().zip(values) {
        eight(source, local, places, values);
    }
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn eight(source: &Source<'_>, local: &Local, places: &[Place; LANES], values: &mut [i16; LANES]) {
    // SAFETY: `Place` is one u32, and reads need not be aligned.
    let places = unsafe { _mm256_loadu_si256(places.as_ptr().cast::<__m256i>()) };
    let [bits_i, bits_j, _] = super::PLACE_BITS;
    const { assert!(super::PLACE_BITS[0] == 13 && super::PLACE_BITS[1] == 13) };
    let i = _mm256_and_si256(places, _mm256_set1_epi32((1 << bits_i) - 1));
    let j = _mm256_and_si256(_mm256_srli_epi32::<13>(places), _mm256_set1_epi32((1 << bits_j) - 1));
    let p = [i, j, _mm256_srli_epi32::<26>(places)].map(|n| _mm256_cvtepi32_ps(n));
    let mut cell = [i; 3];
    let mut t = p;
    for a in 0..3 {
        let [x, y, z] = local.slopes[a].map(|s| _mm256_set1_ps(s));
        let q = _mm256_fmadd_ps(p[0], x, _mm256_set1_ps(local.constant[a]));
        let q = _mm256_fmadd_ps(p[2], z, _mm256_fmadd_ps(p[1], y, q));
        // The second argument is the result where the first is NaN.
        let q = _mm256_max_ps(q, _mm256_set1_ps(local.low[a]));
        let q = _mm256_min_ps(q, _mm256_set1_ps(local.high[a]));
        cell[a] = _mm256_min_epi32(_mm256_cvttps_epi32(q), _mm256_set1_epi32(local.last[a]));
        t[a] = _mm256_sub_ps(q, _mm256_cvtepi32_ps(cell[a]));
    }
    let [row, slice] = local.steps;
    let at = _mm256_add_epi32(
        _mm256_add_epi32(cell[0], _mm256_mullo_epi32(cell[1], _mm256_set1_epi32(row))),
        _mm256_mullo_epi32(cell[2], _mm256_set1_epi32(slice)),
    );
    let (row, slice) = (row as usize, slice as usize);
    let mut cells = [0i32; LANES];
    // SAFETY: `cells` has room for eight.
    unsafe { _mm256_storeu_si256(cells.as_mut_ptr().cast::<__m256i>(), at) };
    let along = |more: usize| {
        // SAFETY: `Local` holds cells within the volume, none of them the last along an axis: the voxel beside,
        // and those in the next row and slice, are in it too.
        let [a, b] = unsafe { pairs(source.data.as_ptr().add(local.start + more), &cells) };
        between(a, b, t[0])
    };
    let plane = |more: usize| between(along(more), along(more + row), t[1]);
    let value = _mm256_cvtps_epi32(between(plane(0), plane(slice), t[2]));
    let (low, high) = (_mm256_castsi256_si128(value), _mm256_extracti128_si256::<1>(value));
    // SAFETY: `values` has room for eight.
    unsafe { _mm_storeu_si128(values.as_mut_ptr().cast::<__m128i>(), _mm_packs_epi32(low, high)) }
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn between(a: __m256, b: __m256, t: __m256) -> __m256 {
    _mm256_fmadd_ps(t, _mm256_sub_ps(b, a), a)
}

/// The voxels `cells` after `from`, and those after them.
///
/// # Safety
/// All of them lie in one allocation.
#[target_feature(enable = "avx2,fma")]
#[inline]
unsafe fn pairs(from: *const i16, cells: &[i32; LANES]) -> [__m256; 2] {
    // One by one: gathering is slower on many processors.
    // SAFETY: as the caller says; reads need not be aligned.
    let [a, b, c, d, e, f, g, h] =
        cells.map(|n| unsafe { from.add(n as usize).cast::<i32>().read_unaligned() });
    let both = _mm256_setr_epi32(a, b, c, d, e, f, g, h);
    let first = _mm256_srai_epi32::<16>(_mm256_slli_epi32::<16>(both));
    [first, _mm256_srai_epi32::<16>(both)].map(|n| _mm256_cvtepi32_ps(n))
}
