//! Merging two vertices.

use crate::mesher::Mesher;
use crate::shape::shape;
use supine_space::Vector;

/// What a collapse must respect.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CollapseRule {
    /// Tetrahedra that change must be at least this good, or no worse than before.
    pub floor: f64,
    /// Longest new edge, mm.
    pub longest: f64,
}

impl Mesher<'_> {
    /// Merges vertex `a` into `b`, which moves to `at`. Returns whether it was done.
    ///
    /// Refused unless it keeps the topology of volume and boundary (link condition: Dey,
    /// Edelsbrunner, Guha and Nekhayev 1999), the rims and corners, and the rule.
    pub(crate) fn collapse(&mut self, a: u32, b: u32, at: Vector, rule: CollapseRule) -> bool {
        let ring = self.mesh.ring(a, b);
        let moves = at != self.mesh.points[b as usize];
        // Cheap tests first.
        if ring.is_empty()
            || !self.keeps_class(a, b, &ring)
            || !self.keeps_quality(a, b, at, &ring, rule)
            || !self.keeps_topology(a, b, &ring)
            || !self.keeps_surface(a, b, at, moves)
        {
            return false;
        }
        self.merge(a, b, at, &ring, moves);
        true
    }

    /// Whether a lies on nothing that b does not lie on, and the edge runs along it.
    fn keeps_class(&self, a: u32, b: u32, ring: &[u32]) -> bool {
        let (ca, cb) = (self.mesh.class[a as usize], self.mesh.class[b as usize]);
        if ca & !cb != 0 || ca.count_ones() == 3 {
            return false;
        }
        ca == 0 || self.mesh.edge_class(ring, a, b) == (ca, 2)
    }

    fn keeps_topology(&self, a: u32, b: u32, ring: &[u32]) -> bool {
        let mesh = &self.mesh;
        for &id in ring {
            let tags = mesh.tags[id as usize];
            if tags[mesh.corner_of(id, a)] != 0 && tags[mesh.corner_of(id, b)] != 0 {
                return false;
            }
        }
        if mesh.class[a as usize] != 0 {
            let (near_a, near_b) = (mesh.boundary_neighbours(a), mesh.boundary_neighbours(b));
            let shared = near_a.iter().filter(|v| near_b.binary_search(v).is_ok()).count();
            if shared != 2 || self.closes_patch(a, b, ring) {
                return false;
            }
        }
        let opposite = |id: u32| {
            let mut rest = mesh.tets[id as usize].into_iter().filter(|&v| v != a && v != b);
            let (c, d) = (rest.next().unwrap_or(a), rest.next().unwrap_or(a));
            [c.min(d), c.max(d)]
        };
        let mut spans: Vec<[u32; 2]> = ring.iter().map(|&id| opposite(id)).collect();
        spans.sort_unstable();
        let mut link: Vec<u32> = spans.iter().flatten().copied().collect();
        link.sort_unstable();
        link.dedup();
        let near_b = mesh.neighbours(b);
        let shared = mesh.neighbours(a).iter().filter(|v| near_b.binary_search(v).is_ok()).count();
        if shared != link.len() {
            return false;
        }
        let of_a = self.link_edges_within(a, &link);
        let of_b = self.link_edges_within(b, &link);
        of_a.iter()
            .filter(|e| of_b.binary_search(e).is_ok())
            .all(|e| spans.binary_search(e).is_ok())
    }

    /// Edges of the link of `v` whose ends are both in `among`, sorted.
    fn link_edges_within(&self, v: u32, among: &[u32]) -> Vec<[u32; 2]> {
        let mut edges = Vec::new();
        for &id in &self.mesh.star[v as usize] {
            let [a, b, c] = self.mesh.face(id, self.mesh.corner_of(id, v));
            for [p, q] in [[a, b], [b, c], [a, c]] {
                if among.binary_search(&p).is_ok() && among.binary_search(&q).is_ok() {
                    edges.push([p.min(q), p.max(q)]);
                }
            }
        }
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    /// Whether one of the two boundary faces at ab has rims on both other sides, so that the
    /// collapse would fold a patch of the boundary or its rim away.
    fn closes_patch(&self, a: u32, b: u32, ring: &[u32]) -> bool {
        let mesh = &self.mesh;
        let is_rim = |u: u32, v: u32| {
            let (class, _) = mesh.edge_class(&mesh.ring(u, v), u, v);
            class.count_ones() > 1
        };
        ring.iter().any(|&id| {
            (0..4).any(|corner| {
                let v = mesh.tets[id as usize][corner];
                if mesh.tags[id as usize][corner] == 0 || v == a || v == b {
                    return false;
                }
                let c = mesh.face(id, corner).into_iter().find(|&w| w != a && w != b);
                c.is_some_and(|c| is_rim(a, c) && is_rim(b, c))
            })
        })
    }

    fn keeps_quality(&self, a: u32, b: u32, at: Vector, ring: &[u32], rule: CollapseRule) -> bool {
        let mesh = &self.mesh;
        let stays = at == mesh.points[b as usize];
        let mut before = mesh.worst_of(&mesh.star[a as usize]);
        if !stays {
            before = before.min(mesh.worst_of(&mesh.star[b as usize]));
        }
        let lowest = rule.floor.min(before).max(1e-3);
        for from in [a, b] {
            if from == b && stays {
                continue;
            }
            for &id in mesh.star[from as usize].iter().filter(|id| !ring.contains(id)) {
                let tet = mesh.tets[id as usize];
                let mut p = mesh.corners(tet);
                for c in 0..4 {
                    if tet[c] == from {
                        p[c] = at;
                    } else if (p[c] - at).norm_squared() > rule.longest * rule.longest {
                        return false;
                    }
                }
                if shape(&p) < lowest {
                    return false;
                }
            }
        }
        true
    }

    fn keeps_surface(&self, a: u32, b: u32, at: Vector, moves: bool) -> bool {
        let mesh = &self.mesh;
        let from: &[u32] = if moves { &[a, b] } else { &[a] };
        if mesh.class[a as usize] == 0 && (!moves || mesh.class[b as usize] == 0) {
            return true;
        }
        let mut limit = None;
        for &v in from {
            for (id, corner) in mesh.boundary_faces(v) {
                let face = mesh.face(id, corner);
                if face.contains(&a) && face.contains(&b) {
                    continue;
                }
                let place = face.map(|w| if w == v { at } else { mesh.points[w as usize] });
                let fault = self.face_fault(mesh.tags[id as usize][corner], &place);
                if fault > 0.0 {
                    let limit = *limit.get_or_insert_with(|| {
                        let now =
                            |&v: &u32| self.star_fault(v, &mesh.points[v as usize], f64::INFINITY);
                        from.iter().map(now).fold(0.0, f64::max)
                    });
                    if fault > limit {
                        return false;
                    }
                }
            }
        }
        true
    }

    fn merge(&mut self, a: u32, b: u32, at: Vector, ring: &[u32], moves: bool) {
        let mesh = &mut self.mesh;
        // The faces opposite a and b of a dying tetrahedron fall together.
        let mut tagged = Vec::new();
        for &id in ring {
            let (tet, tags) = (mesh.tets[id as usize], mesh.tags[id as usize]);
            let tag = tags[mesh.corner_of(id, a)].max(tags[mesh.corner_of(id, b)]);
            if tag != 0 {
                let mut rest = tet.into_iter().filter(|&v| v != a && v != b);
                tagged.push((rest.next().unwrap_or(a), rest.next().unwrap_or(a), tag));
            }
            mesh.remove(id);
        }
        if moves {
            mesh.move_vertex(b, at);
        }
        for id in mesh.star[a as usize].clone() {
            let (tet, tags) = (mesh.tets[id as usize], mesh.tags[id as usize]);
            mesh.remove(id);
            mesh.add(tet.map(|v| if v == a { b } else { v }), tags);
        }
        for (c, d, tag) in tagged {
            let holder = mesh.star[b as usize].iter().copied().find(|&id| {
                let tet = mesh.tets[id as usize];
                tet.contains(&c) && tet.contains(&d)
            });
            if let Some(id) = holder {
                let tet = mesh.tets[id as usize];
                let far = tet.iter().position(|&v| v != b && v != c && v != d);
                mesh.set_tag(id, far.unwrap_or(0), tag);
            }
        }
    }
}
