//! A breast of a known shape with tissue of another law than is usually assumed: what it does when
//! the patient sits up, and on the tilted table: `other_laws DISPLACEMENT OUT [KEY=VALUE ...]`.
//!
//! DISPLACEMENT is the `displacement.npz` of a synthetic patient: `nodes` (n × 3, supine, mm) and
//! `tets` (m × 10, in VTK's order: corners, then the middles of the edges 01, 12, 02, 03, 13, 23) of
//! quadratic elements, and `wall_nodes` and `fixed_nodes`. The rest state is unloaded. The elements
//! are as curved as those of the file, so that skin and chest wall are where its nodes are.
//!
//! A face of the boundary with all its six nodes in `wall_nodes` is of the chest wall, else one with
//! all in `fixed_nodes` of the cut, which is held; the others are skin.
//!
//! | key | value | unless given |
//! |---|---|---|
//! | `young` | kPa | 0.609 |
//! | `poisson` | | 0.45 |
//! | `law`, `stiffening` | as in case files | neo-hookean, 0 |
//! | `fibres`, `fibre_stiffening` | modulus over that of the tissue; k | 0, 1 |
//! | `slide` | shear traction per displacement on the chest wall, kPa/mm | held |
//! | `radius`, `rim` | of the part of the chest wall that slides, mm | 75, a third of it |
//! | `centre` | of that part: x,y,z | below the middle of the breast |
//! | `skin` | modulus of a membrane, kPa | none |
//! | `thickness`, `stretch` | of the membrane, mm; where the tissue is free of stress | 1.8, 1 |
//! | `rest` | `unloaded` or `net` | unloaded |
//! | `ap`, `lat` | tilt of the table, degrees | 8, 5 |
//!
//! OUT is an npz with `nodes` as they are in DISPLACEMENT, displacements from there (mm) `u_sitting`
//! and `u_table`, `middles` (node, and the two ends of its edge), and the faces `skin`, `wall` and
//! `cut` (three corners outward, then the middles of 01, 12 and 02). Nodes are numbered as there.

#![expect(clippy::print_stdout, reason = "a program for the shell")]
#![expect(clippy::disallowed_methods, reason = "it reads and writes files")]

use nalgebra::Matrix3;
use ndarray::{Array1, Array2};
use ndarray_npy::{NpzReader, NpzWriter};
use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::fs::File;
use std::str::FromStr;
use std::sync::Arc;
use supine_fem::{Body, Cut, Law, Membrane, Params, RestState, Sequence, SlidingArea, Tissue};
use supine_mesh::{
    BoundaryFace, BoundaryTag, Displacement, Edges, Order, TET_EDGES, TET_FACES, TetMesh,
};
use supine_space::{Point, Progress, TablePose, Vector, sitting, supine};

type Failed = Box<dyn Error>;

/// The patient, nodes numbered as in the file.
struct Anatomy {
    nodes: Vec<Point>,
    tets: Vec<[u32; 10]>,
    wall: BTreeSet<u32>,
    fixed: BTreeSet<u32>,
}

impl Anatomy {
    fn read(path: &str) -> Result<Self, Failed> {
        let mut file = NpzReader::new(File::open(path)?)?;
        let nodes: Array2<f32> = file.by_name("nodes")?;
        let tets: Array2<u16> = file.by_name("tets")?;
        if nodes.ncols() != 3 || tets.ncols() != 10 {
            return Err("nodes of 3 coordinates and tetrahedra of 10 nodes are asked for".into());
        }
        let mut set = |name: &str| -> Result<BTreeSet<u32>, Failed> {
            let indices: Array1<u16> = file.by_name(name)?;
            Ok(indices.iter().map(|&n| n.into()).collect())
        };
        let (wall, fixed) = (set("wall_nodes")?, set("fixed_nodes")?);
        let point = |k: usize| Point::from([0, 1, 2].map(|axis| f64::from(nodes[[k, axis]])));
        let tet = |k: usize| std::array::from_fn(|node| tets[[k, node]].into());
        Ok(Self {
            nodes: (0..nodes.nrows()).map(point).collect(),
            tets: (0..tets.nrows()).map(tet).collect(),
            wall,
            fixed,
        })
    }

    /// The middle of each edge, its ends in order.
    fn middles(&self) -> BTreeMap<[u32; 2], u32> {
        let of = |tet: &[u32; 10]| {
            let tet = *tet;
            TET_EDGES.into_iter().enumerate().map(move |(e, [a, b])| {
                let (a, b) = (tet[a], tet[b]);
                ([a.min(b), a.max(b)], tet[4 + e])
            })
        };
        self.tets.iter().flat_map(of).collect()
    }
}

/// A face of the boundary: corners and middles as the file numbers them.
type Face = [u32; 6];

/// The mesh of the corners, and what of it is what in the file.
struct Shape {
    mesh: Arc<TetMesh>,
    edges: Edges,
    /// Of each point, then of each edge, the node in the file.
    nodes: Vec<u32>,
    faces: Vec<(BoundaryTag, Face)>,
    curved: Displacement,
}

impl Shape {
    fn of(anatomy: &Anatomy) -> Result<Self, Failed> {
        let corners: BTreeSet<u32> =
            anatomy.tets.iter().flat_map(|tet| [tet[0], tet[1], tet[2], tet[3]]).collect();
        let number: BTreeMap<u32, u32> =
            corners.iter().enumerate().map(|(k, node)| (*node, k as u32)).collect();
        let middles = anatomy.middles();
        let faces = boundary(anatomy, &middles);
        let tagged = faces.iter().map(|(tag, [a, b, c, ..])| BoundaryFace {
            points: [a, b, c].map(|node| number[node]),
            tag: *tag,
        });
        let mesh = TetMesh::new(
            corners.iter().map(|node| anatomy.nodes[*node as usize]).collect(),
            anatomy.tets.iter().map(|tet| [0, 1, 2, 3].map(|k| number[&tet[k]])).collect(),
            tagged.collect(),
        )?;
        let edges = Edges::new(&mesh);
        let mut nodes: Vec<u32> = corners.into_iter().collect();
        let mut offsets = vec![Vector::zeros(); nodes.len()];
        for ends in edges.ends() {
            let [a, b] = ends.map(|point| nodes[point as usize]);
            let middle = middles[&[a.min(b), a.max(b)]];
            let [a, b, m] = [a, b, middle].map(|node| anatomy.nodes[node as usize].coords);
            nodes.push(middle);
            offsets.push(m - (a + b) / 2.0);
        }
        let curved = Displacement::new(&mesh, &edges, offsets)?;
        Ok(Self { mesh: mesh.into(), edges, nodes, faces, curved })
    }

    /// The field at the nodes of the curved elements, mm.
    ///
    /// The solver gives it at the places that the nodes have in straight elements; it is carried on
    /// from there as in the straight element that a node lies in, or least outside of. Corners are
    /// in both places the same, and nodes on the cut do not move.
    fn at_curved(&self, field: &Displacement) -> Result<Vec<Vector>, Failed> {
        let (points, offsets) = (self.mesh.points(), self.curved.values());
        let mut best: BTreeMap<usize, (f64, usize, [f64; 4])> = BTreeMap::new();
        for (t, (tet, edges)) in self.mesh.tets().iter().zip(self.edges.of_tets()).enumerate() {
            let [first, b, c, d] = tet.map(|p| points[p as usize].coords);
            let map = Matrix3::from_columns(&[b - first, c - first, d - first]);
            let inverse = map.try_inverse().ok_or("a flat tetrahedron")?;
            for (edge, [a, b]) in edges.iter().zip(TET_EDGES) {
                let node = points.len() + *edge as usize;
                let [a, b] = [a, b].map(|k| points[tet[k] as usize].coords);
                let l = inverse * ((a + b) / 2.0 + offsets[node] - first);
                let l = [1.0 - l.sum(), l.x, l.y, l.z];
                let inside = l.into_iter().fold(f64::INFINITY, f64::min);
                if best.get(&node).is_none_or(|other| inside > other.0) {
                    best.insert(node, (inside, t, l));
                }
            }
        }
        let mut values = field.values().to_vec();
        for (node, (_, tet, l)) in best {
            values[node] = field.at(&self.mesh, &self.edges, tet, l);
        }
        let on_cut = self.faces.iter().filter(|(tag, _)| *tag == BoundaryTag::Cut);
        let held: BTreeSet<u32> = on_cut.flat_map(|(_, face)| *face).collect();
        for (value, node) in values.iter_mut().zip(&self.nodes) {
            if held.contains(node) {
                *value = Vector::zeros();
            }
        }
        Ok(values)
    }

    /// As the file numbers the nodes.
    fn renumbered(&self, values: &[Vector]) -> Array2<f64> {
        let mut all = Array2::zeros((self.nodes.len(), 3));
        for (node, value) in self.nodes.iter().zip(values) {
            (0..3).for_each(|axis| all[[*node as usize, axis]] = value[axis]);
        }
        all
    }

    /// The faces of a part of the boundary.
    fn part(&self, tag: BoundaryTag) -> Array2<i32> {
        let faces: Vec<&Face> =
            self.faces.iter().filter(|(of, _)| *of == tag).map(|(_, face)| face).collect();
        Array2::from_shape_fn((faces.len(), 6), |(k, node)| faces[k][node] as i32)
    }
}

/// The faces of one tetrahedron alone.
fn boundary(anatomy: &Anatomy, middles: &BTreeMap<[u32; 2], u32>) -> Vec<(BoundaryTag, Face)> {
    let faces = || {
        let of = |tet: &[u32; 10]| TET_FACES.map(|face| face.map(|k| tet[k]));
        anatomy.tets.iter().flat_map(of)
    };
    let key = |mut face: [u32; 3]| {
        face.sort_unstable();
        face
    };
    let mut times: BTreeMap<[u32; 3], u32> = BTreeMap::new();
    faces().for_each(|face| *times.entry(key(face)).or_default() += 1);
    let whole = |[a, b, c]: [u32; 3]| {
        let middle = |a: u32, b: u32| middles[&[a.min(b), a.max(b)]];
        [a, b, c, middle(a, b), middle(b, c), middle(a, c)]
    };
    let tag = |face: &Face| {
        if face.iter().all(|node| anatomy.wall.contains(node)) {
            BoundaryTag::ChestWall
        } else if face.iter().all(|node| anatomy.fixed.contains(node)) {
            BoundaryTag::Cut
        } else {
            BoundaryTag::Skin
        }
    };
    let outer = faces().filter(|face| times[&key(*face)] == 1).map(whole);
    outer.map(|face| (tag(&face), face)).collect()
}

/// What is asked on the command line.
struct Keys(BTreeMap<String, String>);

impl Keys {
    fn read(args: impl Iterator<Item = String>) -> Result<Self, Failed> {
        let pair = |arg: String| arg.split_once('=').map(|(k, v)| (k.to_owned(), v.to_owned()));
        Ok(Self(args.map(pair).collect::<Option<_>>().ok_or("KEY=VALUE is asked for")?))
    }

    fn given<T: FromStr<Err: Error + 'static>>(&mut self, key: &str) -> Result<Option<T>, Failed> {
        Ok(self.0.remove(key).map(|text| text.parse()).transpose()?)
    }

    fn number(&mut self, key: &str, usual: f64) -> Result<f64, Failed> {
        Ok(self.given(key)?.unwrap_or(usual))
    }

    fn tissue(&mut self) -> Result<Tissue, Failed> {
        let usual = Tissue::default();
        let law: String = self.given("law")?.unwrap_or_else(|| usual.law.name().to_owned());
        Ok(Tissue {
            young_kpa: self.number("young", usual.young_kpa)?,
            poisson: self.number("poisson", usual.poisson)?,
            law: Law::ALL.into_iter().find(|l| l.name() == law).ok_or("no such law")?,
            stiffening: self.number("stiffening", usual.stiffening)?,
            fibres: self.number("fibres", usual.fibres)?,
            fibre_stiffening: self.number("fibre_stiffening", usual.fibre_stiffening)?,
            ..usual
        })
    }

    fn params(&mut self) -> Result<Params, Failed> {
        let radius_mm = self.number("radius", 75.0)?;
        let rim_mm = self.number("rim", radius_mm / 3.0)?;
        let centre_mm = self.given::<String>("centre")?.map(|text| place(&text)).transpose()?;
        let area =
            |stiffness_kpa_mm| SlidingArea { centre_mm, radius_mm, rim_mm, stiffness_kpa_mm };
        let (thickness_mm, stretch) =
            (self.number("thickness", 1.8)?, self.number("stretch", 1.0)?);
        let membrane = |young_kpa| Membrane { thickness_mm, young_kpa, stretch };
        let rest: String = self.given("rest")?.unwrap_or_else(|| "unloaded".to_owned());
        Ok(Params {
            order: Order::Quadratic,
            rest: match rest.as_str() {
                "unloaded" => RestState::Unloaded,
                "net" => RestState::Net,
                _ => return Err("no such rest state".into()),
            },
            cut: Cut::Fixed,
            sliding: self.given("slide")?.map(area),
            skin: self.given("skin")?.map(membrane),
            tolerance: 1e-8,
            ..Params::default()
        })
    }
}

/// Three numbers with commas between.
fn place(text: &str) -> Result<[f64; 3], Failed> {
    let numbers: Vec<f64> = text.split(',').map(str::parse).collect::<Result<_, _>>()?;
    numbers.try_into().map_err(|_| "a centre of three numbers is asked for".into())
}

fn main() -> Result<(), Failed> {
    let mut args = std::env::args().skip(1);
    let (Some(path), Some(out)) = (args.next(), args.next()) else {
        return Err("usage: other_laws DISPLACEMENT OUT [KEY=VALUE ...]".into());
    };
    let mut keys = Keys::read(args)?;
    let (tissue, params) = (keys.tissue()?, keys.params()?);
    let table = TablePose { ap_deg: keys.number("ap", 8.0)?, lat_deg: keys.number("lat", 5.0)? };
    if let Some(unknown) = keys.0.keys().next() {
        return Err(format!("no key {unknown}").into());
    }

    let anatomy = Anatomy::read(&path)?;
    let shape = Shape::of(&anatomy)?;
    let body = Body { curved: Some(shape.curved.clone()), ..Body::new(shape.mesh.clone(), tissue) };
    let mut file = NpzWriter::new_compressed(File::create(&out)?);
    // Table before sitting up: the one nearer to the CT is found first, and helps to the other.
    let mut poses = Sequence::new(&body, supine(), &params)?;
    for (name, gravity) in [("table", table.gravity()), ("sitting", sitting())] {
        let solution = poses.at(tissue.young_kpa, gravity, false, Progress::none())?;
        let info = &solution.info;
        println!(
            "{name}: {} unknowns, {} Newton iterations, det F from {:.3}, moves up to {:.2} mm",
            info.unknowns,
            info.solve.iterations,
            info.solve.min_det_f,
            info.solve.max_displacement_mm
        );
        info.warnings.iter().for_each(|warning| println!("{name}: {warning}"));
        let values = shape.at_curved(solution.deformation.displacement())?;
        file.add_array(format!("u_{name}"), &shape.renumbered(&values))?;
    }
    let nodes: Vec<Vector> =
        shape.nodes.iter().map(|node| anatomy.nodes[*node as usize].coords).collect();
    file.add_array("nodes", &shape.renumbered(&nodes))?;
    let middles: Vec<[u32; 3]> =
        anatomy.middles().into_iter().map(|([a, b], middle)| [middle, a, b]).collect();
    let middles = Array2::from_shape_fn((middles.len(), 3), |(k, n)| middles[k][n] as i32);
    file.add_array("middles", &middles)?;
    for (name, tag) in
        [("skin", BoundaryTag::Skin), ("wall", BoundaryTag::ChestWall), ("cut", BoundaryTag::Cut)]
    {
        file.add_array(name, &shape.part(tag))?;
    }
    file.finish()?;
    Ok(())
}
