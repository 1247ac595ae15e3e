//! Which voxels of a slab were met.

use crate::rows::Span;
use rayon::prelude::*;
use supine_volume::Volume;

/// Voxels `first..end` along i, j, k.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Window {
    pub(crate) first: [usize; 3],
    pub(crate) end: [usize; 3],
}

/// One bit for each voxel of a window; each row begins with a word of its own.
#[derive(Clone, Debug)]
pub(crate) struct Coverage {
    words: Vec<u64>,
    window: Window,
    /// Words of a row.
    row: usize,
}

const BITS: usize = u64::BITS as usize;

impl Window {
    /// The part in slices `from..to`.
    pub(crate) fn slices(self, from: usize, to: usize) -> Self {
        let [i, j, k] = self.first;
        let [ni, nj, nk] = self.end;
        Self { first: [i, j, k.max(from)], end: [ni, nj, nk.min(to)] }
    }

    /// The smallest window that holds both; an empty one counts for nothing.
    pub(crate) fn with(self, other: Self) -> Self {
        match (self.is_empty(), other.is_empty()) {
            (true, _) => other,
            (_, true) => self,
            _ => Self {
                first: [0, 1, 2].map(|a| self.first[a].min(other.first[a])),
                end: [0, 1, 2].map(|a| self.end[a].max(other.end[a])),
            },
        }
    }

    /// One voxel more on each side, within a volume of `size` voxels; of an empty one the first two
    /// along each axis.
    pub(crate) fn wider(self, size: [usize; 3]) -> Self {
        if self.is_empty() {
            return Self { first: [0; 3], end: size.map(|n| n.min(2)) };
        }
        Self {
            first: self.first.map(|n| n.saturating_sub(1)),
            end: [0, 1, 2].map(|a| (self.end[a] + 1).min(size[a])),
        }
    }

    /// Whether it holds no voxel.
    pub(crate) fn is_empty(&self) -> bool {
        (0..3).any(|a| self.first[a] >= self.end[a])
    }
}

impl Coverage {
    /// None of the voxels of a window, which may be taken somewhat larger.
    pub(crate) fn new(window: Window) -> Self {
        if window.is_empty() {
            return Self { words: Vec::new(), window, row: 0 };
        }
        let Window { mut first, end } = window;
        first[0] -= first[0] % BITS;
        let [ni, nj, nk] = [0, 1, 2].map(|a| end[a] - first[a]);
        let row = ni.div_ceil(BITS);
        Self { words: vec![0; row * nj * nk], window: Window { first, end }, row }
    }

    /// The voxels that may be marked.
    pub(crate) fn window(&self) -> Window {
        self.window
    }

    /// The same marks in a window that holds this one.
    pub(crate) fn within(&self, window: Window) -> Self {
        let mut wider = Self::new(window);
        for (at, words) in self.words.chunks_exact(self.row.max(1)).enumerate() {
            let [i, j, k] = self.place(at * self.row).map(|n| n as u32);
            let span = Span { j, k, from: i, to: i };
            let first = wider.row(&span) + (i as usize - wider.window.first[0]) / BITS;
            wider.words[first..first + self.row].copy_from_slice(words);
        }
        wider
    }

    /// None of the same voxels.
    pub(crate) fn none(&self) -> Self {
        Self { words: vec![0; self.words.len()], ..*self }
    }

    /// Where the words of a row begin.
    #[inline(always)]
    fn row(&self, span: &Span) -> usize {
        let Window { first, end } = &self.window;
        let (j, k) = (span.j as usize - first[1], span.k as usize - first[2]);
        (k * (end[1] - first[1]) + j) * self.row
    }

    /// The words that a span touches, as places and masks.
    #[inline(always)]
    fn masks(&self, span: &Span) -> impl Iterator<Item = (usize, u64)> + use<> {
        let start = self.row(span);
        let [from, to] = [span.from, span.to].map(|n| n as usize - self.window.first[0]);
        (from / BITS..=(to - 1) / BITS).map(move |word| {
            let low = from.saturating_sub(word * BITS);
            let high = (to - word * BITS).min(BITS);
            (start + word, (u64::MAX >> (BITS - (high - low))) << low)
        })
    }

    /// Marks the voxels of a span; the number of those that were marked before.
    #[inline(always)]
    pub(crate) fn mark(&mut self, span: &Span) -> usize {
        let mut before = 0;
        for (word, mask) in self.masks(span) {
            before += (self.words[word] & mask).count_ones() as usize;
            self.words[word] |= mask;
        }
        before
    }

    /// Marks the voxels of spans; whether any was marked before.
    #[inline(always)]
    pub(crate) fn mark_all(&mut self, spans: &[Span]) -> bool {
        let (Window { first, end }, row) = (self.window, self.row);
        let (slice, words) = ((end[1] - first[1]) * row, &mut self.words[..]);
        let mut before = 0;
        for span in spans {
            let start = (span.k as usize - first[2]) * slice + (span.j as usize - first[1]) * row;
            let (from, last) = (span.from as usize - first[0], span.to as usize - 1 - first[0]);
            let (low, high) = (u64::MAX << (from % BITS), u64::MAX >> (BITS - 1 - last % BITS));
            let (one, other) = (start + from / BITS, start + last / BITS);
            if one == other {
                before |= words[one] & low & high;
                words[one] |= low & high;
            } else {
                let mut mark = |word: usize, mask: u64| {
                    before |= words[word] & mask;
                    words[word] |= mask;
                };
                mark(one, low);
                (one + 1..other).for_each(|word| mark(word, u64::MAX));
                mark(other, high);
            }
        }
        before != 0
    }

    /// Number of voxels of a span that are marked.
    #[inline(always)]
    pub(crate) fn marked(&self, span: &Span) -> usize {
        self.masks(span).map(|(word, mask)| (self.words[word] & mask).count_ones() as usize).sum()
    }

    /// Marks all that is marked in `other`.
    pub(crate) fn add(&mut self, other: &Self) {
        self.words.iter_mut().zip(&other.words).for_each(|(own, other)| *own |= other);
    }

    /// Calls `with` for each voxel (i, j, k) that is marked here and not in `other`, of the same
    /// window; their number.
    pub(crate) fn each_without(&self, other: &Self, mut with: impl FnMut([usize; 3])) -> usize {
        let mut count = 0;
        for (at, (own, other)) in self.words.iter().zip(&other.words).enumerate() {
            let mut left = own & !other;
            while left != 0 {
                let [i, j, k] = self.place(at);
                with([i + left.trailing_zeros() as usize, j, k]);
                left &= left - 1;
                count += 1;
            }
        }
        count
    }

    /// The first voxel of a word.
    fn place(&self, word: usize) -> [usize; 3] {
        let Window { first, end } = &self.window;
        let (row, nj) = (word / self.row, end[1] - first[1]);
        [first[0] + word % self.row * BITS, first[1] + row % nj, first[2] + row / nj]
    }

    /// The part of each row that holds all its marked voxels.
    pub(crate) fn hulls(&self) -> impl Iterator<Item = Span> {
        self.words.chunks_exact(self.row.max(1)).enumerate().filter_map(|(row, words)| {
            let first = words.iter().position(|w| *w != 0)?;
            let last = words.iter().rposition(|w| *w != 0)?;
            let [start, j, k] = self.place(row * self.row).map(|n| n as u32);
            let bit = |word: usize, n: u32| start + (word * BITS) as u32 + n;
            let from = bit(first, words[first].trailing_zeros());
            Some(Span { j, k, from, to: bit(last, u64::BITS - words[last].leading_zeros()) })
        })
    }
}

/// The box of the vectors that are not 0.
pub(crate) fn moving(field: &Volume<[f32; 3]>) -> Window {
    holding(field, |v| *v != [0.0; 3])
}

/// The box of the voxels of which `held` is true.
pub(crate) fn holding<T: Sync>(volume: &Volume<T>, held: impl Fn(&T) -> bool + Sync) -> Window {
    let none = Window { first: [0; 3], end: [0; 3] };
    let [ni, nj, _] = volume.grid().size();
    let row = |(at, row): (usize, &[T])| {
        let (j, k) = (at % nj, at / nj);
        let Some(first) = row.iter().position(&held) else { return none };
        let last = row.iter().rposition(&held).unwrap_or(first);
        Window { first: [first, j, k], end: [last + 1, j + 1, k + 1] }
    };
    volume.data().par_chunks_exact(ni).enumerate().map(row).reduce(|| none, Window::with)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn spans_are_counted_as_voxel_by_voxel(
            spans in proptest::collection::vec((7u32..10, 4u32..6, 70u32..220, 1u32..150), 1..20),
        ) {
            let window = Window { first: [70, 7, 4], end: [370, 10, 6] };
            let mut coverage = Coverage::new(window);
            let mut plain = vec![0usize; 370 * 10 * 6];
            let start = |s: &Span| ((s.k * 10 + s.j) * 370) as usize;
            for (j, k, from, length) in spans {
                let span = Span { j, k, from, to: from + length };
                let own = start(&span) + from as usize..start(&span) + span.to as usize;
                let before = plain[own.clone()].iter().filter(|n| **n > 0).count();
                prop_assert_eq!(coverage.marked(&span), before);
                let mut all = coverage.clone();
                prop_assert_eq!(all.mark_all(&[span]), before > 0);
                prop_assert_eq!(all.marked(&span), length as usize);
                prop_assert_eq!(all.mark_all(&[span]), true);
                prop_assert_eq!(coverage.mark(&span), before);
                plain[own].iter_mut().for_each(|n| *n += 1);
            }
            let mut seen = vec![0usize; plain.len()];
            let with = |[i, j, k]: [usize; 3]| seen[(k * 10 + j) * 370 + i] += 1;
            let count = coverage.each_without(&coverage.none(), with);
            prop_assert_eq!(count, plain.iter().filter(|n| **n > 0).count());
            prop_assert!(seen.iter().zip(&plain).all(|(s, p)| *s == usize::from(*p > 0)));
            prop_assert_eq!(coverage.each_without(&coverage, |_| ()), 0);
            let hulls: Vec<_> = coverage.hulls().collect();
            let ends = |h: &Span| [h.from, h.to - 1].map(|i| plain[start(h) + i as usize]);
            prop_assert!(hulls.iter().all(|h| ends(h).iter().all(|n| *n > 0)));
            let wider = Window { first: [3, 6, 4], end: [380, 10, 8] };
            let wider = coverage.within(wider);
            prop_assert!(hulls.iter().all(|h| wider.marked(h) == coverage.marked(h)));
            prop_assert_eq!(wider.each_without(&wider.none(), |_| ()), count);
            let rows: Vec<_> = hulls.iter().map(|h| (start(h) + h.from as usize, h.to - h.from)).collect();
            let within = |at: usize| rows.iter().any(|(s, n)| (*s..s + *n as usize).contains(&at));
            prop_assert!((0..plain.len()).all(|at| plain[at] == 0 || within(at)));
        }
    }
}
