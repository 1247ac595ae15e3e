//! Tissue that nothing was measured of is counted.

use super::fixture::{lattice, moved};
use crate::{Params, beyond_field_mm3};
use supine_mesh::{BoundaryTag, Order};
use supine_space::{Grid, Matrix, Point, Progress, Vector};
use supine_volume::{Ct, Field, Volume};

/// Tissue from x = 0 to 40 mm, measured up to `end`; beyond it padding.
fn ct(end: f64) -> Ct {
    let grid = Grid::new([60, 40, 40], Vector::repeat(1.0), Point::origin(), Matrix::identity());
    let grid = grid.unwrap();
    let hu = |[i, j, k]: [usize; 3]| match i as f64 {
        x if x > end => -2048,
        x if x < 40.0 && (10..30).contains(&j) && (10..30).contains(&k) => 40,
        _ => -1000,
    };
    Volume::from_fn(grid, hu)
}

/// What a shift of tissue that reaches from 20 to 40 mm by `shift` along x brings from beyond, mm³.
fn beyond(end: f64, shift: f64) -> f64 {
    let ct = ct(end);
    let origin = Point::new(20.5, 9.5, 9.5);
    let mesh = lattice([4, 4, 4], 5.0, origin, |_| BoundaryTag::Skin);
    let u = moved(&mesh, Order::Linear, |_| Vector::new(shift, 0.0, 0.0));
    let params = Params { fade_mm: Some(0.0), ..Params::default() };
    beyond_field_mm3(&ct, &Field::found(&ct), &u, &params, Progress::none()).unwrap()
}

#[test]
fn tissue_from_beyond_the_field_is_counted_and_skin_is_not() {
    // The mesh reaches to 40.5 mm and the field to 35 mm: what lies between moves in, and nothing
    // is known of what follows.
    assert_eq!(beyond(35.0, -4.0), 4.0 * 20.0 * 20.0);
    // The field ends at the mesh: what is to follow it was not measured.
    assert_eq!(beyond(39.0, -4.0), 4.0 * 20.0 * 20.0);
    // Skin that moves away from the end of the field or towards it leaves air or takes its place.
    assert_eq!(beyond(44.0, -4.0), 0.0);
    assert_eq!(beyond(44.0, 2.0), 0.0);
    assert_eq!(beyond(60.0, -4.0), 0.0);
}
