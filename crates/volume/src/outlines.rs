//! Closed contours of one plane: which go together, and what lies within them.

/// Lines on which a contour is measured, and two are compared.
const LINES: usize = 64;
/// Contours that share less than this of the smaller one lie beside each other.
const BESIDE: f64 = 0.01;
/// A contour lies within another when it shares more than this with it.
const WITHIN: f64 = 1.0 - BESIDE;
/// A contour within another, nearer to it than this all round in the mean, is the same drawn again,
/// mm.
const SAME_MM: f64 = 1.0;
/// One that is nearer than this is a hole, but may have been meant as the same, mm.
const THIN_MM: f64 = 2.0;

/// A place in the plane.
type Spot = [f64; 2];

/// How the contours of a plane go together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rule {
    /// A contour well within another is a hole in it; contours that cross or lie upon each other
    /// are one region.
    #[default]
    Joined,
    /// What an odd number of contours holds (CLOSEDPLANAR_XOR, PS3.3 C.8.8.6.3).
    Exclusive,
}

/// Closed contours of one plane.
///
/// Each holds what it goes round, however often (nonzero winding), so that a keyhole leaves its
/// hole and a contour drawn twice in one go does not vanish.
#[derive(Clone, Debug)]
pub struct Outlines {
    contours: Vec<Vec<Spot>>,
    /// The group of each contour: groups are joined within and exclusive among each other.
    groups: Vec<usize>,
    overlap: bool,
}

impl Outlines {
    /// Contours in units of `mm` along the two axes.
    pub fn new(contours: Vec<Vec<Spot>>, mm: [f64; 2], rule: Rule) -> Self {
        let mut groups: Vec<usize> = (0..contours.len()).collect();
        let mut overlap = false;
        let sizes: Vec<Size> = contours.iter().map(|c| Size::of(c, mm)).collect();
        for b in 0..contours.len() {
            for a in 0..b {
                let pair = [&contours[a], &contours[b]];
                let near = relation(pair, [&sizes[a], &sizes[b]], mm[0] * mm[1]);
                let joined = rule == Rule::Joined;
                overlap |= near == Relation::Joined || (joined && near == Relation::Thin);
                if joined && near == Relation::Joined {
                    let (from, to) = (groups[b], groups[a]);
                    groups.iter_mut().filter(|g| **g == from).for_each(|g| *g = to);
                }
            }
        }
        Self { contours, groups, overlap }
    }

    /// The contours, as they were given.
    pub fn contours(&self) -> &[Vec<Spot>] {
        &self.contours
    }

    /// Whether some of them cross or lie upon each other.
    pub fn overlap(&self) -> bool {
        self.overlap
    }

    /// The same contours moved.
    #[must_use]
    pub fn moved(&self, by: Spot) -> Self {
        let corner = |c: &Spot| [c[0] + by[0], c[1] + by[1]];
        let contours = self.contours.iter().map(|c| c.iter().map(corner).collect()).collect();
        Self { contours, ..self.clone() }
    }

    /// Where a line along the first axis lies inside, ascending. A corner on the line belongs to
    /// the lower side.
    pub fn line(&self, y: f64) -> Vec<[f64; 2]> {
        let mut ends: Vec<(f64, usize, i32)> = Vec::new();
        for (contour, &group) in self.contours.iter().zip(&self.groups) {
            for [from, to] in within(contour, y) {
                ends.extend([(from, group, 1), (to, group, -1)]);
            }
        }
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut held = vec![0; self.contours.len()];
        let (mut inside, mut lines) = (0usize, Vec::new());
        let mut from = f64::NAN;
        for (x, group, step) in ends {
            let (before, was) = (held[group] > 0, inside % 2 == 1);
            held[group] += step;
            match (before, held[group] > 0) {
                (false, true) => inside += 1,
                (true, false) => inside -= 1,
                _ => {}
            }
            match (was, inside % 2 == 1) {
                (false, true) => from = x,
                (true, false) => lines.push([from, x]),
                _ => {}
            }
        }
        lines
    }
}

/// Where a line along the first axis lies within a contour, ascending.
fn within(contour: &[Spot], y: f64) -> Vec<[f64; 2]> {
    let mut crossings: Vec<(f64, i32)> = Vec::new();
    let Some(mut from) = contour.last() else { return vec![] };
    for to in contour {
        if (from[1] <= y) != (to[1] <= y) {
            let x = from[0] + (y - from[1]) / (to[1] - from[1]) * (to[0] - from[0]);
            crossings.push((x, if from[1] <= y { 1 } else { -1 }));
        }
        from = to;
    }
    crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut winding, mut start, mut lines) = (0, 0.0, Vec::new());
    for (x, step) in crossings {
        let before = winding;
        winding += step;
        if before == 0 {
            start = x;
        } else if winding == 0 {
            lines.push([start, x]);
        }
    }
    lines
}

/// Reach, area and length of a contour.
struct Size {
    low: Spot,
    high: Spot,
    area: f64,
    length_mm: f64,
}

impl Size {
    fn of(contour: &[Spot], mm: [f64; 2]) -> Self {
        let (low, high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let mut size = Self { low, high, area: 0.0, length_mm: 0.0 };
        let Some(mut from) = contour.last() else { return size };
        for to in contour {
            for a in 0..2 {
                size.low[a] = size.low[a].min(to[a]);
                size.high[a] = size.high[a].max(to[a]);
            }
            size.length_mm += ((to[0] - from[0]) * mm[0]).hypot((to[1] - from[1]) * mm[1]);
            from = to;
        }
        size.area = integral([size.low[1], size.high[1]], |y| length(&within(contour, y)));
        size
    }

    fn meets(&self, other: &Self) -> bool {
        (0..2).all(|a| self.low[a] < other.high[a] && other.low[a] < self.high[a])
    }
}

/// How two contours lie to each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Relation {
    /// They share nothing.
    Beside,
    /// One lies within the other.
    Nested,
    /// One lies within the other, hardly smaller.
    Thin,
    /// They cross or lie upon each other.
    Joined,
}

fn relation(pair: [&Vec<Spot>; 2], sizes: [&Size; 2], unit_mm2: f64) -> Relation {
    if !sizes[0].meets(sizes[1]) {
        return Relation::Beside;
    }
    let low = sizes[0].low[1].max(sizes[1].low[1]);
    let high = sizes[0].high[1].min(sizes[1].high[1]);
    let shared = integral([low, high], |y| {
        let [a, b] = pair.map(|contour| within(contour, y));
        common(&a, &b)
    });
    let (smaller, larger) = (sizes[0].area.min(sizes[1].area), sizes[0].area.max(sizes[1].area));
    if shared <= BESIDE * smaller {
        return Relation::Beside;
    }
    if shared < WITHIN * smaller {
        return Relation::Joined;
    }
    let gap_mm = 2.0 * (larger - smaller) * unit_mm2 / (sizes[0].length_mm + sizes[1].length_mm);
    if gap_mm < SAME_MM {
        Relation::Joined
    } else if gap_mm < THIN_MM {
        Relation::Thin
    } else {
        Relation::Nested
    }
}

/// The integral over a range by the middles of equal parts.
fn integral([low, high]: [f64; 2], f: impl Fn(f64) -> f64) -> f64 {
    let step = (high - low) / LINES as f64;
    (0..LINES).map(|n| f(low + (n as f64 + 0.5) * step) * step).sum()
}

fn length(lines: &[[f64; 2]]) -> f64 {
    lines.iter().map(|[from, to]| to - from).sum()
}

/// Length of what two ascending lists of lines share.
fn common(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    let (mut i, mut j, mut sum) = (0, 0, 0.0);
    while let (Some(one), Some(other)) = (a.get(i), b.get(j)) {
        sum += (one[1].min(other[1]) - one[0].max(other[0])).max(0.0);
        if one[1] < other[1] { i += 1 } else { j += 1 }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circle(x: f64, radius: f64, turn: f64) -> Vec<Spot> {
        let at = |n: usize| (turn * n as f64 * std::f64::consts::TAU / 180.0).sin_cos();
        (0..180).map(|n| [x + radius * at(n).1, radius * at(n).0]).collect()
    }

    fn outlines(contours: &[Vec<Spot>], rule: Rule) -> Outlines {
        Outlines::new(contours.to_vec(), [1.0, 1.0], rule)
    }

    fn area(outlines: &Outlines) -> f64 {
        let line = |n: i32| length(&outlines.line(f64::from(n) * 0.05 + 0.013));
        (-600..600).map(line).sum::<f64>() * 0.05
    }

    fn joined(contours: &[Vec<Spot>]) -> (f64, bool) {
        let outlines = outlines(contours, Rule::Joined);
        (area(&outlines) / std::f64::consts::PI, outlines.overlap())
    }

    fn close(found: (f64, bool), squares: f64, overlap: bool) {
        assert!((found.0 - squares).abs() < 0.01 * squares, "{found:?}, not {squares}");
        assert_eq!(found.1, overlap);
    }

    #[test]
    fn a_contour_drawn_twice_is_drawn_once() {
        let one = circle(0.0, 10.0, 1.0);
        close(joined(&[one.clone(), one.clone()]), 100.0, true);
        close(joined(&[one.clone(), one.clone(), one.clone()]), 100.0, true);
        close(joined(&[one.clone(), circle(0.0, 10.0, -1.0)]), 100.0, true);
        close(joined(&[one.clone(), circle(0.3, 10.2, 1.0)]), 104.0, true);
        close(joined(&[[one.clone(), one].concat()]), 100.0, false);
    }

    #[test]
    fn contours_that_cross_are_one_region_with_the_holes_of_both() {
        let pair = [circle(-5.0, 10.0, 1.0), circle(5.0, 10.0, -1.0)];
        let lens = 2.0 * 100.0 * 0.5f64.acos() - 5.0 * 300.0f64.sqrt();
        let union = 200.0 - lens / std::f64::consts::PI;
        close(joined(&pair), union, true);
        let holed = [pair.clone().into(), vec![circle(0.0, 2.0, 1.0)]].concat();
        close(joined(&holed), union - 4.0, true);
    }

    #[test]
    fn a_contour_within_another_is_a_hole_and_one_within_that_is_none() {
        for turn in [1.0, -1.0] {
            let nested = [circle(0.0, 20.0, 1.0), circle(1.0, 10.0, turn), circle(2.0, 5.0, 1.0)];
            close(joined(&nested[..2]), 300.0, false);
            close(joined(&nested), 325.0, false);
        }
        let twice = [circle(0.0, 20.0, 1.0), circle(1.0, 10.0, 1.0), circle(1.0, 10.0, 1.0)];
        close(joined(&twice), 300.0, true);
        close(joined(&[circle(0.0, 20.0, 1.0), circle(0.0, 18.5, 1.0)]), 400.0 - 342.25, true);
    }

    #[test]
    fn contours_beside_each_other_are_no_overlap() {
        close(joined(&[circle(-10.0, 10.0, 1.0), circle(10.0, 10.0, 1.0)]), 200.0, false);
    }

    #[test]
    fn exclusive_contours_take_away_what_two_hold() {
        let xor = |contours: &[Vec<Spot>]| {
            let outlines = outlines(contours, Rule::Exclusive);
            (area(&outlines) / std::f64::consts::PI, outlines.overlap())
        };
        close(xor(&[circle(0.0, 20.0, 1.0), circle(1.0, 10.0, 1.0)]), 300.0, false);
        let lens = 2.0 * 100.0 * 0.5f64.acos() - 5.0 * 300.0f64.sqrt();
        let apart = 200.0 - 2.0 * lens / std::f64::consts::PI;
        close(xor(&[circle(-5.0, 10.0, 1.0), circle(5.0, 10.0, 1.0)]), apart, true);
        let one = circle(0.0, 10.0, 1.0);
        assert_eq!(xor(&[one.clone(), one]), (0.0, true));
    }
}
