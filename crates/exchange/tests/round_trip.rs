//! What is written is read back equal; nothing is left behind on failure.

#![expect(clippy::disallowed_methods, reason = "looks at the files that were written")]
#![expect(clippy::unwrap_used, reason = "a test may fail")]

use nalgebra::Rotation3;
use proptest::prelude::*;
use std::path::Path;
use supine_exchange::*;
use supine_mesh::{BoundaryFace, BoundaryTag, Displacement, Edges, Order, TET_FACES, TetMesh};
use supine_space::{Failure, Grid, Point, Progress, Vector};
use supine_volume::{Ct, LabelMap, SeedKind, Volume};

fn grid(size: [usize; 3], angles: [f64; 3], spacing: [f64; 3], left_handed: bool) -> Grid {
    let mut d = Rotation3::from_euler_angles(angles[0], angles[1], angles[2]).into_inner();
    if left_handed {
        d.column_mut(2).neg_mut();
    }
    Grid::new(size, spacing.into(), Point::new(-250.3, -175.7, 31.4), d).unwrap()
}

fn expect_same(a: &Grid, b: &Grid, tolerance: f64) {
    assert_eq!(a.size(), b.size());
    let last = a.size().map(|n| n - 1);
    for voxel in [[0; 3], [last[0], 0, 0], [0, last[1], 0], [0, 0, last[2]]] {
        let off = (a.centre(voxel) - b.centre(voxel)).norm();
        assert!(off < tolerance, "{off} mm at {voxel:?}");
    }
}

fn ct(grid: Grid) -> Ct {
    Volume::from_fn(grid, |[i, j, k]| (i * 7 + j * 131 + k * 1009) as i16 - 1024)
}

fn labels(grid: Grid) -> LabelMap {
    Volume::from_fn(grid, |[i, j, k]| (i + 3 * j + 5 * k) as u8 % 10)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn volumes_keep_values_and_places(
        size in [1usize..6, 1usize..6, 1usize..6],
        angles in [-3.1f64..3.1, -1.5f64..1.5, -3.1f64..3.1],
        spacing in [0.3f64..3.0, 0.3f64..3.0, 0.3f64..3.0],
        left_handed in any::<bool>(),
    ) {
        let folder = tempfile::tempdir().unwrap();
        let grid = grid(size, angles, spacing, left_handed);
        let (ct, labels) = (ct(grid.clone()), labels(grid));
        // NIfTI holds f32: 1.5e-5 mm at 250 mm.
        for (name, tolerance) in [("a.nrrd", 1e-12), ("a.nii", 5e-5), ("a.nii.gz", 5e-5), ("a.mha", 1e-12)] {
            let path = folder.path().join(name);
            let note = "DERIVED from series 1.2.3\nby an example";
            write_ct(&ct, &path, note, Progress::none()).unwrap();
            let back = read_ct(&path, Progress::none()).unwrap().ct;
            prop_assert_eq!(back.data(), ct.data());
            expect_same(back.grid(), ct.grid(), tolerance);
        }
        for (name, tolerance) in [("l.seg.nrrd", 1e-12), ("l.nrrd", 1e-12), ("l.nii.gz", 5e-5), ("l.mha", 1e-12)] {
            let path = folder.path().join(name);
            write_labels(&labels, &path, Progress::none()).unwrap();
            let back = read_labels(&path, Progress::none()).unwrap();
            prop_assert_eq!(back.data(), labels.data());
            expect_same(back.grid(), labels.grid(), tolerance);
        }
    }
}

/// What a CT is known by if this software deformed it comes back from every format, short of the
/// end in NIfTI.
#[test]
fn the_note_of_a_ct_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let ct = ct(grid([3, 4, 5], [0.0; 3], [1.0; 3], false));
    let note = "DERIVED: simulated deformation by supine 0.1.0; not acquired anatomy. Breast left, operating table AP 7";
    for name in ["a.nrrd", "a.nii", "a.nii.gz", "a.mha"] {
        let path = folder.path().join(name);
        for (note, told) in [(note, true), ("", false)] {
            write_ct(&ct, &path, note, Progress::none()).unwrap();
            let CtFile { ct: back, note: found, .. } = read_ct(&path, Progress::none()).unwrap();
            assert_eq!(back.data(), ct.data());
            assert!(found.contains(note), "{name}: {found}");
            assert_eq!(found.is_empty(), !told, "{name}: {found}");
        }
    }
    // Programs that rewrite NIfTI drop extensions; `descrip` alone still says whose it is.
    let path = folder.path().join("a.nii");
    write_ct(&ct, &path, note, Progress::none()).unwrap();
    let mut bytes = std::fs::read(&path).unwrap();
    let extension = usize::from(bytes[352]) + 256 * usize::from(bytes[353]);
    bytes.drain(352..352 + extension);
    bytes[348] = 0;
    bytes[108..112].copy_from_slice(&352f32.to_le_bytes());
    std::fs::write(&path, bytes).unwrap();
    let found = read_ct(&path, Progress::none()).unwrap().note;
    assert_eq!(found, note[..79]);
}

/// sform and qform of a written file give the same map, the one that was meant.
#[test]
fn both_forms_of_nifti_agree() {
    let folder = tempfile::tempdir().unwrap();
    for (n, left_handed) in [(0, false), (1, true), (2, false), (3, true)] {
        let angles = [0.3 + f64::from(n), -0.2, 3.0 - f64::from(n)];
        let written = ct(grid([3, 4, 5], angles, [0.7, 0.8, 2.5], left_handed));
        let path = folder.path().join("a.nii");
        write_ct_nifti(&written, &path, "", Progress::none()).unwrap();
        let mut bytes = std::fs::read(&path).unwrap();
        bytes[254..256].fill(0); // sform_code
        std::fs::write(&path, &bytes).unwrap();
        expect_same(read_ct(&path, Progress::none()).unwrap().ct.grid(), written.grid(), 5e-5);
    }
}

#[test]
fn decimal_spacings_survive_single_precision() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.nii");
    let written = ct(grid([2, 2, 2], [0.0; 3], [0.7, 0.9765625, 1.25], false));
    write_ct_nifti(&written, &path, "", Progress::none()).unwrap();
    assert_eq!(read_ct(&path, Progress::none()).unwrap().ct.grid(), written.grid());
}

/// A cube of 2 mm made of six tetrahedra, tags in turn.
fn cube() -> TetMesh {
    let corner = |n: u8| Point::new(f64::from(n & 1), f64::from(n >> 1 & 1), f64::from(n >> 2 & 1));
    let points: Vec<Point> = (0..8).map(|n| corner(n) * 2.0).collect();
    let tets =
        vec![[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]];
    let sorted = |mut f: [u32; 3]| {
        f.sort_unstable();
        f
    };
    let all: Vec<[u32; 3]> =
        tets.iter().flat_map(|t: &[u32; 4]| TET_FACES.map(|f| f.map(|c| t[c]))).collect();
    let once = |f: &&[u32; 3]| all.iter().filter(|g| sorted(**g) == sorted(**f)).count() == 1;
    let boundary = all.iter().filter(once).enumerate();
    let boundary =
        boundary.map(|(n, &points)| BoundaryFace { points, tag: BoundaryTag::ALL[n % 3] });
    let boundary = boundary.collect();
    TetMesh::new(points, tets, boundary).unwrap()
}

#[test]
fn meshes_come_back_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.vtu");
    let mesh = cube();
    let edges = Edges::new(&mesh);
    let vectors = |n: usize| -> Vec<Vector> {
        (0..n).map(|n| Vector::new(n as f64 / 3.0, -0.1, 1e-9 * n as f64)).collect()
    };
    let (points, all) = (mesh.points().len(), mesh.points().len() + edges.ends().len());
    for displacement in [None, Some(vectors(points)), Some(vectors(all))] {
        let displacement = displacement.map(|v| Displacement::new(&mesh, &edges, v).unwrap());
        write_vtu(&mesh, displacement.as_ref(), &path).unwrap();
        assert_eq!(read_vtu(&path).unwrap(), (mesh.clone(), displacement.clone()));
        // In Gmsh's files the faces stand by their tags.
        let msh = folder.path().join("a.msh");
        write_mesh(&mesh, displacement.as_ref(), &msh).unwrap();
        let (read, carried) = read_mesh(&msh).unwrap();
        let mut faces = mesh.boundary().to_vec();
        faces.sort_by_key(|f| f.tag);
        assert_eq!((read.points(), read.tets()), (mesh.points(), mesh.tets()));
        assert_eq!((read.boundary(), carried), (&faces[..], displacement));
    }
}

#[test]
fn problems_hold_what_is_fixed_and_the_load() {
    let folder = tempfile::tempdir().unwrap();
    let (feb, inp) = (folder.path().join("a.feb"), folder.path().join("a.inp"));
    let statics = Statics {
        young_kpa: 1.5,
        poisson: 0.25,
        density_kg_m3: 1000.0,
        acceleration_m_s2: Vector::new(0.0, 0.0, -9.81),
        order: Order::Quadratic,
        cut_held: true,
    };
    let text = |path: &Path, statics: &Statics| {
        write_problem(&cube(), statics, &[], path).unwrap();
        std::fs::read_to_string(path).unwrap()
    };
    let written = text(&feb, &statics);
    assert_eq!(written, text(&feb, &statics));
    assert!(written.contains("<density>1e-6</density>"), "kg/mm³");
    assert!(written.contains(",9810.0</force>"), "FEBio's sign");
    assert!(written.contains("node_set=\"cut\"") && written.contains("<tri6 id=\"1\">"));
    let written = text(&inp, &statics);
    // C10 = E / 4 (1 + nu), D1 = 6 (1 - 2 nu) / E.
    assert!(written.contains("\n3.0000000000e-1, 2.0000000000e0\n"), "{written}");
    assert!(written.contains("\ncut, 1, 3\n") && written.contains("TYPE=C3D10"));
    let rest = Statics {
        acceleration_m_s2: Vector::zeros(),
        order: Order::Linear,
        cut_held: false,
        ..statics
    };
    let written = text(&inp, &rest);
    assert!(written.contains("GRAV, 0.00000000, 0.0"), "a direction without a load: {written}");
    assert!(!written.contains("\ncut, 1, 3\n") && written.contains("TYPE=C3D4,"));
    let refused = write_problem(&cube(), &rest, &[], &folder.path().join("a.bdf")).unwrap_err();
    assert!(refused.to_string().contains(".inp"), "{refused}");
}

#[test]
fn points_and_seeds_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let point =
        |name: &str, x| NamedPoint { name: name.into(), position: Point::new(x, -0.1, 1e3) };
    let points = [
        point("chest_wall-1", 1.0 / 3.0),
        point("Soft tissue, \"upper\"", -2.0),
        point("exclude", 5.0),
    ];
    for name in ["p.csv", "p.mrk.json"] {
        let path = folder.path().join(name);
        write_points(&points, &path).unwrap();
        assert_eq!(read_points(&path).unwrap(), points);
        let seeds = read_seeds(&path, Progress::none()).unwrap();
        assert_eq!(seeds.chest_wall, [points[0].position]);
        assert_eq!(seeds.soft_tissue, [points[1].position]);
        assert_eq!(seeds.exclude, [points[2].position]);
    }
    let path = folder.path().join("soft_tissue.mrk.json");
    write_points(&[point("F-1", 1.0)], &path).unwrap();
    assert_eq!(
        read_seeds(&path, Progress::none()).unwrap().soft_tissue.len(),
        1,
        "the file's name decides"
    );
    let path = folder.path().join("list.mrk.json");
    write_points(&[point("F-1", 1.0)], &path).unwrap();
    let message = read_seeds(&path, Progress::none()).unwrap_err().to_string();
    assert!(
        message.contains("point 1 (`F-1`): neither its name nor that of its list"),
        "{message}"
    );
}

#[test]
fn failures_name_the_file_and_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let written = ct(grid([2, 2, 2], [0.0; 3], [1.0; 3], false));
    let missing = folder.path().join("no/such/folder.nrrd");
    let error = write_ct_nrrd(&written, &missing, "", Progress::none()).unwrap_err();
    assert_eq!(error.kind(), Failure::Output);
    assert!(error.to_string().contains("folder.nrrd"), "{error}");
    let error = read_ct(&missing, Progress::none()).unwrap_err();
    assert_eq!(error.kind(), Failure::Input);
    assert!(error.to_string().contains("folder.nrrd"), "{error}");

    let refused = [
        write_ct_nifti(&written, &folder.path().join("a.img"), "", Progress::none()),
        write_labels(&written.map(|_| 1), &folder.path().join("a.mhd"), Progress::none()),
        write_ct(&written, &folder.path().join("a.mhd"), "", Progress::none()),
        write_labels(&written.map(|_| 99), &folder.path().join("a.seg.nrrd"), Progress::none()),
        write_points(&[], &folder.path().join("a.txt")),
        write_vtu(&cube(), None, &folder.path().join("a.vtk")),
        write_scalar(&written.map(|_| 1.0), &folder.path().join("a.raw"), Progress::none()),
        // A folder stands where the file should go.
        write_ct_nrrd(&written, folder.path(), "", Progress::none()),
    ];
    for result in refused {
        assert_eq!(result.unwrap_err().kind(), Failure::Output);
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);

    let other = folder.path().join("a.nrrd");
    std::fs::write(&other, "no volume").unwrap();
    let error = read_ct(&other, Progress::none()).unwrap_err().to_string();
    assert!(error.contains("format is not recognised") && error.contains("a.nrrd"), "{error}");
}

#[test]
fn fields_are_vectors_with_their_type() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("f.nrrd");
    let grid = grid([2, 3, 4], [0.1, 0.2, 0.3], [1.0; 3], false);
    let field = Volume::from_fn(grid.clone(), |[i, j, k]| [i as f32, j as f32, k as f32]);
    write_field(&field, &path, FieldKind::Modeling, Progress::none()).unwrap();
    let text = String::from_utf8_lossy(&std::fs::read(&path).unwrap()).into_owned();
    for line in [
        "type: float",
        "dimension: 4",
        "sizes: 3 2 3 4",
        "kinds: vector domain domain domain",
        "space: left-posterior-superior",
        "displacement field type:=modeling",
    ] {
        assert!(text.contains(&format!("\n{line}\n")), "{line}");
    }
    let error = read_ct(&path, Progress::none()).unwrap_err().to_string();
    assert!(error.contains("3 values per voxel, a CT has one"), "{error}");
}

#[test]
fn a_transform_holds_the_vectors_and_the_grid_as_itk_orders_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("f.mat");
    let grid = grid([2, 3, 4], [0.1, 0.2, 0.3], [1.0, 1.5, 2.5], true);
    let field = Volume::from_fn(grid.clone(), |[i, j, k]| [i as f32, j as f32 + 0.1, -(k as f32)]);
    write_transform(&field, &path, Progress::none()).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    // What ITK's own writer begins with, but for the type: 10 is single precision.
    let head =
        b"\x0a\0\0\0\x48\0\0\0\x01\0\0\0\0\0\0\0\x26\0\0\0DisplacementFieldTransform_double_3_3\0";
    let (first, rest) = bytes.split_at(head.len());
    assert_eq!(first, head);
    let (vectors, rest) = rest.split_at(4 * 72);
    let read = vectors.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b));
    assert!(read.eq(field.data().iter().flatten().copied()));
    let head = b"\0\0\0\0\x12\0\0\0\x01\0\0\0\0\0\0\0\x06\0\0\0fixed\0";
    let (second, rest) = rest.split_at(head.len());
    assert_eq!((second, rest.len()), (&head[..], 8 * 18));
    let fixed: Vec<f64> = rest.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
    assert_eq!(fixed[..9], [2.0, 3.0, 4.0, -250.3, -175.7, 31.4, 1.0, 1.5, 2.5]);
    let rows = grid.direction().transpose();
    assert_eq!(fixed[9..], rows.as_slice()[..]);
    let refused = write_transform(&field, &folder.path().join("f.h5"), Progress::none());
    assert_eq!(refused.unwrap_err().kind(), Failure::Output);
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let written = labels(grid([5, 4, 3], [0.1, 0.2, 0.3], [1.0; 3], true));
    for name in ["a.seg.nrrd", "a.nii.gz", "a.mha"] {
        let bytes = |path: &Path| {
            write_labels(&written, path, Progress::none()).unwrap();
            std::fs::read(path).unwrap()
        };
        let again = bytes(&folder.path().join(name));
        assert!(bytes(&folder.path().join(name)) == again);
    }
}

#[test]
fn painted_seeds_are_known_by_the_names_of_segments_files_and_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let labels = LabelMap::from_fn(grid([6, 5, 4], [0.1; 3], [1.0; 3], false), |[i, j, _]| {
        [0, 1, 2][(i + j) % 3]
    });
    let kinds = |map: &Volume<Option<SeedKind>>| -> Vec<Option<SeedKind>> { map.data().to_vec() };
    let both: Vec<Option<SeedKind>> = (labels.data().iter())
        .map(|l| [None, Some(SeedKind::SoftTissue), Some(SeedKind::ChestWall)][usize::from(*l)])
        .collect();
    for name in ["paint.seg.nrrd", "paint.nrrd", "paint.nii.gz", "paint.mha"] {
        write_labels(&labels, &folder.path().join(name), Progress::none()).unwrap();
        let seeds = read_seeds(&folder.path().join(name), Progress::none()).unwrap();
        assert_eq!(kinds(&seeds.painted[0]), both, "{name}");
    }
    let cropped = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/slicer_cropped.seg.nrrd");
    let seeds = read_seeds(Path::new(cropped), Progress::none()).unwrap();
    assert_eq!(seeds.painted[0].grid().size(), [3, 5, 4], "on its own grid");
    let masks = folder.path().join("masks");
    std::fs::create_dir(&masks).unwrap();
    let rib = labels.map(|l| u8::from(*l == 2));
    write_labels(&rib, &masks.join("rib_left_4.nii.gz"), Progress::none()).unwrap();
    write_labels(&labels, &masks.join("adrenal_gland_left.nii.gz"), Progress::none()).unwrap();
    let seeds = read_seeds(&masks, Progress::none()).unwrap();
    let told = |kind| seeds.painted[0].data().iter().filter(|k| **k == Some(kind)).count();
    assert_eq!(told(SeedKind::ChestWall), rib.data().iter().filter(|l| **l == 1).count());
    assert_eq!(told(SeedKind::SoftTissue), 0);
    let other = labels.map(|l| l * 40);
    write_labels(&other, &folder.path().join("paint.nrrd"), Progress::none()).unwrap();
    let message =
        read_seeds(&folder.path().join("paint.nrrd"), Progress::none()).unwrap_err().to_string();
    assert!(message.contains("label 40 is no kind of seed"), "{message}");
}

#[test]
fn masks_of_a_folder_may_be_empty_and_say_nothing_where_they_contradict() {
    let folder = tempfile::tempdir().unwrap();
    let on = |name: &str, first: usize, end: usize| {
        let grid = grid([40, 5, 4], [0.1; 3], [1.0; 3], false);
        let mask = LabelMap::from_fn(grid, |[i, ..]| u8::from((first..end).contains(&i)));
        write_labels(&mask, &folder.path().join(name), Progress::none()).unwrap();
    };
    on("rib_left_12.nii.gz", 0, 0);
    let message = read_seeds(folder.path(), Progress::none()).unwrap_err().to_string();
    assert!(message.contains("its masks are empty"), "{message}");
    on("rib_left_4.nii.gz", 0, 3);
    on("pectoralis_minor.nii.gz", 4, 10);
    on("serratus_anterior.nii.gz", 10, 16);
    on("breast.nii.gz", 14, 40);
    on("spleen.nii.gz", 0, 40);
    std::fs::write(folder.path().join("statistics.json"), "{}").unwrap();
    let seeds = read_seeds(folder.path(), Progress::none()).unwrap();
    assert_eq!(seeds.painted.len(), 1);
    let at = |i| seeds.painted[0].at([i, 2, 2]);
    let (soft, wall) = (Some(SeedKind::SoftTissue), Some(SeedKind::ChestWall));
    // Bone to its edge; the muscles as one, and the breast, without theirs.
    assert_eq!([0, 2, 3].map(at), [wall, wall, None]);
    assert_eq!([6, 7, 10, 12, 13].map(at), [None, wall, wall, wall, None]);
    assert_eq!([16, 17, 39].map(at), [None, soft, soft]);
}

#[test]
fn a_stop_ends_reading_and_writing_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let written = labels(grid([64, 64, 40], [0.1; 3], [1.0; 3], false));
    let stop = |_: f64| false;
    for name in ["a.seg.nrrd", "a.nrrd", "a.nii.gz", "a.mha"] {
        let path = folder.path().join(name);
        let error = write_labels(&written, &path, Progress::new(&stop)).unwrap_err();
        assert!(matches!(error, Error::Stopped(_)), "{error}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "{name}");
    }
    let path = folder.path().join("a.nrrd");
    write_labels(&written, &path, Progress::none()).unwrap();
    let error = read_labels(&path, Progress::new(&stop)).unwrap_err();
    assert!(matches!(error, Error::Stopped(_)), "{error}");
    assert_eq!(error.kind(), Failure::Stopped);
}

#[test]
fn values_with_decimals_are_rounded_to_hu_and_told() {
    let folder = tempfile::tempdir().unwrap();
    let grid = grid([3, 4, 5], [0.0; 3], [1.0; 3], false);
    let value = |n: usize| -1023.63 + 41.5 * n as f32;
    let volume = Volume::from_fn(grid.clone(), |v| value(grid.offset(v)));
    for name in ["a.nrrd", "a.nii.gz", "a.mha"] {
        let path = folder.path().join(name);
        write_scalar(&volume, &path, Progress::none()).unwrap();
        let CtFile { ct, warnings, .. } = read_ct(&path, Progress::none()).unwrap();
        let wanted: Vec<i16> = (0..60).map(|n| value(n).round_ties_even() as i16).collect();
        assert_eq!(ct.data(), wanted);
        assert_eq!(warnings.iter().map(|w| w.code()).collect::<Vec<_>>(), ["values-rounded"]);
        // What was scaled to 0..1 is no CT.
        let scaled = volume.map(|hu| (hu + 1024.0) / 4000.0);
        write_scalar(&scaled, &path, Progress::none()).unwrap();
        let error = read_ct(&path, Progress::none()).unwrap_err().to_string();
        assert!(error.contains("they are no HU"), "{error}");
        let beyond = volume.map(|hu| hu * 1e4);
        write_scalar(&beyond, &path, Progress::none()).unwrap();
        let error = read_ct(&path, Progress::none()).unwrap_err().to_string();
        assert!(error.contains("expected HU from -32768 to 32767"), "{error}");
    }
    let whole = volume.map(|hu| hu.round());
    write_scalar(&whole, &folder.path().join("b.nrrd"), Progress::none()).unwrap();
    assert!(read_ct(&folder.path().join("b.nrrd"), Progress::none()).unwrap().warnings.is_empty());
}
