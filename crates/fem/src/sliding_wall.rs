//! A chest wall on which the tissue slides.
//!
//! Between the breast and the fascia of the pectoral muscle lies loose tissue that shears easily
//! and does not open. The wall is taken as rigid; a node of it keeps its level φ above the wall,
//! and shear bears a traction k times the way that it slid, k in kPa/mm: that of a layer of shear
//! modulus G and thickness h is G/h. With x the present, X the stress-free and x⁰ the CT position
//! of a node, both on the wall, the energy is
//!
//! ½ ∫ k |x − X|² dA + ½ c Σ A [φ(x − x⁰) − φ(X − x⁰)]², φ(p) = n · p + ½ p · K p,
//!
//! n and K being normal and curvature of the wall at the node (`wall_shape`) and A its share of the
//! area. The way is the straight one, the area that of the CT. c holds the levels; the pressure of
//! the breast's weight, below 1 kPa, moves a node by less than 0.002 mm from its own.
//!
//! Towards the rim of the area k grows without a bound, and beyond it the tissue is held.

use crate::SlidingArea;
use crate::boundary::{Face, faces_on};
use crate::foundation::Foundation;
use crate::pattern::{Block, Pattern, block};
use crate::wall_shape::WallShape;
use crate::wall_turn::Normals;
use std::collections::BTreeMap;
use std::sync::Arc;
use supine_mesh::{BoundaryTag, PointTree, TET_EDGES, TetMesh};
use supine_record::Slid;
use supine_space::{Matrix, Point, Vector};

/// c, kPa/mm.
const TIE_KPA_MM: f64 = 1000.0;
/// How k grows over the share t of the rim's width: by this times (t / (1 − t))², kPa/mm; and the
/// largest share: there it is 36 kPa/mm, which holds as a node does.
const RIM_KPA_MM: f64 = 0.1;
const RIM_SHARE: f64 = 0.95;
/// Steps by which a node is brought back; two are exact to rounding on any wall of a body.
const FOLLOWING_STEPS: usize = 2;

/// The wall under a body whose elements have `N` nodes.
#[derive(Clone, Debug)]
pub(crate) struct SlidingWall<const N: usize> {
    centre: Point,
    shear: Arc<Foundation<N>>,
    ties: Arc<[Tie]>,
}

/// A node that keeps its level.
#[derive(Clone, Copy, Debug)]
struct Tie {
    node: usize,
    /// c A, mN/mm.
    stiffness: f64,
    normal: Vector,
    curvature: Matrix,
    /// Its position in the CT, and from there to the stress-free one, mm.
    ct: Vector,
    rest: Vector,
}

impl Tie {
    /// φ and its slope.
    fn level(&self, p: &Vector) -> (f64, Vector) {
        let bent = self.curvature * p;
        (self.normal.dot(p) + 0.5 * p.dot(&bent), self.normal + bent)
    }

    /// φ(x) − φ(X) and the slope of φ at x.
    fn lifted(&self, u: &[Vector]) -> (f64, Vector) {
        let (level, slope) = self.level(&(self.rest + u[self.node]));
        (level - self.level(&self.rest).0, slope)
    }

    /// Moves `end` off the way from `begin`, both from a place `base`, to the level that φ's slope
    /// at `begin` expects there.
    fn follow(&self, base: &Vector, begin: &Vector, end: &mut Vector) {
        let (level, slope) = self.level(&(base + begin));
        let meant = level + slope.dot(&(*end - begin));
        for _ in 0..FOLLOWING_STEPS {
            let (found, slope) = self.level(&(base + *end));
            *end += slope * ((meant - found) / slope.norm_squared());
        }
    }

    /// Change of its force with x.
    fn change(&self, u: &[Vector]) -> Matrix {
        let (lifted, slope) = self.lifted(u);
        (slope * slope.transpose() + self.curvature * lifted) * self.stiffness
    }
}

/// k of a place at `distance` (mm) from the middle of the area.
fn shear_kpa_mm(sliding: &SlidingArea, distance: f64) -> f64 {
    let begin = sliding.radius_mm - sliding.rim_mm;
    let share = ((distance - begin) / sliding.rim_mm).clamp(0.0, RIM_SHARE);
    sliding.stiffness_kpa_mm + RIM_KPA_MM * (share / (1.0 - share)).powi(2)
}

/// A node of the area.
struct AreaNode {
    /// The point that it is, or those between which it lies.
    ends: Vec<u32>,
    /// Its share of the area, mm².
    area_mm2: f64,
}

impl<const N: usize> SlidingWall<N> {
    /// The part of the wall of `mesh` on which the tissue slides, without shear in the CT.
    ///
    /// `positions` are those of the nodes in the CT (mm), `nodes` those of the elements; nodes that
    /// are `held` do not slide.
    pub(crate) fn new(
        mesh: &TetMesh,
        nodes: &[[u32; N]],
        positions: &[Vector],
        held: &[bool],
        sliding: &SlidingArea,
    ) -> Self {
        let faces = faces_on(mesh, BoundaryTag::ChestWall);
        let slippery =
            |face: &&Face| slides(sliding, face.points.map(|p| mesh.points()[p as usize]));
        let slippery: Vec<&Face> = faces.iter().filter(slippery).collect();
        let spring = |face: &&Face| {
            let corners = face.points.map(|p| mesh.points()[p as usize].coords);
            let middle = Point::from(corners.iter().sum::<Vector>() / 3.0);
            let k = shear_kpa_mm(sliding, distance(sliding, &middle).unwrap_or_default());
            (**face, k * face.area_mm2)
        };
        let shear = Foundation::given(slippery.iter().map(spring));
        let shape = WallShape::new(mesh, &faces);
        let tie = |(node, AreaNode { ends, area_mm2 }): (usize, AreaNode)| {
            let (normal, curvature) = shape.at(&positions[node], &ends);
            let (ct, rest) = (positions[node], Vector::zeros());
            Tie { node, stiffness: TIE_KPA_MM * area_mm2, normal, curvature, ct, rest }
        };
        let free = area_nodes(mesh, nodes, &slippery).into_iter().filter(|(n, _)| !held[*n]);
        let centre = sliding.centre_mm.map(Point::from).unwrap_or_default();
        Self { centre, shear: Arc::new(shear), ties: free.map(tie).collect() }
    }

    /// The same at those elements that are to be kept, which then are renumbered. Nodes without an
    /// element stay tied.
    pub(crate) fn only(&self, keep: &[bool]) -> Self {
        Self { shear: Arc::new(self.shear.only(keep)), ..self.clone() }
    }

    /// The same on another stress-free shape.
    pub(crate) fn at_rest(&self, rest: &[Vector]) -> Self {
        let tie = |tie: &Tie| Tie { rest: rest[tie.node] - tie.ct, ..*tie };
        Self { ties: self.ties.iter().map(tie).collect(), ..self.clone() }
    }

    /// Energy, mN mm; adds the nodal forces, mN.
    pub(crate) fn evaluate(&self, nodes: &[[u32; N]], u: &[Vector], forces: &mut [Vector]) -> f64 {
        self.shear.add_forces(nodes, u, 1.0, forces);
        let mut energy = self.shear.energy(nodes, u);
        for tie in self.ties.iter() {
            let (lifted, slope) = tie.lifted(u);
            forces[tie.node] += slope * (tie.stiffness * lifted);
            energy += 0.5 * tie.stiffness * lifted * lifted;
        }
        energy
    }

    /// Adds ∂f/∂x, mN/mm.
    pub(crate) fn add_stiffness(&self, u: &[Vector], pattern: &Pattern, blocks: &mut [Block]) {
        self.shear.add_stiffness(1.0, pattern, blocks);
        for tie in self.ties.iter() {
            pattern.add_at(tie.node as u32, &block(&tie.change(u)), blocks);
        }
    }

    /// Adds ∂f/∂X at fixed x, mN/mm.
    pub(crate) fn add_rest_stiffness(&self, u: &[Vector], pattern: &Pattern, blocks: &mut [Block]) {
        self.shear.add_stiffness(-1.0, pattern, blocks);
        for tie in self.ties.iter() {
            let (slope, at_rest) = (tie.lifted(u).1, tie.level(&tie.rest).1);
            let change = slope * at_rest.transpose() * -tie.stiffness;
            pattern.add_at(tie.node as u32, &block(&change), blocks);
        }
    }

    /// The nodes that slide, and the wall's normals where they are.
    pub(crate) fn normals(&self, u: &[Vector]) -> Normals {
        self.ties.iter().map(|tie| (tie.node as u32, tie.lifted(u).1)).collect()
    }

    /// Where it is, and how far the tissue slid.
    pub(crate) fn told(&self, u: &[Vector]) -> Slid {
        let way = |tie: &Tie| (tie.rest + u[tie.node]).norm();
        let most_mm = self.ties.iter().map(way).fold(0.0, f64::max);
        Slid { centre_mm: self.centre.into(), most_mm }
    }

    /// Adds the change of the nodal forces with `v`, mN.
    pub(crate) fn add_slope(
        &self,
        nodes: &[[u32; N]],
        u: &[Vector],
        v: &[Vector],
        forces: &mut [Vector],
    ) {
        self.shear.add_forces(nodes, v, 1.0, forces);
        for tie in self.ties.iter() {
            forces[tie.node] += tie.change(u) * v[tie.node];
        }
    }

    /// Brings the nodes, which went a straight way from `u` to `moved`, to where they are as far
    /// off their levels as the wall's slopes at `u` say: a step of Newton's method then meets no
    /// force of the wall that its linear system did not know.
    pub(crate) fn follow(&self, u: &[Vector], moved: &mut [Vector]) {
        for tie in self.ties.iter() {
            tie.follow(&tie.rest, &u[tie.node], &mut moved[tie.node]);
        }
    }

    /// The same for stress-free positions, which went from `positions` + `y` to `positions` +
    /// `moved`.
    pub(crate) fn follow_rest(&self, positions: &[Vector], y: &[Vector], moved: &mut [Vector]) {
        for tie in self.ties.iter() {
            let loaded = positions[tie.node] - tie.ct;
            tie.follow(&loaded, &y[tie.node], &mut moved[tie.node]);
        }
    }
}

/// The area on the wall of a mesh. Its middle, where none is given, is the point of the wall nearest
/// to the mean of the wall's faces by area times the fourth power of the tissue over them: below the
/// middle of the breast whatever the mesh, while the point under the thickest tissue lies 30 mm
/// apart in two meshes of one breast.
pub(crate) fn placed(area: SlidingArea, mesh: &TetMesh) -> SlidingArea {
    let centre_mm = area.centre_mm.or_else(|| below_breast(mesh).map(Into::into));
    SlidingArea { centre_mm, ..area }
}

/// The point of the wall below the middle of the breast.
fn below_breast(mesh: &TetMesh) -> Option<Point> {
    let on = |tag| mesh.points_on(tag).into_iter().map(|p| mesh.points()[p as usize]);
    let skin = PointTree::new(&on(BoundaryTag::Skin).collect::<Vec<_>>());
    let (mut sum, mut weights) = (Vector::zeros(), 0.0);
    for face in mesh.boundary().iter().filter(|face| face.tag == BoundaryTag::ChestWall) {
        let [a, b, c] = face.points.map(|p| mesh.points()[p as usize].coords);
        let middle = (a + b + c) / 3.0;
        let (_, over_mm) = skin.nearest(&middle.into(), f64::INFINITY)?;
        let weight = (b - a).cross(&(c - a)).norm() * over_mm.powi(4);
        sum += middle * weight;
        weights += weight;
    }
    let middle = Point::from(sum / weights);
    let off = |foot: &Point| (foot - middle).norm_squared();
    on(BoundaryTag::ChestWall).min_by(|a, b| off(a).total_cmp(&off(b)))
}

/// Whether a face with these corners slides.
pub(crate) fn slides(area: &SlidingArea, corners: [Point; 3]) -> bool {
    let near = |corner: &Point| distance(area, corner).is_some_and(|way| way < area.radius_mm);
    corners.iter().all(near)
}

/// Whether the whole chest wall of a mesh slides: with an area without a middle, below the breast.
pub fn slides_everywhere(area: &SlidingArea, mesh: &TetMesh) -> bool {
    let area = placed(*area, mesh);
    let mut wall = mesh.boundary().iter().filter(|face| face.tag == BoundaryTag::ChestWall);
    wall.all(|face| slides(&area, face.points.map(|p| mesh.points()[p as usize])))
}

/// How far a place lies from the middle of an area, mm, if that is known.
fn distance(area: &SlidingArea, place: &Point) -> Option<f64> {
    area.centre_mm.map(|centre| (place - Point::from(centre)).norm())
}

/// The nodes on some faces.
fn area_nodes<const N: usize>(
    mesh: &TetMesh,
    nodes: &[[u32; N]],
    faces: &[&Face],
) -> BTreeMap<usize, AreaNode> {
    let mut by_node = BTreeMap::new();
    for face in faces {
        let (tet, own) = (mesh.tets()[face.element], face.nodes::<N>());
        for &a in &own {
            let ends = if a < 4 { vec![a] } else { TET_EDGES[a - 4].to_vec() };
            let node = nodes[face.element][a] as usize;
            let entry = by_node.entry(node).or_insert_with(|| {
                let ends = ends.into_iter().map(|end| tet[end]).collect();
                AreaNode { ends, area_mm2: 0.0 }
            });
            entry.area_mm2 += face.area_mm2 / own.len() as f64;
        }
    }
    by_node
}

#[cfg(test)]
#[path = "sliding_wall_tests.rs"]
mod tests;
