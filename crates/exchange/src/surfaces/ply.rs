//! PLY, as text and binary of either byte order.

use super::{Parts, fan};
use crate::{Problem, scalar::Scalar};
use supine_space::{Point, Vector};

/// What a row of an element holds.
enum Property {
    One(Meaning, Scalar),
    /// The type of its count, then that of its values.
    List(Meaning, Scalar, Scalar),
}

/// What a value is for, by the name of its property.
#[derive(Clone, Copy, PartialEq)]
enum Meaning {
    /// A coordinate, by its axis.
    Place(usize),
    Normal(usize),
    /// Corners of a face.
    Corners,
    /// Colours, quality and the like.
    Other,
}

struct Element {
    name: String,
    rows: u64,
    properties: Vec<Property>,
}

impl Element {
    fn has(&self, meaning: Meaning) -> bool {
        self.properties.iter().any(|p| matches!(p, Property::One(m, _) if *m == meaning))
    }
}

pub(super) fn parse(bytes: &[u8]) -> Result<Parts, Problem> {
    let (elements, mut values) = header(bytes)?;
    let (mut parts, mut corners) = (Parts::default(), Vec::new());
    for element in &elements {
        let (vertex, face) = (element.name == "vertex", element.name == "face");
        let normals = vertex && (0..3).all(|axis| element.has(Meaning::Normal(axis)));
        if element.name == "tristrips" && element.rows > 0 {
            let what = "a PLY of triangle strips".into();
            return Err(Problem::Unsupported { what, advice: "save it with single triangles" });
        }
        // A row without properties takes no bytes: nothing would bound their number.
        let rows = if element.properties.is_empty() { 0 } else { element.rows };
        for _ in 0..rows {
            let (mut position, mut normal) = ([f64::NAN; 3], [0.0; 3]);
            corners.clear();
            for property in &element.properties {
                match *property {
                    Property::One(meaning, kind) => {
                        let value = values.next(kind)?;
                        match meaning {
                            Meaning::Place(axis) => position[axis] = value,
                            Meaning::Normal(axis) => normal[axis] = value,
                            Meaning::Corners | Meaning::Other => {}
                        }
                    }
                    Property::List(meaning, count, kind) => {
                        for _ in 0..values.next(count)?.max(0.0) as u64 {
                            let value = values.next(kind)?;
                            if meaning == Meaning::Corners {
                                corners.push(index(value)?);
                            }
                        }
                    }
                }
            }
            if vertex {
                parts.points.push(Point::from(position));
            }
            if normals {
                parts.normals.push(Vector::from(normal));
            }
            if face {
                fan(&corners, &mut parts.triangles);
            }
        }
    }
    // Two elements of vertices, one of them with normals.
    if parts.normals.len() != parts.points.len() {
        parts.normals.clear();
    }
    Ok(parts)
}

/// What the values of a property are for.
fn meaning(name: &str) -> Meaning {
    match name {
        "x" => Meaning::Place(0),
        "y" => Meaning::Place(1),
        "z" => Meaning::Place(2),
        "nx" => Meaning::Normal(0),
        "ny" => Meaning::Normal(1),
        "nz" => Meaning::Normal(2),
        "vertex_indices" | "vertex_index" => Meaning::Corners,
        _ => Meaning::Other,
    }
}

fn index(value: f64) -> Result<u32, Problem> {
    if value >= 0.0 && value <= f64::from(u32::MAX) && value.fract() == 0.0 {
        Ok(value as u32)
    } else {
        Err(Problem::field("vertex_indices", format!("{value} is not the number of a vertex")))
    }
}

/// The elements in their order, and the values behind the header.
fn header(bytes: &[u8]) -> Result<(Vec<Element>, Values<'_>), Problem> {
    let mut rest = bytes;
    let (mut elements, mut format) = (Vec::<Element>::new(), None);
    let mut number = 0;
    loop {
        number += 1;
        let end = rest.iter().position(|&b| b == b'\n');
        let end = end.ok_or_else(|| Problem::field("end_header", "is missing"))?;
        let line = String::from_utf8_lossy(&rest[..end]).into_owned();
        rest = &rest[end + 1..];
        let wrong = |reason: &str| Problem::Line { line: number, reason: reason.into() };
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match words[..] {
            ["ply"] if number == 1 => {}
            _ if number == 1 => return Err(Problem::Format("PLY")),
            ["format", name, _] => format = Some(name.to_owned()),
            ["element", name, rows] => {
                let rows = rows.parse().map_err(|_| wrong("is not a count"))?;
                elements.push(Element { name: name.into(), rows, properties: vec![] });
            }
            ["property", ref words @ ..] => {
                let kind = |word: &str| scalar(word).ok_or_else(|| wrong("has an unknown type"));
                let property = match words[..] {
                    ["list", count, value, name] => {
                        Property::List(meaning(name), kind(count)?, kind(value)?)
                    }
                    [value, name] => Property::One(meaning(name), kind(value)?),
                    _ => return Err(wrong("is not a property")),
                };
                let element = elements.last_mut().ok_or_else(|| wrong("belongs to no element"))?;
                element.properties.push(property);
            }
            ["end_header"] => break,
            // Comments, object information.
            _ => {}
        }
    }
    let values = match format.as_deref() {
        Some("ascii") => {
            let text =
                std::str::from_utf8(rest).map_err(|_| Problem::field("format", "no text"))?;
            Values::Text(text.split_ascii_whitespace())
        }
        Some("binary_little_endian") => Values::Bytes { rest, big_endian: false },
        Some("binary_big_endian") => Values::Bytes { rest, big_endian: true },
        _ => return Err(Problem::field("format", "is missing or unknown")),
    };
    Ok((elements, values))
}

fn scalar(word: &str) -> Option<Scalar> {
    Some(match word {
        "char" | "int8" => Scalar::I8,
        "uchar" | "uint8" => Scalar::U8,
        "short" | "int16" => Scalar::I16,
        "ushort" | "uint16" => Scalar::U16,
        "int" | "int32" => Scalar::I32,
        "uint" | "uint32" => Scalar::U32,
        "float" | "float32" => Scalar::F32,
        "double" | "float64" => Scalar::F64,
        _ => return None,
    })
}

/// The numbers behind the header.
enum Values<'a> {
    Text(std::str::SplitAsciiWhitespace<'a>),
    Bytes { rest: &'a [u8], big_endian: bool },
}

impl Values<'_> {
    fn next(&mut self, kind: Scalar) -> Result<f64, Problem> {
        match self {
            Self::Text(words) => {
                let word = words.next().ok_or(Problem::Truncated { wanted: 1, found: 0 })?;
                word.parse().map_err(|_| {
                    let shown: String = word.chars().take(20).collect();
                    Problem::field("vertex or face", format!("`{shown}` is not a number"))
                })
            }
            Self::Bytes { rest, big_endian } => {
                let size = kind.size();
                let (bytes, after) = rest.split_at_checked(size).ok_or(Problem::Truncated {
                    wanted: size as u128,
                    found: rest.len() as u128,
                })?;
                *rest = after;
                let mut value = 0.0;
                kind.try_each(bytes, *big_endian, |_, v| {
                    value = v;
                    Ok::<_, Problem>(())
                })?;
                Ok(value)
            }
        }
    }
}
