//! The worker, and what becomes of one that dies.
#![cfg(feature = "tetgen")]

use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};
use supine_mesh::{BoundaryFace, BoundaryTag, TetMesh};
use supine_space::{Point, Progress};
use supine_tetrahedralise_tetgen::{Error, Params, fill};

/// A box from the origin whose sides have a grid of `n` by `n` squares each; its lowest side is
/// chest wall, its highest skin.
fn surface(size: f64, n: usize) -> (Vec<Point>, Vec<BoundaryFace>) {
    let mut number = std::collections::BTreeMap::new();
    let mut faces = Vec::new();
    for (axis, side) in [0, 1, 2].into_iter().flat_map(|axis| [(axis, 0), (axis, n)]) {
        let tag = match (axis, side) {
            (2, 0) => BoundaryTag::ChestWall,
            (2, _) => BoundaryTag::Skin,
            _ => BoundaryTag::Cut,
        };
        let mut vertex = |u: usize, v: usize| {
            let mut at = [0; 3];
            (at[axis], at[(axis + 1) % 3], at[(axis + 2) % 3]) = (side, u, v);
            let next = number.len() as u32;
            *number.entry(at).or_insert(next)
        };
        for (u, v) in (0..n).flat_map(|u| (0..n).map(move |v| (u, v))) {
            let corners = [vertex(u, v), vertex(u + 1, v), vertex(u + 1, v + 1), vertex(u, v + 1)];
            for pick in [[0, 1, 2], [0, 2, 3]] {
                faces.push(BoundaryFace { points: pick.map(|c: usize| corners[c]), tag });
            }
        }
    }
    let mut points = vec![Point::origin(); number.len()];
    for (at, v) in number {
        points[v as usize] = Point::from(at.map(|c| size * c as f64 / n as f64));
    }
    (points, faces)
}

fn worker() -> Command {
    Command::new(env!("CARGO_BIN_EXE_tetgen-worker"))
}

fn filled(n: usize, params: &Params, worker: &mut Command) -> Result<TetMesh, Error> {
    let (points, faces) = surface(20.0, n);
    fill(&points, &faces, params, worker, Progress::none())
}

/// A worker that does what a line of shell says.
fn shell(line: &str) -> Command {
    let mut worker = Command::new("sh");
    worker.args(["-c", line]);
    worker
}

#[test]
fn a_box_is_filled_and_keeps_its_faces() {
    let params = Params { max_volume_mm3: 20.0, ..Params::default() };
    let mesh = filled(4, &params, &mut worker()).unwrap();
    assert!((mesh.total_volume() - 8000.0).abs() < 1e-6);
    assert_eq!(mesh.boundary().len(), 6 * 4 * 4 * 2, "the triangles are those given");
    assert!((mesh.area(BoundaryTag::ChestWall) - 400.0).abs() < 1e-9);
    assert!((mesh.area(BoundaryTag::Cut) - 1600.0).abs() < 1e-9);
    for face in mesh.boundary().iter().filter(|f| f.tag == BoundaryTag::Skin) {
        assert!(face.points.iter().all(|&v| (mesh.points()[v as usize].z - 20.0).abs() < 1e-12));
    }
    let finer = Params { max_volume_mm3: 5.0, ..Params::default() };
    assert!(filled(4, &finer, &mut worker()).unwrap().tets().len() > mesh.tets().len());
}

#[test]
fn the_same_mesh_each_time() {
    let [a, b] = [(); 2].map(|()| filled(3, &Params::default(), &mut worker()).unwrap());
    assert_eq!(a, b);
}

#[test]
fn an_abort_is_one_error_that_says_what_to_do() {
    for (line, how) in [
        ("kill -ABRT $$", "signal"),
        ("kill -SEGV $$", "signal"),
        ("cat > /dev/null; echo 'no way' >&2; exit 1", "no way"),
        ("cat > /dev/null; echo half an answer", "cut short"),
    ] {
        let error = filled(3, &Params::default(), &mut shell(line)).unwrap_err();
        let text = error.to_string();
        assert!(matches!(error, Error::Died { .. }), "{line}: {text}");
        assert!(text.contains(how) && text.contains("use the native mesher"), "{line}: {text}");
    }
    let none = filled(3, &Params::default(), &mut Command::new("no-such-program-at-all"));
    assert!(matches!(none, Err(Error::Start(_))));
}

/// Two boxes one of which pokes through the other's side.
#[test]
fn a_surface_that_crosses_itself_is_refused() {
    let (mut points, mut faces) = surface(20.0, 3);
    let first = points.len() as u32;
    let (more, again) = surface(20.0, 2);
    points.extend(more.iter().map(|p| p + supine_space::Vector::new(11.0, 7.3, 5.9)));
    faces.extend(again.iter().map(|f| BoundaryFace { points: f.points.map(|v| v + first), ..*f }));
    let made = fill(&points, &faces, &Params::default(), &mut worker(), Progress::none());
    let text = made.unwrap_err().to_string();
    assert!(text.contains("ended without a mesh"), "{text}");
}

#[test]
fn a_stop_ends_the_worker_at_once() {
    let looks = AtomicUsize::new(0);
    let stop = |_| looks.fetch_add(1, Ordering::Relaxed) < 5;
    let (points, faces) = surface(20.0, 3);
    let mut endless = shell("exec sleep 300");
    let made = fill(&points, &faces, &Params::default(), &mut endless, Progress::new(&stop));
    assert!(matches!(made, Err(Error::Stopped(_))));
    assert!(looks.load(Ordering::Relaxed) < 20, "it was not waited for");
}
