//! Reading MSH: text only, boundary tags by the names of the physical groups.

use super::TET_ORDER;
use crate::{Problem, elements::Elements};
use std::collections::BTreeMap;
use supine_mesh::{BoundaryTag, Displacement, Order, TetMesh};
use supine_space::{Point, Vector};

/// The mesh at the CT shape and, when there are node data `displacement`, its displacement.
pub(crate) fn parse(bytes: &[u8]) -> Result<(TetMesh, Option<Displacement>), Problem> {
    if !bytes.trim_ascii_start().starts_with(b"$") {
        return Err(Problem::Format("a Gmsh mesh (MSH 4.1)"));
    }
    let text = String::from_utf8_lossy(bytes);
    let mut lines = Lines { lines: text.lines().enumerate(), number: 0 };
    let mut file = File::default();
    let mut known = false;
    while let Some(section) = lines.section() {
        // The text of a binary file ends within its first section.
        if !known && section != "MeshFormat" && section != "Comments" {
            return Err(lines.wrong("`$MeshFormat` must come first"));
        }
        match section {
            "MeshFormat" => {
                let format = lines.next()?;
                known = format.starts_with("4.1 0");
                if !known {
                    let what = format!("version and type `{format}` of a mesh");
                    let advice = "save it as MSH 4.1, ASCII";
                    return Err(Problem::Unsupported { what, advice });
                }
            }
            "PhysicalNames" => file.names(&mut lines)?,
            "Entities" => file.entities(&mut lines)?,
            "Nodes" => file.nodes(&mut lines)?,
            "Elements" => file.elements(&mut lines)?,
            "NodeData" => file.node_data(&mut lines)?,
            _ => {}
        }
        lines.end(section)?;
    }
    if file.elements.tets.is_empty() {
        return Err(Problem::field("Elements", "there are no tetrahedra"));
    }
    file.elements.assemble(&file.positions, file.displacement.as_deref())
}

/// What has been read so far.
#[derive(Default)]
struct File {
    /// Tags of the groups of surfaces that bear the name of one.
    groups: BTreeMap<i64, BoundaryTag>,
    /// Those of the surfaces in such a group.
    surfaces: BTreeMap<i64, BoundaryTag>,
    positions: Vec<Point>,
    /// Place of each node by its number in the file.
    places: BTreeMap<i64, usize>,
    elements: Elements,
    displacement: Option<Vec<Vector>>,
}

impl File {
    fn names(&mut self, lines: &mut Lines<'_>) -> Result<(), Problem> {
        for _ in 0..lines.whole::<1>()?[0] {
            let line = lines.next()?;
            let mut words = line.splitn(3, ' ');
            let [dimension, number] = [words.next(), words.next()].map(|w| w?.parse::<i64>().ok());
            let name = words.next().unwrap_or_default().trim().trim_matches('"');
            let tag = BoundaryTag::ALL.into_iter().find(|tag| tag.name() == name);
            if let (Some(2), Some(number), Some(tag)) = (dimension, number, tag) {
                self.groups.insert(number, tag);
            }
        }
        Ok(())
    }

    fn entities(&mut self, lines: &mut Lines<'_>) -> Result<(), Problem> {
        let [points, curves, surfaces, volumes] = lines.whole()?;
        for _ in 0..points.saturating_add(curves) {
            lines.next()?;
        }
        for _ in 0..surfaces {
            let line = lines.next()?;
            // Number, box, how many groups, groups.
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            let whole = |n: usize| words.get(n).and_then(|w| w.parse::<i64>().ok());
            let (Some(number), Some(count)) = (whole(0), whole(7)) else {
                return Err(lines.wrong("is not a surface"));
            };
            let groups = (0..count.max(0) as usize).map_while(|n| whole(8 + n));
            let tag = groups.filter_map(|group| self.groups.get(&group.abs())).next();
            tag.into_iter().for_each(|&tag| _ = self.surfaces.insert(number, tag));
        }
        for _ in 0..volumes {
            lines.next()?;
        }
        Ok(())
    }

    fn nodes(&mut self, lines: &mut Lines<'_>) -> Result<(), Problem> {
        let [blocks, ..] = lines.whole::<4>()?;
        if !self.positions.is_empty() {
            return Err(lines.wrong("begins a second section of nodes"));
        }
        for _ in 0..blocks {
            let [_, _, _, count] = lines.whole()?;
            let mut numbers = Vec::new();
            for _ in 0..count {
                numbers.push(lines.whole::<1>()?[0]);
            }
            for number in numbers {
                self.places.insert(number, self.positions.len());
                // Coordinates on the surface may follow.
                self.positions.push(lines.vector()?.into());
            }
        }
        Ok(())
    }

    fn elements(&mut self, lines: &mut Lines<'_>) -> Result<(), Problem> {
        let [blocks, ..] = lines.whole::<4>()?;
        if !self.elements.tets.is_empty() {
            return Err(lines.wrong("begins a second section of elements"));
        }
        for _ in 0..blocks {
            let [_, entity, kind, count] = lines.whole()?;
            let size = match kind {
                2 => 3,
                4 => 4,
                9 => 6,
                11 => 10,
                // Points and lines.
                1 | 8 | 15 => 0,
                other => {
                    let what = format!("an element of Gmsh's type {other}");
                    let advice =
                        "the mesh must consist of tetrahedra (4 or 11) and triangles (2 or 9)";
                    return Err(Problem::Unsupported { what, advice });
                }
            };
            for _ in 0..count {
                let line = lines.next()?;
                let of = line.split_ascii_whitespace().skip(1);
                let place = |word: &str| self.places.get(&word.parse().ok()?).copied();
                let nodes: Option<Vec<usize>> = of.take(size).map(place).collect();
                let nodes = nodes.filter(|nodes| nodes.len() == size);
                let nodes = nodes.ok_or_else(|| lines.wrong("names nodes that are not there"))?;
                match size {
                    4 => self.elements.push_tet(Order::Linear, nodes)?,
                    10 => {
                        let nodes = TET_ORDER.map(|n| nodes[n]).to_vec();
                        self.elements.push_tet(Order::Quadratic, nodes)?;
                    }
                    3 | 6 => {
                        let tag = self.surfaces.get(&entity).copied().ok_or_else(|| {
                            let reason = format!(
                                "surface {entity} is in no physical group named skin, chest_wall or cut"
                            );
                            Problem::field("PhysicalNames", reason)
                        })?;
                        self.elements.faces.push(([nodes[0], nodes[1], nodes[2]], tag));
                    }
                    _ => {}
                }
            }
        }
        Ok(())
    }

    fn node_data(&mut self, lines: &mut Lines<'_>) -> Result<(), Problem> {
        let mut name = String::new();
        for _ in 0..lines.whole::<1>()?[0] {
            name = lines.next()?.trim().trim_matches('"').to_owned();
        }
        for _ in 0..lines.whole::<1>()?[0] {
            lines.next()?;
        }
        let mut tags = Vec::new();
        for _ in 0..lines.whole::<1>()?[0] {
            tags.push(lines.whole::<1>()?[0]);
        }
        if name != "displacement" {
            return Ok(());
        }
        if self.displacement.is_some() {
            return Err(lines.wrong("is a second `displacement`: save the file with one time step"));
        }
        if tags.get(1) != Some(&3) {
            return Err(lines.wrong("`displacement` must have three components"));
        }
        let mut vectors = vec![Vector::repeat(f64::NAN); self.positions.len()];
        for _ in 0..tags.get(2).copied().unwrap_or_default() {
            let line = lines.next()?;
            let (node, rest) = line.trim_start().split_once(' ').unwrap_or_default();
            let place = node.parse().ok().and_then(|n: i64| self.places.get(&n));
            let place = *place.ok_or_else(|| lines.wrong("names a node that is not there"))?;
            vectors[place] = vector(rest).ok_or_else(|| lines.wrong("is not a vector"))?;
        }
        self.displacement = Some(vectors);
        Ok(())
    }
}

fn vector(text: &str) -> Option<Vector> {
    let mut words = text.split_ascii_whitespace().map(|w| w.parse().ok());
    Some(Vector::new(words.next()??, words.next()??, words.next()??))
}

/// The lines of a file.
struct Lines<'a> {
    lines: std::iter::Enumerate<std::str::Lines<'a>>,
    /// That of the last one, from 1.
    number: u64,
}

impl<'a> Lines<'a> {
    fn wrong(&self, reason: &str) -> Problem {
        Problem::Line { line: self.number, reason: reason.into() }
    }

    /// The next section's name.
    fn section(&mut self) -> Option<&'a str> {
        let (n, name) = self.lines.find_map(|(n, l)| Some((n, l.trim().strip_prefix('$')?)))?;
        self.number = n as u64 + 1;
        Some(name)
    }

    /// Goes on behind the section's end.
    fn end(&mut self, section: &str) -> Result<(), Problem> {
        let ends = |line: &str| line.trim().strip_prefix("$End") == Some(section);
        match self.lines.find(|(_, line)| ends(line)) {
            Some((n, _)) => {
                self.number = n as u64 + 1;
                Ok(())
            }
            None => Err(Problem::field(section, "has no end")),
        }
    }

    fn next(&mut self) -> Result<&'a str, Problem> {
        let (n, line) = self.lines.next().ok_or_else(|| self.wrong("the file ends here"))?;
        self.number = n as u64 + 1;
        Ok(line)
    }

    /// The whole numbers that a line begins with.
    fn whole<const N: usize>(&mut self) -> Result<[i64; N], Problem> {
        let line = self.next()?;
        let words = line.split_ascii_whitespace().map(|w| w.parse().ok()).take(N);
        let numbers: Option<Vec<i64>> = words.collect();
        let numbers = numbers.and_then(|n| <[i64; N]>::try_from(n).ok());
        numbers.ok_or_else(|| self.wrong(&format!("must hold {N} whole numbers")))
    }

    /// The three numbers that a line begins with.
    fn vector(&mut self) -> Result<Vector, Problem> {
        let line = self.next()?;
        vector(line).ok_or_else(|| self.wrong("must hold three coordinates"))
    }
}
