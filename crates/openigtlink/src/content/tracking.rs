//! TDATA and QTDATA: poses of all tools that are seen at one time; the others are left out.

use crate::content::transform::{self, Rows};
use crate::error::Refusal;
use crate::name::Name;
use crate::reader::{Reader, put_f32s};

/// Bytes of a tool with a matrix.
pub(crate) const BYTES: usize = 70;

/// Bytes of a tool with a quaternion.
pub(crate) const QUATERNION_BYTES: usize = 50;

/// Most tools of one message: each takes two bytes more of memory than on the wire.
pub(crate) const TOOLS: usize = 10_000;

/// What kind of tool is tracked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ToolKind {
    /// 1: the tracker itself.
    Tracker,
    /// 2: a tool with all six degrees of freedom.
    SixD,
    /// 3: the tip only.
    ThreeD,
    /// 4: tip and handle.
    FiveD,
    /// Any other number.
    Other(u8),
}

impl ToolKind {
    /// The number on the wire.
    pub fn number(self) -> u8 {
        match self {
            Self::Tracker => 1,
            Self::SixD => 2,
            Self::ThreeD => 3,
            Self::FiveD => 4,
            Self::Other(number) => number,
        }
    }
}

impl From<u8> for ToolKind {
    fn from(number: u8) -> Self {
        match number {
            1 => Self::Tracker,
            2 => Self::SixD,
            3 => Self::ThreeD,
            4 => Self::FiveD,
            _ => Self::Other(number),
        }
    }
}

/// A tool with its pose as a matrix (TDATA).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tool {
    /// Name, at most 20 characters.
    pub name: Name<20>,
    /// Kind.
    pub kind: ToolKind,
    /// Pose, mm.
    pub pose: Rows,
}

/// A tool with its pose as a quaternion (QTDATA).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuaternionTool {
    /// Name, at most 20 characters.
    pub name: Name<20>,
    /// Kind.
    pub kind: ToolKind,
    /// Place, mm.
    pub position: [f32; 3],
    /// Rotation x, y, z, w, the scalar last.
    pub rotation: [f32; 4],
}

/// Reads a TDATA: for each tool char[20] name, u8 kind, u8 0, f32 x 12 by columns.
pub(crate) fn read(bytes: &[u8]) -> Result<Vec<Tool>, Refusal> {
    let mut reader = Reader::new(bytes, "a TDATA has 70 bytes for each of its tools");
    let mut tools = Vec::with_capacity(number(bytes, BYTES)?);
    while reader.left() > 0 {
        let name = Name::read(reader.array()?);
        let [kind, _] = *reader.array()?;
        let pose = transform::read_rows(&mut reader)?;
        tools.push(Tool { name, kind: kind.into(), pose });
    }
    Ok(tools)
}

/// Reads a QTDATA: for each tool char[20] name, u8 kind, u8 0, f32 x 3 place, f32 x 4 rotation.
pub(crate) fn read_quaternions(bytes: &[u8]) -> Result<Vec<QuaternionTool>, Refusal> {
    let mut reader = Reader::new(bytes, "a QTDATA has 50 bytes for each of its tools");
    let mut tools = Vec::with_capacity(number(bytes, QUATERNION_BYTES)?);
    while reader.left() > 0 {
        let name = Name::read(reader.array()?);
        let [kind, _] = *reader.array()?;
        let (position, rotation) = (reader.f32s()?, reader.f32s()?);
        tools.push(QuaternionTool { name, kind: kind.into(), position, rotation });
    }
    Ok(tools)
}

/// How many tools there are, of so many bytes each.
fn number(bytes: &[u8], each: usize) -> Result<usize, Refusal> {
    let count = bytes.len() / each;
    if count > TOOLS {
        let (count, limit) = (count as u64, TOOLS as u64);
        return Err(Refusal::TooMany { what: "tools", count, limit });
    }
    Ok(count)
}

impl Tool {
    /// Adds it as it goes over the wire.
    pub(crate) fn put(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(self.name.field());
        out.extend_from_slice(&[self.kind.number(), 0]);
        transform::put(out, &self.pose);
    }
}

impl QuaternionTool {
    /// Adds it as it goes over the wire.
    pub(crate) fn put(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(self.name.field());
        out.extend_from_slice(&[self.kind.number(), 0]);
        put_f32s(out, &self.position);
        put_f32s(out, &self.rotation);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_tools_together_stay_within_the_margin_of_memory() {
        let more = (size_of::<Tool>() - BYTES).max(size_of::<QuaternionTool>() - QUATERNION_BYTES);
        assert!(more * TOOLS <= 1 << 15, "{more} bytes more for each");
    }

    #[test]
    fn every_number_of_a_kind_comes_back() {
        assert!((0..=u8::MAX).all(|number| ToolKind::from(number).number() == number));
    }
}
