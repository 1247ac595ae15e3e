//! Cubic convolution: one voxel after the other, each its 64 voxels at once; eight are then summed
//! together.
//!
//! Four rows of four voxels, one above the other in four slices, fill a register. The twin is
//! [`super::super::scalar::cubic`].

use super::super::scalar;
use super::{LANES, Source, Spots, load_f32, store, store_f32};
use std::arch::x86_64::*;

/// The weights of eight voxels. Voxel `v` stands at number [`at`] of `x` and `z`.
#[repr(align(32))]
struct Weights {
    /// Of rows 0, 1, 2, 3, each of all eight voxels.
    y: [[f32; LANES]; 4],
    /// Four for each voxel: 0, 2, 1, 3.
    x: [[f32; LANES]; 4],
    /// Four for each voxel: 0, 1, 2, 3; and behind the last, so that all can be read as eight.
    z: [[f32; LANES]; 5],
}

/// Where the four weights of a voxel begin.
#[inline(always)]
const fn at(voxel: usize) -> usize {
    voxel % 4 * LANES + voxel / 4 * 4
}

/// What becomes of the 64 voxels around one: eight numbers whose sum is the value, and sixteen
/// among which are the lowest and the highest.
type Block = (__m256, __m256i, __m256i);

pub(in super::super) fn cubic(source: &Source<'_>, spots: &Spots, values: &mut [i16]) {
    assert!(super::is_there());
    let Some(last) = source.last_block() else {
        return scalar::cubic(source, spots, 0..values.len(), values);
    };
    // SAFETY: the processor was asked.
    unsafe { cubic_all(source, last, spots, values) }
    // Where a block leaves the volume it was held within, and that is not its value.
    for edge in &spots.edges {
        scalar::cubic(source, spots, edge.clone(), values);
    }
}

#[target_feature(enable = "avx2,fma")]
fn cubic_all(source: &Source<'_>, last: usize, spots: &Spots, values: &mut [i16]) {
    let (cells, _) = spots.cells.as_chunks::<LANES>();
    let [x, y, z] = &spots.within;
    let (x, y, z) = (x.as_chunks().0, y.as_chunks().0, z.as_chunks().0);
    let (values, _) = values.as_chunks_mut::<LANES>();
    let zeros = [0.0; LANES];
    let mut weights = Weights { y: [zeros; 4], x: [zeros; 4], z: [zeros; 5] };
    for ((((cells, x), y), z), values) in cells.iter().zip(x).zip(y).zip(z).zip(values) {
        weights.set([x, y, z]);
        cubic_eight(source, last, cells, &weights, values);
    }
}

impl Weights {
    #[target_feature(enable = "avx2,fma")]
    #[inline]
    fn set(&mut self, [x, y, z]: [&[f32; LANES]; 3]) {
        for (to, weight) in self.y.iter_mut().zip(keys(load_f32(y))) {
            store_f32(to, weight);
        }
        let [a, b, c, d] = keys(load_f32(x));
        for (to, four) in self.x.iter_mut().zip(by_voxel([a, c, b, d])) {
            store_f32(to, four);
        }
        for (to, four) in self.z.iter_mut().zip(by_voxel(keys(load_f32(z)))) {
            store_f32(to, four);
        }
    }
}

/// Weights of the four voxels around places `t` after the second.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn keys(t: __m256) -> [__m256; 4] {
    let all = |number: f32| _mm256_set1_ps(number);
    let square = _mm256_mul_ps(t, t);
    let a = _mm256_fmadd_ps(t, _mm256_fmadd_ps(t, all(-0.5), all(1.0)), all(-0.5));
    let b = _mm256_fmadd_ps(t, all(1.5), all(-2.5));
    let c = _mm256_fmadd_ps(t, _mm256_fmadd_ps(t, all(-1.5), all(2.0)), all(0.5));
    let d = _mm256_fmadd_ps(t, all(0.5), all(-0.5));
    [
        _mm256_mul_ps(t, a),
        _mm256_fmadd_ps(square, b, all(1.0)),
        _mm256_mul_ps(t, c),
        _mm256_mul_ps(square, d),
    ]
}

/// The four numbers of each of eight voxels one after the other: those of voxels n and n + 4 in
/// register n.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn by_voxel([a, b, c, d]: [__m256; 4]) -> [__m256; 4] {
    let pairs = |a: __m256, b: __m256| {
        let (low, high) = (_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
        (_mm256_castps_pd(low), _mm256_castps_pd(high))
    };
    let ((ab, ab_high), (cd, cd_high)) = (pairs(a, b), pairs(c, d));
    [
        _mm256_castpd_ps(_mm256_unpacklo_pd(ab, cd)),
        _mm256_castpd_ps(_mm256_unpackhi_pd(ab, cd)),
        _mm256_castpd_ps(_mm256_unpacklo_pd(ab_high, cd_high)),
        _mm256_castpd_ps(_mm256_unpackhi_pd(ab_high, cd_high)),
    ]
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn cubic_eight(
    source: &Source<'_>,
    last: usize,
    cells: &[u32; LANES],
    weights: &Weights,
    values: &mut [i16; LANES],
) {
    let [_, row, slice] = source.steps;
    let mut held = [0; LANES];
    // SAFETY: there are eight, and reads need not be aligned.
    let cells = unsafe { _mm256_loadu_si256(cells.as_ptr().cast::<__m256i>()) };
    // What begins before the volume is a large number here, and is held too.
    let first = _mm256_sub_epi32(cells, _mm256_set1_epi32((1 + row + slice) as i32));
    store(&mut held, _mm256_min_epu32(first, _mm256_set1_epi32(last as i32)));
    let mut pairs = [(_mm256_setzero_ps(), cells, cells); 4];
    for (n, pair) in pairs.iter_mut().enumerate() {
        let [a, b] = [n, n + 4].map(|voxel| held[voxel] as usize);
        // SAFETY: no block begins behind the last that lies in the volume, whose slices have two
        // rows of two or more.
        let (a, b) = unsafe {
            let from = source.data.as_ptr();
            (
                block(from.add(a), [row, slice], weights, n),
                block(from.add(b), [row, slice], weights, n + 4),
            )
        };
        *pair = halved(a, b);
    }
    let [a, b, c, d] = pairs;
    let sums = _mm256_cvtps_epi32(sums([a.0, b.0, c.0, d.0]));
    let lowest = extremes([a.1, b.1, c.1, d.1], |a, b| _mm256_min_epi16(a, b));
    let highest = extremes([a.2, b.2, c.2, d.2], |a, b| _mm256_max_epi16(a, b));
    let (low, high) = (_mm256_castsi256_si128(sums), _mm256_extracti128_si256::<1>(sums));
    let value = _mm_max_epi16(_mm_packs_epi32(low, high), lowest);
    let value = _mm_min_epi16(value, highest);
    // SAFETY: `values` has room for eight.
    unsafe { _mm_storeu_si128(values.as_mut_ptr().cast::<__m128i>(), value) }
}

/// What becomes of the 64 voxels from `from` on.
///
/// # Safety
/// All of them lie in one allocation, a slice has four voxels or more, and `voxel` is one of eight.
#[target_feature(enable = "avx2,fma")]
#[inline]
unsafe fn block(
    from: *const i16,
    [row, slice]: [usize; 2],
    weights: &Weights,
    voxel: usize,
) -> Block {
    let zero = _mm256_setzero_si256();
    let mut rows = [zero; 4];
    for (n, four) in rows.iter_mut().enumerate() {
        // SAFETY: as the caller says.
        *four = unsafe { one_row(from.add(n * row), slice) };
    }
    let [a, b, c, d] = rows;
    let low = _mm256_min_epi16(_mm256_min_epi16(a, b), _mm256_min_epi16(c, d));
    let high = _mm256_max_epi16(_mm256_max_epi16(a, b), _mm256_max_epi16(c, d));
    let first = _mm256_set1_epi32(1);
    let (mut even, mut odd) = (_mm256_setzero_ps(), _mm256_setzero_ps());
    for (four, weights) in rows.into_iter().zip(&weights.y) {
        // Of each pair the first voxel times one and the second times none; then the second alone.
        let pair = [_mm256_madd_epi16(four, first), _mm256_srai_epi32::<16>(four)];
        let weight = _mm256_set1_ps(weights[voxel]);
        even = _mm256_fmadd_ps(weight, _mm256_cvtepi32_ps(pair[0]), even);
        odd = _mm256_fmadd_ps(weight, _mm256_cvtepi32_ps(pair[1]), odd);
    }
    // SAFETY: `x` and `z` hold four numbers from there on, and `z` four more; reads need not be
    // aligned.
    let (x_even, x_odd, z) = unsafe {
        let x = weights.x.as_ptr().cast::<f32>().add(at(voxel)).cast::<f64>();
        let z = weights.z.as_ptr().cast::<f32>().add(at(voxel));
        (
            _mm256_set1_pd(x.read_unaligned()),
            _mm256_set1_pd(x.add(1).read_unaligned()),
            _mm256_loadu_ps(z),
        )
    };
    let z = _mm256_permutevar8x32_ps(z, _mm256_setr_epi32(0, 0, 1, 1, 2, 2, 3, 3));
    let even = _mm256_mul_ps(even, _mm256_castpd_ps(x_even));
    let sum = _mm256_fmadd_ps(odd, _mm256_castpd_ps(x_odd), even);
    (_mm256_mul_ps(sum, z), low, high)
}

/// A row of four voxels and those in the same place of the three slices behind.
///
/// # Safety
/// All of them lie in one allocation, and a slice has four voxels or more.
#[target_feature(enable = "avx2,fma")]
#[inline]
unsafe fn one_row(from: *const i16, slice: usize) -> __m256i {
    // SAFETY: four voxels are read of the even slices, eight of the odd ones, which begin with the
    // four before; a slice has as many.
    let [a, b, c, d] = unsafe {
        let four = |n: usize| _mm_loadl_epi64(from.add(n * slice).cast::<__m128i>());
        let eight = |n: usize| _mm_loadu_si128(from.add(n * slice - 4).cast::<__m128i>());
        [four(0), eight(1), four(2), eight(3)]
    };
    let (ab, cd) = (_mm_blend_epi32::<0b1100>(a, b), _mm_blend_epi32::<0b1100>(c, d));
    _mm256_set_m128i(cd, ab)
}

/// The halves of each, brought together: of one voxel below, of the other above.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn halved(a: Block, b: Block) -> Block {
    let halves = |a: __m256i, b: __m256i| {
        let low = _mm256_permute2x128_si256::<0x20>(a, b);
        (low, _mm256_permute2x128_si256::<0x31>(a, b))
    };
    let sum = _mm256_add_ps(
        _mm256_permute2f128_ps::<0x20>(a.0, b.0),
        _mm256_permute2f128_ps::<0x31>(a.0, b.0),
    );
    let (low, high) = (halves(a.1, b.1), halves(a.2, b.2));
    (sum, _mm256_min_epi16(low.0, low.1), _mm256_max_epi16(high.0, high.1))
}

/// The sums of four numbers each, of voxels n and n + 4 in register n: in the order of the voxels.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn sums(all: [__m256; 4]) -> __m256 {
    let [a, b, c, d] = all;
    let ab = _mm256_add_ps(_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
    let cd = _mm256_add_ps(_mm256_unpacklo_ps(c, d), _mm256_unpackhi_ps(c, d));
    let (ab, cd) = (_mm256_castps_pd(ab), _mm256_castps_pd(cd));
    _mm256_add_ps(
        _mm256_castpd_ps(_mm256_unpacklo_pd(ab, cd)),
        _mm256_castpd_ps(_mm256_unpackhi_pd(ab, cd)),
    )
}

/// As [`sums`], of eight numbers each, the lowest or the highest.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn extremes(all: [__m256i; 4], of: impl Fn(__m256i, __m256i) -> __m256i) -> __m128i {
    let [a, b, c, d] = all;
    let ab = of(_mm256_unpacklo_epi16(a, b), _mm256_unpackhi_epi16(a, b));
    let cd = of(_mm256_unpacklo_epi16(c, d), _mm256_unpackhi_epi16(c, d));
    let twice = of(_mm256_unpacklo_epi32(ab, cd), _mm256_unpackhi_epi32(ab, cd));
    let once = of(twice, _mm256_shuffle_epi32::<0b0100_1110>(twice));
    _mm256_castsi256_si128(_mm256_permute4x64_epi64::<0b1000>(once))
}
