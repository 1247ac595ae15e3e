//! What a plane of a volume's own grid cuts, as lines between the voxels.

use crate::draw::contours;
use crate::draw::cut::{Cut, Spot, joined};
use crate::draw::planes::views;
use crate::draw::surface::Surface;
use serde::Serialize;
use std::borrow::Cow;
use std::sync::Arc;
use supine_flow::OwnObjects;
use supine_mesh::{BoundaryTag, Displacement, Edges, Faces, TetMesh};
use supine_space::{Grid, Sphere};
use supine_volume::{Surfaces, Volume};

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
    /// Only there its place matters; unknown while there is none.
    pub(crate) region: Option<Sphere>,
    pub(crate) body: Option<Body>,
    /// A tumour that is no sphere any more.
    pub(crate) tumour: Option<Arc<Surface>>,
    /// The patient's own structures and doses.
    pub(crate) plan: Option<PlanLines>,
}

/// Structures and doses, as given or as carried.
#[derive(Clone, Debug)]
pub(crate) struct PlanLines {
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
            if let Some(map) = &self.uncertainty {
                let points = cut.uncertain(&wall, map, self.region.as_ref());
                lines.push(Line { name: "uncertain".into(), points });
            }
            lines.push(Line { name: "chest wall".into(), points: wall });
            lines.push(Line { name: "skin".into(), points: cut.level(&surfaces.skin) });
        }
        if let Some(body) = &self.body {
            lines.extend(body.lines(&cut));
        }
        if let Some(tumour) = &self.tumour {
            lines.push(Line { name: "tumour".into(), points: cut.surface(tumour) });
        }
        if let Some(plan) = &self.plan {
            lines.extend(plan.lines(&cut));
        }
        lines.retain(|line| !line.points.is_empty());
        Some(lines)
    }
}

impl PlanLines {
    fn lines(&self, cut: &Cut<'_>) -> Vec<Line> {
        let structures = self.objects.structures().filter_map(|one| {
            let contours = if self.carried { one.after? } else { one.before };
            let name = format!("structure: {}", one.name).into();
            Some(Line { name, points: contours::structure(contours, cut) })
        });
        let mut lines: Vec<Line> = structures.collect();
        let dose = self.objects.doses().next();
        let dose = dose.and_then(|dose| if self.carried { dose.after } else { Some(dose.before) });
        if let Some(dose) = dose {
            let all = contours::isodoses(dose, &self.levels_gy, cut);
            let name = |gy: f64| format!("isodose: {gy} Gy").into();
            let named = self.levels_gy.iter().zip(all);
            lines.extend(named.map(|(gy, points)| Line { name: name(*gy), points }));
        }
        lines
    }
}

impl Body {
    /// Skin, wall and cut of a mesh that is displaced; of one in the CT shape the cut, for the
    /// labels tell the rest; and where the tetrahedra meet.
    fn lines(&self, cut: &Cut<'_>) -> Vec<Line> {
        let displacement = self.displacement.as_deref();
        let faces = Faces::new(&self.mesh);
        let cuts = faces.cut_by(&self.edges, displacement, &|p| cut.seen(p));
        let line = |name: &'static str, tag| {
            let of_tag = cuts.iter().filter(|cut| cut.tag == tag);
            Line {
                name: name.into(),
                points: joined(&of_tag.map(|cut| cut.segment).collect::<Vec<_>>()),
            }
        };
        let mut lines = vec![line("cut", Some(BoundaryTag::Cut)), line("mesh", None)];
        if displacement.is_some() {
            lines.push(line("chest wall", Some(BoundaryTag::ChestWall)));
            lines.push(line("skin", Some(BoundaryTag::Skin)));
        }
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Matrix, Point, Vector};
    use supine_volume::SignedDistance;

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
            region: None,
            body: None,
            tumour: None,
            plan: None,
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
}
