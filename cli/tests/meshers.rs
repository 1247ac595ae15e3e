//! All meshers of this build through the same case; those it lacks are refused with what to do.
//!
//! `cargo test -p supine --features cgal,tetgen` tries all three; `cargo xtask test` does so where
//! the Debian packages are there.
#![expect(
    clippy::disallowed_methods,
    clippy::unwrap_used,
    reason = "the tests look at files, and a panic is a failed test"
)]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use supine_exchange::{read_vtu, write_labels};
use supine_mesh::{BoundaryTag, TetMesh, quality};
use supine_space::{Grid, Matrix, Point, Progress, Vector};
use supine_volume::{Volume, label};

const MESHERS: [(&str, bool); 3] =
    [("native", true), ("cgal", cfg!(feature = "cgal")), ("tetgen", cfg!(feature = "tetgen"))];

const TETRAHEDRA: usize = 1537;
const CENTRE: &str = "--centre=5,-60,12";

/// A folder of this test, empty. The tests with other meshers may run beside those without.
fn folder(name: &str) -> PathBuf {
    let meshers = MESHERS.iter().filter(|(_, built)| *built).count();
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-{meshers}"));
    if folder.exists() {
        std::fs::remove_dir_all(&folder).unwrap();
    }
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// A dome of soft tissue on a chest wall that bends, with the patient's front at -y.
fn labels(folder: &Path) -> PathBuf {
    let spacing = Vector::new(1.5, 1.5, 2.0);
    let origin = Point::new(5.0 - 60.0, -60.0 - 60.0, 12.0 - 60.0);
    let grid = Grid::new([81, 81, 61], spacing, origin, Matrix::identity()).unwrap();
    let labels = Volume::from_fn(grid.clone(), |v| {
        let p = grid.centre(v) - Point::new(5.0, -60.0, 12.0);
        let wall = 12.0 + 0.004 * (p.x * p.x + p.z * p.z);
        let skin = 2.0 - 24.0 * (-(p.x * p.x + p.z * p.z) / 700.0).exp();
        match p.y {
            y if y > wall => label::CHEST_WALL,
            y if y > skin => label::SOFT_TISSUE,
            _ => label::OUTSIDE,
        }
    });
    let path = folder.join("labels.nrrd");
    write_labels(&labels, &path, Progress::none()).unwrap();
    path
}

/// The program: the one that whoever runs the tests has put aside, or cargo's own.
fn supine() -> Command {
    let given = std::env::var_os("SUPINE");
    Command::new(given.unwrap_or_else(|| env!("CARGO_BIN_EXE_supine").into()))
}

fn mesh(mesher: &str, labels: &Path, out: &Path) -> Output {
    let mut supine = supine();
    supine.arg("mesh").arg("--labels").arg(labels).arg("--out").arg(out);
    supine.args([CENTRE, "--radius=42", "--mesher", mesher, "--quiet", "--json"]);
    supine.arg(format!("--tetrahedra={TETRAHEDRA}")).output().unwrap()
}

fn made(mesher: &str, labels: &Path, out: &Path) -> TetMesh {
    let said = mesh(mesher, labels, out);
    let words = String::from_utf8_lossy(&said.stderr);
    assert!(said.status.success(), "{mesher}: {}: {words}", said.status);
    let said = String::from_utf8_lossy(&said.stdout);
    assert!(said.contains(&format!("\"mesher\": \"{mesher}\"")), "{said}");
    read_vtu(out).unwrap().0
}

#[test]
fn every_mesher_of_this_build_makes_the_same_tissue() {
    let folder = folder("meshers-made");
    let labels = labels(&folder);
    let mut volume = None;
    for (mesher, _) in MESHERS.iter().filter(|(_, built)| *built) {
        let out = folder.join(format!("{mesher}.vtu"));
        let mesh = made(mesher, &labels, &out);
        assert_eq!(mesh.tets().len(), TETRAHEDRA, "{mesher}");
        let shape = quality(&mesh);
        assert!(shape.min_dihedral_deg > 20.0, "{mesher}: {} degrees", shape.min_dihedral_deg);
        for tag in BoundaryTag::ALL {
            assert!(mesh.area(tag) > 100.0, "{mesher}: {} mm² of {}", mesh.area(tag), tag.name());
        }
        let native = *volume.get_or_insert(mesh.total_volume());
        let off = mesh.total_volume() / native - 1.0;
        assert!(off.abs() < 0.005, "{mesher}: {:.2} % off the native mesh", 100.0 * off);
        let again = folder.join(format!("{mesher}-again.vtu"));
        made(mesher, &labels, &again);
        let same = std::fs::read(&out).unwrap() == std::fs::read(&again).unwrap();
        assert!(same, "{mesher}: another mesh the second time");
    }
}

#[test]
fn a_mesher_this_build_lacks_is_refused() {
    let folder = folder("meshers-refused");
    let labels = labels(&folder);
    for (mesher, _) in MESHERS.iter().filter(|(_, built)| !*built) {
        let out = folder.join("none.vtu");
        let said = mesh(mesher, &labels, &out);
        let words = String::from_utf8_lossy(&said.stderr);
        assert_eq!(said.status.code(), Some(2), "{mesher}: {words}");
        assert!(words.contains(&format!("--features {mesher}")), "{mesher}: {words}");
        assert!(!out.exists());
    }
}
