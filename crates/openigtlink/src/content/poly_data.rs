//! POLYDATA: points, cells that connect them, and values at either.

use crate::error::{LayoutError, Refusal};
use crate::name::readable;
use crate::reader::{Reader, put_f32s, put_u32s};

/// Bytes before the points.
const HEAD: usize = 40;

/// Most attributes of one message. More would cost more memory than they have bytes.
pub(crate) const ATTRIBUTES: usize = 500;

/// A surface, or lines, or points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PolyData {
    /// Places, mm.
    pub points: Vec<[f32; 3]>,
    /// Cells of single points.
    pub vertices: Cells,
    /// Chains of points.
    pub lines: Cells,
    /// Polygons, each a ring of points.
    pub polygons: Cells,
    /// Strips of triangles.
    pub strips: Cells,
    /// Values at points or cells; 500 at most are written.
    pub attributes: Vec<Attribute>,
}

/// Cells, each a list of indices into the points.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cells {
    count: u32,
    /// For each cell the number of its points, then the points: as on the wire.
    words: Vec<u32>,
}

impl Cells {
    /// No cells.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a cell. `false`, and nothing is added, when all cells would take 4 GiB, which the
    /// format cannot say.
    pub fn push(&mut self, cell: &[u32]) -> bool {
        let words = self.words.len() + 1 + cell.len();
        let Ok(number) = u32::try_from(cell.len()) else { return false };
        if words > u32::MAX as usize / 4 {
            return false;
        }
        self.words.push(number);
        self.words.extend_from_slice(cell);
        self.count += 1;
        true
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.count as usize
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The cells, one after the other.
    pub fn iter(&self) -> impl Iterator<Item = &[u32]> {
        let mut left = self.words.as_slice();
        std::iter::from_fn(move || next_cell(&mut left))
    }

    /// Memory of the cells, bytes.
    pub fn allocated(&self) -> usize {
        4 * self.words.capacity()
    }

    /// Reads `count` cells of so many bytes together, whose indices are below `points`.
    fn read(
        reader: &mut Reader<'_>,
        (count, bytes): (u32, u32),
        points: u32,
    ) -> Result<Self, Refusal> {
        let rule =
            "cells of a POLYDATA have u32 n and n u32, as many and as long as its header says";
        let (words, rest) = reader.take(u64::from(bytes))?.as_chunks();
        if !rest.is_empty() {
            return Err(Refusal::Form(rule));
        }
        let words: Vec<u32> = words.iter().map(|bytes| u32::from_be_bytes(*bytes)).collect();
        let mut left = words.as_slice();
        let mut cells = 0;
        while let Some(cell) = next_cell(&mut left) {
            if cell.iter().any(|index| *index >= points) {
                return Err(Refusal::Form("cells of a POLYDATA name only points that it has"));
            }
            cells += 1;
        }
        if !left.is_empty() || cells != count {
            return Err(Refusal::Form(rule));
        }
        Ok(Self { count, words })
    }
}

impl<C: AsRef<[u32]>> FromIterator<C> for Cells {
    fn from_iter<I: IntoIterator<Item = C>>(cells: I) -> Self {
        let mut all = Self::new();
        for cell in cells {
            all.push(cell.as_ref());
        }
        all
    }
}

/// Takes the next cell off; `None`, and nothing is taken, where none is whole.
fn next_cell<'a>(left: &mut &'a [u32]) -> Option<&'a [u32]> {
    let (number, after) = left.split_first()?;
    let (cell, after) = after.split_at_checked(usize::try_from(*number).ok()?)?;
    *left = after;
    Some(cell)
}

/// What has the values of an attribute.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AttributeOf {
    /// The points.
    Points,
    /// The cells: vertices, lines, polygons, strips, in this order.
    Cells,
}

/// What the values of an attribute are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AttributeKind {
    /// 0x00: numbers.
    Scalars,
    /// 0x01: vectors of 3.
    Vectors,
    /// 0x02: unit vectors of 3.
    Normals,
    /// 0x03: tensors of 9.
    Tensors,
    /// 0x04: red, green, blue, opacity.
    Colours,
}

/// The kinds: number n stands at place n.
const ATTRIBUTE_KINDS: [AttributeKind; 5] = [
    AttributeKind::Scalars,
    AttributeKind::Vectors,
    AttributeKind::Normals,
    AttributeKind::Tensors,
    AttributeKind::Colours,
];

/// What is added to the number of a kind for values of cells.
const CELL: u8 = 0x10;

/// Values at points or cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Attribute {
    of: AttributeOf,
    kind: AttributeKind,
    components: u8,
    name: String,
    values: Vec<f32>,
}

impl Attribute {
    /// Values by samples of `components` each. The name ends before its first NUL.
    ///
    /// # Errors
    /// When there are no components, or the values are not whole samples.
    pub fn new(
        of: AttributeOf,
        kind: AttributeKind,
        components: u8,
        name: &str,
        values: Vec<f32>,
    ) -> Result<Self, LayoutError> {
        if components == 0 {
            return Err(LayoutError::NoComponents);
        }
        let whole = values.len().is_multiple_of(usize::from(components));
        if !whole || values.len() > u32::MAX as usize {
            return Err(LayoutError::Values { values: values.len(), components });
        }
        let name = name.split('\0').next().unwrap_or_default().to_owned();
        Ok(Self { of, kind, components, name, values })
    }

    /// What has the values.
    pub fn of(&self) -> AttributeOf {
        self.of
    }

    /// What they are.
    pub fn kind(&self) -> AttributeKind {
        self.kind
    }

    /// Values of a sample.
    pub fn components(&self) -> u8 {
        self.components
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The values, sample by sample.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Number of samples.
    fn samples(&self) -> u32 {
        // Made so that it fits.
        (self.values.len() / usize::from(self.components.max(1))) as u32
    }

    fn number(&self) -> u8 {
        let place = ATTRIBUTE_KINDS.iter().zip(0..).find(|(kind, _)| **kind == self.kind);
        let number = place.map_or(0, |(_, number)| number);
        number + if self.of == AttributeOf::Cells { CELL } else { 0 }
    }

    /// Reads attributes: for each u8 kind, u8 components, u32 samples; then all names, each with a
    /// NUL, and one more NUL if their length is odd; then all values.
    fn read(reader: &mut Reader<'_>, count: u32) -> Result<Vec<Self>, Refusal> {
        let heads = reader.take(6 * u64::from(count))?;
        if count as usize > ATTRIBUTES {
            let (count, limit) = (u64::from(count), ATTRIBUTES as u64);
            return Err(Refusal::TooMany { what: "attributes", count, limit });
        }
        let mut attributes = Vec::with_capacity(count as usize);
        let mut names = 0;
        for head in heads.as_chunks::<6>().0 {
            let (of, kind, components) = Self::read_head(head)?;
            let name = reader.until_nul()?;
            names += name.len() + 1;
            let name = readable(name);
            attributes.push(Self { of, kind, components, name, values: Vec::new() });
        }
        if names % 2 == 1 {
            reader.u8()?;
        }
        for (attribute, head) in attributes.iter_mut().zip(heads.as_chunks::<6>().0) {
            let [_, components, samples @ ..] = *head;
            let samples = u64::from(u32::from_be_bytes(samples));
            let bytes = reader.take(4 * samples * u64::from(components))?;
            attribute.values = f32s(bytes);
        }
        Ok(attributes)
    }

    fn read_head(head: &[u8; 6]) -> Result<(AttributeOf, AttributeKind, u8), Refusal> {
        let [number, components, ..] = *head;
        let of = if number & CELL == 0 { AttributeOf::Points } else { AttributeOf::Cells };
        match ATTRIBUTE_KINDS.get(usize::from(number & !CELL)) {
            Some(kind) if components > 0 => Ok((of, *kind, components)),
            _ => Err(Refusal::Form(
                "an attribute of a POLYDATA is of kind 0x00 to 0x04 or 0x10 to 0x14 and has a component",
            )),
        }
    }
}

/// Whole f32 of some bytes.
fn f32s(bytes: &[u8]) -> Vec<f32> {
    bytes.as_chunks().0.iter().map(|bytes| f32::from_be_bytes(*bytes)).collect()
}

impl PolyData {
    /// About how many bytes it has on the wire.
    pub(crate) fn bytes(&self) -> usize {
        let cells = [&self.vertices, &self.lines, &self.polygons, &self.strips];
        let words: usize = cells.iter().map(|cells| cells.words.len()).sum();
        let attributes = self.attributes.iter().map(|a| 8 + a.name.len() + 4 * a.values.len());
        HEAD + 12 * self.points.len() + 4 * words + attributes.sum::<usize>()
    }

    /// Reads a POLYDATA: u32 points, for vertices, lines, polygons and strips u32 count and u32
    /// bytes, u32 attributes; then f32 x 3 for each point, the cells, the attributes.
    pub(crate) fn read(bytes: &[u8]) -> Result<Self, Refusal> {
        let mut reader = Reader::new(
            bytes,
            "a POLYDATA has 40 bytes of header, then points, cells and attributes as that counts them",
        );
        let points = reader.u32()?;
        let mut group = || Ok((reader.u32()?, reader.u32()?));
        let groups = [group()?, group()?, group()?, group()?];
        let attributes = reader.u32()?;
        let places = reader.take(12 * u64::from(points))?;
        let places = places.as_chunks::<4>().0.as_chunks::<3>().0.iter();
        let places = places.map(|place| place.map(f32::from_be_bytes)).collect();
        let [vertices, lines, polygons, strips] = groups;
        let mut cells = |group| Cells::read(&mut reader, group, points);
        let (vertices, lines) = (cells(vertices)?, cells(lines)?);
        let (polygons, strips) = (cells(polygons)?, cells(strips)?);
        let attributes = Attribute::read(&mut reader, attributes)?;
        reader.end()?;
        Ok(Self { points: places, vertices, lines, polygons, strips, attributes })
    }

    /// Adds it as it goes over the wire.
    pub(crate) fn put(&self, out: &mut Vec<u8>) {
        let points = u32::try_from(self.points.len()).unwrap_or(u32::MAX);
        let cells = [&self.vertices, &self.lines, &self.polygons, &self.strips];
        let attributes = self.attributes.iter().take(ATTRIBUTES);
        put_u32s(out, &[points]);
        for cells in cells {
            // Pushed so that it fits.
            put_u32s(out, &[cells.count, 4 * cells.words.len() as u32]);
        }
        put_u32s(out, &[attributes.len() as u32]);
        for point in self.points.iter().take(points as usize) {
            put_f32s(out, point);
        }
        for cells in cells {
            put_u32s(out, &cells.words);
        }
        for attribute in attributes.clone() {
            out.extend_from_slice(&[attribute.number(), attribute.components]);
            put_u32s(out, &[attribute.samples()]);
        }
        let names = out.len();
        for attribute in attributes.clone() {
            out.extend_from_slice(attribute.name.as_bytes());
            out.push(0);
        }
        if (out.len() - names) % 2 == 1 {
            out.push(0);
        }
        for attribute in attributes {
            put_f32s(out, &attribute.values);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_come_back_one_by_one() {
        let cells: Cells = [&[0, 1, 2][..], &[], &[3]].into_iter().collect();
        assert_eq!((cells.len(), cells.is_empty()), (3, false));
        assert_eq!(cells.iter().collect::<Vec<_>>(), [&[0, 1, 2][..], &[], &[3]]);
    }

    #[test]
    fn a_cell_that_names_a_missing_point_is_refused() {
        let mut data = PolyData { points: vec![[0.0; 3]; 2], ..PolyData::default() };
        data.lines = [[0, 1]].into_iter().collect();
        let mut bytes = Vec::new();
        data.put(&mut bytes);
        assert_eq!(PolyData::read(&bytes), Ok(data.clone()));
        data.lines = [[0, 2]].into_iter().collect();
        bytes.clear();
        data.put(&mut bytes);
        assert!(PolyData::read(&bytes).is_err());
    }

    #[test]
    fn attributes_of_all_kinds_come_back_with_names_of_even_and_odd_length() {
        for names in [["a", "bc"], ["ab", "cd"], ["", ""]] {
            for of in [AttributeOf::Points, AttributeOf::Cells] {
                let attributes = ATTRIBUTE_KINDS.into_iter().zip(names.into_iter().cycle());
                let attributes = attributes.map(|(kind, name)| {
                    Attribute::new(of, kind, 2, name, vec![1.0, 2.0]).expect("whole samples")
                });
                let data = PolyData { attributes: attributes.collect(), ..PolyData::default() };
                let mut bytes = Vec::new();
                data.put(&mut bytes);
                assert_eq!(PolyData::read(&bytes), Ok(data));
            }
        }
    }

    #[test]
    fn an_attribute_has_whole_samples() {
        let of = |components, values| {
            let kind = AttributeKind::Scalars;
            Attribute::new(AttributeOf::Points, kind, components, "a\0b", values)
        };
        assert_eq!(of(0, vec![1.0]), Err(LayoutError::NoComponents));
        assert_eq!(of(2, vec![1.0]), Err(LayoutError::Values { values: 1, components: 2 }));
        assert_eq!(of(1, vec![1.0]).map(|a| a.name), Ok("a".to_owned()));
    }

    #[test]
    fn attributes_that_are_too_many_or_not_there_are_refused() {
        let mut bytes = vec![0; HEAD - 4];
        bytes.extend(u32::MAX.to_be_bytes());
        assert!(matches!(PolyData::read(&bytes), Err(Refusal::Form(_))));
        bytes[HEAD - 4..].copy_from_slice(&501_u32.to_be_bytes());
        bytes.extend([0, 1, 0, 0, 0, 0].repeat(501));
        assert!(matches!(PolyData::read(&bytes), Err(Refusal::TooMany { count: 501, .. })));
    }
}
