//! STL, as text and binary.

use super::{Parts, coordinate};
use crate::Problem;
use supine_space::Point;

/// Bytes before the triangles: a text and their number.
const HEAD: usize = 84;
/// Bytes of a triangle: normal, three corners, two spare.
const TRIANGLE: usize = 50;

/// Binary is known by its length: its text may begin like that of the other kind. Some programs
/// leave a few bytes behind the last triangle.
pub(super) fn parse(bytes: &[u8]) -> Result<Parts, Problem> {
    let binary = bytes.split_at_checked(HEAD).map(|(head, body)| {
        let count = head.last_chunk().map_or(0, |n| u32::from_le_bytes(*n));
        (count as usize, body)
    });
    let more =
        binary.and_then(|(count, body)| body.len().checked_sub(count.saturating_mul(TRIANGLE)));
    let soup = match binary {
        Some((_, body)) if more == Some(0) => corners(body),
        _ if is_text(bytes) => text(bytes)?,
        Some((_, body)) if more.is_some_and(|more| more < TRIANGLE) => corners(body),
        Some((count, body)) => {
            let wanted = count as u128 * TRIANGLE as u128;
            return Err(match body.len() as u128 {
                found if found < wanted => Problem::Truncated { wanted, found },
                _ => Problem::Excess { wanted: count * TRIANGLE },
            });
        }
        None => return Err(Problem::Format("STL")),
    };
    let triangles = (0..soup.len() / 3).map(|n| [0, 1, 2].map(|c| (3 * n + c) as u32)).collect();
    Ok(Parts { points: soup, triangles, ..Parts::default() })
}

/// Whether it is the kind that is text: by its first word, in small or capital letters, and a
/// corner.
fn is_text(bytes: &[u8]) -> bool {
    let bytes = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes).trim_ascii_start();
    let begins = bytes.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    begins && bytes.windows(6).any(|word| word.eq_ignore_ascii_case(b"vertex"))
}

/// The corners of binary triangles, three by three.
fn corners(body: &[u8]) -> Vec<Point> {
    let number = |b: &[u8; 4]| f64::from(f32::from_le_bytes(*b));
    let triangles = body.as_chunks::<TRIANGLE>().0.iter();
    let numbers = triangles.flat_map(|t| t[12..48].as_chunks().0.iter().map(number));
    numbers.collect::<Vec<f64>>().as_chunks::<3>().0.iter().map(|&xyz| xyz.into()).collect()
}

/// The corners of a text, three by three.
fn text(bytes: &[u8]) -> Result<Vec<Point>, Problem> {
    let text = String::from_utf8_lossy(bytes);
    let mut soup = Vec::new();
    for (at, line) in text.lines().enumerate() {
        let mut words = line.split_ascii_whitespace();
        match words.next().map(str::to_ascii_lowercase).as_deref() {
            Some("vertex") => {
                let mut next = || coordinate(words.next(), at + 1);
                soup.push(Point::new(next()?, next()?, next()?));
            }
            Some("endloop") if soup.len() % 3 != 0 => {
                let reason = "a facet without three vertices".into();
                return Err(Problem::Line { line: at as u64 + 1, reason });
            }
            _ => {}
        }
    }
    if soup.len() % 3 != 0 {
        let count = soup.len() as u128;
        return Err(Problem::Truncated { wanted: count.next_multiple_of(3), found: count });
    }
    Ok(soup)
}
