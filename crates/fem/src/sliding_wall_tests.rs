use super::*;
use crate::test_mesh::{bent, block};
use crate::{Body, Cut, Info, Load, Params, RestState, Tissue, solve};
use supine_mesh::{Deformation, Order};
use supine_space::{Progress, TablePose, supine};

/// Curvature of the wall, 1/mm: that of ribs.
const BENT: f64 = 0.01;

fn bowl() -> Arc<TetMesh> {
    let flat = block([6, 6, 2], 10.0, 0.0);
    let centred = flat.points().iter().map(|p| p - Vector::new(30.0, 30.0, 0.0)).collect();
    let flat = TetMesh::new(centred, flat.tets().to_vec(), flat.boundary().to_vec()).unwrap();
    bent(&flat, BENT)
}

fn area(stiffness_kpa_mm: f64) -> SlidingArea {
    SlidingArea { centre_mm: Some([0.0; 3]), radius_mm: 29.0, rim_mm: 8.0, stiffness_kpa_mm }
}

fn moved(sliding: Option<SlidingArea>, rest: RestState, order: Order) -> (Deformation, Info) {
    let tissue = Tissue { young_kpa: 2.0, ..Tissue::default() };
    let body = Body::new(bowl(), tissue);
    let target = TablePose { ap_deg: 60.0, lat_deg: 10.0 }.gravity();
    let load = Load { ct: supine(), target };
    solve(&body, &load, &Params { rest, order, sliding, ..Params::default() }, Progress::none())
        .unwrap()
}

fn most(a: &Deformation, b: &Deformation) -> f64 {
    let both = a.displacement().values().iter().zip(b.displacement().values());
    both.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

#[test]
fn the_shape_of_a_wall_is_found() {
    let mesh = bowl();
    let shape = WallShape::new(&mesh, &faces_on(&mesh, BoundaryTag::ChestWall));
    for point in mesh.points_on(BoundaryTag::ChestWall) {
        let place = mesh.points()[point as usize].coords;
        if place.xy().norm() > 15.0 {
            continue;
        }
        let (normal, curvature) = shape.at(&place, &[point]);
        let wanted = Vector::new(-BENT * place.x, -BENT * place.y, 1.0).normalize();
        let normal = normal * normal.z.signum();
        assert!((normal - wanted).norm() < 2e-3, "{place} {normal}");
        let bent = curvature.symmetric_eigenvalues().map(f64::abs);
        assert!((bent.max() - BENT).abs() < 0.05 * BENT, "{bent}");
    }
}

/// The wall is the paraboloid itself, from which the tissue lifts by less than the local
/// quadratics differ from it.
#[test]
fn the_tissue_slides_along_the_wall_and_stays_on_it() {
    for order in [Order::Linear, Order::Quadratic] {
        for rest in [RestState::Net, RestState::Unloaded] {
            let (held, _) = moved(None, rest, order);
            let (slid, info) = moved(Some(area(0.02)), rest, order);
            let mesh = slid.mesh();
            let (mut lifted, mut way) = (0.0f64, 0.0f64);
            for point in mesh.points_on(BoundaryTag::ChestWall) {
                let (u, p) =
                    (slid.displacement().values()[point as usize], mesh.points()[point as usize]);
                let end = p + u;
                lifted = lifted.max((end.z - 0.5 * BENT * end.coords.xy().norm_squared()).abs());
                way = way.max(u.norm());
            }
            assert!(way > 0.3, "{order:?} {rest:?}: {way}");
            assert!(lifted < 0.01 * way, "{order:?} {rest:?}: {lifted} of {way}");
            assert!(most(&slid, &held) > 0.9 * way);
            assert!(info.solve.iterations <= 7 && info.solve.load_steps == 1, "{:?}", info.solve);
        }
    }
}

#[test]
fn a_stiff_layer_holds_and_a_soft_one_lets_go() {
    for rest in [RestState::Net, RestState::Unloaded] {
        let with = |sliding| moved(sliding, rest, Order::Quadratic).0;
        let held = with(None);
        let ways = [1e6, 1.0, 0.1, 0.01, 0.0].map(|k| most(&with(Some(area(k))), &held));
        assert!(ways[0] < 1e-3, "{ways:?}");
        assert!(ways.is_sorted(), "{ways:?}");
        assert!(ways[4] > 0.4, "{ways:?}");
    }
}

#[test]
fn tissue_that_slides_everywhere_is_held_by_friction_or_by_the_cut_and_else_by_nothing() {
    let body = Body::new(bowl(), Tissue { young_kpa: 2.0, ..Tissue::default() });
    let target = TablePose { ap_deg: 60.0, lat_deg: 10.0 }.gravity();
    let load = Load { ct: supine(), target };
    let with = |stiffness, cut| {
        let everywhere = SlidingArea { radius_mm: 1000.0, ..area(stiffness) };
        assert!(slides_everywhere(&everywhere, &body.mesh));
        let params = Params { sliding: Some(everywhere), cut, ..Params::default() };
        solve(&body, &load, &params, Progress::none())
    };
    let most = |stiffness| {
        let solved = with(stiffness, Cut::Free).unwrap();
        solved.0.displacement().max_norm()
    };
    // Stiff friction holds as a wall does, and less lets it go further.
    let ways = [1e3, 0.1, 0.03].map(most);
    assert!(ways.is_sorted() && ways[2] > 1.5 * ways[0], "{ways:?}");
    assert!(matches!(with(0.0, Cut::Free), Err(crate::Error::NoSupport { .. })));
    assert!(!slides_everywhere(&area(0.1), &body.mesh));
}

#[test]
fn the_middle_of_the_area_is_that_of_the_breast_on_any_mesh() {
    // Tissue 4 mm thick with a mound of 30 mm over (15, -10), on coarse and fine grids.
    let mound = |cells: u32, size: f64| {
        let flat = block([cells as usize, cells as usize, 2], size, 0.0);
        let raised = flat.points().iter().map(|p| {
            let (x, y) = (p.x - 60.0, p.y - 60.0);
            let far = (x - 15.0).powi(2) + (y + 10.0).powi(2);
            Point::new(x, y, p.z / (2.0 * size) * (4.0 + 30.0 * (-far / 600.0).exp()))
        });
        TetMesh::new(raised.collect(), flat.tets().to_vec(), flat.boundary().to_vec()).unwrap()
    };
    for (cells, size) in [(10, 12.0), (17, 120.0 / 17.0), (30, 4.0)] {
        let asked = SlidingArea { centre_mm: None, ..area(0.0) };
        let middle = Point::from(placed(asked, &mound(cells, size)).centre_mm.unwrap());
        let off = (middle - Point::new(15.0, -10.0, middle.z)).norm();
        assert!(off < 0.75 * size, "{off} mm off on cells of {size}");
    }
}
