//! How much a volume has in common with another and with its mirror images.

use rayon::prelude::*;

/// Sum of the products of all voxels with those of the source, for each way to mirror the source:
/// along i (bit 0), j (bit 1) and k (bit 2) of the place. Exact.
pub(super) fn mirrored(ours: &[i16], source: &[i16], [ni, nj, nk]: [usize; 3]) -> [i64; 8] {
    let part = unbounded(ours, source);
    let row = |j: usize, k: usize| (k * nj + j) * ni..(k * nj + j + 1) * ni;
    let rows = |n: usize| {
        let (j, k) = (n % nj, n / nj);
        let theirs = &source[row(j, k)];
        let reversed: Vec<i16> = theirs.iter().rev().copied().collect();
        let mut sums = [0; 8];
        for turned in 0..4 {
            let j = if turned & 1 > 0 { nj - 1 - j } else { j };
            let k = if turned & 2 > 0 { nk - 1 - k } else { k };
            let ours = &ours[row(j, k)];
            sums[2 * turned] = product(ours, theirs, part);
            sums[2 * turned + 1] = product(ours, &reversed, part);
        }
        sums
    };
    let join = |a: [i64; 8], b: [i64; 8]| std::array::from_fn(|n| a[n] + b[n]);
    (0..nj * nk).into_par_iter().map(rows).reduce(|| [0; 8], join)
}

/// How many products of these values add up to less than 32 bits hold.
fn unbounded(ours: &[i16], source: &[i16]) -> usize {
    let largest = |hu: &[i16]| {
        let part = |part: &[i16]| part.iter().map(|v| v.unsigned_abs()).fold(0, u16::max);
        i64::from(hu.par_chunks(1 << 16).map(part).reduce(|| 0, u16::max))
    };
    let product = (largest(ours) * largest(source)).max(1);
    (i64::from(i32::MAX) / product).max(1) as usize
}

/// Sum of products, `part` of which add up in 32 bits.
fn product(a: &[i16], b: &[i16], part: usize) -> i64 {
    let sum = |(a, b): (&[i16], &[i16])| {
        let products = a.iter().zip(b).map(|(&a, &b)| i32::from(a) * i32::from(b));
        i64::from(products.fold(0, i32::wrapping_add))
    };
    a.chunks(part).zip(b.chunks(part)).map(sum).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sums_are_those_of_each_mirror_image() {
        let size @ [ni, nj, nk] = [7, 5, 4];
        for scale in [1, 30, 230] {
            let value = |n: usize| ((n * 7919 % 285) as i16 - 142) * scale;
            let ours: Vec<i16> = (0..ni * nj * nk).map(value).collect();
            let theirs: Vec<i16> = (0..ni * nj * nk).map(|n| value(3 * n + 5)).collect();
            let sums = mirrored(&ours, &theirs, size);
            for (mirror, sum) in sums.into_iter().enumerate() {
                let flip = |n: usize, size: usize, bit: usize| {
                    if mirror >> bit & 1 > 0 { size - 1 - n } else { n }
                };
                let mut expected = 0;
                for n in 0..ours.len() {
                    let (i, j, k) = (n % ni, n / ni % nj, n / ni / nj);
                    let at = (flip(k, nk, 2) * nj + flip(j, nj, 1)) * ni + flip(i, ni, 0);
                    expected += i64::from(ours[n]) * i64::from(theirs[at]);
                }
                assert_eq!(sum, expected, "{mirror} {scale}");
            }
        }
    }
}
