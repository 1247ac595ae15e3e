//! The CT as a navigation carries it, in the planes of the page.

use supine_openigtlink::{Endian, Image, ImageFrame, Scalar};
use supine_space::{Grid, Matrix, Point, Vector};
use supine_volume::{Ct, sample_trilinear};

/// The part of the CT that an image holds, LPS.
///
/// # Errors
/// Why it is none, in words.
pub(crate) fn read(image: &Image) -> Result<Ct, String> {
    let layout = image.layout();
    if layout.components != 1 || layout.scalar != Scalar::I16 {
        return Err("the voxels of its image are no HU".into());
    }
    if layout.start != [0; 3] || layout.extent != layout.size {
        return Err("its image is only a part of one".into());
    }
    let lps = |[x, y, z]: [f64; 3]| match layout.frame {
        ImageFrame::Lps => Vector::new(x, y, z),
        ImageFrame::Ras => Vector::new(-x, -y, z),
    };
    let steps = layout.steps.map(|step| lps(step.map(f64::from)));
    let spacing = Vector::from(steps.map(|step| step.norm()));
    let direction = Matrix::from_columns(&steps.map(|step| step.normalize()));
    let origin = Point::from(lps(layout.first_voxel()));
    let grid = Grid::new(layout.size.map(usize::from), spacing, origin, direction)
        .map_err(|error| format!("its image lies nowhere: {error}"))?;
    let value = |bytes: &[u8]| match (layout.endian, bytes) {
        (Endian::Little, &[a, b]) => i16::from_le_bytes([a, b]),
        (Endian::Big, &[a, b]) => i16::from_be_bytes([a, b]),
        _ => 0,
    };
    let data = image.data().chunks_exact(2).map(value).collect();
    Ct::new(grid, data).map_err(|error| error.to_string())
}

/// A part of the CT where voxels of another grid lie in it.
pub(crate) struct Over<'a> {
    part: &'a Ct,
    grid: &'a Grid,
    /// The voxels of the grid between which it lies.
    low: [f64; 3],
    high: [f64; 3],
}

impl<'a> Over<'a> {
    pub(crate) fn new(part: &'a Ct, grid: &'a Grid) -> Self {
        let last = part.grid().size().map(|n| n as f64 - 1.0);
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for corner in 0..8 {
            let index =
                [0, 1, 2].map(|axis| if corner >> axis & 1 == 1 { last[axis] } else { 0.0 });
            let at = grid.index_from_patient(&part.grid().patient_from_index(index));
            for axis in 0..3 {
                low[axis] = low[axis].min(at[axis]);
                high[axis] = high[axis].max(at[axis]);
            }
        }
        Self { part, grid, low, high }
    }

    /// HU at a voxel, if it lies in the part.
    pub(crate) fn at(&self, voxel: [usize; 3]) -> Option<i16> {
        let beyond = |axis: usize| {
            let at = voxel[axis] as f64;
            at < self.low[axis] || at > self.high[axis]
        };
        if (0..3).any(beyond) {
            return None;
        }
        let index = self.part.grid().index_from_patient(&self.grid.centre(voxel));
        let size = self.part.grid().size();
        let within = |axis: usize| (0.0..=size[axis] as f64 - 1.0).contains(&index[axis]);
        // HU are within i16, and so is what lies between them.
        (0..3).all(within).then(|| sample_trilinear(self.part, index).round() as i16)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_openigtlink::ImageLayout;

    /// 4 x 3 x 2 voxels of 2 mm, the value 100 k + 10 j + i.
    fn layout(frame: ImageFrame) -> ImageLayout {
        let sign = if frame == ImageFrame::Ras { -1.0 } else { 1.0 };
        let steps = [[2.0 * sign, 0.0, 0.0], [0.0, 2.0 * sign, 0.0], [0.0, 0.0, 2.0]];
        let size = [4, 3, 2];
        let first = [f64::from(sign) * 10.0, f64::from(sign) * 20.0, 30.0];
        ImageLayout {
            components: 1,
            scalar: Scalar::I16,
            endian: Endian::Little,
            frame,
            size,
            steps,
            centre: ImageLayout::centre_of(first, &steps, size),
            start: [0; 3],
            extent: size,
        }
    }

    fn image(layout: ImageLayout) -> Image {
        let values = (0..24i16).map(|n| 100 * (n / 12) + 10 * (n / 4 % 3) + n % 4);
        let bytes = |hu: i16| match layout.endian {
            Endian::Little => hu.to_le_bytes(),
            Endian::Big => hu.to_be_bytes(),
        };
        Image::new(layout, values.flat_map(bytes).collect()).unwrap()
    }

    #[test]
    fn an_image_lies_where_it_says_in_either_frame() {
        let lps = read(&image(layout(ImageFrame::Lps))).unwrap();
        assert_eq!(lps.grid().centre([0; 3]), Point::new(10.0, 20.0, 30.0));
        assert_eq!(lps.at([3, 2, 1]), 123);
        let ras = read(&image(layout(ImageFrame::Ras))).unwrap();
        assert!(ras.grid().is_same(lps.grid()));
        assert_eq!(ras.data(), lps.data());
        let big = ImageLayout { endian: Endian::Big, ..layout(ImageFrame::Lps) };
        assert_eq!(read(&image(big)).unwrap().data(), lps.data());
    }

    #[test]
    fn what_is_no_part_of_a_ct_is_refused() {
        let good = layout(ImageFrame::Lps);
        let part = ImageLayout { start: [1, 0, 0], extent: [3, 3, 2], ..good };
        let flat = ImageLayout { steps: [[0.0; 3]; 3], ..good };
        let bytes = |layout: &ImageLayout| vec![0; layout.data_bytes() as usize];
        for wrong in [part, flat, ImageLayout { scalar: Scalar::U16, ..good }] {
            let image = Image::new(wrong, bytes(&wrong)).unwrap();
            assert!(read(&image).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn voxels_of_another_grid_get_what_lies_there_and_nothing_beyond() {
        let part = read(&image(layout(ImageFrame::Lps))).unwrap();
        let grid =
            Grid::new([9; 3], Vector::repeat(1.0), Point::new(9.0, 19.0, 29.0), Matrix::identity());
        let grid = grid.unwrap();
        let over = Over::new(&part, &grid);
        assert_eq!(over.at([1, 1, 1]), Some(0));
        // Half way between two voxels: 110.5, rounded away from 0.
        assert_eq!(over.at([2, 3, 3]), Some(111));
        assert_eq!(over.at([7, 5, 3]), Some(123));
        for beyond in [[0, 1, 1], [1, 6, 1], [8, 1, 1], [1, 1, 4]] {
            assert_eq!(over.at(beyond), None, "{beyond:?}");
        }
    }
}
