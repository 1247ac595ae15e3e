//! What becomes of the blurred skin edge.

use super::fixture::{lattice, moved};
use crate::{Params, carry_points, warp};
use std::sync::Arc;
use supine_mesh::{BoundaryTag, Order, TetMesh};
use supine_space::{Grid, Matrix, Point, Progress, Vector};
use supine_volume::{Ct, Volume};

/// 24 x 16 x 20 mm of tissue with its skin at y = 0.
fn block() -> Arc<TetMesh> {
    lattice([6, 4, 5], 4.0, Point::origin(), |p| {
        if p.y < 0.1 { BoundaryTag::Skin } else { BoundaryTag::ChestWall }
    })
}

/// Tissue below y = 0 with an edge 4 mm wide; above, a second body ends at y = -`gap_mm`.
fn ct(gap_mm: f64) -> Ct {
    let size = [30, 36, 20];
    let grid = Grid::new(
        size,
        Vector::new(1.0, 1.0, 1.25),
        Point::new(-3.0, -15.0, -2.0),
        Matrix::identity(),
    );
    let grid = grid.unwrap();
    let edge = |depth: f64| (250.0 * depth + 500.0).clamp(0.0, 1000.0);
    Volume::from_fn(grid.clone(), |v| {
        let y = grid.centre(v).y;
        (edge(y).max(edge(-gap_mm - y)) - 1000.0) as i16
    })
}

/// The skin moves by up to `by` mm along y; sides and back rest.
fn dent(by: f64) -> impl Fn(Point) -> Vector {
    move |p| {
        let bump = |t: f64| 4.0 * t * (1.0 - t);
        Vector::y() * (by * (1.0 - p.y / 16.0) * bump(p.x / 24.0) * bump(p.z / 20.0))
    }
}

fn column(ct: &Ct) -> impl Iterator<Item = (f64, i16)> {
    (0..ct.grid().size()[1]).map(|j| {
        let v = [15, j, 10];
        (ct.grid().centre(v).y, ct.at(v))
    })
}

#[test]
fn the_soft_edge_moves_with_the_skin() {
    let mesh = block();
    let u = moved(&mesh, Order::Quadratic, dent(5.0));
    let ct = ct(100.0);
    let run = |collar_mm| {
        let params = Params { collar_mm, ..Params::default() };
        warp(&ct, &u, &params, Progress::none()).unwrap()
    };
    let (out, info) = run(5.0);
    assert!(info.warnings.is_empty() && info.collar_voxels > 0, "{info:?}");
    let skin = dent(5.0)(Point::new(12.0, 0.0, 10.5)).y;
    for (y, hu) in column(&out) {
        let want = if y < skin {
            (250.0 * (y - skin) - 500.0).max(-1000.0)
        } else {
            // Tissue at Y is carried to Y + skin (1 - Y / 16).
            (250.0 * (y - skin) / (1.0 - skin / 16.0) - 500.0).min(0.0)
        };
        assert!((f64::from(hu) - want).abs() < 60.0, "y {y}: {hu} for {want}");
    }
    let floating = column(&run(0.0).0).filter(|&(y, hu)| y < 0.0 && hu > -800).count();
    assert!(floating > 0, "without a collar the old edge stays in the air");
}

#[test]
fn another_body_across_a_gap_stays() {
    let mesh = block();
    let ct = ct(5.0);
    for by in [4.0, -3.0] {
        let u = moved(&mesh, Order::Linear, dent(by));
        let (out, info) = warp(&ct, &u, &Params::default(), Progress::none()).unwrap();
        assert!(info.facts.moved_voxels > 1000, "{info:?}");
        for (n, (got, was)) in out.data().iter().zip(ct.data()).enumerate() {
            let y = ct.grid().centre(ct.grid().voxel(n)).y;
            if y <= -5.0 {
                assert_eq!(got, was, "by {by} mm, y {y}");
            }
        }
        // Nothing of the other body is drawn along with the skin.
        if by > 0.0 {
            let drawn = column(&out).filter(|&(y, hu)| y > -2.5 && y < 1.0 && hu > -700).count();
            assert_eq!(drawn, 0, "tissue in the open gap");
        }
    }
}

#[test]
fn a_mark_on_the_skin_moves_with_it_and_one_behind_the_chest_wall_does_not() {
    let mesh = block();
    for order in [Order::Linear, Order::Quadratic] {
        let u = moved(&mesh, order, dent(5.0));
        let at = |x, y, z| Point::new(x, y, z);
        let marks =
            [at(9.3, -1.5, 11.0), at(8.0, -0.4, 8.0), at(9.3, -5.5, 11.0), at(9.0, 17.0, 9.0)];
        let carried = carry_points(&u, &Params::default(), &marks).unwrap();
        for n in 0..2 {
            // What stands on the skin turns with it.
            let foot = Point::new(marks[n].x, 0.0, marks[n].z);
            let skin = |p: Point| p + dent(5.0)(p);
            let [x, z] = [Vector::x(), Vector::z()].map(|d| skin(foot + d) - skin(foot - d));
            let mark = skin(foot) + x.cross(&z).normalize() * -marks[n].y;
            let error = (carried[n].unwrap() - mark).norm();
            // The bump is a product of parabolas: of higher order than the elements.
            assert!(error < if order == Order::Linear { 0.4 } else { 0.03 }, "{order:?}: {error}");
        }
        assert_eq!((carried[2], carried[3]), (None, None));
    }
}
