//! A piece of a cylinder in every format and unit; files that are no scans.

use super::*;
use crate::Error;
use proptest::prelude::*;
use supine_mesh::NormalSource;
use supine_space::Vector;

const AROUND: usize = 40;
const ALONG: usize = 30;

/// The front of a torso, lengths in mm times `scale`: points, normals, triangles.
fn front(scale: f64) -> (Vec<Point>, Vec<Vector>, Vec<[u32; 3]>) {
    let (mut points, mut normals, mut triangles) = (vec![], vec![], vec![]);
    for n in 0..AROUND * ALONG {
        let (i, j) = (n % AROUND, n / AROUND);
        let (sin, cos) = (std::f64::consts::PI * (0.1 + 0.8 * i as f64 / AROUND as f64)).sin_cos();
        let z = 12.0 * j as f64 - 900.0;
        points.push(Point::new(160.0 * cos + 30.0, 160.0 * sin, z) * scale);
        normals.push(Vector::new(cos, sin, 0.0));
        if i + 1 < AROUND && j + 1 < ALONG {
            let [a, b, c, d] = [n, n + 1, n + 1 + AROUND, n + AROUND].map(|p| p as u32);
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    (points, normals, triangles)
}

/// A PLY; with normals, with triangles, in doubles.
fn ply(format: &str, scale: f64, [with_normals, faces, double]: [bool; 3]) -> Vec<u8> {
    let (points, normals, triangles) = front(scale);
    let real = if double { "double" } else { "float" };
    let mut text = format!("ply\nformat {format} 1.0\ncomment SPACE=RAS\ncomment SPACE=LPS\n");
    text += &format!("element vertex {}\nproperty uchar red\n", points.len());
    let names =
        if with_normals { &["x", "y", "z", "nx", "ny", "nz"][..] } else { &["x", "y", "z"] };
    names.iter().for_each(|name| text += &format!("property {real} {name}\n"));
    text += "property float quality\n";
    if faces {
        text += &format!("element face {}\n", triangles.len());
        text += "property list uchar int vertex_indices\n";
    }
    let mut bytes = (text + "end_header\n").into_bytes();
    let big = format.contains("big");
    let ascii = format == "ascii";
    let real = |bytes: &mut Vec<u8>, value: f64| match (ascii, double, big) {
        (true, ..) => bytes.extend(format!("{value} ").into_bytes()),
        (_, true, true) => bytes.extend(value.to_be_bytes()),
        (_, true, false) => bytes.extend(value.to_le_bytes()),
        (_, false, true) => bytes.extend((value as f32).to_be_bytes()),
        (_, false, false) => bytes.extend((value as f32).to_le_bytes()),
    };
    for (p, n) in points.iter().zip(&normals) {
        bytes.extend(if ascii { &b"200 "[..] } else { &[200] });
        p.iter().for_each(|c| real(&mut bytes, *c));
        n.iter().filter(|_| with_normals).for_each(|c| real(&mut bytes, *c));
        match (ascii, big) {
            (true, _) => bytes.extend(b"0.5\n"),
            (_, true) => bytes.extend(0.5f32.to_be_bytes()),
            (_, false) => bytes.extend(0.5f32.to_le_bytes()),
        }
    }
    for t in triangles.iter().filter(|_| faces) {
        match (ascii, big) {
            (true, _) => bytes.extend(format!("3 {} {} {}\n", t[0], t[1], t[2]).into_bytes()),
            (_, true) => {
                bytes.extend([3].into_iter().chain(t.iter().flat_map(|c| c.to_be_bytes())))
            }
            (_, false) => {
                bytes.extend([3].into_iter().chain(t.iter().flat_map(|c| c.to_le_bytes())))
            }
        }
    }
    bytes
}

/// An OBJ with colours; normals by the corners of faces, or one for each vertex.
fn obj(scale: f64, by_faces: bool) -> Vec<u8> {
    let (points, normals, triangles) = front(scale);
    let mut text = String::new();
    points.iter().for_each(|p| text += &format!("v {} {} {} 0.5 0.25 1\n", p.x, p.y, p.z));
    // Backwards, so that their numbers are not those of the vertices.
    let listed: Vec<&Vector> =
        if by_faces { normals.iter().rev().collect() } else { normals.iter().collect() };
    listed.iter().for_each(|n| text += &format!("vn {} {} {}\n", n.x, n.y, n.z));
    if by_faces {
        let count = points.len() as u32;
        let corner = |p: u32| format!("{}//{}", p + 1, count - p);
        for [a, b, c] in triangles.iter().map(|t| t.map(corner)) {
            text += &format!("f {a} {b} {c}\n");
        }
    }
    text.into_bytes()
}

fn stl(scale: f64, text: bool) -> Vec<u8> {
    let (points, _, triangles) = front(scale);
    let mut bytes = if text { b"solid a\n".to_vec() } else { vec![b' '; 80] };
    if !text {
        bytes.extend((triangles.len() as u32).to_le_bytes());
    }
    for corners in triangles.iter().map(|t| t.map(|p| points[p as usize])) {
        if text {
            let corner =
                |p: Point| format!("vertex {} {} {}\n", p.x as f32, p.y as f32, p.z as f32);
            bytes.extend(
                format!("outer loop\n{}endloop\n", corners.map(corner).concat()).into_bytes(),
            );
        } else {
            let numbers = [[0.0; 3].into()].into_iter().chain(corners);
            bytes.extend(
                numbers
                    .flat_map(|p| p.coords.map(|c| c as f32).data.0[0])
                    .flat_map(f32::to_le_bytes),
            );
            bytes.extend([0; 2]);
        }
    }
    bytes
}

/// Every format: its name, its bytes, where the normals come from, whether it has triangles.
fn all(scale: f64) -> Vec<(&'static str, Vec<u8>, NormalSource, bool)> {
    use NormalSource::{Given, Neighbours, Triangles};
    let (little, big) = ("binary_little_endian", "binary_big_endian");
    vec![
        ("a.ply", ply("ascii", scale, [true, false, false]), Given, false),
        ("b.ply", ply("ascii", scale, [false, true, false]), Triangles, true),
        ("c.ply", ply(little, scale, [true, false, false]), Given, false),
        ("d.PLY", ply(little, scale, [false, false, true]), Neighbours, false),
        ("e.ply", ply(big, scale, [true, true, true]), Given, true),
        ("f.ply", ply(big, scale, [false, true, false]), Triangles, true),
        ("g.obj", obj(scale, true), Given, true),
        ("h.obj", obj(scale, false), Given, false),
        ("i.stl", stl(scale, true), Triangles, true),
        ("j.stl", stl(scale, false), Triangles, true),
    ]
}

fn read(name: &str, bytes: &[u8], unit: Option<LengthUnit>) -> Result<(Scan, ScanFile), Error> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    read_scan(&path, unit)
}

#[test]
fn every_format_gives_the_same_scan_in_mm() {
    use LengthUnit::{Centimetre, Inch, Metre, Millimetre};
    let (points, normals, triangles) = front(1.0);
    for (unit, stated) in [
        (Millimetre, None),
        (Metre, None),
        (Metre, Some(Metre)),
        (Centimetre, Some(Centimetre)),
        (Inch, Some(Inch)),
    ] {
        for (name, bytes, source, with_triangles) in all(1.0 / unit.mm()) {
            let (scan, file) = read(name, &bytes, stated).unwrap();
            assert_eq!((file.unit, file.detected), (unit, stated.is_none()), "{name}");
            assert_eq!(file.info.normals, source, "{name}");
            assert!(file.info.warnings.is_empty(), "{name} {:?}", file.info.warnings);
            assert!((450.0..480.0).contains(&file.size_mm), "{}", file.size_mm);
            assert_eq!(scan.points().len(), points.len(), "{name}");
            let expected = if with_triangles { triangles.len() } else { 0 };
            assert_eq!(scan.triangles().len(), expected, "{name}");
            // STL has no order of points.
            for (p, n) in scan.points().iter().zip(scan.normals()) {
                let true_normal = Vector::new(p.x - 30.0, p.y, 0.0).normalize();
                assert!(n.dot(&true_normal) > 0.99, "{name} {p} {n}");
            }
            if !name.ends_with("stl") {
                assert!(scan.points().iter().zip(&points).all(|(a, b)| (a - b).norm() < 1e-3));
            }
            if source == NormalSource::Given {
                assert!(scan.normals().iter().zip(&normals).all(|(a, b)| (a - b).norm() < 1e-5));
            }
        }
    }
}

#[test]
fn a_size_that_does_not_tell_the_unit_is_refused() {
    for unit in [LengthUnit::Centimetre, LengthUnit::Inch] {
        let bytes = obj(1.0 / unit.mm(), true);
        let refused = read("a.obj", &bytes, None).unwrap_err().to_string();
        assert!(refused.contains("say whether its unit is mm, cm, m or inch"), "{refused}");
        let (_, file) = read("a.obj", &bytes, Some(LengthUnit::Millimetre)).unwrap();
        assert_eq!(file.info.warnings[0].code(), "scan-size");
    }
    let bytes = obj(0.1, true);
    let refused = read("a.obj", &bytes, None).unwrap_err().to_string();
    assert!(refused.contains("measures 47.") && refused.contains("in centimetres"), "{refused}");
    for scale in [1e-9, 0.004, 5.0, 1e30] {
        assert!(matches!(
            read("a.obj", &obj(scale, false), None),
            Err(Error::Input { problem: Problem::Unit { .. }, .. })
        ));
    }
}

#[test]
fn holes_and_far_points_do_not_change_the_unit() {
    let mut bytes = obj(1.0, false);
    bytes.retain(|b| *b != b'#');
    let mut text = String::from_utf8(bytes).unwrap();
    text += &"v nan nan nan\nvn 0 0 0\nv 0 0 0\nvn 0 0 0\n".repeat(400);
    text += "v 9e9 0 0\nvn 1 0 0\n";
    let (scan, file) = read("a.obj", text.as_bytes(), None).unwrap();
    assert_eq!((file.unit, scan.points().len()), (LengthUnit::Millimetre, AROUND * ALONG));
    assert_eq!((file.info.not_finite, file.info.duplicates, file.info.islands), (400, 399, 2));
}

#[test]
fn what_is_no_scan_is_refused_with_one_error() {
    let refused = |name: &str, bytes: &[u8]| read(name, bytes, None).unwrap_err().to_string();
    assert!(refused("a.obj", b"v 1 2 3\n").contains("too few points"));
    assert!(refused("a.obj", b"").contains("too few points"));
    assert!(refused("a.xyz", b"").contains(".stl, .ply or .obj"));
    let whole = ply("binary_little_endian", 1.0, [true, false, false]);
    assert!(refused("a.ply", &whole[..whole.len() - 1]).contains("end early"));
    let text = String::from_utf8(ply("ascii", 1.0, [false, true, false])).unwrap();
    assert!(
        refused("a.ply", text.replacen("\n3 0 ", "\n3 1200 ", 1).as_bytes())
            .contains("names point 1200")
    );
    assert!(refused("a.ply", text.replacen(" 0.5\n", " half\n", 1).as_bytes()).contains("`half`"));
    let strips = text.replacen("element face", "element tristrips", 1);
    assert!(refused("a.ply", strips.as_bytes()).contains("single triangles"));
    let no_x = text.replacen("property float x", "property float a", 1);
    assert!(refused("a.ply", no_x.as_bytes()).contains("too few points"));
    let missing = read_scan(Path::new("no such.ply"), None).unwrap_err();
    assert!(matches!(missing, Error::Read { .. }));
}

#[test]
fn the_scans_of_the_fixture_are_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/patient/scans");
    for (name, points) in [("supine", 17272), ("sitting", 16372), ("intraop", 15747)] {
        let path = folder.join(name).with_extension("ply");
        let (scan, file) = read_scan(&path, None).unwrap();
        assert_eq!((file.unit, file.info.normals), (LengthUnit::Millimetre, NormalSource::Given));
        assert_eq!((scan.points().len(), file.info.points), (points, points), "{name}");
        assert!(!file.info.turned && file.info.warnings.is_empty(), "{name} {:?}", file.info);
        // Without its normals those from the neighbours are on the same side, and nearly the same.
        let (bare, _) = Scan::new(scan.points().to_vec(), None, vec![]).unwrap();
        let both = scan.normals().iter().zip(bare.normals());
        let near = both.filter(|(a, b)| a.dot(b) > 20f64.to_radians().cos()).count();
        assert!(near * 100 > 95 * points, "{name}: {near}");
    }
}

proptest! {
    #[test]
    fn damage_never_panics(at in 0.0..1.0f64, with in any::<u8>(), cut in 0.0..1.3f64, which in 0..10usize) {
        let (name, mut bytes, ..) = all(1.0).swap_remove(which);
        let place = (at * bytes.len() as f64) as usize;
        bytes[place] = with;
        bytes.truncate((cut * bytes.len() as f64) as usize);
        if let Ok(parts) = parse(Path::new(name), &bytes) {
            let read = scan(parts, Some(LengthUnit::Millimetre));
            prop_assert!(read.map_or(true, |(scan, _)| scan.points().len() >= 500));
        }
    }
}
