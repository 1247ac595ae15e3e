//! Eight rows or voxels at once, on processors with AVX2 and FMA.
//!
//! `unsafe` is needed twice: to call what only such processors have, and to read several voxels as
//! one number without asking for each whether it lies in the volume. The twin is [`super::scalar`].
#![allow(unsafe_code, reason = "vector instructions and unchecked reads, see above")]

mod cubic;

pub(super) use cubic::cubic;

use super::{LANES, Locals, Place, Source, Spots, SpotsMut};
use crate::batch::Crossings;
use crate::rows::Span;
use crate::sweep::{Extent, Swept};
use std::arch::x86_64::*;

/// Whether this processor can.
#[inline(always)]
pub(super) fn is_there() -> bool {
    is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
}

#[inline(always)]
pub(super) fn sweep(crossings: &Crossings, lane: usize, extent: &Extent, swept: &mut Swept) {
    assert!(is_there());
    // SAFETY: the processor was asked.
    unsafe { sweep_all(crossings, lane, extent, swept) }
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

/// Rows are taken slice after slice, eight at once whichever slices they lie in.
#[target_feature(enable = "avx2,fma")]
fn sweep_all(crossings: &Crossings, lane: usize, extent: &Extent, swept: &mut Swept) {
    let Swept { spans, unsure } = swept;
    let Extent { first, count, before } = *extent;
    let rows = count[1] * count[2];
    spans.reserve(rows + LANES);
    let [i, j, k] = [first[0], first[1], first[2].wrapping_sub(before)].map(|n| n as i32);
    let [i, j, k] = [i, j, k].map(|n| _mm256_set1_epi32(n));
    let width = _mm256_set1_ps(count[1] as f32);
    let (step_y, step_z) = (LANES % count[1], LANES / count[1]);
    let (step_y, step_z) = (_mm256_set1_ps(step_y as f32), _mm256_set1_ps(step_z as f32));
    let one = _mm256_set1_ps(1.0);
    let y = _mm256_setr_ps(0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0);
    let z = _mm256_floor_ps(_mm256_div_ps(_mm256_add_ps(y, _mm256_set1_ps(0.5)), width));
    let mut y = _mm256_fnmadd_ps(z, width, y);
    let mut z = _mm256_add_ps(z, _mm256_set1_ps(before as f32));
    for row in (0..rows).step_by(LANES) {
        let valid = u32::MAX >> (32 - LANES.min(rows - row));
        let (from, to, some, sure) = eight_ends(crossings, lane, y, z);
        let some = some & sure & valid;
        let (jj, kk) = (_mm256_cvtps_epi32(y), _mm256_cvtps_epi32(z));
        let all = [
            _mm256_add_epi32(jj, j),
            _mm256_add_epi32(kk, k),
            _mm256_add_epi32(from, i),
            _mm256_add_epi32(to, i),
        ];
        // SAFETY: room was made for one of each row, and eight more.
        unsafe {
            let len = spans.len();
            write_some(all, some, spans.as_mut_ptr().add(len));
            spans.set_len(len + some.count_ones() as usize);
        }
        let mut left = !sure & valid;
        if left != 0 {
            let (mut rows, mut slices) = ([0; LANES], [0; LANES]);
            store(&mut rows, all[0]);
            store(&mut slices, all[1]);
            while left != 0 {
                let lane = left.trailing_zeros() as usize % LANES;
                unsure.push([rows[lane], slices[lane]]);
                left &= left - 1;
            }
        }
        y = _mm256_add_ps(y, step_y);
        z = _mm256_add_ps(z, step_z);
        let over = _mm256_cmp_ps::<_CMP_GE_OQ>(y, width);
        y = _mm256_sub_ps(y, _mm256_and_ps(over, width));
        z = _mm256_add_ps(z, _mm256_and_ps(over, one));
    }
}

/// Where the rows (y, z) begin and end, which of them own some, and which are surely known.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn eight_ends(
    crossings: &Crossings,
    lane: usize,
    y: __m256,
    z: __m256,
) -> (__m256i, __m256i, u32, u32) {
    let (last, blur) = (crossings.last[lane], crossings.blur[lane]);
    let (before, after) = (_mm256_set1_ps(-0.5), _mm256_set1_ps(last + 0.5));
    let (mut from, mut to) = (before, after);
    let all = |numbers: &[f32; LANES]| _mm256_set1_ps(numbers[lane]);
    let offsets = crossings.low.iter().zip(&crossings.high);
    for ([constant, y_slope, z_slope], (low, high)) in crossings.faces.iter().zip(offsets) {
        let at = _mm256_fmadd_ps(z, all(z_slope), all(constant));
        let at = _mm256_fmadd_ps(y, all(y_slope), at);
        from = _mm256_max_ps(from, _mm256_add_ps(at, all(low)));
        to = _mm256_min_ps(to, _mm256_add_ps(at, all(high)));
    }
    let (from, to) = (_mm256_min_ps(from, after), _mm256_max_ps(to, before));
    let one = _mm256_set1_ps(1.0);
    let (first, end) = (_mm256_ceil_ps(from), _mm256_add_ps(_mm256_floor_ps(to), one));
    let above = [
        _mm256_sub_ps(from, _mm256_sub_ps(first, one)),
        _mm256_sub_ps(to, _mm256_sub_ps(end, one)),
    ];
    let (near, far) = (_mm256_set1_ps(blur), _mm256_set1_ps(1.0 - blur));
    let lowest = _mm256_min_ps(above[0], above[1]);
    let highest = _mm256_max_ps(above[0], above[1]);
    let sure = _mm256_and_ps(
        _mm256_cmp_ps::<_CMP_GT_OQ>(lowest, near),
        _mm256_cmp_ps::<_CMP_LT_OQ>(highest, far),
    );
    let some = _mm256_cmp_ps::<_CMP_LT_OQ>(first, end);
    (
        _mm256_cvtps_epi32(first),
        _mm256_cvtps_epi32(end),
        _mm256_movemask_ps(some) as u32,
        _mm256_movemask_ps(sure) as u32,
    )
}

/// For each choice of eight, the numbers of those chosen, one byte each.
const CHOSEN: [u64; 256] = {
    let mut all = [0; 256];
    let mut choice = 0;
    while choice < all.len() {
        let (mut lane, mut at) = (0, 0);
        while lane < LANES {
            if choice >> lane & 1 == 1 {
                all[choice] |= (lane as u64) << (8 * at);
                at += 1;
            }
            lane += 1;
        }
        choice += 1;
    }
    all
};

/// Writes the spans (j, k, from, to) of `some`, one after the other.
///
/// # Safety
/// There is room for eight.
#[target_feature(enable = "avx2,fma")]
#[inline]
unsafe fn write_some(all: [__m256i; 4], some: u32, spans: *mut Span) {
    let chosen = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(CHOSEN[some as usize & 0xff] as i64));
    let [j, k, from, to] = all.map(|all| _mm256_permutevar8x32_epi32(all, chosen));
    let rows = [_mm256_unpacklo_epi32(j, k), _mm256_unpackhi_epi32(j, k)];
    let ends = [_mm256_unpacklo_epi32(from, to), _mm256_unpackhi_epi32(from, to)];
    let a = _mm256_unpacklo_epi64(rows[0], ends[0]);
    let b = _mm256_unpackhi_epi64(rows[0], ends[0]);
    let c = _mm256_unpacklo_epi64(rows[1], ends[1]);
    let d = _mm256_unpackhi_epi64(rows[1], ends[1]);
    let pairs = [
        _mm256_permute2x128_si256::<0x20>(a, b),
        _mm256_permute2x128_si256::<0x20>(c, d),
        _mm256_permute2x128_si256::<0x31>(a, b),
        _mm256_permute2x128_si256::<0x31>(c, d),
    ];
    for (n, pair) in pairs.into_iter().enumerate() {
        // SAFETY: as the caller says; a span is four u32, and writes need not be aligned.
        unsafe { _mm256_storeu_si256(spans.cast::<__m256i>().add(n), pair) }
    }
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
