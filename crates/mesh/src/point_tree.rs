//! The points nearest to a place.

use rayon::join;
use supine_space::Point;

/// Points in a balanced k-d tree, which finds those nearest to a place. mm, in any frame.
///
/// It is made once and never changes. Points equally near are found by the lower index first,
/// whatever the number of threads. Source: Friedman, Bentley and Finkel, ACM Trans. Math. Softw.
/// 3, 1977.
#[derive(Clone, Debug)]
pub struct PointTree {
    /// Inner nodes, each before its left and then its right half; all leaves lie equally deep.
    splits: Vec<Split>,
    /// The points leaf by leaf, and their indices.
    places: Vec<[f64; 3]>,
    indices: Vec<u32>,
}

/// Where a node is divided: the left half lies at or below `low`, the right one at or above `high`.
#[derive(Clone, Copy, Debug, Default)]
struct Split {
    low: f64,
    high: f64,
    axis: u8,
}

/// Most points of a leaf.
const LEAF: usize = 8;
/// Halves of fewer points are not worth a thread.
const APART: usize = 1 << 12;

impl PointTree {
    /// A tree of points. One that is not finite is never found.
    ///
    /// # Panics
    /// With 2^32 points or more.
    pub fn new(points: &[Point]) -> Self {
        assert!(u32::try_from(points.len()).is_ok(), "indices are of 32 bits");
        let mut items: Vec<Item> = points.iter().zip(0..).map(|(p, n)| ((*p).into(), n)).collect();
        let mut leaves = 1;
        while points.len().div_ceil(leaves) > LEAF {
            leaves *= 2;
        }
        let mut splits = vec![Split::default(); leaves - 1];
        divide(&mut splits, &mut items);
        let (places, indices) = items.into_iter().unzip();
        Self { splits, places, indices }
    }

    /// How many points there are.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// The point nearest to a place, no farther than `within_mm`: its index and distance in mm.
    pub fn nearest(&self, place: &Point, within_mm: f64) -> Option<(usize, f64)> {
        let mut best: Option<(f64, u32)> = None;
        self.search(place, within_mm, |found| {
            if best.is_none_or(|best| before(found, best)) {
                best = Some(found);
            }
            best.map(|b| b.0)
        });
        best.map(found)
    }

    /// The `count` points nearest to a place, or fewer where no more lie within `within_mm`:
    /// indices and distances in mm, the nearest first.
    pub fn nearest_few(&self, place: &Point, count: usize, within_mm: f64) -> Vec<(usize, f64)> {
        let mut best: Vec<(f64, u32)> = Vec::with_capacity(count.min(self.len()) + 1);
        if count > 0 {
            self.search(place, within_mm, |found| {
                let at = best.iter().rposition(|&b| before(b, found)).map_or(0, |p| p + 1);
                best.insert(at, found);
                best.truncate(count);
                (best.len() == count).then(|| best[count - 1].0)
            });
        }
        best.into_iter().map(found).collect()
    }

    /// Shows `take` points within reach of a place, by squared distance and index. It answers with
    /// the squared distance beyond which it wants no more, if it knows.
    fn search(&self, place: &Point, within_mm: f64, take: impl FnMut((f64, u32)) -> Option<f64>) {
        if within_mm >= 0.0 {
            // Infinitely far is what is not finite.
            let reach = (within_mm * within_mm).min(f64::MAX);
            let mut search = Search { tree: self, place: (*place).into(), reach, take };
            search.visit(&self.splits, 0..self.len(), [0.0; 3]);
        }
    }
}

/// A point and its index.
type Item = ([f64; 3], u32);

/// Puts the points of a node in the order of its leaves.
fn divide(splits: &mut [Split], items: &mut [Item]) {
    let Some((split, below)) = splits.split_first_mut() else { return };
    let axis = widest(items);
    let middle = items.len() / 2;
    // Equal coordinates go by index, so that each half is the same set whatever the selection does.
    let order = |a: &Item, b: &Item| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1));
    let (left, at, _) = items.select_nth_unstable_by(middle, order);
    let low = left.iter().map(|item| item.0[axis]).fold(f64::NEG_INFINITY, f64::max);
    *split = Split { low, high: at.0[axis], axis: axis as u8 };
    let half = below.len() / 2;
    let (left_splits, right_splits) = below.split_at_mut(half);
    let (left, right) = items.split_at_mut(middle);
    if left.len() < APART {
        divide(left_splits, left);
        divide(right_splits, right);
    } else {
        join(|| divide(left_splits, left), || divide(right_splits, right));
    }
}

/// The axis along which points reach farthest.
fn widest(items: &[Item]) -> usize {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for (place, _) in items {
        for axis in 0..3 {
            low[axis] = low[axis].min(place[axis]);
            high[axis] = high[axis].max(place[axis]);
        }
    }
    let extent = |axis: usize| high[axis] - low[axis];
    (1..3).fold(0, |best, axis| if extent(axis) > extent(best) { axis } else { best })
}

/// Whether a point comes before another: nearer, or equally near and of lower index.
fn before(a: (f64, u32), b: (f64, u32)) -> bool {
    a.0 < b.0 || a.0 == b.0 && a.1 < b.1
}

fn found((squared, index): (f64, u32)) -> (usize, f64) {
    (index as usize, squared.sqrt())
}

struct Search<'a, F> {
    tree: &'a PointTree,
    place: [f64; 3],
    /// Squared distance beyond which points no longer matter.
    reach: f64,
    take: F,
}

impl<F: FnMut((f64, u32)) -> Option<f64>> Search<'_, F> {
    /// Visits a node whose box lies at least `away` from the place along each axis.
    fn visit(&mut self, splits: &[Split], range: std::ops::Range<usize>, away: [f64; 3]) {
        let Some((split, below)) = splits.split_first() else {
            return self.leaf(range);
        };
        let (left, right) = below.split_at(below.len() / 2);
        let middle = range.start + range.len() / 2;
        let (left, right) = ((left, range.start..middle), (right, middle..range.end));
        let axis = usize::from(split.axis);
        let (past_low, past_high) = (self.place[axis] - split.low, split.high - self.place[axis]);
        let (near, far, gap) =
            if past_low < past_high { (left, right, past_high) } else { (right, left, past_low) };
        self.visit(near.0, near.1, away);
        let mut beyond = away;
        beyond[axis] = gap.max(away[axis]);
        // Summed as distances are: rounding never makes a box seem farther than a point in it.
        if squared(beyond) <= self.reach {
            self.visit(far.0, far.1, beyond);
        }
    }

    fn leaf(&mut self, range: std::ops::Range<usize>) {
        let (places, indices) = (&self.tree.places[range.clone()], &self.tree.indices[range]);
        for (place, &index) in places.iter().zip(indices) {
            let distance = squared([0, 1, 2].map(|axis| place[axis] - self.place[axis]));
            if distance <= self.reach
                && let Some(reach) = (self.take)((distance, index))
            {
                self.reach = reach;
            }
        }
    }
}

fn squared([x, y, z]: [f64; 3]) -> f64 {
    x * x + y * y + z * z
}

#[cfg(test)]
mod tests;
