//! Operations within one slice.

/// Squared distance (mm²) of every pixel centre to the nearest one where `on` holds; infinite when
/// it holds nowhere. Exact (lower envelope of parabolas, Felzenszwalb and Huttenlocher 2012).
pub(crate) fn squared_distance(on: &[bool], ni: usize, spacing: [f32; 2]) -> Vec<f32> {
    let nj = on.len() / ni;
    // Transposed: the second pass then runs along memory.
    let mut columns = vec![f32::INFINITY; on.len()];
    for j in 0..nj {
        let row = &on[j * ni..(j + 1) * ni];
        let mut away = f32::INFINITY;
        for i in 0..ni {
            away = if row[i] { 0.0 } else { away + spacing[0] };
            columns[i * nj + j] = away;
        }
        away = f32::INFINITY;
        for i in (0..ni).rev() {
            away = if row[i] { 0.0 } else { away + spacing[0] };
            let d = columns[i * nj + j].min(away);
            columns[i * nj + j] = d * d;
        }
    }
    let mut envelope = Envelope::default();
    for column in columns.chunks_exact_mut(nj) {
        envelope.lower(column, spacing[1]);
    }
    let mut out = vec![0.0; on.len()];
    for j in 0..nj {
        for i in 0..ni {
            out[j * ni + i] = columns[i * nj + j];
        }
    }
    out
}

#[derive(Default)]
struct Envelope {
    apex: Vec<(f32, f32)>,
    from: Vec<f32>,
}

impl Envelope {
    /// Replaces f by min over q of f(q) + ((p - q) step)².
    fn lower(&mut self, f: &mut [f32], step: f32) {
        self.apex.clear();
        self.from.clear();
        for (q, &value) in f.iter().enumerate() {
            if value.is_infinite() {
                continue;
            }
            let b = q as f32 * step;
            let start = loop {
                let Some(&(a, lower)) = self.apex.last() else { break f32::NEG_INFINITY };
                let cross = 0.5 * ((value - lower) / (b - a) + a + b);
                if cross > self.from[self.from.len() - 1] {
                    break cross;
                }
                self.apex.pop();
                self.from.pop();
            };
            self.apex.push((b, value));
            self.from.push(start);
        }
        if self.apex.is_empty() {
            return;
        }
        let mut n = 0;
        for (p, out) in f.iter_mut().enumerate() {
            let x = p as f32 * step;
            while n + 1 < self.apex.len() && self.from[n + 1] < x {
                n += 1;
            }
            let (a, value) = self.apex[n];
            *out = value + (x - a) * (x - a);
        }
    }
}

/// Sets every hole (off pixels that no path of off pixels joins to the border).
pub(crate) fn fill_holes(mask: &mut [bool], ni: usize) {
    let nj = mask.len() / ni;
    let mut outside = vec![false; mask.len()];
    let mut stack = Vec::new();
    let mut visit = |n: usize, stack: &mut Vec<usize>| {
        if !mask[n] && !outside[n] {
            outside[n] = true;
            stack.push(n);
        }
    };
    for i in 0..ni {
        visit(i, &mut stack);
        visit((nj - 1) * ni + i, &mut stack);
    }
    for j in 0..nj {
        visit(j * ni, &mut stack);
        visit(j * ni + ni - 1, &mut stack);
    }
    while let Some(n) = stack.pop() {
        let i = n % ni;
        if i > 0 {
            visit(n - 1, &mut stack);
        }
        if i + 1 < ni {
            visit(n + 1, &mut stack);
        }
        if n >= ni {
            visit(n - ni, &mut stack);
        }
        if n + ni < mask.len() {
            visit(n + ni, &mut stack);
        }
    }
    for (m, out) in mask.iter_mut().zip(outside) {
        *m = !out;
    }
}

/// Keeps of a mask what ways of at most `reach` (mm) along its pixels join to `from`; steps lead to
/// the eight neighbours.
pub(crate) fn keep_joined(
    mask: &mut [bool],
    from: &[bool],
    ni: usize,
    [si, sj]: [f32; 2],
    reach: f32,
) {
    let nj = mask.len() / ni;
    let mut way: Vec<f32> = from.iter().map(|&f| if f { 0.0 } else { f32::INFINITY }).collect();
    let mut front: Vec<usize> = (0..mask.len()).filter(|&n| from[n]).collect();
    while !front.is_empty() {
        let mut next = Vec::new();
        for n in front {
            let (i, j) = (n % ni, n / ni);
            for (di, dj) in [0, 1, 2].into_iter().flat_map(|dj| [0, 1, 2].map(|di| (di, dj))) {
                if !(1..=ni).contains(&(i + di)) || !(1..=nj).contains(&(j + dj)) {
                    continue;
                }
                let m = (j + dj - 1) * ni + i + di - 1;
                let step = (di.abs_diff(1) as f32 * si).hypot(dj.abs_diff(1) as f32 * sj);
                if mask[m] && way[n] + step < way[m].min(reach) {
                    way[m] = way[n] + step;
                    next.push(m);
                }
            }
        }
        front = next;
    }
    mask.iter_mut().zip(way).for_each(|(m, w)| *m &= w.is_finite());
}

/// Smooths a slice in place by a Gaussian (sigma in mm); the border value continues outside.
pub(crate) fn smooth(image: &mut [f32], ni: usize, spacing: [f32; 2], sigma_mm: f32) {
    let nj = image.len() / ni;
    let kernel = kernel(sigma_mm / spacing[0]);
    let reach = kernel.len() - 1;
    let mut padded = vec![0.0; ni + 2 * reach];
    for row in image.chunks_exact_mut(ni) {
        padded[..reach].fill(row[0]);
        padded[reach..reach + ni].copy_from_slice(row);
        padded[reach + ni..].fill(row[ni - 1]);
        for (x, value) in row.iter_mut().enumerate() {
            *value *= kernel[0];
            let centre = x + reach;
            for (d, w) in kernel.iter().enumerate().skip(1) {
                *value += w * (padded[centre - d] + padded[centre + d]);
            }
        }
    }
    let kernel = self::kernel(sigma_mm / spacing[1]);
    let source = image.to_vec();
    for (j, row) in image.chunks_exact_mut(ni).enumerate() {
        row.iter_mut().for_each(|v| *v *= kernel[0]);
        for (d, w) in kernel.iter().enumerate().skip(1) {
            let above = &source[j.saturating_sub(d) * ni..][..ni];
            let below = &source[(j + d).min(nj - 1) * ni..][..ni];
            for (v, (a, b)) in row.iter_mut().zip(above.iter().zip(below)) {
                *v += w * (a + b);
            }
        }
    }
}

/// One-sided half of a normalised Gaussian, centre first, cut at 3 sigma (pixels).
pub(crate) fn kernel(sigma: f32) -> Vec<f32> {
    let reach = (3.0 * sigma).ceil().max(0.0) as usize;
    let half: Vec<f32> =
        (0..=reach).map(|x| (-0.5 * (x as f32 / sigma.max(1e-3)).powi(2)).exp()).collect();
    let sum = half[0] + 2.0 * half[1..].iter().sum::<f32>();
    half.iter().map(|w| w / sum).collect()
}

/// Bilinear sample of an image at (x, y) pixels; `None` off the image.
#[inline]
pub(crate) fn bilinear<T: Copy>(
    image: &[T],
    ni: usize,
    [x, y]: [f32; 2],
    value: impl Fn(T) -> f32,
) -> Option<f32> {
    let nj = image.len() / ni;
    if !(x >= 0.0 && y >= 0.0 && x < (ni - 1) as f32 && y < (nj - 1) as f32) {
        return None;
    }
    let (i, j) = (x as usize, y as usize);
    let (s, t) = (x - i as f32, y - j as f32);
    let n = j * ni + i;
    let top = value(image[n]) * (1.0 - s) + value(image[n + 1]) * s;
    let bottom = value(image[n + ni]) * (1.0 - s) + value(image[n + ni + 1]) * s;
    Some(top * (1.0 - t) + bottom * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distance_equals_brute_force() {
        let (ni, nj, s) = (17, 12, [0.7f32, 1.3]);
        let on: Vec<bool> = (0..ni * nj).map(|n| n * 37 % 29 == 0).collect();
        let got = squared_distance(&on, ni, s);
        for n in 0..ni * nj {
            let want = (0..ni * nj)
                .filter(|&m| on[m])
                .map(|m| {
                    let dx = (m % ni).abs_diff(n % ni) as f32 * s[0];
                    let dy = (m / ni).abs_diff(n / ni) as f32 * s[1];
                    dx * dx + dy * dy
                })
                .fold(f32::INFINITY, f32::min);
            assert!((got[n] - want).abs() < 1e-3, "{n}: {} {want}", got[n]);
        }
        assert!(squared_distance(&[false; 6], 3, s).iter().all(|d| d.is_infinite()));
    }

    #[test]
    fn only_closed_holes_are_filled() {
        let picture = ["#####", "#..##", "#.#.#", "###..", "#.###"];
        let mut mask: Vec<bool> = picture.concat().chars().map(|c| c == '#').collect();
        fill_holes(&mut mask, 5);
        let shown: String = mask.iter().map(|&m| if m { '#' } else { '.' }).collect();
        assert_eq!(shown, ["#####", "#####", "###.#", "###..", "#.###"].concat());
    }

    #[test]
    fn smoothing_keeps_a_constant_and_a_ramp() {
        let mut image: Vec<f32> = (0..30 * 20).map(|n| (n % 30) as f32 + 2.0).collect();
        smooth(&mut image, 30, [0.7, 1.1], 1.5);
        for x in 8..22 {
            assert!((image[10 * 30 + x] - (x as f32 + 2.0)).abs() < 1e-4);
        }
    }
}
