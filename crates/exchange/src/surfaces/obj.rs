//! Wavefront OBJ: vertices, normals and faces; texture, colours, groups and materials are passed
//! over. A line that ends in a backslash goes on in the next.

use super::{Parts, coordinate, fan};
use crate::Problem;
use std::borrow::Cow;
use supine_space::{Point, Vector};

pub(super) fn parse(bytes: &[u8]) -> Result<Parts, Problem> {
    let text = String::from_utf8_lossy(bytes);
    let (mut parts, mut corners) = (Parts::default(), Vec::new());
    let mut normals = Normals::default();
    let mut lines = text.lines().enumerate();
    while let Some((at, first)) = lines.next() {
        let line = joined(at + 1, first, lines.by_ref().map(|(_, line)| line))?;
        let mut words = line.split_ascii_whitespace();
        let kind = words.next();
        let mut next = || coordinate(words.next(), at + 1);
        match kind {
            Some("v") => parts.points.push(Point::new(next()?, next()?, next()?)),
            Some("vn") => normals.listed.push(Vector::new(next()?, next()?, next()?)),
            Some("f") => {
                corners.clear();
                for word in words.take_while(|word| !word.starts_with('#')) {
                    let count = parts.points.len();
                    let corner = index(word.split('/').next(), count).ok_or_else(|| {
                        let shown: String = word.chars().take(20).collect();
                        let reason = format!("`{shown}` is not one of {count} vertices");
                        Problem::Line { line: at as u64 + 1, reason }
                    })?;
                    corners.push(corner);
                    normals.add(corner, word.split('/').nth(2), count);
                }
                fan(&corners, &mut parts.triangles);
            }
            _ => {}
        }
    }
    parts.normals = normals.of_vertices(parts.points.len());
    Ok(parts)
}

/// A line with those that it goes on in; `number` is its own.
///
/// # Errors
/// When no blank stands at the break: whether it parts two numbers or lies within one, nothing says.
fn joined<'a>(
    number: usize,
    first: &'a str,
    rest: impl Iterator<Item = &'a str>,
) -> Result<Cow<'a, str>, Problem> {
    let goes_on = |line: &'a str| line.trim_end().strip_suffix('\\');
    let Some(begun) = goes_on(first) else { return Ok(first.into()) };
    let mut line = String::from(begun);
    for next in rest {
        let blank = |c: char| c.is_ascii_whitespace();
        if !line.is_empty() && !line.ends_with(blank) && next.starts_with(|c| !blank(c)) {
            let reason = "goes on in the next line without a blank at the break, which may lie within a number";
            return Err(Problem::Line { line: number as u64, reason: reason.into() });
        }
        line.push_str(goes_on(next).unwrap_or(next));
        if goes_on(next).is_none() {
            break;
        }
    }
    Ok(line.into())
}

/// Normals as the file lists them, and what the corners of its faces make of them at the vertices.
#[derive(Default)]
struct Normals {
    listed: Vec<Vector>,
    at_vertices: Vec<Vector>,
}

impl Normals {
    /// Adds the normal that a corner names; one that is not there is missing, for a surface does
    /// without.
    fn add(&mut self, corner: u32, number: Option<&str>, vertices: usize) {
        if let Some(normal) = index(number, self.listed.len()) {
            if self.at_vertices.len() < vertices {
                self.at_vertices.resize(vertices, Vector::zeros());
            }
            self.at_vertices[corner as usize] += self.listed[normal as usize];
        }
    }

    /// One for each vertex, or none at all.
    fn of_vertices(mut self, vertices: usize) -> Vec<Vector> {
        if !self.at_vertices.is_empty() {
            self.at_vertices.resize(vertices, Vector::zeros());
            self.at_vertices
        } else if self.listed.len() == vertices {
            self.listed
        } else {
            vec![]
        }
    }
}

/// The vertex or normal of a corner, which is counted from 1, or backwards from the last one before
/// it.
fn index(number: Option<&str>, count: usize) -> Option<u32> {
    let number: i64 = number?.parse().ok()?;
    // A number below all others leads nowhere.
    let place = if number < 0 { (count as i64).checked_add(number)? } else { number - 1 };
    u32::try_from(place).ok().filter(|&p| (p as usize) < count)
}
