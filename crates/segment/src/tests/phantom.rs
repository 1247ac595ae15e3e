//! A thorax with known tissue at every point: ellipses over z, no data of any patient.

use supine_space::{Grid, Matrix, Point, Vector};
use supine_volume::Ct;

/// What a point belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Truth {
    Outside,
    Soft,
    Wall,
}

/// A supine thorax about the origin, LPS, mm: two breasts, gland that touches the pectoralis,
/// ribs, spine, sternum, lungs, a table below and a bra wire under the left breast.
pub(super) struct Thorax {
    /// Radius of the reconstructed field; padding of -2048 HU beyond.
    pub(super) field_radius: Option<f64>,
    /// Whether air lies in the fold under the left breast.
    pub(super) pocket: bool,
    /// Whether the lungs are joined to the air outside, as in a CT that shows the mouth.
    pub(super) airway: bool,
    /// Whether the left pectoralis ends free, over the fat of the armpit.
    pub(super) free_border: bool,
    /// HU of the gland.
    pub(super) gland_hu: f64,
    /// Standard deviation of the noise, HU.
    pub(super) noise: f64,
    /// HU of what was put into or onto the patient, where it is; labels are not changed by it.
    pub(super) object: Option<fn(&Point) -> Option<f64>>,
}

impl Default for Thorax {
    fn default() -> Self {
        Self {
            field_radius: None,
            pocket: false,
            airway: false,
            free_border: false,
            gland_hu: 32.0,
            noise: 10.0,
            object: None,
        }
    }
}

/// Where the air pocket lies.
pub(super) const POCKET: Point = Point::new(75.0, -118.0, -50.0);
/// Highest point of the left breast.
pub(super) const APEX: Point = Point::new(82.0, -127.0, 0.0);

/// Radius of the ellipse (a, b) through the point, as a share: below 1 inside.
fn ellipse(x: f64, y: f64, a: f64, b: f64) -> f64 {
    (x / a).hypot(y / b)
}

impl Thorax {
    /// Distance outside the ribs' outer edge, about mm.
    pub(super) fn above_ribs(p: &Point) -> f64 {
        (ellipse(p.x, p.y, 130.0, 86.0) - 1.0) * 100.0
    }

    /// Thickness of the muscle over the ribs: pectoralis in front, thin at the sides.
    pub(super) fn muscle_mm(p: &Point) -> f64 {
        let front = (-p.y / 86.0).clamp(0.0, 1.0);
        let side = (p.x.abs() / 55.0).clamp(0.0, 1.0);
        let upper = ((p.z + 40.0) / 50.0).clamp(0.2, 1.0);
        3.0 + 9.0 * front * side * upper + if p.y > 20.0 { 14.0 } else { 0.0 }
    }

    /// Below 0 inside the skin: a trunk and two breasts.
    pub(super) fn skin(p: &Point) -> f64 {
        let trunk = (ellipse(p.x, p.y, 155.0, 110.0) - 1.0) * 120.0;
        let off = Vector::new(p.x.abs() - 75.0, p.y + 80.0, p.z);
        let breast = ((off.x / 56.0).hypot(off.y / 48.0).hypot(off.z / 56.0) - 1.0) * 50.0;
        trunk.min(breast)
    }

    pub(super) fn is_gland(p: &Point) -> bool {
        let off = Vector::new(p.x.abs() - 70.0, p.y + 94.0, p.z);
        (off.x / 30.0).hypot(off.y / 22.0).hypot(off.z / 28.0) < 1.0
    }

    fn in_pocket(&self, p: &Point) -> bool {
        let off = p - POCKET;
        self.pocket && (off.x / 9.0).hypot(off.y / 12.0) < 1.0 && (-30.0..6.0).contains(&off.z)
    }

    pub(super) fn truth(&self, p: &Point) -> Truth {
        if Self::skin(p) > 0.0 || self.in_pocket(p) {
            Truth::Outside
        } else if Self::above_ribs(p) < Self::muscle_mm(p) || self.in_free_border(p) {
            Truth::Wall
        } else {
            Truth::Soft
        }
    }

    /// A sheet of muscle 11 mm thick that leaves the ribs to the left.
    pub(super) fn in_free_border(&self, p: &Point) -> bool {
        let front = -86.0 - 0.15 * (p.x - 60.0);
        let sheet = (front..front + 11.0).contains(&p.y) && (60.0..112.0).contains(&p.x);
        self.free_border && sheet && (0.0..50.0).contains(&p.z)
    }

    pub(super) fn is_table_or_wire(&self, p: &Point) -> bool {
        p.y > 114.0 || Self::is_wire(p)
    }

    fn is_wire(p: &Point) -> bool {
        let skin = Self::skin(p);
        p.x > 40.0 && p.y < 0.0 && (0.0..2.5).contains(&skin) && (p.z + 36.0).abs() < 3.0
    }

    fn is_rib(p: &Point) -> bool {
        let depth = -Self::above_ribs(p);
        // Down towards the front.
        let along = p.z - 0.35 * p.y;
        let spine = (p.x / 18.0).hypot((p.y - 66.0) / 20.0) < 1.0;
        let sternum = p.x.abs() < 16.0 && p.y < 0.0 && (0.0..9.0).contains(&depth);
        spine || sternum || ((0.0..7.0).contains(&depth) && along.rem_euclid(24.0) < 12.0)
    }

    /// Tubes from both lungs to the middle, up, and out in front in the top slices.
    fn in_airway(&self, p: &Point) -> bool {
        let across = p.x.abs() < 20.0 && p.y.hypot(p.z - 40.0) < 6.0;
        let up = p.x.hypot(p.y) < 8.0 && p.z > 40.0;
        let out = p.x.abs() < 8.0 && p.y < 0.0 && p.z > 74.0;
        self.airway && (across || up || out)
    }

    fn is_lung(p: &Point) -> bool {
        ellipse(p.x.abs() - 62.0, p.y, 54.0, 66.0) < 1.0 && Self::above_ribs(p) < -11.0
    }

    fn hu(&self, p: &Point) -> f64 {
        if let Some(hu) = self.object.and_then(|object| object(p)) {
            return hu;
        }
        if Self::is_wire(p) {
            return 2200.0;
        }
        if self.in_airway(p) {
            return -1000.0;
        }
        match self.truth(p) {
            Truth::Outside if (114.0..117.0).contains(&p.y) && p.x.abs() < 170.0 => 120.0,
            Truth::Outside if p.y > 117.0 && p.y < 135.0 && p.x.abs() < 170.0 => -900.0,
            Truth::Outside => -1000.0,
            Truth::Soft if Self::skin(p) > -2.0 => 20.0,
            Truth::Soft if Self::is_gland(p) => self.gland_hu,
            Truth::Soft => -100.0,
            Truth::Wall if Self::is_rib(p) => 420.0,
            Truth::Wall if Self::is_lung(p) => -840.0,
            Truth::Wall => 52.0,
        }
    }

    /// The CT on a grid with the given directions: 2.8 x 2.8 x 5 mm, 34 slices.
    pub(super) fn ct(&self, direction: Matrix) -> Ct {
        let (size, spacing) = ([134, 134, 34], Vector::new(2.8, 2.8, 5.0));
        let half = Vector::new(133.0 * 1.4, 133.0 * 1.4, 82.5);
        let origin = Point::origin() - direction * half;
        let grid = Grid::new(size, spacing, origin, direction).unwrap();
        let slanted = direction[(2, 2)].abs() < 0.5;
        let values = (0..grid.len()).map(|n| {
            let p = grid.centre(grid.voxel(n));
            if slanted || self.field_radius.is_some_and(|r| p.x.hypot(p.y) > r) {
                return -2048;
            }
            let step = direction.column(0) * 0.7;
            let mean = 0.5 * (self.hu(&(p + step)) + self.hu(&(p - step)));
            (mean + self.noise * normal(n as u64)).round().max(-1024.0) as i16
        });
        let values = values.collect();
        Ct::new(grid, values).unwrap()
    }
}

/// A number of mean 0 and deviation 1 from a counter (splitmix64, sum of four).
fn normal(n: u64) -> f64 {
    let mut x = n.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(0x9E37_79B9_7F4A_7C15);
    x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^= x >> 31;
    let sum: u64 = (0..4).map(|b| x >> (16 * b) & 0xFFFF).sum();
    (sum as f64 / 65535.0 - 2.0) * 3f64.sqrt()
}
