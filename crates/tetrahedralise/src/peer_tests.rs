//! What other meshers are given, and what becomes of their meshes.

use crate::{Domain, Params};
use nalgebra::Rotation3;
use std::collections::BTreeMap;
use std::sync::Arc;
use supine_mesh::{BoundaryTag, TetMesh, quality};
use supine_space::{Grid, Matrix, Point, Progress, Sphere, Vector};
use supine_volume::{LabelMap, Region, Volume, label};

const CENTRE: Point = Point::new(-20.0, 35.0, 8.0);
const RADIUS: f64 = 28.0;

/// A flat layer between chest wall (below, from 8.4 mm) and air (above, to -7.2 mm), in the grid's
/// own axes.
fn layer(direction: Matrix) -> LabelMap {
    let (size, spacing) = ([66, 66, 54], Vector::new(1.2, 1.2, 1.5));
    let middle = Vector::from_fn(|a, _| 0.5 * (size[a] - 1) as f64 * spacing[a]);
    let grid = Grid::new(size, spacing, CENTRE - direction * middle, direction).unwrap();
    Volume::from_fn(grid.clone(), |v| match direction.tr_mul(&(grid.centre(v) - CENTRE)).y {
        y if y > 8.5 => label::CHEST_WALL,
        y if y > -7.0 => label::SOFT_TISSUE,
        _ => label::OUTSIDE,
    })
}

/// A grid that is askew and left-handed.
fn askew() -> Matrix {
    let turned = *Rotation3::from_euler_angles(0.3, -0.2, 0.5).matrix();
    turned * Matrix::from_diagonal(&Vector::new(1.0, 1.0, -1.0))
}

fn with_domain(direction: Matrix, check: impl Fn(&Domain)) {
    let labels = layer(direction);
    let region =
        Region::new(Arc::new(labels.clone()), Sphere::new(CENTRE, RADIUS).unwrap()).unwrap();
    check(&Domain::new(&region, &Params::default(), Progress::none()).unwrap());
}

#[test]
fn a_place_lies_beyond_the_surface_it_is_nearest_behind() {
    for direction in [Matrix::identity(), askew()] {
        with_domain(direction, |domain| {
            for (x, y, z, beyond) in [
                (0.0, 0.0, 0.0, None),
                (5.0, 9.0, 3.0, Some(BoundaryTag::ChestWall)),
                (5.0, 7.8, 3.0, None),
                (5.0, -7.6, 3.0, Some(BoundaryTag::Skin)),
                (28.5, 0.0, 0.0, Some(BoundaryTag::Cut)),
            ] {
                let p = CENTRE + direction * Vector::new(x, y, z);
                assert_eq!(domain.beyond(&p), beyond, "{x} {y} {z}");
            }
        });
    }
}

#[test]
fn a_shell_is_closed_points_outwards_and_its_rims_lie_on_both_surfaces() {
    for direction in [Matrix::identity(), askew()] {
        with_domain(direction, |domain| {
            let shell = domain.shell(2000, Progress::none()).unwrap();
            let mut sides: BTreeMap<[u32; 2], i32> = BTreeMap::new();
            let mut volume = 0.0;
            for face in &shell.faces {
                let [a, b, c] = face.points.map(|v| shell.points[v as usize] - CENTRE);
                volume += a.dot(&b.cross(&c)) / 6.0;
                let [i, j, k] = face.points;
                for [p, q] in [[i, j], [j, k], [k, i]] {
                    *sides.entry([p.min(q), p.max(q)]).or_default() += if p < q { 1 } else { -1 };
                }
            }
            assert!(sides.values().all(|&sum| sum == 0), "each edge has a face on either side");
            assert!((volume / domain.volume_mm3() - 1.0).abs() < 0.03, "{volume}");
            // Two circles, where wall and skin meet the sphere.
            assert_eq!(shell.rims.len(), 2);
            for rim in &shell.rims {
                assert!(rim.len() > 100 && rim.first() == rim.last());
                let height = direction.tr_mul(&(rim[0] - CENTRE)).y;
                let plane = if height > 0.0 { 8.4 } else { -7.2 };
                for p in rim {
                    let off = direction.tr_mul(&(p - CENTRE));
                    assert!((off.norm() - RADIUS).abs() < 0.01, "{off}");
                    assert!((off.y - plane).abs() < 0.1, "{off}");
                }
            }
        });
    }
}

/// A mesh with the interior points moved about, and so of poor shape.
fn spoilt(mesh: &TetMesh) -> TetMesh {
    let mut edge = vec![false; mesh.points().len()];
    mesh.boundary().iter().flat_map(|f| f.points).for_each(|v| edge[v as usize] = true);
    let mut points = mesh.points().to_vec();
    for v in (0..points.len()).filter(|&v| !edge[v]) {
        let from = points[v];
        for share in [1.6, 0.8, 0.4] {
            points[v] = from + Vector::from_fn(|a, _| share * ((v * 7 + a * 3) as f64).sin());
            let (tets, faces) = (mesh.tets().to_vec(), mesh.boundary().to_vec());
            if TetMesh::new(points.clone(), tets, faces).is_ok() {
                break;
            }
            points[v] = from;
        }
    }
    TetMesh::new(points, mesh.tets().to_vec(), mesh.boundary().to_vec()).unwrap()
}

#[test]
fn a_poor_mesh_made_elsewhere_is_improved_and_reduced_to_the_count() {
    for direction in [Matrix::identity(), askew()] {
        with_domain(direction, |domain| {
            let given = spoilt(&domain.mesh(1900, Progress::none()).unwrap().0);
            let before = quality(&given).min_dihedral_deg;
            assert!(before < 15.0, "the test spoils it: {before}");
            for tetrahedra in [1750, 1900, 2003] {
                let (made, info) = domain.improve(&given, tetrahedra, Progress::none()).unwrap();
                assert_eq!((made.tets().len(), info.asked), (tetrahedra, tetrahedra));
                assert!(info.quality.min_dihedral_deg > 25.0, "{:?}", info.quality);
                assert_eq!(info.deviation.len(), 3, "all three tags");
                assert!(
                    info.deviation.iter().all(|d| d.distance.max_mm < 0.6),
                    "{:?}",
                    info.deviation
                );
            }
        });
    }
}
