//! One tetrahedron in every format; damaged files.

use super::*;
use proptest::prelude::*;

const CORNERS: [[f32; 3]; 4] =
    [[-1.5, 0.0, 0.0], [3.0, 0.25, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 4.0]];
const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

fn stl_text(head: &str) -> Vec<u8> {
    let mut text = format!("solid {head}\n");
    for face in FACES {
        text += "facet normal 0 0 0\n outer loop\n";
        for [x, y, z] in face.map(|c| CORNERS[c]) {
            text += &format!("  vertex {x} {y} {z:e}\n");
        }
        text += " endloop\nendfacet\n";
    }
    (text + "endsolid\n").into_bytes()
}

fn stl_binary(head: &str) -> Vec<u8> {
    let mut bytes = head.as_bytes().to_vec();
    bytes.resize(80, b' ');
    bytes.extend(4u32.to_le_bytes());
    for face in FACES {
        let numbers = [[0.0; 3]].into_iter().chain(face.map(|c| CORNERS[c])).flatten();
        bytes.extend(numbers.flat_map(f32::to_le_bytes));
        bytes.extend([0; 2]);
    }
    bytes
}

fn ply(format: &str, head: &str) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat {format} 1.0\ncomment {head}\nelement vertex 4\nproperty float x\n\
         property uchar red\nproperty float y\nproperty float z\nelement edge 0\nelement face 4\n\
         property list uchar int vertex_indices\nend_header\n"
    )
    .into_bytes();
    let swap = |mut number: [u8; 4]| {
        if format.contains("big") {
            number.reverse();
        }
        number
    };
    for [x, y, z] in CORNERS {
        if format == "ascii" {
            bytes.extend(format!("{x} 7 {y} {z}\n").into_bytes());
        } else {
            bytes.extend(swap(x.to_le_bytes()));
            bytes.push(7);
            bytes.extend([y, z].into_iter().flat_map(|c| swap(c.to_le_bytes())));
        }
    }
    for face in FACES {
        if format == "ascii" {
            bytes.extend(format!("3 {} {} {}\n", face[0], face[1], face[2]).into_bytes());
        } else {
            bytes.push(3);
            bytes.extend(face.into_iter().flat_map(|c| swap((c as u32).to_le_bytes())));
        }
    }
    bytes
}

fn obj(head: &str) -> Vec<u8> {
    let mut text = format!("# {head}\nmtllib a.mtl\n");
    for [x, y, z] in CORNERS {
        text += &format!("v {x} {y} {z}\nvn 0 0 1\n");
    }
    let [a, b, c] = FACES[0].map(|c| c + 1);
    text += &format!("f {a}/1/1 {b}//2 {c} # one\n");
    for face in &FACES[1..] {
        let [a, b, c] = face.map(|c| c as i32 - 4);
        text += &format!("f {a} {b} {c}\n");
    }
    text.into_bytes()
}

/// Every format, with a text in its comment.
fn all(head: &str) -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("text.stl", stl_text(head)),
        ("capitals.stl", stl_text(head).to_ascii_uppercase()),
        ("marked.stl", ["\u{feff}".as_bytes(), &stl_text(head)].concat()),
        ("binary.stl", stl_binary(head)),
        ("longer.stl", [stl_binary(&format!("solid {head}")), vec![0; 2]].concat()),
        ("text.ply", ply("ascii", head)),
        ("little.ply", ply("binary_little_endian", head)),
        ("big.ply", ply("binary_big_endian", head)),
        ("a.OBJ", obj(head)),
    ]
}

fn read(name: &str, bytes: &[u8]) -> Result<(TriSurface, Option<SurfaceFrame>), Error> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    read_surface(&path, SurfaceFrame::Lps)
}

#[test]
fn every_format_gives_the_same_surface_in_lps() {
    for (name, bytes) in all("made by hand") {
        let (surface, said) = read(name, &bytes).unwrap();
        assert_eq!((surface.points().len(), surface.triangles().len()), (4, 4), "{name}");
        assert_eq!(surface.bounds(), ([-1.5, 0.0, 0.0].into(), [3.0, 3.0, 4.0].into()), "{name}");
        assert!(said.is_none() && !surface.was_inside_out(), "{name}");
    }
    for (name, bytes) in all("3D Slicer output. SPACE=RAS") {
        let (surface, said) = read(name, &bytes).unwrap();
        assert_eq!(said, Some(SurfaceFrame::Ras), "{name}");
        assert_eq!(surface.bounds(), ([-3.0, -3.0, 0.0].into(), [1.5, 0.0, 4.0].into()), "{name}");
        assert!(!surface.was_inside_out(), "half a turn keeps the winding");
    }
    let quads = obj::parse(b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n").unwrap();
    assert_eq!(quads.triangles, [[0, 1, 2], [0, 2, 3]]);
    let broken = obj::parse(b"v 0 0 0\nv 1 0 \\\n0\nv 1 1 0\nf 1 2 \\\n\\\n3\n").unwrap();
    let within = obj::parse(b"v 0 0 0\nv 1 0 12\\\n5\n").unwrap_err();
    assert!(matches!(within, Problem::Line { line: 2, .. }), "{within}");
    assert_eq!((broken.points.len(), broken.triangles), (3, vec![[0, 1, 2]]));
}

#[test]
fn impossible_files_are_refused_and_cost_nothing() {
    let huge = "ply\nformat binary_little_endian 1.0\nelement vertex 1000000000000\n\
                property double x\nproperty double y\nproperty double z\nelement none 1000000000000\n\
                end_header\n1234567890";
    let refused = |name: &str, bytes: &[u8]| read(name, bytes).unwrap_err().to_string();
    assert!(refused("a.ply", huge.as_bytes()).contains("end early"));
    let mut short = stl_binary("x");
    short[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(refused("a.stl", &short).contains("214748364750 bytes"));
    assert!(refused("a.obj", b"v 0 0 0\nf 1 2 3\n").contains("line 2: `2` is not one of 1"));
    assert!(refused("a.obj", b"v 0 0 zero\n").contains("line 1: `zero`"));
    assert!(refused("a.stl", b"solid\nvertex 0 0 0\nendloop\n").contains("line 3"));
    assert!(refused("a.ply", &ply("ascii", "SPACE=RAS SPACE=LPS")).contains("both"));
    assert!(refused("a.vtp", b"").contains(".stl, .ply or .obj"));
    let (name, mut open) = (".stl", stl_binary("x"));
    open.truncate(84 + 150);
    open[80] = 3;
    assert!(refused(name, &open).contains("open: 3 edges"));
}

proptest! {
    #[test]
    fn damage_never_panics(at in 0.0..1.0f64, with in any::<u8>(), cut in 0.0..1.0f64) {
        for (_, bytes) in all("x") {
            let mut spoiled = bytes.clone();
            spoiled[(at * bytes.len() as f64) as usize] = with;
            spoiled.truncate((cut * 1.3 * bytes.len() as f64) as usize);
            for parse in [stl::parse, ply::parse, obj::parse] {
                let parts = parse(&spoiled);
                if let Ok(Ok(surface)) = parts.map(|p| TriSurface::new(p.points, p.triangles)) {
                    prop_assert!(surface.triangles().len() >= 2);
                }
            }
        }
    }

    #[test]
    fn noise_never_panics(noise in prop::collection::vec(any::<u8>(), 0..200)) {
        for head in [&b""[..], b"solid\nvertex ", b"ply\nformat ascii 1.0\nelement face 9\n", b"f "] {
            let bytes = [head, &noise].concat();
            for parse in [stl::parse, ply::parse, obj::parse] {
                prop_assert!(parse(&bytes).map_or(true, |p| p.points.len() + p.triangles.len() <= bytes.len()));
            }
        }
    }
}
