//! The XML of a VTU file: which arrays there are and where their data lie.

use super::array::{Array, Encoding, Storage};
use crate::{Problem, scalar::Scalar};
use quick_xml::{
    Reader, XmlVersion,
    events::{BytesStart, Event},
};

/// The part of a file an array belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Section {
    Points,
    Cells,
    PointData,
    CellData,
    /// Field data and whatever else.
    Other,
}

/// The arrays of one piece.
#[derive(Debug)]
pub(super) struct Document<'a> {
    pub(super) points: usize,
    pub(super) cells: usize,
    arrays: Vec<(Section, Array)>,
    encoding: Encoding,
    appended: Storage<'a>,
}

impl<'a> Document<'a> {
    /// Reads the XML; appended data stay where they are.
    pub(super) fn parse(bytes: &'a [u8]) -> Result<Self, Problem> {
        let (xml, appended) = split_appended(bytes)?;
        let mut walk = Walk::default();
        let mut reader = Reader::from_reader(xml);
        loop {
            let event = reader
                .read_event()
                .map_err(|e| Problem::Xml { at: reader.error_position(), reason: e.to_string() })?;
            match event {
                Event::Start(e) => walk.open(&e, false)?,
                Event::Empty(e) => walk.open(&e, true)?,
                Event::Text(e) => {
                    if let Some(array) = walk.current() {
                        let text = e.decode().map_err(|e| Problem::field("text", e.to_string()))?;
                        array.text.push_str(&text);
                    }
                }
                Event::End(e) => walk.close(e.local_name().as_ref()),
                Event::Eof => break,
                _ => {}
            }
        }
        walk.finish(appended)
    }

    /// The named array of a section; points have one array of any name.
    pub(super) fn find(&self, section: Section, name: &str) -> Option<&Array> {
        let fits = |a: &Array| section == Section::Points || a.name == name;
        self.arrays.iter().find(|(s, a)| *s == section && fits(a)).map(|(_, a)| a)
    }

    /// As [`Self::find`], or the error that says what is missing.
    pub(super) fn required(&self, section: Section, name: &str) -> Result<&Array, Problem> {
        self.find(section, name).ok_or_else(|| {
            let present: Vec<&str> = self
                .arrays
                .iter()
                .filter(|(s, _)| *s == section)
                .map(|(_, a)| a.name.as_str())
                .collect();
            let contents = match present.as_slice() {
                [] => "no arrays".into(),
                names => format!("only `{}`", names.join("`, `")),
            };
            Problem::field(name, format!("is missing: {section:?} holds {contents}"))
        })
    }

    /// The values of an array, of which there must be so many.
    pub(super) fn floats(&self, array: &Array, count: usize) -> Result<Vec<f64>, Problem> {
        let values = array.floats(self.encoding, self.appended)?;
        counted(array, values, count)
    }

    /// The whole numbers of an array.
    pub(super) fn integers(&self, array: &Array) -> Result<Vec<i64>, Problem> {
        array.integers(self.encoding, self.appended)
    }

    /// The whole numbers of an array, of which there must be so many.
    pub(super) fn counted_integers(
        &self,
        array: &Array,
        count: usize,
    ) -> Result<Vec<i64>, Problem> {
        counted(array, self.integers(array)?, count)
    }
}

fn counted<T>(array: &Array, values: Vec<T>, count: usize) -> Result<Vec<T>, Problem> {
    if values.len() == count {
        return Ok(values);
    }
    let reason = format!("holds {} values instead of {count}", values.len());
    Err(Problem::field(array.name.clone(), reason))
}

/// What has been seen so far.
#[derive(Default)]
struct Walk {
    root: Option<Encoding>,
    size: Option<(usize, usize)>,
    section: Option<Section>,
    /// Elements that are open from the data array inwards (VTK notes ranges within arrays); 0
    /// outside of data arrays.
    depth: usize,
    arrays: Vec<(Section, Array)>,
}

impl Walk {
    /// The array whose own text comes next.
    fn current(&mut self) -> Option<&mut Array> {
        self.arrays.last_mut().filter(|_| self.depth == 1).map(|(_, array)| array)
    }

    fn open(&mut self, e: &BytesStart<'_>, empty: bool) -> Result<(), Problem> {
        if self.depth > 0 {
            self.depth += usize::from(!empty);
            return Ok(());
        }
        let section = match e.local_name().as_ref() {
            b"VTKFile" => {
                let kind = attribute(e, "type")?.unwrap_or_default();
                if kind != "UnstructuredGrid" {
                    let what = format!("a VTK file of type `{kind}`");
                    let advice = "save the mesh as an unstructured grid (.vtu)";
                    return Err(Problem::Unsupported { what, advice });
                }
                self.root = Some(encoding(e)?);
                return Ok(());
            }
            b"Piece" => {
                if self.size.is_some() {
                    let what = "a grid of several pieces".into();
                    return Err(Problem::Unsupported { what, advice: "merge the pieces into one" });
                }
                self.size = Some((count(e, "NumberOfPoints")?, count(e, "NumberOfCells")?));
                return Ok(());
            }
            b"DataArray" => {
                self.arrays.push((self.section.unwrap_or(Section::Other), array(e)?));
                self.depth = usize::from(!empty);
                return Ok(());
            }
            b"Points" => Section::Points,
            b"Cells" => Section::Cells,
            b"PointData" => Section::PointData,
            b"CellData" => Section::CellData,
            b"FieldData" => Section::Other,
            _ => return Ok(()),
        };
        self.section = (!empty).then_some(section);
        Ok(())
    }

    fn close(&mut self, name: &[u8]) {
        if self.depth > 0 {
            self.depth -= 1;
            return;
        }
        match name {
            b"Points" | b"Cells" | b"PointData" | b"CellData" | b"FieldData" => self.section = None,
            _ => {}
        }
    }

    fn finish(self, appended: Storage<'_>) -> Result<Document<'_>, Problem> {
        let expected = "a VTK XML unstructured grid (.vtu)";
        let encoding = self.root.ok_or(Problem::Format(expected))?;
        let (points, cells) =
            self.size.ok_or_else(|| Problem::field("Piece", "is missing: there is no mesh"))?;
        Ok(Document { points, cells, arrays: self.arrays, encoding, appended })
    }
}

fn attribute(e: &BytesStart<'_>, name: &str) -> Result<Option<String>, Problem> {
    let wrong = |e: String| Problem::field(name, e);
    match e.try_get_attribute(name).map_err(|e| wrong(e.to_string()))? {
        None => Ok(None),
        Some(a) => {
            let value = a.normalized_value(XmlVersion::Implicit1_0);
            Ok(Some(value.map_err(|e| wrong(e.to_string()))?.into_owned()))
        }
    }
}

fn count(e: &BytesStart<'_>, name: &str) -> Result<usize, Problem> {
    let text = attribute(e, name)?.unwrap_or_default();
    text.trim().parse().map_err(|_| Problem::field(name, format!("`{text}` is not a count")))
}

fn encoding(e: &BytesStart<'_>) -> Result<Encoding, Problem> {
    let big_endian = match attribute(e, "byte_order")?.as_deref() {
        None | Some("LittleEndian") => false,
        Some("BigEndian") => true,
        Some(other) => return Err(Problem::field("byte_order", format!("`{other}` is unknown"))),
    };
    let word = match attribute(e, "header_type")?.as_deref() {
        None | Some("UInt32") => 4,
        Some("UInt64") => 8,
        Some(other) => return Err(Problem::field("header_type", format!("`{other}` is unknown"))),
    };
    let compressed = match attribute(e, "compressor")?.as_deref() {
        None | Some("") => false,
        Some("vtkZLibDataCompressor") => true,
        Some(other) => {
            let advice = "save the file with zlib compression or none";
            return Err(Problem::Unsupported {
                what: format!("the compression `{other}`"),
                advice,
            });
        }
    };
    Ok(Encoding { big_endian, word, compressed })
}

fn array(e: &BytesStart<'_>) -> Result<Array, Problem> {
    let name = attribute(e, "Name")?.unwrap_or_else(|| "Points".into());
    let scalar = match attribute(e, "type")?.as_deref() {
        Some("Int8") => Some(Scalar::I8),
        Some("UInt8") => Some(Scalar::U8),
        Some("Int16") => Some(Scalar::I16),
        Some("UInt16") => Some(Scalar::U16),
        Some("Int32") => Some(Scalar::I32),
        Some("UInt32") => Some(Scalar::U32),
        Some("Int64") => Some(Scalar::I64),
        Some("UInt64") => Some(Scalar::U64),
        Some("Float32") => Some(Scalar::F32),
        Some("Float64") => Some(Scalar::F64),
        // Strings and bits never carry the mesh.
        _ => None,
    };
    let components = match attribute(e, "NumberOfComponents")? {
        None => 1,
        Some(text) => text.trim().parse().map_err(|_| {
            Problem::field("NumberOfComponents", format!("`{text}` is not a count"))
        })?,
    };
    let format = attribute(e, "format")?.unwrap_or_else(|| "ascii".into());
    let offset = match attribute(e, "offset")? {
        Some(text) => text
            .trim()
            .parse()
            .map_err(|_| Problem::field("offset", format!("`{text}` is not a place")))?,
        None => 0,
    };
    Ok(Array { name, scalar, components, format, offset, text: String::new() })
}

/// The XML up to the appended data, and these data behind their underscore.
fn split_appended(bytes: &[u8]) -> Result<(&[u8], Storage<'_>), Problem> {
    let tag = b"<AppendedData";
    let Some(start) = bytes.windows(tag.len()).position(|w| w == tag) else {
        return Ok((bytes, Storage::None));
    };
    let wrong = || Problem::field("AppendedData", "is damaged");
    let body = start + bytes[start..].iter().position(|&b| b == b'>').ok_or_else(wrong)?;
    let head = String::from_utf8_lossy(&bytes[start..body]);
    let mark = body + bytes[body..].iter().position(|&b| b == b'_').ok_or_else(wrong)?;
    let data = &bytes[mark + 1..];
    if head.contains("base64") {
        Ok((&bytes[..start], Storage::Base64(data)))
    } else if head.contains("raw") {
        Ok((&bytes[..start], Storage::Raw(data)))
    } else {
        Err(Problem::field("AppendedData", "its encoding is neither raw nor base64"))
    }
}
