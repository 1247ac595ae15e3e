//! What a plane of a volume's own grid cuts, as lines between the voxels.

use crate::own_lines;
use crate::state::{ViewShown, views};
use crate::surface::Surface;
use serde::Serialize;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;
use supine_flow::OwnObjects;
use supine_mesh::{BoundaryTag, Displacement, Edges, Faces, TetMesh};
use supine_space::{Grid, Point};
use supine_volume::{SignedDistance, Surfaces, Volume, contour};

/// A place in a plane, voxels along the view's right and down axes.
pub(crate) type Spot = [f64; 2];

/// The lines of one thing.
#[derive(Debug, Serialize)]
pub(crate) struct Line {
    name: Cow<'static, str>,
    points: Vec<Vec<Spot>>,
}

/// What can be cut.
#[derive(Clone, Debug)]
pub(crate) struct Cuttable {
    pub(crate) grid: Grid,
    /// Skin and chest wall between the voxels.
    pub(crate) surfaces: Option<Arc<Surfaces>>,
    /// How far the chest wall may be wrong, tenths of mm.
    pub(crate) uncertainty: Option<Arc<Volume<u8>>>,
    pub(crate) body: Option<Body>,
    /// A tumour that is no sphere any more.
    pub(crate) tumour: Option<Arc<Surface>>,
    /// The patient's own structures and doses.
    pub(crate) own: Option<Own>,
}

/// Structures and doses, as given or as carried.
#[derive(Clone, Debug)]
pub(crate) struct Own {
    pub(crate) objects: OwnObjects,
    pub(crate) carried: bool,
    /// Doses of the isodoses: finding them takes the whole dose, and planes are asked for often.
    pub(crate) levels_gy: Vec<f64>,
}

/// A mesh, displaced or in the CT shape.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    pub(crate) mesh: Arc<TetMesh>,
    pub(crate) edges: Arc<Edges>,
    /// Nothing in the CT shape.
    pub(crate) displacement: Option<Arc<Displacement>>,
}

/// A plane of a grid.
pub(crate) struct Cut<'a> {
    pub(crate) grid: &'a Grid,
    pub(crate) view: ViewShown,
    pub(crate) slice: usize,
}

impl Cuttable {
    /// The lines of a plane; nothing where there is no such plane.
    pub(crate) fn lines(&self, view: &str, slice: usize) -> Option<Vec<Line>> {
        let view = views(&self.grid).into_iter().find(|shown| shown.is(view))?;
        let cut = Cut { grid: &self.grid, view, slice };
        if slice >= self.grid.size()[cut.view.normal()] {
            return None;
        }
        let mut lines = vec![];
        if let Some(surfaces) = &self.surfaces {
            let wall = cut.level(&surfaces.chest_wall);
            lines.extend(self.uncertainty.as_deref().map(|map| cut.uncertain(&wall, map)));
            lines.push(Line { name: "chest wall".into(), points: wall });
            lines.push(Line { name: "skin".into(), points: cut.level(&surfaces.skin) });
        }
        if let Some(body) = &self.body {
            lines.extend(cut.mesh(body));
        }
        if let Some(tumour) = &self.tumour {
            lines.push(Line { name: "tumour".into(), points: cut.surface(tumour) });
        }
        if let Some(own) = &self.own {
            lines.extend(own.lines(&cut));
        }
        lines.retain(|line| !line.points.is_empty());
        Some(lines)
    }
}

impl Own {
    fn lines(&self, cut: &Cut<'_>) -> Vec<Line> {
        let structures = self.objects.structures().filter_map(|one| {
            let contours = if self.carried { one.after? } else { one.before };
            let name = format!("structure: {}", one.name).into();
            Some(Line { name, points: own_lines::structure(contours, cut) })
        });
        let mut lines: Vec<Line> = structures.collect();
        let dose = self.objects.doses().next();
        let dose = dose.and_then(|dose| if self.carried { dose.after } else { Some(dose.before) });
        if let Some(dose) = dose {
            let all = own_lines::isodoses(dose, &self.levels_gy, cut);
            let name = |gy: f64| format!("isodose: {gy} Gy").into();
            let named = self.levels_gy.iter().zip(all);
            lines.extend(named.map(|(gy, points)| Line { name: name(*gy), points }));
        }
        lines
    }
}

impl Cut<'_> {
    /// Where a position lies: right, down, and how many planes before this one.
    fn seen(&self, p: &Point) -> [f64; 3] {
        let index = self.grid.index_from_patient(p);
        let [right, down] = self.view.sides();
        [index[right], index[down], index[self.view.normal()] - self.slice as f64]
    }

    /// The line on which a distance is 0.
    fn level(&self, distance: &SignedDistance) -> Vec<Vec<Spot>> {
        let (size, [right, down]) = (self.grid.size(), self.view.sides());
        let mut samples = Vec::with_capacity(size[right] * size[down]);
        let mut voxel = [0; 3];
        voxel[self.view.normal()] = self.slice;
        for y in 0..size[down] {
            for x in 0..size[right] {
                (voxel[right], voxel[down]) = (x, y);
                samples.push(distance.mm(self.grid.offset(voxel)) as f32);
            }
        }
        joined(contour(&samples, size[right], 0.0))
    }

    /// The parts of the wall that may be far wrong.
    fn uncertain(&self, wall: &[Vec<Spot>], map: &Volume<u8>) -> Line {
        let [right, down] = self.view.sides();
        let doubted = |spot: &Spot| {
            let mut voxel = [self.slice; 3];
            (voxel[right], voxel[down]) = (spot[0].round() as usize, spot[1].round() as usize);
            map.at(voxel) >= supine_flow::UNCERTAIN_TENTHS
        };
        let mut points = vec![];
        for line in wall {
            let runs = line.chunk_by(|a, b| doubted(a) == doubted(b));
            points.extend(runs.filter(|run| run.len() > 1 && doubted(&run[0])).map(<[_]>::to_vec));
        }
        Line { name: "uncertain".into(), points }
    }

    /// Skin, wall and cut of a mesh that is displaced; of one in the CT shape the cut, for the
    /// labels tell the rest; and where the tetrahedra meet.
    fn mesh(&self, body: &Body) -> Vec<Line> {
        let displacement = body.displacement.as_deref();
        let faces = Faces::new(&body.mesh);
        let cuts = faces.cut_by(&body.edges, displacement, &|p| self.seen(p));
        let line = |name: &'static str, tag| {
            let of_tag = cuts.iter().filter(|cut| cut.tag == tag);
            Line { name: name.into(), points: joined(of_tag.map(|cut| cut.segment).collect()) }
        };
        let mut lines = vec![line("cut", Some(BoundaryTag::Cut)), line("mesh", None)];
        if displacement.is_some() {
            lines.push(line("chest wall", Some(BoundaryTag::ChestWall)));
            lines.push(line("skin", Some(BoundaryTag::Skin)));
        }
        lines
    }

    fn surface(&self, surface: &Surface) -> Vec<Vec<Spot>> {
        let seen: Vec<[f64; 3]> = surface.points().iter().map(|p| self.seen(p)).collect();
        let cut = |t: &[u32; 3]| supine_mesh::cut_triangle(&t.map(|n| seen[n as usize]));
        joined(surface.triangles().iter().filter_map(cut).collect())
    }
}

/// Segments joined where they meet; each line goes as far as it can without a choice that matters:
/// any of several ways on is taken.
pub(crate) fn joined(segments: Vec<[Spot; 2]>) -> Vec<Vec<Spot>> {
    /// Ends this near are one, voxels.
    const NEAR: f64 = 1e-4;
    let key = |spot: &Spot| spot.map(|x| (x / NEAR).round() as i64);
    let mut at: BTreeMap<[i64; 2], Vec<usize>> = BTreeMap::new();
    for (n, segment) in segments.iter().enumerate() {
        for end in segment {
            at.entry(key(end)).or_default().push(n);
        }
    }
    let mut used = vec![false; segments.len()];
    let onward = |from: Spot, used: &mut Vec<bool>| -> Option<Spot> {
        let n = at.get(&key(&from))?.iter().copied().find(|&n| !used[n])?;
        used[n] = true;
        let [a, b] = segments[n];
        Some(if key(&a) == key(&from) { b } else { a })
    };
    let mut lines = vec![];
    for n in 0..segments.len() {
        if std::mem::replace(&mut used[n], true) {
            continue;
        }
        let mut line = std::collections::VecDeque::from(segments[n]);
        while let Some(next) = onward(line[line.len() - 1], &mut used) {
            line.push_back(next);
        }
        while let Some(next) = onward(line[0], &mut used) {
            line.push_front(next);
        }
        lines.push(line.into_iter().map(|spot| spot.map(|x| (x * 1e3).round() / 1e3)).collect());
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Matrix, Vector};

    /// A coronal grid with flipped rows.
    fn grid() -> Grid {
        let axes = Matrix::from_columns(&[
            Vector::new(-1.0, 0.0, 0.0),
            Vector::new(0.0, 0.0, -1.0),
            Vector::new(0.0, 1.0, 0.0),
        ]);
        Grid::new([40, 44, 30], Vector::new(1.0, 1.5, 2.0), Point::new(20.0, -30.0, 40.0), axes)
            .unwrap()
    }

    fn ball(grid: &Grid, centre: Point, radius: f64) -> SignedDistance {
        let away = |n: usize| (grid.centre(grid.voxel(n)) - centre).norm() - radius;
        let share = |n: usize, m: usize| (away(n) / (away(n) - away(m))).abs() as f32;
        SignedDistance::new(grid, SignedDistance::WIDEST_MM, |n| away(n) < 0.0, share)
    }

    #[test]
    fn lines_lie_between_the_voxels_in_every_view_of_a_turned_grid() {
        let grid = grid();
        let centre = grid.patient_from_index([20.3, 21.8, 14.6]);
        let (skin, wall) = (ball(&grid, centre, 14.0), ball(&grid, centre, 8.0));
        let surfaces = Some(Arc::new(Surfaces { skin, chest_wall: wall }));
        let ball = Cuttable {
            grid: grid.clone(),
            surfaces,
            uncertainty: None,
            body: None,
            tumour: None,
            own: None,
        };
        for (view, slice) in [("axial", 22), ("sagittal", 19), ("coronal", 15)] {
            let shown = views(&grid).into_iter().find(|shown| shown.is(view)).unwrap();
            let lines = ball.lines(view, slice).unwrap();
            assert_eq!(
                lines.iter().map(|line| line.name.as_ref()).collect::<Vec<_>>(),
                ["chest wall", "skin"]
            );
            for (line, radius) in lines.iter().zip([8.0, 14.0]) {
                assert_eq!(line.points.len(), 1, "one closed line");
                assert_eq!(line.points[0].first(), line.points[0].last());
                for [x, y] in &line.points[0] {
                    let mut index = [slice as f64; 3];
                    let [right, down] = shown.sides();
                    (index[right], index[down]) = (*x, *y);
                    let off = (grid.patient_from_index(index) - centre).norm() - radius;
                    assert!(off.abs() < 0.12, "{view} {off}");
                }
            }
            assert!(ball.lines(view, 99).is_none());
        }
        assert!(ball.lines("oblique", 1).is_none());
    }

    #[test]
    fn segments_in_any_order_make_one_line() {
        let place = |n: usize| [n as f64, (n * n) as f64];
        let segment = |n: usize| {
            if n.is_multiple_of(2) { [place(n), place(n + 1)] } else { [place(n + 1), place(n)] }
        };
        let lines = joined([3, 0, 4, 1, 2].map(segment).to_vec());
        assert_eq!(lines.len(), 1);
        assert_eq!(lines[0].len(), 6);
        assert_eq!(joined(vec![segment(0), segment(7)]).len(), 2);
    }
}
