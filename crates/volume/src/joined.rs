//! Segments as lines.

use std::collections::BTreeMap;
use supine_space::Spot;

/// The lines that segments form which meet at their ends, those nearer than `near` being one. A
/// ring begins and ends at the same place. Where several ways lead on any of them is taken.
pub fn joined(segments: &[[Spot; 2]], near: f64) -> Vec<Vec<Spot>> {
    let key = |s: Spot| s.map(|c| (c / near).round() as i64);
    let mut ends: BTreeMap<[i64; 2], Vec<usize>> = BTreeMap::new();
    for (n, segment) in segments.iter().enumerate() {
        segment.iter().for_each(|&s| ends.entry(key(s)).or_default().push(n));
    }
    // Open lines first, from their ends; what is left are rings.
    let open = ends.iter().filter(|(_, at)| at.len() == 1).map(|(&k, at)| (at[0], k));
    let rings = (0..segments.len()).map(|n| (n, key(segments[n][0])));
    let mut used = vec![false; segments.len()];
    let mut lines = Vec::new();
    for (first, start) in open.chain(rings) {
        let (mut next, mut from) = (Some(first).filter(|&n| !used[n]), start);
        let mut line = Vec::new();
        while let Some(n) = next {
            used[n] = true;
            let [a, b] = segments[n];
            let [begin, end] = if key(a) == from { [a, b] } else { [b, a] };
            if line.is_empty() {
                line.push(begin);
            }
            line.push(end);
            from = key(end);
            next = ends[&from].iter().copied().find(|&m| !used[m]);
        }
        let Some(&begin) = line.first() else { continue };
        if from == start
            && let Some(end) = line.last_mut()
        {
            *end = begin;
        }
        lines.push(line);
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_in_any_order_make_one_line() {
        let place = |n: usize| [n as f64, (n * n) as f64];
        let segment = |n: usize| {
            if n.is_multiple_of(2) { [place(n), place(n + 1)] } else { [place(n + 1), place(n)] }
        };
        let lines = joined(&[3, 0, 4, 1, 2].map(segment), 1e-4);
        assert_eq!(lines, [(0..6).map(place).collect::<Vec<_>>()]);
        assert_eq!(joined(&[segment(0), segment(7)], 1e-4).len(), 2);
    }

    #[test]
    fn a_ring_ends_where_it_begins() {
        let corner = |n: usize| [[0.0, 0.0], [4.0, 0.0], [2.0, 3.0]][n % 3];
        let nearly = |n: usize| corner(n).map(|c| c + 1e-6);
        let lines =
            joined(&[[corner(0), corner(1)], [nearly(2), nearly(1)], [corner(2), nearly(0)]], 1e-4);
        assert_eq!(lines.len(), 1);
        assert_eq!((lines[0].len(), lines[0][0]), (4, lines[0][3]));
    }
}
