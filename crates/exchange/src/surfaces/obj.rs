//! Wavefront OBJ: vertices and faces; texture, normals, groups and materials are passed over.

use super::{Parts, coordinate, fan};
use crate::Problem;
use supine_space::Point;

pub(super) fn parse(bytes: &[u8]) -> Result<Parts, Problem> {
    let text = String::from_utf8_lossy(bytes);
    let (mut points, mut triangles, mut corners) = (Vec::new(), Vec::new(), Vec::new());
    for (at, line) in text.lines().enumerate() {
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => {
                let mut next = || coordinate(words.next(), at + 1);
                points.push(Point::new(next()?, next()?, next()?));
            }
            Some("f") => {
                corners.clear();
                for word in words.take_while(|word| !word.starts_with('#')) {
                    corners.push(index(word, points.len()).ok_or_else(|| {
                        let shown: String = word.chars().take(20).collect();
                        let reason = format!("`{shown}` is not one of {} vertices", points.len());
                        Problem::Line { line: at as u64 + 1, reason }
                    })?);
                }
                fan(&corners, &mut triangles);
            }
            _ => {}
        }
    }
    Ok((points, triangles))
}

/// The vertex of a corner, which is counted from 1, or backwards from the last one before it.
fn index(word: &str, vertices: usize) -> Option<u32> {
    let number: i64 = word.split('/').next()?.parse().ok()?;
    let place = if number < 0 { vertices as i64 + number } else { number - 1 };
    u32::try_from(place).ok().filter(|&p| (p as usize) < vertices)
}
