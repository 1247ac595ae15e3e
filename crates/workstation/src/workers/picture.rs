//! A small picture of a series: its middle axial plane.

use crate::Error;
use crate::workers::open::of_series;
use crate::workspace::Workspace;
use supine_flow::{Request, Session};
use supine_space::{Grid, Point, Vector, View};
use supine_volume::Ct;

/// Its longer side, pixels.
const SIDE: usize = 160;
/// Black and white, HU.
const WINDOW_HU: [f64; 2] = [-200.0, 250.0];

/// A picture of a series that was found, as PNG.
///
/// # Errors
/// When there is no such series, or it cannot be read.
pub(crate) fn picture(workspace: &Workspace, id: &str) -> Result<Vec<u8>, Error> {
    let (dir, uid) = workspace.look(|store| store.folder.series(id).cloned())?;
    let ct = Session::new(of_series(&dir, &uid)?, 1)?.ct(&Request::default())?;
    png(&middle(&ct)).map_err(|e| Error::Request(e.to_string()))
}

/// A picture in grey.
struct Grey {
    width: usize,
    height: usize,
    data: Vec<u8>,
}

/// The axial plane through the middle, square pixels.
fn middle(ct: &Ct) -> Grey {
    let grid = ct.grid();
    let (low, high) = bounds(grid);
    let view = View::Axial;
    let (right, down) = (view.right(), view.down());
    let extent = [(high - low).dot(&right.abs()), (high - low).dot(&down.abs())];
    let pixel_mm = extent[0].max(extent[1]) / SIDE as f64;
    let [width, height] = extent.map(|mm| ((mm / pixel_mm).round() as usize).max(1));
    let middle = low + (high - low) / 2.0;
    let at = |n: usize| {
        let across = ((n % width) as f64 + 0.5) * pixel_mm - extent[0] / 2.0;
        let along = ((n / width) as f64 + 0.5) * pixel_mm - extent[1] / 2.0;
        let voxel = grid.voxel_at(&(middle + right * across + down * along));
        let hu = voxel.map_or(-1024.0, |voxel| f64::from(ct.at(voxel)));
        let [black, white] = WINDOW_HU;
        (255.0 * ((hu - black) / (white - black)).clamp(0.0, 1.0)).round() as u8
    };
    Grey { width, height, data: (0..width * height).map(at).collect() }
}

/// The box that holds a grid's voxels, LPS, mm.
fn bounds(grid: &Grid) -> (Point, Point) {
    let last = grid.size().map(|n| n as f64 - 0.5);
    let corner = |n: usize| {
        let at = [0, 1, 2].map(|a| if n >> a & 1 == 1 { last[a] } else { -0.5 });
        grid.patient_from_index(at).coords
    };
    let fold = |pick: fn(&Vector, &Vector) -> Vector| {
        (1..8).fold(corner(0), |all, n| pick(&all, &corner(n))).into()
    };
    (fold(Vector::inf), fold(Vector::sup))
}

fn png(grey: &Grey) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, grey.width as u32, grey.height as u32);
    encoder.set_color(png::ColorType::Grayscale);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&grey.data)?;
    writer.finish()?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::Matrix;

    #[test]
    fn the_front_is_up_and_the_patients_left_at_the_right() {
        // Feet first: the grid's axes run against x and z.
        let axes = Matrix::from_diagonal(&Vector::new(-1.0, 1.0, -1.0));
        let size = [40, 20, 11];
        let grid = Grid::new(size, Vector::repeat(4.0), Point::origin(), axes).unwrap();
        let bright = |v: [usize; 3]| if v[0] < 10 && v[1] < 5 { 400 } else { -1000 };
        let grey = middle(&Ct::from_fn(grid, bright));
        assert_eq!((grey.width, grey.height), (160, 80));
        let at = |x: usize, y: usize| grey.data[y * grey.width + x];
        assert_eq!([at(150, 5), at(10, 5), at(150, 70), at(10, 70)], [255, 0, 0, 0]);
        assert!(png(&grey).unwrap().starts_with(b"\x89PNG"));
    }
}
