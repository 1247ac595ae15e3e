//! Regions at odd places, of odd sizes, and numbers too small for them.

use crate::tests::{Shape, dome, euler, labelled, sphere, wedge};
use crate::{Domain, Error, Info, Params, tetrahedralise};
use std::collections::BTreeMap;
use std::sync::Arc;
use supine_mesh::{BoundaryTag, TetMesh};
use supine_space::{Grid, Matrix, Point, Progress, Sphere, Vector};
use supine_volume::{LabelMap, Region, RegionError, Volume, label};

/// The sphere with another radius, moved by `shift` (mm).
fn elsewhere(shift: Vector, radius: f64) -> Sphere {
    Sphere::new(sphere().centre() + shift, radius).unwrap()
}

fn meshed(labels: &LabelMap, sphere: Sphere, tetrahedra: usize) -> (TetMesh, Info) {
    let region = Region::new(Arc::new(labels.clone()), sphere).unwrap();
    let params = Params { tetrahedra, ..Params::default() };
    let (mesh, info) = tetrahedralise(&region, &params, Progress::none()).unwrap();
    assert_eq!(mesh.tets().len(), tetrahedra, "{sphere:?}");
    assert!(info.quality.min_dihedral_deg > 20.0, "{sphere:?}: {:?}", info.quality);
    (mesh, info)
}

/// Lengths of the loops in which two tags meet, mm; where loops touch they count as one.
fn loops(mesh: &TetMesh) -> Vec<f64> {
    let mut tags: BTreeMap<[u32; 2], Vec<BoundaryTag>> = BTreeMap::new();
    for face in mesh.boundary() {
        let [a, b, c] = face.points;
        for [p, q] in [[a, b], [b, c], [c, a]] {
            tags.entry([p.min(q), p.max(q)]).or_default().push(face.tag);
        }
    }
    let rim: Vec<[u32; 2]> = tags.into_iter().filter(|(_, t)| t[0] != t[1]).map(|e| e.0).collect();
    let mut part: BTreeMap<u32, u32> = rim.iter().flatten().map(|&v| (v, v)).collect();
    for _ in 0..rim.len() {
        for [a, b] in &rim {
            let least = part[a].min(part[b]);
            part.extend([(*a, least), (*b, least)]);
        }
    }
    let mut lengths: BTreeMap<u32, f64> = BTreeMap::new();
    for [a, b] in &rim {
        let p = |v: u32| mesh.points()[v as usize];
        *lengths.entry(part[a]).or_default() += (p(*a) - p(*b)).norm();
    }
    lengths.into_values().collect()
}

/// Where the sphere grazes skin or chest wall, no rim is left that is shorter than two edges.
#[test]
fn a_sphere_that_grazes_a_surface_leaves_no_sliver_of_a_rim() {
    let labels = labelled(Matrix::identity(), dome);
    for beyond in [-1.0, -0.3, 0.0, 0.15, 0.4, 1.0, 2.5] {
        // The top of the skin lies at y = -15, the chest wall at 10 or so.
        let skin = elsewhere(Vector::zeros(), 15.0 + beyond);
        let wall = elsewhere(Vector::new(0.0, -4.0, 3.0), 14.0 + beyond);
        for grazing in [skin, wall] {
            if matches!(
                Region::new(Arc::new(labels.clone()), grazing),
                Err(RegionError::NoChestWall { .. })
            ) {
                continue;
            }
            let (mesh, info) = meshed(&labels, grazing, 1000);
            assert_eq!(euler(&mesh), 2, "{beyond}");
            let short = loops(&mesh).into_iter().find(|&l| l < 2.0 * info.edge_mm);
            assert!(short.is_none(), "{beyond}: {short:?} at edges of {}", info.edge_mm);
        }
    }
}

#[test]
fn small_and_large_regions_are_meshed() {
    let labels = labelled(Matrix::identity(), dome);
    let (small, info) = meshed(&labels, elsewhere(Vector::new(2.0, 8.0, 1.0), 5.0), 3000);
    assert_eq!(euler(&small), 2);
    assert!(
        info.warnings.iter().any(|w| w.to_string().contains("shorter than a voxel")),
        "{:?}",
        info.warnings
    );
    let grid = {
        let (size, s) = ([80; 3], Vector::repeat(4.0));
        Grid::new(size, s, Point::new(-158.0, -158.0, -158.0), Matrix::identity()).unwrap()
    };
    let large = Volume::from_fn(grid.clone(), |v| {
        let p = grid.centre(v).coords;
        let skin = 10.0 - 90.0 * (-(p.x * p.x + p.z * p.z) / 9000.0).exp();
        match p.y {
            y if y > 50.0 => label::CHEST_WALL,
            y if y > skin => label::SOFT_TISSUE,
            _ => label::OUTSIDE,
        }
    });
    let (mesh, _) = meshed(&large, Sphere::new(Point::origin(), 150.0).unwrap(), 5000);
    assert_eq!(euler(&mesh), 2);
}

/// Soft tissue cut off by the end of the volume is refused with what is missing; up to the end all
/// is well, though the smoothing finds nothing beyond.
#[test]
fn the_end_of_the_volume_is_respected() {
    let labels = labelled(Matrix::identity(), dome);
    let grid = labels.grid();
    let end = grid.centre([0, 0, grid.size()[2] - 1]).z - sphere().centre().z;
    let (inside, outside) = (end - 20.1, end - 15.0);
    let (mesh, _) = meshed(&labels, elsewhere(Vector::new(0.0, 0.0, inside), 20.0), 1000);
    assert_eq!(euler(&mesh), 2);
    let error =
        Region::new(Arc::new(labels.clone()), elsewhere(Vector::new(0.0, 0.0, outside), 20.0))
            .unwrap_err();
    let RegionError::OutsideVolume { missing, side, axis, .. } = error else {
        panic!("{error}");
    };
    assert!((missing - 5.0).abs() < 1e-9 && side == "upper" && axis == 'k', "{missing} {side}");
}

/// Lumps of chest wall in the soft tissue, each of which needs elements around it.
fn lumpy(p: &Vector) -> u8 {
    let lump = |n: usize| {
        let at = Vector::new((n % 3) as f64 - 1.0, -0.1, (n / 3) as f64 - 1.0) * 11.0;
        (p - at).norm() < 4.5
    };
    if (0..9).any(lump) { label::CHEST_WALL } else { dome(p) }
}

/// The number named is true: it works.
#[test]
fn the_smallest_number_that_works_is_named_and_works() {
    for (shape, asked) in [(dome as Shape, 0), (wedge, 199), (lumpy, 220)] {
        let labels = labelled(Matrix::identity(), shape);
        let region = Region::new(Arc::new(labels.clone()), sphere()).unwrap();
        let domain = Domain::new(&region, &Params::default(), Progress::none()).unwrap();
        let error = domain.mesh(asked, Progress::none()).map(|(_, info)| info).unwrap_err();
        let Error::TooFew { min: least, .. } = error else { panic!("{asked}: {error}") };
        assert!(error.to_string().contains(&format!("ask for {least} or more")), "{error}");
        let (mesh, info) = domain.mesh(least, Progress::none()).unwrap();
        assert_eq!(mesh.tets().len(), least);
        assert!(info.quality.min_dihedral_deg > 10.0, "{least}: {:?}", info.quality);
    }
}
