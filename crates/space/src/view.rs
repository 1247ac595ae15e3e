//! Planes of patient space as a radiologist expects them, with square pixels.

use crate::{Point, Vector};

/// A place in a plane: pixels to the right and down from the centre of the upper left pixel.
pub type Spot = [f64; 2];

/// How the patient is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// From the feet: patient's left at the right of the picture, front up.
    Axial,
    /// From the patient's left: front at the left of the picture, head up.
    Sagittal,
    /// From the front: patient's left at the right of the picture, head up.
    Coronal,
}

impl View {
    /// All views.
    pub const ALL: [Self; 3] = [Self::Axial, Self::Sagittal, Self::Coronal];

    /// Direction of growing x of the picture, LPS.
    pub fn right(self) -> Vector {
        match self {
            Self::Axial | Self::Coronal => Vector::x(),
            Self::Sagittal => Vector::y(),
        }
    }

    /// Direction of growing y of the picture, LPS.
    pub fn down(self) -> Vector {
        match self {
            Self::Axial => Vector::y(),
            Self::Sagittal | Self::Coronal => -Vector::z(),
        }
    }

    /// Axis of LPS (0, 1, 2) at right angles to the plane.
    pub fn axis(self) -> usize {
        match self {
            Self::Axial => 2,
            Self::Sagittal => 0,
            Self::Coronal => 1,
        }
    }

    /// Name, as in files and captions.
    pub fn name(self) -> &'static str {
        match self {
            Self::Axial => "axial",
            Self::Sagittal => "sagittal",
            Self::Coronal => "coronal",
        }
    }

    /// Letters at the left, right, upper and lower edge.
    pub fn letters(self) -> [&'static str; 4] {
        match self {
            Self::Axial => ["R", "L", "A", "P"],
            Self::Sagittal => ["A", "P", "H", "F"],
            Self::Coronal => ["R", "L", "H", "F"],
        }
    }
}

/// A rectangle of a plane of patient space, in pixels.
#[derive(Clone, Debug)]
pub struct Plane {
    /// How it is looked at.
    pub view: View,
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Side of a pixel, mm.
    pub pixel_mm: f64,
    /// Centre of the upper left pixel, LPS, mm.
    corner: Point,
}

impl Plane {
    /// The plane through `at` that shows the box from `low` to `high` (LPS, mm), seen along the
    /// view's axis, with pixels of `pixel_mm`.
    pub fn new(view: View, at: &Point, [low, high]: [Point; 2], pixel_mm: f64) -> Self {
        let (right, down) = (view.right(), view.down());
        let middle = low + (high - low) / 2.0;
        let extent = |along: Vector| (high - low).dot(&along.abs());
        let pixels = |mm: f64| (mm / pixel_mm).round().max(1.0) as usize;
        let (width, height) = (pixels(extent(right)), pixels(extent(down)));
        let mut corner = middle
            - right * (pixel_mm * (width - 1) as f64 / 2.0)
            - down * (pixel_mm * (height - 1) as f64 / 2.0);
        corner[view.axis()] = at[view.axis()];
        Self { view, width, height, pixel_mm, corner }
    }

    /// Position of a spot, LPS, mm.
    #[inline]
    pub fn patient(&self, [x, y]: Spot) -> Point {
        self.corner + (self.view.right() * x + self.view.down() * y) * self.pixel_mm
    }

    /// The spot a position (LPS, mm) is projected to.
    pub fn spot(&self, p: &Point) -> Spot {
        self.along(&(p - self.corner))
    }

    /// The part of a vector (mm) that lies in the plane, pixels.
    pub fn along(&self, v: &Vector) -> Spot {
        [self.view.right().dot(v) / self.pixel_mm, self.view.down().dot(v) / self.pixel_mm]
    }

    /// Distance of a position from the plane, mm, positive towards +x, +y or +z of LPS.
    pub fn depth(&self, p: &Point) -> f64 {
        p[self.view.axis()] - self.corner[self.view.axis()]
    }

    /// Where the plane lies: `z -594.5`.
    pub fn position(&self) -> String {
        let axis = self.view.axis();
        format!("{} {:.1}", ["x", "y", "z"][axis], self.corner[axis])
    }

    /// Radius, pixels, of the circle in which the plane cuts a sphere; `None` when it does not.
    pub fn cut_radius(&self, centre: &Point, radius: f64) -> Option<f64> {
        let square = radius * radius - self.depth(centre).powi(2);
        (square > 0.0).then(|| square.sqrt() / self.pixel_mm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(view: View) -> Plane {
        let frame = [Point::new(-10.0, -20.0, -30.0), Point::new(30.0, 20.0, 10.0)];
        Plane::new(view, &Point::new(1.0, 2.0, 3.0), frame, 0.5)
    }

    #[test]
    fn spots_and_positions_agree() {
        for view in View::ALL {
            let p = plane(view);
            assert_eq!((p.width, p.height), (80, 80));
            let back = p.spot(&p.patient([12.0, 30.0]));
            assert!((back[0] - 12.0).abs() < 1e-12 && (back[1] - 30.0).abs() < 1e-12);
            assert!(p.depth(&p.patient([5.0, 6.0])).abs() < 1e-12);
            let middle = p.patient([39.5, 39.5]);
            let mut want = Point::new(10.0, 0.0, -10.0);
            want[view.axis()] = [1.0, 2.0, 3.0][view.axis()];
            assert!((middle - want).norm() < 1e-12, "{view:?} {middle}");
        }
    }

    #[test]
    fn the_patients_left_front_and_head_are_where_radiologists_look_for_them() {
        let towards = |view, v: Vector| plane(view).along(&v);
        let (left, front, head) = (Vector::x(), -Vector::y(), Vector::z());
        assert_eq!(towards(View::Axial, left), [2.0, 0.0]);
        assert_eq!(towards(View::Axial, front), [0.0, -2.0]);
        assert_eq!(towards(View::Sagittal, front), [-2.0, 0.0]);
        assert_eq!(towards(View::Sagittal, head), [0.0, -2.0]);
        assert_eq!(towards(View::Coronal, left), [2.0, 0.0]);
        assert_eq!(towards(View::Coronal, head), [0.0, -2.0]);
    }
}
