//! `supine mesh --skin --chest-wall`: closed surfaces from files to a mesh, and what is refused.
#![expect(
    clippy::disallowed_methods,
    clippy::unwrap_used,
    reason = "the tests write and look at files, and a panic is a failed test"
)]

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use supine_exchange::read_vtu;
use supine_mesh::{BoundaryTag, quality};
use supine_space::Point;

/// Low and high corner, mm, LPS: the patient's front is at -y.
const BODY: [[f64; 3]; 2] = [[-100.0, 0.0, -90.0], [100.0, 150.0, 90.0]];
const WALL: [[f64; 3]; 2] = [[-80.0, 28.0, -95.0], [80.0, 140.0, 95.0]];
const QUADS: [[usize; 4]; 6] =
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

/// A file of a box, in units of mm over `scale`; in RAS the coordinates of x and y change sign.
fn write_box(path: &Path, corners: [[f64; 3]; 2], head: &str, scale: f64) {
    let sign = if head.contains("RAS") { -1.0 } else { 1.0 };
    let corner = |n: usize| [0, 1, 2].map(|a| corners[n >> a & 1][a] * scale);
    let corner = |n: usize| [sign * corner(n)[0], sign * corner(n)[1], corner(n)[2]];
    let mut text = String::new();
    if path.extension().unwrap() == "obj" {
        writeln!(text, "# {head}").unwrap();
        (0..8).for_each(|n| {
            let [x, y, z] = corner(n);
            writeln!(text, "v {x} {y} {z}").unwrap();
        });
        for quad in QUADS {
            let [a, b, c, d] = quad.map(|n| n + 1);
            writeln!(text, "f {a} {b} {c} {d}").unwrap();
        }
    } else {
        writeln!(text, "solid {head}").unwrap();
        for [a, b, c, d] in QUADS {
            for triangle in [[a, b, c], [a, c, d]] {
                writeln!(text, "facet normal 0 0 0\nouter loop").unwrap();
                for [x, y, z] in triangle.map(corner) {
                    writeln!(text, "vertex {x} {y} {z}").unwrap();
                }
                writeln!(text, "endloop\nendfacet").unwrap();
            }
        }
        writeln!(text, "endsolid").unwrap();
    }
    std::fs::write(path, text).unwrap();
}

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    if folder.exists() {
        std::fs::remove_dir_all(&folder).unwrap();
    }
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// The program: the one that whoever runs the tests has put aside, or cargo's own.
fn supine() -> Command {
    let given = std::env::var_os("SUPINE");
    Command::new(given.unwrap_or_else(|| env!("CARGO_BIN_EXE_supine").into()))
}

fn mesh(skin: &Path, wall: &Path, out: &Path) -> Output {
    let mut supine = supine();
    supine.arg("mesh").arg("--skin").arg(skin).arg("--chest-wall").arg(wall).arg("--out").arg(out);
    supine.args(["--centre=5,12,-3", "--radius=45", "--tetrahedra=1100", "--no-progress"]);
    supine.output().unwrap()
}

#[test]
fn surfaces_from_files_are_meshed_in_their_frame() {
    let folder = folder("surfaces-meshed");
    let [body, wall, out] = ["body.stl", "wall.obj", "mesh.vtu"].map(|name| folder.join(name));
    write_box(&body, BODY, "3D Slicer output. SPACE=RAS", 1.0);
    write_box(&wall, WALL, "made by hand", 1.0);
    let said = mesh(&body, &wall, &out);
    let words = String::from_utf8_lossy(&said.stderr);
    assert!(said.status.success(), "{words}");
    assert!(words.contains("wall.obj does not say its frame: taken as LPS"), "{words}");
    assert!(!words.contains("body.stl"), "{words}");
    let (mesh, _) = read_vtu(&out).unwrap();
    assert_eq!(mesh.tets().len(), 1100);
    assert!(quality(&mesh).min_dihedral_deg >= 30.0, "{:?}", quality(&mesh));
    for face in mesh.boundary() {
        for p in face.points.map(|p| mesh.points()[p as usize]) {
            let level = match face.tag {
                BoundaryTag::Skin => p.y,
                BoundaryTag::ChestWall => p.y - 28.0,
                BoundaryTag::Cut => (p - Point::new(5.0, 12.0, -3.0)).norm() - 45.0,
            };
            assert!(level.abs() < 0.6, "{:?} at {p}: {level:.3} mm off", face.tag);
        }
    }
    assert!(BoundaryTag::ALL.iter().all(|&tag| mesh.area(tag) > 1000.0));
}

#[test]
fn surfaces_that_cannot_be_used_are_refused_by_name() {
    let folder = folder("surfaces-refused");
    let at = |name: &str| folder.join(name);
    let (good, wall, out) = (at("good.stl"), at("wall.stl"), at("mesh.vtu"));
    write_box(&good, BODY, "SPACE=LPS", 1.0);
    write_box(&wall, WALL, "SPACE=LPS", 1.0);
    let whole = std::fs::read_to_string(&good).unwrap();
    let facet = whole.find("facet normal").unwrap();
    let second = facet + 1 + whole[facet + 1..].find("facet normal").unwrap();
    std::fs::write(at("open.stl"), whole[..facet].to_owned() + &whole[second..]).unwrap();
    write_box(&at("metres.stl"), BODY, "SPACE=LPS", 1e-3);
    write_box(&at("turned.stl"), BODY.map(|[x, y, z]| [x, y + 40.0, z]), "SPACE=LPS", -1.0);
    for (name, words) in [
        ("open.stl", "open: 3 edges belong to one triangle only"),
        ("metres.stl", "in metres?"),
        ("turned.stl", "other frame (LPS, RAS)"),
        ("missing.stl", "cannot read"),
    ] {
        let said = mesh(&at(name), &wall, &out);
        let message = String::from_utf8_lossy(&said.stderr);
        assert_eq!(said.status.code(), Some(1), "{name}: {message}");
        assert!(message.contains(words), "{name}: {message}");
        assert!(!out.exists());
    }
    let alone = supine()
        .args(["mesh", "--skin=a.stl", "--centre=0,0,0", "--radius=9", "--tetrahedra=900"])
        .arg("--out=a.vtu")
        .output()
        .unwrap();
    assert_eq!(alone.status.code(), Some(2));
}
