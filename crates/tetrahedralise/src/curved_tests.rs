use super::*;
use crate::Params;
use std::sync::Arc;
use supine_mesh::BoundaryTag;
use supine_space::{Grid, Matrix, Point, Progress, Sphere};
use supine_volume::{LabelMap, Region, Volume, label};

const MIDDLE: [f64; 3] = [-20.0, 15.0, 40.0];
const RADIUS: f64 = 40.0;

/// A ball whose back is chest wall.
fn ball() -> LabelMap {
    let origin = Point::from(MIDDLE) - Vector::repeat(60.0);
    let grid = Grid::new([101, 101, 81], Vector::new(1.2, 1.2, 1.5), origin, Matrix::identity());
    let grid = grid.unwrap();
    Volume::from_fn(grid.clone(), |v| match grid.centre(v) - Point::from(MIDDLE) {
        p if p.norm() > RADIUS => label::OUTSIDE,
        p if p.y > 12.0 => label::CHEST_WALL,
        _ => label::SOFT_TISSUE,
    })
}

fn with_mesh(check: impl Fn(&Domain, &TetMesh)) {
    let labels = ball();
    let region =
        Region::new(Arc::new(labels.clone()), Sphere::new(Point::from(MIDDLE), 55.0).unwrap())
            .unwrap();
    let domain = Domain::new(&region, &Params::default(), Progress::none()).unwrap();
    let (mesh, _) = domain.mesh(800, Progress::none()).unwrap();
    check(&domain, &mesh);
}

/// Distances of the skin's faces from the ball at points all over them, mm: mean and largest.
fn off(mesh: &TetMesh, offsets: Option<&Displacement>) -> (f64, f64) {
    let edges = Edges::new(mesh);
    let (mut sum, mut count, mut largest) = (0.0, 0.0, 0.0f64);
    for face in mesh.boundary().iter().filter(|f| f.tag == BoundaryTag::Skin) {
        let holds = |tet: &[u32; 4]| face.points.iter().all(|p| tet.contains(p));
        let tet = mesh.tets().iter().position(holds).unwrap();
        for (a, b) in [(1, 1), (1, 6), (6, 1), (4, 4), (4, 0), (0, 4), (2, 2), (0, 0)] {
            let weights = [f64::from(a) / 8.0, f64::from(b) / 8.0, f64::from(8 - a - b) / 8.0];
            let mut l = [0.0; 4];
            for (p, w) in face.points.iter().zip(weights) {
                l[mesh.tets()[tet].iter().position(|q| q == p).unwrap()] = w;
            }
            let at: Vector = mesh.corners(tet).iter().zip(l).map(|(c, w)| c.coords * w).sum();
            let moved = at + offsets.map_or(Vector::zeros(), |o| o.at(mesh, &edges, tet, l));
            let distance = ((moved - Vector::from(MIDDLE)).norm() - RADIUS).abs();
            (sum, count, largest) = (sum + distance, count + 1.0, largest.max(distance));
        }
    }
    (sum / count, largest)
}

#[test]
fn curved_faces_lie_on_the_surface() {
    with_mesh(|domain, mesh| {
        let (offsets, told) = domain.curved(mesh).unwrap();
        let (straight, curved) = (off(mesh, None), off(mesh, Some(&offsets)));
        assert!(curved.0 < 0.4 * straight.0, "{curved:?} {straight:?} {told:?}");
        assert!(curved.0 < 0.1, "{curved:?} {straight:?} {told:?}");
        assert!(told.nodes > 100 && told.max_mm < 3.0 && told.mean_mm > 0.05, "{told:?}");
    });
}

#[test]
fn no_element_is_squeezed() {
    with_mesh(|domain, mesh| {
        let edges = Edges::new(mesh);
        let (offsets, _) = domain.curved(mesh).unwrap();
        for tet in 0..mesh.tets().len() {
            assert!(min_ratio(&offsets, mesh, &edges, tet) >= MIN_RATIO, "{tet}");
        }
        // Inside and on the cut nothing moves but what hangs on the surfaces.
        let mut on = vec![false; mesh.points().len()];
        for face in mesh.boundary().iter().filter(|f| f.tag != BoundaryTag::Cut) {
            face.points.iter().for_each(|&p| on[p as usize] = true);
        }
        for (point, offset) in offsets.values()[..on.len()].iter().enumerate() {
            assert!(on[point] || *offset == Vector::zeros());
        }
    });
}

#[test]
fn bad_elements_are_given_less() {
    with_mesh(|domain, mesh| {
        // A mesh moved off its surfaces by several millimetres wants offsets that fold it.
        let shift = Vector::new(0.0, -3.0, 0.0);
        let points = mesh.points().iter().map(|p| p + shift).collect();
        let moved = TetMesh::new(points, mesh.tets().to_vec(), mesh.boundary().to_vec()).unwrap();
        let (offsets, told) = domain.curved(&moved).unwrap();
        let edges = Edges::new(&moved);
        let worst = (0..moved.tets().len()).map(|t| min_ratio(&offsets, &moved, &edges, t));
        let worst = worst.fold(f64::INFINITY, f64::min);
        assert!(worst > 0.0 && told.shortened > 0, "{worst} {told:?}");
    });
}
