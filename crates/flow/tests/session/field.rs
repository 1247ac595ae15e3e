//! Where the scanner reconstructed nothing a mesh is cut, whatever tells of it, and what would come
//! from there is told.

use crate::support::full_size_patient;
use std::path::Path;
use supine_exchange::{write_ct, write_vtu};
use supine_flow::commands::warp::{OutputGrid, Warp, warp};
use supine_flow::{Request, RunFolder, Session, Spec, Unwatched, read_ct};
use supine_mesh::{BoundaryTag, Displacement, Edges, TetMesh};
use supine_space::{Grid, Point, Progress, Vector};
use supine_volume::{Ct, Field};

/// A circle about a place before the patient's middle cuts her flank and not her breast, mm.
const RADIUS_MM: f64 = 216.0;
/// Rows before the patient that nothing was measured of.
const ROWS: usize = 85;
/// A region at the flank.
const PLACE: &str = "tumour = { centre = [130.0, -65.0, -594.5], radius = 5.0 }\n\
                     region = { centre = [130.0, -45.0, -594.5], radius = 45.0 }\n";

/// The patient's CT in a file, with one value beyond a circle about the middle; the text of her
/// case.
fn cut(folder: &Path, fill: i16) -> (String, Field) {
    let case = full_size_patient(folder);
    let ct = read_ct(&folder.join("ct"), &Default::default(), Progress::none()).unwrap().ct;
    let [ni, nj, nk] = ct.grid().size();
    let origin = ct.grid().patient_from_index([0.0, -(ROWS as f64), 0.0]);
    let (spacing, direction) = (ct.grid().spacing(), *ct.grid().direction());
    let grid = Grid::new([ni, nj + ROWS, nk], spacing, origin, direction).unwrap();
    let middle = middle(&grid);
    // Air with noise, also where the patient's own series has one value.
    let air = |[i, j, k]: [usize; 3]| -990 - ((7 * i + 13 * j + 29 * k) % 31) as i16;
    let hu = |[i, j, k]: [usize; 3]| match j.checked_sub(ROWS) {
        _ if off(&middle, &grid.centre([i, j, k])) > RADIUS_MM => fill,
        Some(row) => ct.at([i, row, k]).max(air([i, j, k])),
        None => air([i, j, k]),
    };
    let path = folder.join("cut.nrrd");
    write_ct(&Ct::from_fn(grid.clone(), hu), &path, "", Progress::none()).unwrap();
    let read = read_ct(&path, &Default::default(), Progress::none()).unwrap();
    let of = |line: &&str| !["ct", "tumour", "region"].iter().any(|key| line.starts_with(key));
    let rest: Vec<&str> = case.lines().filter(of).collect();
    (format!("ct = \"cut.nrrd\"\n{PLACE}{}\n", rest.join("\n")), read.field())
}

fn middle(grid: &Grid) -> Point {
    grid.patient_from_index(grid.size().map(|n| 0.5 * (n - 1) as f64))
}

/// Distance within the slice, mm.
fn off(middle: &Point, p: &Point) -> f64 {
    (p.x - middle.x).hypot(p.y - middle.y)
}

/// Area of the faces of a kind whose middle lies within 3 mm of the circle, cm².
fn at_circle_cm2(mesh: &TetMesh, middle: &Point, tag: BoundaryTag) -> f64 {
    let area = |face: &supine_mesh::BoundaryFace| {
        let [a, b, c] = face.points.map(|p| mesh.points()[p as usize]);
        let at = Point::from((a.coords + b.coords + c.coords) / 3.0);
        let near = (off(middle, &at) - RADIUS_MM).abs() < 3.0 && face.tag == tag;
        if near { 0.5 * (b - a).cross(&(c - a)).norm() / 100.0 } else { 0.0 }
    };
    mesh.boundary().iter().map(area).sum()
}

fn session(case: &str, base: &Path) -> Session {
    Session::new(Spec::from_text(case, base).unwrap(), 2).unwrap()
}

#[test]
fn a_mesh_is_cut_where_the_field_ends_and_what_comes_from_beyond_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let (_, padded) = cut(dir.path(), -2048);
    let (case, field) = cut(dir.path(), -1024);
    assert!(field == padded && field.seen().contains(&false));
    let request = Request::default();
    let out = dir.path().join("out");
    let kept = |case: &str| {
        let folder = RunFolder::open(&out).unwrap();
        session(case, dir.path()).with_folder(folder).unwrap().mesh(&request).unwrap()
    };
    kept(&case);
    // Another mesh of what the folder keeps, for which no CT is read, is that of a session that
    // kept nothing.
    let finer = case.replace("tetrahedra = 500", "tetrahedra = 600");
    let cold = session(&finer, dir.path());
    let (mesh, ct) = (cold.mesh(&request).unwrap(), cold.ct(&request).unwrap());
    assert_eq!(kept(&finer).boundary(), mesh.boundary());
    let middle = middle(ct.grid());
    let [is_cut, is_skin] =
        [BoundaryTag::Cut, BoundaryTag::Skin].map(|tag| at_circle_cm2(&mesh, &middle, tag));
    assert!(is_cut > 5.0 && is_skin < 0.3 * is_cut, "{is_cut} {is_skin} cm²");
    let told = beyond_cm3(dir.path(), &mesh, -4.0);
    // Obliquely to the circle, before which the mesh ends by up to a pixel.
    assert!((0.2..1.0).contains(&(told / (0.4 * is_cut))), "{told} cm³ of {is_cut} cm²");
    assert_eq!(beyond_cm3(dir.path(), &mesh, 0.0), 0.0);
}

/// What `supine warp` tells of a mesh that moves along x as a whole, its end at the circle taken
/// for skin, cm³.
fn beyond_cm3(folder: &Path, mesh: &TetMesh, shift: f64) -> f64 {
    let mesh = mesh.clone().tagged(|_, _| BoundaryTag::Skin);
    let moved = vec![Vector::new(shift, 0.0, 0.0); mesh.points().len()];
    let moved = Displacement::new(&mesh, &Edges::new(&mesh), moved).unwrap();
    let file = folder.join("moved.vtu");
    write_vtu(&mesh, Some(&moved), &file).unwrap();
    let told = |grid: OutputGrid| {
        let given = Warp {
            spec: Spec::from_text("ct = \"cut.nrrd\"\n", folder).unwrap(),
            mesh: file.clone(),
            grid,
            fields: None,
            registration: None,
            out: folder.join("warped.nrrd"),
            start: None,
            overwrite: true,
        };
        let warnings = warp(&given, &Unwatched).unwrap().warnings;
        let beyond = warnings.iter().find(|w| w.code == "tissue-beyond-field");
        beyond.map_or(0.0, |warning| warning.values["volume_cm3"])
    };
    let (own, other) = (
        told(OutputGrid::default()),
        told(OutputGrid { around_mm: Some(5.0), ..OutputGrid::default() }),
    );
    assert_eq!(own, other);
    own
}
