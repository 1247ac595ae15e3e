//! Surfaces of triangles as a body: seen along a direction, the nearest on top, lit, with their
//! edges.
//!
//! Our own: tiny-skia knows no depth, and rasterisers that do want a processor for graphics, whose
//! bytes differ from one to the next, or a window.

use crate::canvas::{Canvas, Rgb, Spot};
use crate::palette;
use supine_space::{Point, Vector};

/// Samples along each side of a pixel.
const FINE: usize = 2;
/// Width of the edges of the triangles, pixels.
const EDGE: f64 = 0.9;
/// What an edge leaves of a triangle's light.
const EDGE_LIGHT: f64 = 0.45;
/// Light on what is turned away from the lamp, and on what faces it.
const LIGHT: [f64; 2] = [0.45, 1.0];

/// From where a body is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    /// From the front: patient's left at the right of the picture, head up.
    Front,
    /// From the back: patient's left at the left of the picture, head up.
    Back,
    /// From the patient's left: front at the left of the picture, head up.
    Left,
    /// From the patient's right: front at the right of the picture, head up.
    Right,
}

impl Side {
    /// Direction of growing x of the picture, LPS; y grows to the feet.
    fn right(self) -> Vector {
        match self {
            Self::Front => Vector::x(),
            Self::Back => -Vector::x(),
            Self::Left => Vector::y(),
            Self::Right => -Vector::y(),
        }
    }

    /// Direction towards who looks.
    fn towards(self) -> Vector {
        self.right().cross(&Vector::z())
    }

    /// Name, as in files and captions.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Front => "front",
            Self::Back => "back",
            Self::Left => "left",
            Self::Right => "right",
        }
    }

    /// Letters at the left, right, upper and lower edge.
    pub(crate) fn letters(self) -> [&'static str; 4] {
        match self {
            Self::Front => ["R", "L", "H", "F"],
            Self::Back => ["L", "R", "H", "F"],
            Self::Left => ["A", "P", "H", "F"],
            Self::Right => ["P", "A", "H", "F"],
        }
    }
}

/// Where a body is seen from, and how large.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Camera {
    pub(crate) side: Side,
    /// What lies in the middle of the picture, LPS, mm.
    pub(crate) centre: Point,
    /// Side of a pixel, mm.
    pub(crate) pixel_mm: f64,
    /// Pixels along each side of the picture.
    pub(crate) size: usize,
}

/// What is seen in each sample of a picture, the nearest on top.
struct Samples {
    /// Distance towards who looks, mm.
    near: Vec<f64>,
    /// Colour in the light; not a number where nothing is.
    shown: Vec<[f64; 3]>,
}

impl Samples {
    fn new(camera: &Camera) -> Self {
        let count = (FINE * camera.size).pow(2);
        Self { near: vec![f64::NEG_INFINITY; count], shown: vec![[f64::NAN; 3]; count] }
    }

    fn put(&mut self, n: usize, depth: f64, rgb: Rgb, light: f64) {
        if depth > self.near[n] {
            self.near[n] = depth;
            self.shown[n] = rgb.map(|c| f64::from(c) * light);
        }
    }
}

/// Light on a surface by the cosine between its normal and the lamp.
fn light(cosine: f64) -> f64 {
    LIGHT[0] + (LIGHT[1] - LIGHT[0]) * (0.5 + 0.5 * cosine)
}

impl Camera {
    /// The spot of a position (LPS, mm) in samples, and its distance towards who looks, mm.
    fn seen(&self, p: &Point) -> (Spot, f64) {
        let away = p - self.centre;
        let scale = FINE as f64 / self.pixel_mm;
        let middle = (FINE * self.size) as f64 / 2.0;
        let x = middle + self.side.right().dot(&away) * scale;
        ([x, middle - away.z * scale], self.side.towards().dot(&away))
    }

    /// A picture of triangles (corners anticlockwise as seen from outside; LPS, mm) with their
    /// colours.
    pub(crate) fn picture(&self, faces: impl Iterator<Item = ([Point; 3], Rgb)>) -> Canvas {
        let (mut samples, lamp) = (Samples::new(self), self.lamp());
        for (corners, rgb) in faces {
            let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0])).normalize();
            // The lamp's side of a face that is seen from behind is its back.
            let facing = normal.dot(&self.side.towards()).signum();
            let light = light(facing * normal.dot(&lamp));
            for (n, depth, edge) in self.covered(&corners.map(|c| self.seen(&c))) {
                let light = if edge { light * EDGE_LIGHT } else { light };
                samples.put(n, depth, rgb, light);
            }
        }
        self.averaged(&samples.shown)
    }

    /// Direction to the lamp.
    fn lamp(&self) -> Vector {
        (self.side.towards() - 0.5 * self.side.right() + 0.6 * Vector::z()).normalize()
    }

    /// The spot of a position (LPS, mm) in pixels.
    pub(crate) fn spot(&self, p: &Point) -> Spot {
        self.seen(p).0.map(|x| x / FINE as f64)
    }

    /// A picture of points (LPS, mm) with their outward normals and colours, as discs of a radius
    /// (mm); those that are turned away are left out.
    pub(crate) fn dotted(
        &self,
        points: impl Iterator<Item = (Point, Vector, Rgb)>,
        radius_mm: f64,
    ) -> Canvas {
        let across = FINE * self.size;
        let radius = radius_mm * FINE as f64 / self.pixel_mm;
        let (mut samples, lamp) = (Samples::new(self), self.lamp());
        for (place, normal, rgb) in points.filter(|(_, n, _)| n.dot(&self.side.towards()) > 0.0) {
            let light = light(normal.dot(&lamp));
            let ([x, y], depth) = self.seen(&place);
            let range = |at: f64| {
                let end = |at: f64| at.clamp(0.0, across as f64) as usize;
                end((at - radius).ceil())..end((at + radius).floor() + 1.0)
            };
            for (i, j) in range(y).flat_map(|j| range(x).map(move |i| (i, j))) {
                if (i as f64 - x).hypot(j as f64 - y) <= radius {
                    samples.put(j * across + i, depth, rgb, light);
                }
            }
        }
        self.averaged(&samples.shown)
    }

    /// The samples that a triangle covers: number, distance towards who looks, whether near an
    /// edge.
    fn covered(&self, corners: &[(Spot, f64); 3]) -> Vec<(usize, f64, bool)> {
        let across = FINE * self.size;
        let [a, b, c] = corners.map(|(spot, _)| spot);
        let turn = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if turn.abs() < 1e-9 {
            return Vec::new();
        }
        let range = |axis: usize| {
            let of = corners.map(|(spot, _)| spot[axis]);
            let low = of.into_iter().fold(f64::INFINITY, f64::min).ceil().max(0.0) as usize;
            let high = of.into_iter().fold(f64::NEG_INFINITY, f64::max).floor().max(-1.0) + 1.0;
            low..(high as usize).min(across)
        };
        let sides = [[b, c], [c, a], [a, b]];
        let mut covered = Vec::new();
        for y in range(1) {
            for x in range(0) {
                let p = [x as f64, y as f64];
                let area = |[s, e]: [Spot; 2]| {
                    (e[0] - s[0]) * (p[1] - s[1]) - (e[1] - s[1]) * (p[0] - s[0])
                };
                let weights = sides.map(|side| area(side) / turn);
                if weights.iter().any(|w| *w < 0.0) {
                    continue;
                }
                let depth = weights.iter().zip(corners).map(|(w, (_, d))| w * d).sum();
                let from_edge = |(side, w): (&[Spot; 2], &f64)| {
                    w * turn.abs() / (side[1][0] - side[0][0]).hypot(side[1][1] - side[0][1])
                };
                let nearest =
                    sides.iter().zip(&weights).map(from_edge).fold(f64::INFINITY, f64::min);
                covered.push((y * across + x, depth, nearest < 0.5 * EDGE * FINE as f64));
            }
        }
        covered
    }

    /// The picture of the samples' means; where there is nothing, the ground.
    fn averaged(&self, samples: &[[f64; 3]]) -> Canvas {
        let mut canvas = Canvas::new(self.size, self.size);
        let ground = palette::NOTHING.map(f64::from);
        for y in 0..self.size {
            for x in 0..self.size {
                let mut sum = [0.0; 3];
                for n in 0..FINE * FINE {
                    let at = (FINE * y + n / FINE) * FINE * self.size + FINE * x + n % FINE;
                    let rgb = if samples[at][0].is_nan() { ground } else { samples[at] };
                    sum.iter_mut().zip(rgb).for_each(|(s, c)| *s += c);
                }
                let rgb = sum.map(|s| (s / (FINE * FINE) as f64).round() as u8);
                canvas.mix(y * self.size + x, rgb, 1.0);
            }
        }
        canvas
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square at right angles to LPS y at `y`, outwards to the front.
    fn square(y: f64, half: f64) -> [[Point; 3]; 2] {
        let p = |x: f64, z: f64| Point::new(x * half, y, z * half);
        [[p(-1., -1.), p(1., -1.), p(1., 1.)], [p(-1., -1.), p(1., 1.), p(-1., 1.)]]
    }

    fn seen(side: Side) -> Canvas {
        let camera = Camera { side, centre: Point::origin(), pixel_mm: 1.0, size: 41 };
        let red = square(-10.0, 8.0).map(|f| (f, [200, 0, 0]));
        let blue = square(5.0, 15.0).map(|f| (f, [0, 0, 200]));
        camera.picture(red.into_iter().chain(blue))
    }

    #[test]
    fn the_nearer_face_hides_the_other() {
        let (front, back) = (seen(Side::Front), seen(Side::Back));
        let (red, blue) =
            (|c: [u8; 3]| c[0] > 80 && c[2] == 0, |c: [u8; 3]| c[2] > 80 && c[0] == 0);
        assert!(red(front.at(23, 18)) && blue(front.at(9, 18)), "{:?}", front.at(23, 18));
        assert!(blue(back.at(23, 18)) && blue(back.at(9, 18)));
        assert_eq!(front.at(1, 1), palette::NOTHING);
    }

    #[test]
    fn every_side_sees_head_up_and_its_own_left() {
        let camera = |side| Camera { side, centre: Point::origin(), pixel_mm: 1.0, size: 40 };
        let places = [Point::new(10.0, 0.0, 0.0), Point::new(0.0, 10.0, 0.0)];
        let right = |side| places.map(|p| camera(side).seen(&p).0[0] > 45.0);
        let left = |side| places.map(|p| camera(side).seen(&p).0[0] < 35.0);
        assert_eq!(right(Side::Front), [true, false]);
        assert_eq!(left(Side::Back), [true, false]);
        assert_eq!(right(Side::Left), [false, true]);
        assert_eq!(left(Side::Right), [false, true]);
        for side in [Side::Front, Side::Back, Side::Left, Side::Right] {
            let (head, _) = camera(side).seen(&Point::new(0.0, 0.0, 10.0));
            assert!(head[1] < 35.0);
            assert!((camera(side).seen(&Point::from(side.towards())).1 - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn the_nearer_point_hides_the_other_and_what_is_turned_away_is_left_out() {
        let camera = Camera { side: Side::Front, centre: Point::origin(), pixel_mm: 1.0, size: 41 };
        let front = -Vector::y();
        let points = [
            (Point::new(0.0, -10.0, 0.0), front, [200, 0, 0]),
            (Point::new(0.0, 5.0, 0.0), front, [0, 0, 200]),
            (Point::new(0.0, -20.0, 12.0), -front, [0, 200, 0]),
        ];
        let canvas = camera.dotted(points.into_iter(), 3.0);
        let [x, y] = camera.spot(&points[0].0).map(|c| c as usize);
        let seen = canvas.at(x, y);
        assert!(seen[0] > 80 && seen[2] == 0, "{seen:?}");
        assert_eq!(canvas.at(x, y - 12), palette::NOTHING);
        assert_eq!(canvas.at(x + 5, y), palette::NOTHING);
    }
}
