//! Where the frames of a segmentation lie on the voxels of the CT.

use crate::data_set::DataSet;
use crate::number::parse_ds_list;
use dicom_core::Tag;
use dicom_dictionary_std::tags;
use supine_space::{Grid, Point, Vector};

/// Farthest that the centre of a pixel may lie from that of its voxel, mm.
const SAME_VOXEL_MM: f64 = 0.01;

/// Rows and columns of every frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    pub(super) rows: usize,
    pub(super) columns: usize,
}

/// A frame on the grid: voxel of its first pixel, and the steps in memory to the next pixel of a
/// row and to the next row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    /// Number of the segment it shows; `None` when its values are the numbers.
    pub(super) segment: Option<u16>,
    start: isize,
    across: isize,
    down: isize,
}

impl Frame {
    /// The voxel of a pixel, counted in memory.
    pub(super) fn voxel(&self, row: usize, column: usize) -> usize {
        (self.start + row as isize * self.down + column as isize * self.across) as usize
    }

    /// Places a frame: its pixels must coincide with voxels of the grid, in any order of the axes.
    pub(super) fn place(
        grid: &Grid,
        shape: Shape,
        segment: Option<u16>,
        own: &DataSet,
        shared: &DataSet,
    ) -> Result<Self, String> {
        let measures = Group { own, shared, sequence: tags::PIXEL_MEASURES_SEQUENCE };
        let position = Group { own, shared, sequence: tags::PLANE_POSITION_SEQUENCE };
        let orientation = Group { own, shared, sequence: tags::PLANE_ORIENTATION_SEQUENCE };
        let [down_mm, across_mm] = measures.numbers(tags::PIXEL_SPACING, "Pixel Spacing")?;
        let origin: [f64; 3] =
            position.numbers(tags::IMAGE_POSITION_PATIENT, "Image Position (Patient)")?;
        let [a, b, c, d, e, f] =
            orientation.numbers(tags::IMAGE_ORIENTATION_PATIENT, "Image Orientation (Patient)")?;
        let last = [shape.columns - 1, shape.rows - 1];
        let to_column = Vector::new(a, b, c) * (across_mm * last[0] as f64);
        let to_row = Vector::new(d, e, f) * (down_mm * last[1] as f64);
        let first = voxel(grid, Point::from(origin))?;
        let right = voxel(grid, Point::from(origin) + to_column)?;
        let bottom = voxel(grid, Point::from(origin) + to_row)?;
        // The fourth corner must be within the grid too.
        voxel(grid, Point::from(origin) + to_column + to_row)?;
        let (axis_across, across) = step(grid, first, right, last[0])?;
        let (axis_down, down) = step(grid, first, bottom, last[1])?;
        if axis_across.is_some() && axis_across == axis_down {
            return Err("has rows and columns along one line".into());
        }
        Ok(Self { segment, start: grid.offset(first) as isize, across, down })
    }
}

/// The voxel whose centre is a position.
fn voxel(grid: &Grid, position: Point) -> Result<[usize; 3], String> {
    let at = format!("({:.2}, {:.2}, {:.2}) mm", position.x, position.y, position.z);
    let Some(voxel) = grid.voxel_at(&position) else {
        return Err(format!("reaches beyond the CT, to {at}"));
    };
    let off = (grid.centre(voxel) - position).norm();
    if off > SAME_VOXEL_MM {
        return Err(format!(
            "does not lie on the voxels of the CT: its corner {at} is {off:.2} mm off"
        ));
    }
    Ok(voxel)
}

/// Axis and step in memory of one pixel, from the two ends of `pixels` steps.
fn step(
    grid: &Grid,
    from: [usize; 3],
    to: [usize; 3],
    pixels: usize,
) -> Result<(Option<usize>, isize), String> {
    let moved = [0, 1, 2].map(|a| to[a] as isize - from[a] as isize);
    let [ni, nj, _] = grid.size();
    let stride = [1, ni as isize, (ni * nj) as isize];
    if pixels == 0 {
        return Ok((None, 0));
    }
    let along = (0..3)
        .find(|&a| moved[a].unsigned_abs() == pixels && (0..3).all(|b| b == a || moved[b] == 0));
    match along {
        Some(a) => Ok((Some(a), moved[a].signum() * stride[a])),
        None => Err(format!(
            "has other spacing or axes than the CT: {pixels} pixels span {moved:?} voxels"
        )),
    }
}

/// A functional group: of the frame itself or of all frames (PS3.3 C.7.6.16).
struct Group<'a> {
    own: &'a DataSet,
    shared: &'a DataSet,
    sequence: Tag,
}

impl Group<'_> {
    fn numbers<const N: usize>(&self, tag: Tag, name: &str) -> Result<[f64; N], String> {
        let texts = group(self.own, self.shared, self.sequence).map(|g| g.texts(tag));
        let texts = texts.unwrap_or_default();
        parse_ds_list(&texts)
            .ok_or_else(|| format!("has the {name} {:?}, not {N} numbers", texts.join("\\")))
    }
}

/// The item of a functional group, of the frame itself or of all frames.
pub(super) fn group<'a>(
    own: &'a DataSet,
    shared: &'a DataSet,
    sequence: Tag,
) -> Option<&'a DataSet> {
    own.items(sequence).first().or_else(|| shared.items(sequence).first())
}
