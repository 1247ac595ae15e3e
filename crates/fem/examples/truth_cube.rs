//! Predicted against measured displacements in the truth cube, a silicone cube with beads that a
//! plate compresses in a CT (Kerdok et al., Medical Image Analysis 7:283-291, 2003):
//! `truth_cube BEADS [KEY=VALUE ...]`.
//!
//! BEADS has a line for each bead: x y z (mm) uncompressed, then at each of the three levels. Lines
//! that begin with # are comments. The frame is that of the CT; gravity points to +z.
//!
//! | key | value | unless given |
//! |---|---|---|
//! | `cells` | cubes along an edge, six quadratic tetrahedra each | 8 |
//! | `law`, `stiffening` | as in case files | neo-hookean, 0.5 |
//! | `young` | kPa; alters forces alone | 15 |
//! | `poisson` | | 0.49 |
//! | `plate` | `tied`, or `sliding` without friction | tied |
//! | `travel` | of the plate: `nominal`, or `fitted` to the beads next to it | nominal |
//! | `weight` | `none`, or `own`: the uncompressed cube bears its weight, too | none |
//! | `out` | file for a line per level and bead: level, place, u predicted, u measured | |
//!
//! Beads to which the plate is fitted measure nothing: the line `not at plate` leaves them out. The
//! line `inner` has the beads farther than 15 mm from all faces.

#![expect(clippy::print_stdout, reason = "a program for the shell")]
#![expect(clippy::disallowed_methods, reason = "it reads what was measured")]

use nalgebra::UnitQuaternion;
use std::collections::BTreeMap;
use std::error::Error;
use std::fmt::Write;
use std::sync::Arc;
use supine_fem::{
    Applicator, Body, Contact, Insertion, Law, Load, Params, RestState, RigidBody, Tissue,
};
use supine_mesh::{BoundaryFace, BoundaryTag, Edges, Located, Locator, TET_FACES, TetMesh};
use supine_space::{Point, Pose, Progress, Vector};

const SIDE_MM: f64 = 80.0;
/// Where x, y and z of the cube begin. The plate lies on its face of lowest z, the opposite one is
/// glued to the base.
const FIRST_MM: [f64; 3] = [-40.0, -37.0, -57.0];
/// How far the plate moves, as is told: 5, 12.5 and 18.25 % of the side.
const TRAVEL_MM: [f64; 3] = [4.0, 10.0, 14.6];
/// Layers of beads lie 10 mm apart, the first and last about as far from the faces.
const LAYER_MM: f64 = 15.0;
/// Newton's relative residual.
const TOLERANCE: f64 = 1e-8;
/// Times that the pose of the plate is corrected by the beads next to it.
const FITS: usize = 6;

/// The plate, as the half-space beyond the face that it presses.
struct Plate;

impl RigidBody for Plate {
    fn distance(&self, place: &Point) -> f64 {
        place.z - FIRST_MM[2]
    }

    fn centre(&self) -> Point {
        let [x, y, z] = FIRST_MM;
        Point::new(x + SIDE_MM / 2.0, y + SIDE_MM / 2.0, z)
    }

    fn size_mm(&self) -> f64 {
        SIDE_MM / 2.0
    }
}

/// A bead, and how it moves to each level.
struct Bead {
    place: Point,
    moved: [Vector; 3],
}

impl Bead {
    fn read(line: &str) -> Result<Self, Box<dyn Error>> {
        let numbers = line.split_whitespace().map(str::parse).collect::<Result<Vec<f64>, _>>()?;
        let [first, levels @ ..] = numbers.as_chunks::<3>().0 else { return Err("no bead".into()) };
        let place = Point::from(*first);
        let levels: [[f64; 3]; 3] = levels.try_into()?;
        Ok(Self { place, moved: levels.map(|at| Point::from(at) - place) })
    }

    /// Distance from the plate's face, and the least from any face, mm.
    fn depths(&self) -> (f64, f64) {
        let from_first = self.place - Point::from(FIRST_MM);
        let least = from_first.iter().map(|d| d.min(SIDE_MM - d)).fold(f64::INFINITY, f64::min);
        (from_first.z, least)
    }
}

/// The cube of `cells`³ smaller ones of six tetrahedra each. Neighbours mirror each other, so that
/// no direction is favoured.
fn cube(cells: usize) -> Result<TetMesh, Box<dyn Error>> {
    const PATHS: [[usize; 3]; 6] =
        [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
    let each = cells + 1;
    let grid = |n: usize, per_side: usize| {
        [n % per_side, n / per_side % per_side, n / (per_side * per_side)]
    };
    let at = |[x, y, z]: [usize; 3]| ((z * each + y) * each + x) as u32;
    let side = SIDE_MM / cells as f64;
    let place = |n| Point::from(FIRST_MM) + Vector::from(grid(n, each).map(|k| k as f64 * side));
    let points: Vec<Point> = (0..each.pow(3)).map(place).collect();
    let mut tets = Vec::new();
    for (cell, path) in (0..cells.pow(3)).flat_map(|n| PATHS.map(|path| (grid(n, cells), path))) {
        let mut corner = cell.map(|k| k + k % 2);
        let mut tet = [at(corner); 4];
        for (k, axis) in path.into_iter().enumerate() {
            corner[axis] = 2 * cell[axis] + 1 - corner[axis];
            tet[k + 1] = at(corner);
        }
        let [a, b, c, d] = tet.map(|p| points[p as usize]);
        if (b - a).dot(&(c - a).cross(&(d - a))) < 0.0 {
            tet.swap(2, 3);
        }
        tets.push(tet);
    }
    let faces = tets.iter().flat_map(|tet| TET_FACES.map(|face| face.map(|c| tet[c])));
    let outer = |face: &[u32; 3]| {
        let corners = face.map(|p| grid(p as usize, each));
        let on = |k: usize, end: usize| corners.iter().all(|c| c[k] == end);
        (0..3).any(|k| on(k, 0) || on(k, cells))
    };
    let base = |face: &[u32; 3]| face.iter().all(|&p| grid(p as usize, each)[2] == cells);
    let tag = |f: &[u32; 3]| if base(f) { BoundaryTag::ChestWall } else { BoundaryTag::Skin };
    let boundary =
        faces.filter(outer).map(|points| BoundaryFace { points, tag: tag(&points) }).collect();
    Ok(TetMesh::new(points, tets, boundary)?)
}

/// The cube under the plate, and where the beads lie in it.
struct Pressed<'a> {
    plate: Applicator,
    edges: Edges,
    beads: &'a [Bead],
    located: Vec<Located>,
}

impl Pressed<'_> {
    /// The displacements of the beads with the plate at `pose`.
    fn moved(&mut self, pose: &Pose) -> Result<Vec<Vector>, Box<dyn Error>> {
        self.plate.settle(pose, TOLERANCE, Progress::none())?;
        let deformation = self.plate.deformation()?;
        let at = |l: &Located| {
            deformation.displacement().at(deformation.mesh(), &self.edges, l.tet, l.weights)
        };
        Ok(self.located.iter().map(at).collect())
    }

    /// The pose of the plate in which the layer of beads next to it moves as it does at `level`: on
    /// the mean along z; and if tissue is tied to it, along x and y, and in how z changes along
    /// these.
    fn fitted(&mut self, level: usize, tied: bool) -> Result<Pose, Box<dyn Error>> {
        let (mut shift, mut tilt) = (Vector::z() * TRAVEL_MM[level], Vector::zeros());
        for _ in 0..FITS {
            let moved = self.moved(&pose(shift, tilt))?;
            let layer = self.beads.iter().zip(moved).filter(|(bead, _)| bead.depths().0 < LAYER_MM);
            let off: Vec<(Vector, Vector)> = layer
                .map(|(bead, moved)| (bead.place - Plate.centre(), bead.moved[level] - moved))
                .collect();
            let share = 1.0 / off.len() as f64;
            let middle = off.iter().map(|(place, _)| place).sum::<Vector>() * share;
            let mean = off.iter().map(|(_, off)| off).sum::<Vector>() * share;
            shift.z += mean.z;
            if tied {
                (shift.x, shift.y) = (shift.x + mean.x, shift.y + mean.y);
                let slope = |k: usize| {
                    let along = |place: &Vector| place[k] - middle[k];
                    off.iter().map(|(p, off)| along(p) * off.z).sum::<f64>()
                        / off.iter().map(|(p, _)| along(p).powi(2)).sum::<f64>()
                };
                tilt += Vector::new(slope(1), -slope(0), 0.0);
            }
        }
        Ok(pose(shift, tilt))
    }
}

/// The plate moved, after it turned about its middle.
fn pose(shift: Vector, turn: Vector) -> Pose {
    let turn = UnitQuaternion::from_scaled_axis(turn);
    Pose::translation(shift.x, shift.y, shift.z) * Pose::rotation_wrt_point(turn, Plate.centre())
}

/// Mean, root mean square, 95 % quantile and largest length.
fn spread(off: &[Vector]) -> [f64; 4] {
    let mut lengths: Vec<f64> = off.iter().map(Vector::norm).collect();
    lengths.sort_by(f64::total_cmp);
    let n = lengths.len() as f64;
    let mean = lengths.iter().sum::<f64>() / n;
    let square = lengths.iter().map(|l| l * l).sum::<f64>() / n;
    let rank = (0.95 * n).ceil() as usize - 1;
    [mean, square.sqrt(), lengths[rank], lengths[lengths.len() - 1]]
}

/// A line of the table.
fn tell(name: &str, off: &[Vector]) {
    let share = 1.0 / off.len() as f64;
    let mean = off.iter().sum::<Vector>() * share;
    let centred: Vec<Vector> = off.iter().map(|v| v - mean).collect();
    let squares = off.iter().map(|v| v.component_mul(v)).sum::<Vector>() * share;
    let [x, y, z] = squares.map(f64::sqrt).into();
    let ([whole, rms, p95, max], [_, apart, ..]) = (spread(off), spread(&centred));
    println!(
        "  {name:12} {:4} | {whole:5.2} {rms:5.2} {p95:5.2} {max:5.2} | {x:5.2} {y:5.2} {z:5.2} \
         | {apart:5.2} after ({:5.2}, {:5.2}, {:5.2})",
        off.len(),
        mean.x,
        mean.y,
        mean.z,
    );
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let path = args.next().ok_or("usage: truth_cube BEADS [KEY=VALUE ...]")?;
    let pair = |arg: String| arg.split_once('=').map(|(k, v)| (k.to_owned(), v.to_owned()));
    let mut keys: BTreeMap<String, String> =
        args.map(pair).collect::<Option<_>>().ok_or("KEY=VALUE is asked for")?;
    let mut key = |name: &str, usual: &str| keys.remove(name).unwrap_or_else(|| usual.to_owned());
    let (law, cells) = (key("law", "neo-hookean"), key("cells", "8").parse()?);
    let tissue = Tissue {
        young_kpa: key("young", "15").parse()?,
        poisson: key("poisson", "0.49").parse()?,
        law: Law::ALL.into_iter().find(|l| l.name() == law).ok_or("no such law")?,
        stiffening: key("stiffening", "0.5").parse()?,
        ..Tissue::default()
    };
    let sliding = key("plate", "tied") == "sliding";
    let fitted = key("travel", "nominal") == "fitted";
    let rest = if key("weight", "none") == "own" { RestState::Unloaded } else { RestState::Net };
    let out = key("out", "");
    if let Some(unknown) = keys.keys().next() {
        return Err(format!("no key {unknown}").into());
    }

    let text = std::fs::read_to_string(path)?;
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let beads = lines.map(Bead::read).collect::<Result<Vec<_>, _>>()?;
    let body = Body::new(Arc::new(cube(cells)?), tissue);
    let locator = Locator::new(body.mesh.clone());
    let located = beads.iter().map(|bead| locator.nearest(&bead.place)).collect();
    // The same gravity before and after: no load but that of the plate.
    let load = Load { ct: Vector::z(), target: Vector::z() };
    let params = Params { rest, ..Params::default() };
    let contact = if sliding { Contact::Frictionless } else { Contact::Tied };
    let insertion = Insertion::new(&Plate, contact);
    let (plate, info) = Applicator::attach(&body, &load, &params, &insertion, Progress::none())?;
    println!("{} beads, {} unknowns", beads.len(), info.unknowns);
    println!("  distances, mm: mean rms 95 % max | rms of x y z | rms after a shift");
    let mut pressed = Pressed { plate, edges: Edges::new(&body.mesh), beads: &beads, located };
    let mut table = String::new();
    for (level, travel) in TRAVEL_MM.into_iter().enumerate() {
        let pose = if fitted {
            pressed.fitted(level, !sliding)?
        } else {
            pose(Vector::z() * travel, Vector::zeros())
        };
        let moved = pressed.moved(&pose)?;
        let force = pressed.plate.reaction().force_n;
        let ([x, y, z], turn) = (
            (pose * Plate.centre() - Plate.centre()).into(),
            pose.rotation.scaled_axis() * 180.0 / std::f64::consts::PI,
        );
        println!(
            "{:5.2} %: plate at ({x:.2}, {y:.2}, {z:.2}) mm, turned ({:.2}, {:.2})°, {:.2} N",
            100.0 * travel / SIDE_MM,
            turn.x,
            turn.y,
            -force.z
        );
        let off = |of: &dyn Fn(&Bead) -> bool| -> Vec<Vector> {
            let pairs = beads.iter().zip(&moved).filter(|(bead, _)| of(bead));
            pairs.map(|(bead, moved)| moved - bead.moved[level]).collect()
        };
        tell("all", &off(&|_| true));
        tell("not at plate", &off(&|bead| bead.depths().0 > LAYER_MM));
        tell("inner", &off(&|bead| bead.depths().1 > LAYER_MM));
        let motion: Vec<Vector> = beads.iter().map(|bead| bead.moved[level]).collect();
        tell("as measured", &motion);
        for (bead, u) in beads.iter().zip(&moved) {
            let (p, m) = (bead.place, bead.moved[level]);
            let numbers = [p.x, p.y, p.z, u.x, u.y, u.z, m.x, m.y, m.z];
            let cells = numbers.map(|v| format!("{v:.4}")).join(" ");
            writeln!(table, "{level} {cells}")?;
        }
    }
    if !out.is_empty() {
        std::fs::write(out, table)?;
    }
    Ok(())
}
