//! Tests of the whole on label maps made of formulas.

use crate::domain::edge_for;
use crate::faults::faults;
use crate::fields::{Fields, Smoothing};
use crate::mesher::Mesher;
use crate::sizing::Sizing;
use crate::start::start;
use crate::{Domain, Error, Info, Params, Piece, Refinement, coarsen, labels, tetrahedralise};
use nalgebra::Rotation3;
use std::sync::Arc;
use supine_mesh::{BoundaryTag, TetMesh};
use supine_space::{Grid, Matrix, Point, Progress, Sphere, Vector};
use supine_volume::{LabelMap, Region, Volume, label};

/// Labels by position.
pub(crate) type Shape = fn(&Vector) -> u8;

/// Radius of the test region, mm.
const RADIUS: f64 = 30.0;
const CENTRE: Point = Point::new(12.0, -7.0, 40.0);

fn grid(direction: Matrix) -> Grid {
    let (size, spacing) = ([72, 70, 52], Vector::new(1.1, 1.1, 1.5));
    let middle = Vector::from_fn(|a, _| 0.5 * (size[a] - 1) as f64 * spacing[a]);
    Grid::new(size, spacing, CENTRE - direction * middle, direction).unwrap()
}

/// Labels by a function of the position relative to the region's centre, mm.
pub(crate) fn labelled(direction: Matrix, at: impl Fn(&Vector) -> u8) -> LabelMap {
    let grid = grid(direction);
    Volume::from_fn(grid.clone(), |v| at(&(grid.centre(v) - CENTRE)))
}

pub(crate) fn sphere() -> Sphere {
    Sphere::new(CENTRE, RADIUS).unwrap()
}

/// A dome of soft tissue on a wavy slab; the patient's front is -y.
pub(crate) fn dome(p: &Vector) -> u8 {
    let wall = 10.0 + 0.6 * (p.z / 4.0).sin();
    let skin = 1.0 - 16.0 * (-(p.x * p.x + p.z * p.z) / 300.0).exp();
    if p.y > wall {
        label::CHEST_WALL
    } else if p.y > skin {
        label::SOFT_TISSUE
    } else {
        label::OUTSIDE
    }
}

/// Soft tissue that thins out to nothing towards +x.
pub(crate) fn wedge(p: &Vector) -> u8 {
    if p.y > 5.0 {
        label::CHEST_WALL
    } else if p.y > 5.0 - (0.4 * (12.0 - p.x)).clamp(0.0, 14.0) {
        label::SOFT_TISSUE
    } else {
        label::OUTSIDE
    }
}

/// A repeatable number in 0..1 for a position.
pub(crate) fn noise(p: &Vector, salt: f64) -> f64 {
    let x = (p.x * 12.9898 + p.y * 78.233 + p.z * 37.719 + salt).sin() * 43_758.545;
    x - x.floor()
}

fn mesh_with(labels: &LabelMap, params: &Params) -> Result<(TetMesh, Info), Error> {
    let region = Region::new(Arc::new(labels.clone()), sphere()).unwrap();
    tetrahedralise(&region, params, Progress::none())
}

/// One domain gives any number of meshes, each the same as if made alone.
#[test]
fn a_domain_is_meshed_again_and_again() {
    let labels = labelled(Matrix::identity(), dome);
    let region = Region::new(Arc::new(labels.clone()), sphere()).unwrap();
    let domain = Domain::new(&region, &Params::default(), Progress::none()).unwrap();
    for tetrahedra in [3000, 1200, 3000] {
        let (again, info) = domain.mesh(tetrahedra, Progress::none()).unwrap();
        assert_eq!((again.tets().len(), info.asked), (tetrahedra, tetrahedra));
        assert!(again == mesh(&labels, tetrahedra).0, "{tetrahedra}");
    }
    let few = domain.mesh(10, Progress::none());
    assert!(matches!(few, Err(Error::TooFew { asked: 10, .. })), "{few:?}");
}

/// A mesh is coarsened on its own surface; tags, volume and rims stay.
#[test]
fn a_mesh_is_coarsened_on_its_own_surface() {
    for shape in [dome as Shape, wedge] {
        let (fine, before) = mesh(&labelled(Matrix::identity(), shape), 6000);
        let (coarse, info) = coarsen(&fine, 1200, &Refinement::None, Progress::none()).unwrap();
        assert_eq!(coarse.tets().len(), 1200);
        assert!(info.quality.min_dihedral_deg > 20.0, "{:?}", info.quality);
        let change = coarse.total_volume() / fine.total_volume() - 1.0;
        assert!(change.abs() < 0.01, "{change}");
        assert!(
            (info.rim_mm / before.rim_mm - 1.0).abs() < 0.03,
            "{} {}",
            info.rim_mm,
            before.rim_mm
        );
        assert_eq!(info.deviation.len(), before.deviation.len());
        for (after, before) in info.deviation.iter().zip(&before.deviation) {
            assert_eq!(after.tag, before.tag);
            assert!((after.area_mm2 / before.area_mm2 - 1.0).abs() < 0.03, "{after:?} {before:?}");
            let off = &after.distance;
            assert!(off.max_mm < 1.1 && off.mean_mm < 0.2, "{after:?}");
        }
        assert!(coarse == coarsen(&fine, 1200, &Refinement::None, Progress::none()).unwrap().0);
        let more = coarsen(&fine, 6000, &Refinement::None, Progress::none());
        assert!(matches!(more, Err(Error::NotCoarser { asked: 6000, has: 6000 })), "{more:?}");
    }
}

fn mesh(labels: &LabelMap, tetrahedra: usize) -> (TetMesh, Info) {
    mesh_with(labels, &Params { tetrahedra, ..Params::default() }).unwrap()
}

/// Volume of the voxels of soft tissue in the sphere, mm³.
fn voxel_volume(labels: &LabelMap) -> f64 {
    let grid = labels.grid();
    let inside = |n: &usize| sphere().contains(&grid.centre(grid.voxel(*n)));
    let soft = |n: &usize| label::is_soft_tissue(labels.data()[*n]);
    (0..grid.len()).filter(soft).filter(inside).count() as f64 * grid.voxel_volume()
}

/// Euler number of the boundary, after checking that each of its edges has two faces.
pub(crate) fn euler(mesh: &TetMesh) -> i64 {
    let mut edges: Vec<[u32; 2]> = Vec::new();
    let mut points: Vec<u32> = Vec::new();
    for face in mesh.boundary() {
        let [a, b, c] = face.points;
        points.extend([a, b, c]);
        edges.extend([[a, b], [b, c], [c, a]].map(|[p, q]| [p.min(q), p.max(q)]));
    }
    edges.sort_unstable();
    assert!(edges.chunk_by(|a, b| a == b).all(|same| same.len() == 2), "a pinched edge");
    edges.dedup();
    points.sort_unstable();
    points.dedup();
    points.len() as i64 - edges.len() as i64 + mesh.boundary().len() as i64
}

#[test]
fn a_dome_has_the_asked_count_volume_tags_and_good_angles() {
    let labels = labelled(Matrix::identity(), dome);
    for asked in [1000, 1001, 2003] {
        let (mesh, info) = mesh(&labels, asked);
        assert_eq!((mesh.tets().len(), info.tetrahedra), (asked, asked));
        assert!(info.quality.min_dihedral_deg > 25.0, "{asked}: {:?}", info.quality);
        assert!(info.quality.max_dihedral_deg < 145.0, "{asked}: {:?}", info.quality);
        let want = voxel_volume(&labels);
        assert!((mesh.total_volume() / want - 1.0).abs() < 0.01, "{asked}: {want}");
        assert_eq!(euler(&mesh), 2, "{asked}");
        assert!(info.warnings.is_empty(), "{:?}", info.warnings);
        assert_eq!(info.deviation.len(), 3);
        for face in mesh.boundary() {
            let p = face.points.iter().map(|&p| mesh.points()[p as usize] - CENTRE);
            let middle: Vector = p.sum::<Vector>() / 3.0;
            let off = match face.tag {
                BoundaryTag::Cut => middle.norm() - RADIUS,
                BoundaryTag::ChestWall => middle.y - 10.0,
                BoundaryTag::Skin => f64::from(u8::from(middle.y > 4.0)) * middle.y,
            };
            assert!(off.abs() < 2.0, "{asked}: {:?} at {middle}", face.tag);
        }
    }
}

#[test]
fn every_stage_keeps_the_mesh_whole() {
    let params = Params { tetrahedra: 1500, ..Params::default() };
    let shapes: [(Shape, usize); 2] = [(dome, 1200), (wedge, 900)];
    for (shape, count) in shapes {
        let labels = labelled(Matrix::identity(), shape);
        let region = Region::new(Arc::new(labels.clone()), sphere()).unwrap();
        let kinds = labels::kinds(&region, Piece::Largest, 7.5, &mut Info::new()).unwrap();
        let fields = Fields::new(&kinds, sphere(), Smoothing::Labels(1.5), 1.0).unwrap();
        let (complex, parts, _) = start(&fields, 3.5, Progress::none()).unwrap().unwrap();
        assert_eq!(parts, 0);
        let edge = edge_for(fields.volume, count);
        let mut m = Mesher { mesh: complex, sizing: Sizing::new(&fields, &params, edge) };
        let whole = |m: &Mesher<'_>, stage: &str| {
            let faults = faults(&m.mesh);
            assert!(faults.is_empty(), "{stage}: {:?}", &faults[..faults.len().min(5)]);
        };
        whole(&m, "start");
        m.settle();
        whole(&m, "settle");
        m.coarsen(3.5, Progress::none()).unwrap();
        whole(&m, "coarsen");
        m.rounds(2, count, Progress::none()).unwrap();
        whole(&m, "rounds");
        assert!(m.reach(count + 7, f64::INFINITY, Progress::none()).unwrap());
        whole(&m, "count");
        m.fit(0.5, Progress::none()).unwrap();
        m.polish(0.5, 3, Progress::none()).unwrap();
        whole(&m, "fit");
        assert_eq!(m.mesh.count(), count + 7);
    }
}

#[test]
fn one_and_two_threads_give_the_same_bits() {
    let labels = labelled(Matrix::identity(), dome);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| mesh(&labels, 1200).0)
    };
    assert!(with(1) == with(2));
}

#[test]
fn oblique_and_left_handed_grids_are_honoured() {
    let turned = Rotation3::from_euler_angles(0.4, -0.3, 0.6).into_inner();
    let mirrored = turned * Matrix::from_diagonal(&Vector::new(1.0, 1.0, -1.0));
    for direction in [turned, mirrored] {
        let labels = labelled(direction, dome);
        let (mesh, info) = mesh(&labels, 1500);
        assert_eq!(mesh.tets().len(), 1500);
        assert!(info.quality.min_dihedral_deg > 20.0, "{:?}", info.quality);
        let centroid = |tag: BoundaryTag| {
            let of = |f: &supine_mesh::BoundaryFace| f.points.map(|p| mesh.points()[p as usize].y);
            let ys: Vec<f64> =
                mesh.boundary().iter().filter(|f| f.tag == tag).flat_map(of).collect();
            ys.iter().sum::<f64>() / ys.len() as f64 - CENTRE.y
        };
        assert!((centroid(BoundaryTag::ChestWall) - 10.0).abs() < 1.0);
        assert!(centroid(BoundaryTag::Skin) < 0.0);
        let want = voxel_volume(&labels);
        assert!((mesh.total_volume() / want - 1.0).abs() < 0.01);
    }
}

#[test]
fn a_wedge_ends_blunt_without_film_or_handle() {
    let labels = labelled(Matrix::identity(), wedge);
    let (mesh, info) = mesh(&labels, 1500);
    assert_eq!(mesh.tets().len(), 1500);
    assert_eq!(euler(&mesh), 2);
    assert!(info.quality.min_dihedral_deg > 15.0, "{:?}", info.quality);
    let furthest = mesh.points().iter().map(|p| p.x - CENTRE.x).fold(f64::MIN, f64::max);
    assert!((6.0..12.5).contains(&furthest), "{furthest}");
}

#[test]
fn random_labels_everywhere_give_a_mesh_of_the_asked_count() {
    let noisy = |p: &Vector| {
        let moved = p + Vector::repeat(1.6 * (noise(p, 0.0) - 0.5));
        if noise(p, 3.0) < 0.1 { (noise(p, 5.0) * 3.0) as u8 } else { dome(&moved) }
    };
    let labels = labelled(Matrix::identity(), noisy);
    let (mesh, info) = mesh(&labels, 1500);
    assert_eq!(mesh.tets().len(), 1500);
    assert!(info.quality.min_dihedral_deg > 10.0, "{:?}", info.quality);
    assert_eq!(euler(&mesh), 2);
}

#[test]
fn other_parts_gas_and_lung_are_told_apart() {
    let shape = |p: &Vector| {
        let ball = |x: f64, y: f64, z: f64, r: f64| (p - Vector::new(x, y, z)).norm() < r;
        if ball(-15.0, -17.0, 4.0, 5.0) {
            label::SOFT_TISSUE // an arm, say: 0.5 cm³ in front of the skin
        } else if ball(2.0, 0.0, 2.0, 4.0) || p.y > 12.5 {
            label::OUTSIDE // gas in the tissue; lung labelled as air behind a thin wall
        } else {
            dome(p)
        }
    };
    let labels = labelled(Matrix::identity(), shape);
    let (mesh, info) = mesh(&labels, 1500);
    assert_eq!(mesh.tets().len(), 1500);
    assert_eq!(info.dropped_components, 1);
    assert!((300.0..700.0).contains(&info.dropped_volume_mm3), "{}", info.dropped_volume_mm3);
    assert_eq!(euler(&mesh), 2, "the gas is filled");
    assert_eq!(info.warnings.len(), 2, "{:?}", info.warnings);
    for face in mesh.boundary().iter().filter(|f| f.tag == BoundaryTag::Skin) {
        let y = face.points.map(|p| mesh.points()[p as usize].y - CENTRE.y);
        assert!(y.iter().all(|&y| y < 4.0), "skin behind the wall: {y:?}");
    }
}

#[test]
fn the_piece_at_the_centre_can_be_asked_for() {
    // Two pieces apart: the smaller holds the centre.
    let shape = |p: &Vector| match p {
        p if p.y > 10.0 => label::CHEST_WALL,
        p if p.norm() < 9.0 || p.x > 12.0 => label::SOFT_TISSUE,
        _ => label::OUTSIDE,
    };
    let labels = labelled(Matrix::identity(), shape);
    let volume = |piece| {
        let params = Params { tetrahedra: 1500, piece, ..Params::default() };
        let (mesh, info) = mesh_with(&labels, &params).unwrap();
        assert_eq!(info.dropped_components, 1);
        mesh.total_volume()
    };
    let ball = 4.0 / 3.0 * std::f64::consts::PI * 9f64.powi(3);
    assert!((volume(Piece::Centre) / ball - 1.0).abs() < 0.05);
    assert!(volume(Piece::Largest) > 3.0 * ball);
    let empty = |p: &Vector| if p.norm() < 6.0 { label::OUTSIDE } else { shape(p) };
    let params = Params { piece: Piece::Centre, ..Params::default() };
    let found = mesh_with(&labelled(Matrix::identity(), empty), &params);
    assert!(matches!(found, Err(Error::NotAtCentre)), "{found:?}");
}

#[test]
fn an_enclosed_island_of_wall_is_an_inner_boundary() {
    let shape = |p: &Vector| {
        if (p - Vector::new(0.0, -3.0, 0.0)).norm() < 5.0 { label::CHEST_WALL } else { dome(p) }
    };
    let (mesh, _) = mesh(&labelled(Matrix::identity(), shape), 1500);
    assert_eq!((mesh.tets().len(), euler(&mesh)), (1500, 4));
}

#[test]
fn one_voxel_bridges_and_holes_leave_no_pinch() {
    let shape = |p: &Vector| {
        let thin = p.x.abs() < 0.8 && p.z.abs() < 0.9;
        let bridge = thin && p.y < -14.0;
        if bridge || (p.y < -21.0 && p.y > -26.0) { label::SOFT_TISSUE } else { dome(p) }
    };
    let (mesh, _) = mesh(&labelled(Matrix::identity(), shape), 1500);
    assert_eq!(mesh.tets().len(), 1500);
    euler(&mesh);
}

#[test]
fn what_cannot_be_meshed_is_said() {
    let labels = labelled(Matrix::identity(), dome);
    let params = Params { smoothing_mm: f64::NAN, ..Params::default() };
    assert!(matches!(mesh_with(&labels, &params), Err(Error::Setting { .. })));
    let mut strange = labels.clone();
    let at = strange.grid().offset([30, 30, 20]);
    strange.data_mut()[at] = 77;
    let error = mesh_with(&strange, &Params::default()).unwrap_err();
    assert!(matches!(error, Error::UnknownLabel { label: 77, voxel: [30, 30, 20] }), "{error}");
    let film = labelled(Matrix::identity(), |p| match p.y {
        y if y > 0.55 => label::CHEST_WALL,
        y if y > -0.55 => label::SOFT_TISSUE,
        _ => label::OUTSIDE,
    });
    let params = Params { min_thickness_mm: 2.5, ..Params::default() };
    let error = mesh_with(&film, &params).unwrap_err();
    assert!(matches!(error, Error::NothingToMesh { .. }), "{error}");
}

#[test]
fn the_user_can_stop_it_at_any_time() {
    let labels = labelled(Matrix::identity(), dome);
    let region = Region::new(Arc::new(labels.clone()), sphere()).unwrap();
    for stop_at in [0.0, 0.15, 0.25, 0.45, 0.7] {
        let sink = |share: f64| share < stop_at;
        let params = Params { tetrahedra: 1000, ..Params::default() };
        let result = tetrahedralise(&region, &params, Progress::new(&sink));
        assert!(matches!(result, Err(Error::Stopped(_))), "{stop_at}");
    }
}
