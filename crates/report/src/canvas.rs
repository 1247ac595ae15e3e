//! Pictures in the making: pixels, and strokes, circles, arrows and letters that tiny-skia draws.
//!
//! Pixel (i, j) has its centre at (i, j); x runs right, y down. tiny-skia is built without SIMD:
//! what it then computes, sums, products and roots in single precision, is the same on every
//! processor. The grey of slices is mixed here, pixel by pixel: it comes from sampled volumes.

use crate::palette::HALO;
pub(crate) use crate::palette::Rgb;
pub(crate) use supine_space::Spot;
use tiny_skia::{
    Color, FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, PixmapMut, Rect, Shader, Stroke,
    StrokeDash, Transform,
};

/// How a stroke looks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pen {
    /// Width, pixels.
    pub(crate) width: f64,
    /// Colour.
    pub(crate) rgb: Rgb,
    /// Opacity, 0..=1.
    pub(crate) alpha: f64,
    /// Length of a dash and of the gap after it, pixels.
    pub(crate) dash: Option<f64>,
}

impl Pen {
    /// An opaque pen.
    pub(crate) fn new(width: f64, rgb: Rgb) -> Self {
        Self { width, rgb, alpha: 1.0, dash: None }
    }

    /// The same pen, see-through.
    pub(crate) fn alpha(self, alpha: f64) -> Self {
        Self { alpha, ..self }
    }

    /// The same pen, in dashes with gaps of the same length, pixels; their round ends reach into
    /// the gaps.
    pub(crate) fn dashed(self, length: f64) -> Self {
        Self { dash: Some(length), ..self }
    }

    /// The dark pen that is drawn below this one so that it shows on any ground.
    fn halo(self) -> Self {
        Self { width: self.width + 2.6, rgb: HALO.0, alpha: HALO.1 * self.alpha, ..self }
    }
}

/// A picture in the making.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Canvas {
    width: usize,
    height: usize,
    /// Red, green, blue and full opacity of each pixel, row by row.
    data: Vec<u8>,
}

/// The nearest whole number of one that is not negative: `round` is a call into a library, for
/// every pixel.
fn nearest(value: f64) -> u8 {
    (value + 0.5) as u8
}

impl Canvas {
    /// A black picture.
    pub(crate) fn new(width: usize, height: usize) -> Self {
        Self { width, height, data: [0, 0, 0, 255].repeat(width * height) }
    }

    /// Pixels across.
    pub(crate) fn width(&self) -> usize {
        self.width
    }

    /// Pixels down.
    pub(crate) fn height(&self) -> usize {
        self.height
    }

    /// The colour of a pixel.
    #[cfg(test)]
    pub(crate) fn at(&self, x: usize, y: usize) -> Rgb {
        let n = 4 * (y * self.width + x);
        [self.data[n], self.data[n + 1], self.data[n + 2]]
    }

    /// Mixes a colour into the pixel at place `n` (row by row) with opacity `alpha`.
    pub(crate) fn mix(&mut self, n: usize, rgb: Rgb, alpha: f64) {
        let pixel = &mut self.data[4 * n..4 * n + 3];
        if alpha >= 1.0 {
            return pixel.copy_from_slice(&rgb);
        }
        for (old, new) in pixel.iter_mut().zip(rgb) {
            let mixed = f64::from(*old) + (f64::from(new) - f64::from(*old)) * alpha;
            *old = nearest(mixed);
        }
    }

    /// Strokes segments as one figure: where they overlap they do not add up, and dashes run on
    /// from one to the next.
    pub(crate) fn stroke(&mut self, segments: &[[Spot; 2]], pen: Pen) {
        self.stroke_path(path(segments).as_ref(), pen);
    }

    /// Strokes segments over a dark halo.
    pub(crate) fn stroke_on_halo(&mut self, segments: &[[Spot; 2]], pen: Pen) {
        self.path_on_halo(path(segments).as_ref(), pen);
    }

    /// A circle; `dashes` of them with gaps of the same length, or a whole line for 0.
    pub(crate) fn circle(&mut self, [x, y]: Spot, radius: f64, dashes: usize, pen: Pen) {
        let length = (dashes > 0).then(|| std::f64::consts::PI * radius / dashes as f64);
        let circle = PathBuilder::from_circle(x as f32, y as f32, radius as f32);
        self.path_on_halo(circle.as_ref(), Pen { dash: length, ..pen });
    }

    /// An ellipse: what two columns make of a circle of radius 1.
    pub(crate) fn ellipse(&mut self, [x, y]: Spot, columns: [Spot; 2], pen: Pen) {
        // Curves approach a circle by what is seen at its size.
        const LARGE: f32 = 1000.0;
        let [[xx, yx], [xy, yy]] = columns.map(|column| column.map(|c| c as f32 / LARGE));
        let to = Transform::from_row(xx, yx, xy, yy, x as f32, y as f32);
        let circle = PathBuilder::from_circle(0.0, 0.0, LARGE);
        self.path_on_halo(circle.and_then(|circle| circle.transform(to)).as_ref(), pen);
    }

    /// An upright cross with arms of `arm` pixels and a free middle.
    pub(crate) fn cross(&mut self, [x, y]: Spot, arm: f64, pen: Pen) {
        let gap = arm / 3.0;
        let segments = [
            [[x - arm, y], [x - gap, y]],
            [[x + gap, y], [x + arm, y]],
            [[x, y - arm], [x, y - gap]],
            [[x, y + gap], [x, y + arm]],
        ];
        self.stroke_on_halo(&segments, pen);
    }

    /// An arrow with a filled head.
    pub(crate) fn arrow(&mut self, from: Spot, to: Spot, pen: Pen) {
        let along = [to[0] - from[0], to[1] - from[1]];
        let length = along[0].hypot(along[1]);
        if length < 1e-9 {
            return;
        }
        let unit = along.map(|c| c / length);
        let head = (2.5 + 2.2 * pen.width).min(length);
        let side = 0.42 * head;
        let base = [to[0] - head * unit[0], to[1] - head * unit[1]];
        let corner = |sign: f64| [base[0] - sign * side * unit[1], base[1] + sign * side * unit[0]];
        let triangle = path(&[[to, corner(1.0)], [corner(1.0), corner(-1.0)], [corner(-1.0), to]]);
        let mut whole = PathBuilder::new();
        let shaft = path(&[[from, base]]);
        [&shaft, &triangle].into_iter().flatten().for_each(|path| whole.push_path(path));
        self.path_on_halo(whole.finish().as_ref(), pen);
        self.fill(triangle.as_ref(), (pen.rgb, pen.alpha));
    }

    /// Fills letters, over a dark halo.
    pub(crate) fn letters(&mut self, outlines: PathBuilder, rgb: Rgb) {
        let outlines = outlines.finish();
        self.stroke_path(outlines.as_ref(), Pen::new(0.0, rgb).halo());
        self.fill(outlines.as_ref(), (rgb, 1.0));
    }

    /// A rectangle from its upper left corner and size, pixels, filled.
    pub(crate) fn rectangle(&mut self, corner: [usize; 2], size: [usize; 2], rgb: Rgb, alpha: f64) {
        let ([x, y], [w, h]) = (corner.map(|c| c as f32), size.map(|c| c as f32));
        // Between centres of pixels; no rectangle is without width or height.
        let path = Rect::from_xywh(x - 0.5, y - 0.5, w, h).map(PathBuilder::from_rect);
        self.fill(path.as_ref(), (rgb, alpha));
    }

    fn path_on_halo(&mut self, path: Option<&Path>, pen: Pen) {
        self.stroke_path(path, pen.halo());
        self.stroke_path(path, pen);
    }

    /// The stroke is filled as an outline of its own: the library's thin lines would add up where
    /// they overlap.
    fn stroke_path(&mut self, path: Option<&Path>, pen: Pen) {
        let dash = pen.dash.and_then(|length| StrokeDash::new(vec![length as f32; 2], 0.0));
        let look = Stroke {
            width: pen.width as f32,
            line_cap: LineCap::Round,
            line_join: LineJoin::Round,
            ..Stroke::default()
        };
        let dashed = dash.and_then(|dash| path?.dash(&dash, 1.0));
        let outline = dashed.as_ref().or(path).and_then(|path| path.stroke(&look, 1.0));
        self.fill(outline.as_ref(), (pen.rgb, pen.alpha));
    }

    fn fill(&mut self, path: Option<&Path>, ([red, green, blue], alpha): (Rgb, f64)) {
        let size = [self.width, self.height].map(|n| n as u32);
        let pixels = PixmapMut::from_bytes(&mut self.data, size[0], size[1]);
        // A path is none that has no extent, a picture that has no pixels.
        let (Some(path), Some(mut pixels)) = (path, pixels) else { return };
        let colour = Color::from_rgba8(red, green, blue, nearest(255.0 * alpha));
        let paint = Paint { shader: Shader::SolidColor(colour), ..Paint::default() };
        let middle = Transform::from_translate(0.5, 0.5);
        pixels.fill_path(path, &paint, FillRule::Winding, middle, None);
    }

    /// The picture as a PNG file.
    ///
    /// # Errors
    /// What the encoder says.
    pub(crate) fn png(&self) -> Result<Vec<u8>, png::EncodingError> {
        let rgb: Vec<u8> = self.data.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        // Measured on the pictures of a report: 2 % larger than what the encoder takes for
        // balanced, in a third of the time.
        encoder.set_deflate_compression(png::DeflateCompression::Level(4));
        encoder.set_filter(png::Filter::Up);
        encoder.write_header()?.write_image_data(&rgb)?;
        Ok(bytes)
    }
}

/// The path of segments, joined where they meet.
fn path(segments: &[[Spot; 2]]) -> Option<Path> {
    /// Ends this near are one, pixels.
    const NEAR: f64 = 1.0 / 256.0;
    let mut path = PathBuilder::new();
    for line in supine_volume::joined(segments, NEAR) {
        for (n, [x, y]) in line.iter().map(|spot| spot.map(|c| c as f32)).enumerate() {
            if n == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
        }
        if line.first() == line.last() {
            path.close();
        }
    }
    path.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn light(canvas: &Canvas) -> f64 {
        canvas.data.chunks(4).map(|p| f64::from(p[0])).sum::<f64>() / 255.0
    }

    #[test]
    fn a_stroke_covers_its_area() {
        let mut canvas = Canvas::new(60, 40);
        canvas.stroke(&[[[10.0, 10.0], [50.0, 25.0]]], Pen::new(3.0, [255; 3]));
        let length = 40f64.hypot(15.0);
        let want = 3.0 * length + std::f64::consts::PI * 2.25;
        assert!((light(&canvas) / want - 1.0).abs() < 0.03, "{} {want}", light(&canvas));
        assert_eq!(canvas.at(30, 18), [255; 3]);
        assert_eq!(canvas.at(30, 30), [0; 3]);
    }

    #[test]
    fn a_ring_and_a_line_are_half_drawn_whatever_the_order_of_their_segments() {
        let at = |n: usize| {
            let a = n as f64 / 100.0 * std::f64::consts::TAU;
            [150.0 + 80.0 * a.cos(), 150.0 + 80.0 * a.sin()]
        };
        let mut segments: Vec<[Spot; 2]> =
            (0..100).map(|n| (n * 37) % 100).map(|n| [at(n), at(n + 1)]).collect();
        segments.extend((0..60).map(|n| (n * 23) % 60).map(|n| {
            let x = n as f64 * 4.0;
            if n % 2 == 0 { [[x, 5.0], [x + 4.0, 5.0]] } else { [[x + 4.0, 5.0], [x, 5.0]] }
        }));
        let drawn = |pen: Pen| {
            let mut canvas = Canvas::new(300, 300);
            canvas.stroke(&segments, pen);
            light(&canvas)
        };
        let pen = Pen::new(2.0, [255; 3]);
        let share = drawn(pen.dashed(8.0)) / drawn(pen);
        // With their round ends dashes of 8 pixels are 10 long.
        assert!((0.57..0.67).contains(&share), "{share}");
    }

    #[test]
    fn what_overlaps_does_not_add_up() {
        let mut canvas = Canvas::new(30, 30);
        let lines = [[[5.0, 15.0], [25.0, 15.0]], [[15.0, 5.0], [15.0, 25.0]]];
        canvas.stroke(&lines, Pen::new(1.0, [255; 3]).alpha(0.5));
        assert_eq!(canvas.at(15, 15), canvas.at(10, 15));
    }

    #[test]
    fn what_lies_off_the_canvas_is_left_out() {
        let mut canvas = Canvas::new(8, 8);
        canvas.stroke(&[[[-50.0, -50.0], [-20.0, -9.0]]], Pen::new(2.0, [255; 3]));
        canvas.arrow([100.0, 4.0], [120.0, 4.0], Pen::new(2.0, [255; 3]));
        canvas.circle([4.0, 400.0], 20.0, 0, Pen::new(2.0, [255; 3]));
        assert_eq!(canvas, Canvas::new(8, 8));
        canvas.stroke(&[[[-50.0, 4.0], [50.0, 4.0]]], Pen::new(1.0, [255; 3]));
        assert_eq!((canvas.at(0, 4), canvas.at(7, 4)), ([255; 3], [255; 3]));
    }

    #[test]
    fn an_arrow_has_its_head_at_its_end() {
        let mut canvas = Canvas::new(60, 40);
        canvas.arrow([10.0, 20.0], [50.0, 20.0], Pen::new(2.0, [255; 3]));
        let column = |x: usize| (0..40).filter(|&y| canvas.at(x, y)[0] > 128).count();
        assert!(column(45) > column(15) + 1, "{} {}", column(45), column(15));
        assert_eq!(column(54), 0);
    }

    #[test]
    fn a_png_reads_back() {
        let mut canvas = Canvas::new(5, 3);
        canvas.mix(7, [10, 20, 30], 1.0);
        let bytes = canvas.png().unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut data = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut data).unwrap();
        assert_eq!(data[21..24], [10, 20, 30]);
        assert_eq!(data.len(), 45);
    }
}
