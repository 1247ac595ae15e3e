//! What the session holds, as the page sees it.

use crate::draw::lines::{Body, Cuttable, Plan};
use crate::draw::surface::{Drawn, Shape, Surface};
use crate::draw::voxels::Voxels;
use crate::own::levels_gy;
use crate::state::{LinesShown, PatchShown, Readiness, TumourShown};
use crate::workspace::OpenCase;
use serde::Serialize;
use std::sync::Arc;
use supine_flow::{Freshness, NodeId, OwnObjects, Session, too_wide};
use supine_mesh::{BoundaryTag, Deformation, Edges, Embedding, Motion, Surround, TetMesh};
use supine_space::{Point, Sphere};
use supine_volume::{LabelMap, Surfaces};

/// What is on the screen, to be known again.
#[derive(Default)]
pub(crate) struct DisplayedInputs {
    mesh: Option<Arc<TetMesh>>,
    carried: Option<Arc<Deformation>>,
    surfaces: Option<Arc<Surfaces>>,
    labels: Option<Arc<LabelMap>>,
    tumour: Option<Sphere>,
    own: Option<OwnObjects>,
    /// Whether the patient's whole skin is drawn.
    body: bool,
}

/// The mesh's surfaces, in the CT shape and as it was carried.
const PARTS: [(BoundaryTag, [&str; 2]); 3] = [
    (BoundaryTag::Skin, ["skin", "skin, simulated"]),
    (BoundaryTag::ChestWall, ["chest wall", "chest wall, simulated"]),
    (BoundaryTag::Cut, ["cut", "cut, simulated"]),
];

impl OpenCase {
    /// Shows what the session holds.
    pub(crate) fn show_results(&mut self, session: &Session) {
        let labels = session.peek_labels();
        if let Some((labels, freshness)) = &labels {
            let fresh = *freshness == Freshness::Fresh;
            self.show("labels", Voxels::Labels(Arc::clone(labels)), fresh);
        }
        let deformed = session.peek_deformed_ct();
        if let Some((ct, freshness)) = deformed {
            self.show("deformed", Voxels::Hu(ct, true), freshness == Freshness::Fresh);
        }
        if session.is_fresh(NodeId::Prepare) {
            self.state.live.segmenter = Readiness::Ready;
        }
        self.show_own(session);
        self.show_shapes(session, labels.map(|(labels, _)| labels));
        self.show_scans(session);
        self.show_jacobian(session);
        let shown = |of: supine_flow::Figure| FigureShown { old: !session.is_fresh(of.node), of };
        self.state.figures = session.figures().into_iter().map(shown).collect();
        self.state.tumour = session.peek_tumour().map(|(movement, interval)| TumourShown {
            distance_mm: movement.distance_mm,
            length_mm: interval.as_ref().map(|interval| interval.length_mm),
            within_mm: interval.as_ref().map(|interval| interval.within_mm),
            reason: interval
                .as_ref()
                .and_then(|interval| too_wide(interval, session.case().tolerance_mm))
                .map(|reason| reason.message),
            level: interval.as_ref().map(|interval| interval.level),
        });
        self.state.preview_bed.final_mm = preview_differs(self, session);
        let Some(case) = &mut self.state.case else { return };
        case.tumour = session.tumour_sphere().map(Into::into);
        if let Some((sphere, patches)) = session.peek_region() {
            case.region = Some(sphere.into());
            self.state.patches = patches.into_iter().map(patch).collect();
            self.state.patches_old = !session.is_fresh(NodeId::Region);
        }
    }

    /// The local change of volume, in thousandths.
    fn show_jacobian(&mut self, session: &Session) {
        let fresh = session.is_fresh(NodeId::Fields);
        if !fresh {
            return self.hide("jacobian");
        }
        if self.voxels.contains_key("jacobian") {
            return;
        }
        let Some(map) = session.peek_jacobian() else { return };
        let thousandths = |det: &f32| (det * 1000.0).round().clamp(-32767.0, 32767.0) as i16;
        let data = map.data().iter().map(thousandths).collect();
        if let Ok(volume) = map.with_data(data) {
            self.show("jacobian", Voxels::Jacobian(Arc::new(volume)), true);
        }
    }

    /// Surfaces and lines, where they are others than before.
    fn show_shapes(&mut self, session: &Session, labels: Option<Arc<LabelMap>>) {
        let now = DisplayedInputs {
            mesh: session.peek_mesh().map(|(mesh, _)| mesh),
            carried: session.peek_carried().map(|(carried, _)| carried),
            surfaces: session.peek_surfaces(),
            labels,
            tumour: session.tumour_sphere(),
            own: self.own.clone(),
            body: self.seen.body,
        };
        let same = same(&self.seen.mesh, &now.mesh)
            && same(&self.seen.carried, &now.carried)
            && same(&self.seen.surfaces, &now.surfaces)
            && same(&self.seen.labels, &now.labels)
            && self.seen.own == now.own
            && self.seen.tumour == now.tumour;
        if same {
            return;
        }
        self.seen = now;
        self.show_tumour();
        self.show_body();
        self.show_mesh();
        self.show_carried();
        self.show_lines(session);
    }

    /// Scans of the skin, by their distance from the model: the sitting one from the fitted one,
    /// that on the table from the result.
    fn show_scans(&mut self, session: &Session) {
        let scans = [
            ("scan, sitting", Shape::Ct, session.peek_sitting_scan()),
            ("scan, table", Shape::Deformed, session.peek_table_scan()),
        ];
        for (part, shape, scan) in scans {
            match scan {
                Some(scan) => self.show_surface(part, shape, Drawn::Scan(scan)),
                None => self.hide_surface(part),
            }
        }
    }

    fn show_tumour(&mut self) {
        if let Some(tumour) = self.seen.tumour {
            self.show_surface("tumour", Shape::Ct, Drawn::Triangles(Surface::ball(&tumour)));
        }
    }

    /// The patient's whole skin, for orientation: made once.
    fn show_body(&mut self) {
        let labels = self.seen.labels.clone().filter(|_| !self.seen.body);
        if let Some(skin) = labels.and_then(|labels| Surface::body(&labels)) {
            self.show_surface("body", Shape::Both, Drawn::Triangles(skin));
            self.seen.body = true;
        }
    }

    fn show_mesh(&mut self) {
        let Some(mesh) = self.seen.mesh.clone() else { return };
        for (tag, [part, _]) in PARTS {
            self.show_surface(part, Shape::Ct, Drawn::Triangles(Surface::of(&mesh, tag)));
        }
    }

    fn show_carried(&mut self) {
        let Some(carried) = self.seen.carried.clone() else { return };
        for (tag, [_, part]) in PARTS {
            if let Some(surface) = Surface::carried(&carried, tag) {
                self.show_surface(part, Shape::Deformed, Drawn::Triangles(surface));
            }
        }
        self.show_surface("displacement", Shape::Ct, Drawn::arrows(&carried));
        if let Some(tumour) = self.carried_tumour() {
            self.show_surface("tumour, simulated", Shape::Deformed, Drawn::Triangles(tumour));
        }
    }

    /// The tumour as the tissue carries it, if it lies in the mesh.
    fn carried_tumour(&self) -> Option<Surface> {
        let (carried, tumour) = (self.seen.carried.as_ref()?, self.seen.tumour?);
        let embedding = Arc::new(Embedding::new(Arc::clone(carried.mesh())));
        let displacement = carried.displacement().clone();
        let motion = Motion::new(Arc::clone(&embedding), displacement, Surround::default()).ok()?;
        Surface::ball(&tumour).moved(|p: &Point| motion.at(&embedding.place(p)))
    }

    fn show_lines(&mut self, session: &Session) {
        let ct = self.voxels.get("ct").map(|(_, voxels)| voxels.grid().clone());
        let Some(grid) = ct else { return };
        let body = self.seen.mesh.clone().map(|mesh| {
            let edges = Arc::new(Edges::new(&mesh));
            Body { mesh, edges, displacement: None }
        });
        let surfaces = self.seen.surfaces.clone();
        let uncertainty = session.peek_uncertainty();
        let levels = self.own.as_ref().map_or(vec![], levels_gy);
        let own = |carried| {
            let objects = self.own.clone()?;
            Some(Plan { objects, carried, levels_gy: levels.clone() })
        };
        let (given, carried) = (own(false), own(true));
        if surfaces.is_some() || body.is_some() || given.is_some() {
            let (tumour, plan) = (None, given);
            let ct = Cuttable { grid: grid.clone(), surfaces, uncertainty, body, tumour, plan };
            self.put_lines("ct", ct);
        } else {
            self.drop_lines("ct");
        }
        let plan = carried;
        let Some(carried) = self.seen.carried.clone() else { return };
        let body = Some(Body {
            mesh: Arc::clone(carried.mesh()),
            edges: Arc::new(Edges::new(carried.mesh())),
            displacement: Some(Arc::new(carried.displacement().clone())),
        });
        let tumour = self.carried_tumour().map(Arc::new);
        let (surfaces, uncertainty) = (None, None);
        let deformed = Cuttable { grid, surfaces, uncertainty, body, tumour, plan };
        self.put_lines("deformed", deformed);
    }

    fn put_lines(&mut self, volume: &'static str, cuttable: Cuttable) {
        let key = self.next_key();
        self.lines.insert(volume, (key, Arc::new(cuttable)));
        self.show_line_keys();
    }

    fn drop_lines(&mut self, volume: &str) {
        if self.lines.remove(volume).is_some() {
            self.show_line_keys();
        }
    }

    fn show_line_keys(&mut self) {
        let shown = self.lines.iter();
        let shown = shown.map(|(volume, (key, _))| LinesShown { volume, key: key.clone() });
        self.state.lines = shown.collect();
    }
}

/// How far off the preview has the tumour from where the planning mesh has it, mm; nothing while
/// either is not there, or both are of different tables.
pub(crate) fn preview_differs(held: &OpenCase, session: &Session) -> Option<f64> {
    let previewed = held.previewed?;
    let bed = session.case().bed?;
    let same = previewed.bed == [bed.ap_deg, bed.lat_deg];
    let (movement, _) = session.peek_tumour().filter(|_| same)?;
    Some((Point::from(movement.after_mm) - previewed.tumour?).norm())
}

fn same<T>(one: &Option<Arc<T>>, other: &Option<Arc<T>>) -> bool {
    match (one, other) {
        (Some(one), Some(other)) => Arc::ptr_eq(one, other),
        (None, None) => true,
        _ => false,
    }
}

/// A figure of a stage.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct FigureShown {
    #[serde(flatten)]
    pub(crate) of: supine_flow::Figure,
    /// Whether it is of what was given before.
    pub(crate) old: bool,
}

fn patch(patch: supine_flow::UncertainPatch) -> PatchShown {
    let supine_flow::UncertainPatch { centre_mm, area_cm2, error_mm, place, .. } = patch;
    PatchShown { centre_mm, area_cm2, error_mm, name: place }
}
