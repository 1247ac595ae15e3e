//! What the session holds, as volumes, surfaces and lines that the page may fetch, each under a key
//! of its own.

use crate::draw::lines::{Body, Cuttable, PlanLines};
use crate::draw::planes::{ViewShown, views};
use crate::draw::surface::{Drawn, Shape, Surface};
use crate::draw::voxels::{VolumeShown, Voxels};
use crate::store::plan::{Plan, levels_gy};
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::Arc;
use supine_flow::{Freshness, NodeId, OwnObjects, Session};
use supine_mesh::{BoundaryTag, Deformation, Edges, Embedding, Motion, Surround, TetMesh};
use supine_space::{Point, Sphere};
use supine_volume::{Ct, LabelMap, Surfaces, Volume};

/// The mesh's surfaces, in the CT shape and as it was carried.
const PARTS: [(BoundaryTag, [&str; 2]); 3] = [
    (BoundaryTag::Skin, ["skin", "skin, simulated"]),
    (BoundaryTag::ChestWall, ["chest wall", "chest wall, simulated"]),
    (BoundaryTag::Cut, ["cut", "cut, simulated"]),
];
/// Both sides of a dose.
const DOSES: [&str; 2] = ["dose", "dose-deformed"];

/// What the page is told.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct DisplayShown<'a> {
    volumes: Vec<&'a VolumeShown>,
    views: &'a [ViewShown],
    surfaces: Vec<SurfaceShown<'a>>,
    /// Volumes whose planes have lines between the voxels.
    lines: Vec<LinesShown<'a>>,
}

/// A surface whose bytes the page may fetch.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct SurfaceShown<'a> {
    part: &'static str,
    key: &'a str,
    /// `ct`, `deformed` or `both`.
    shape: &'static str,
    /// `triangles`, `arrows` or `points`.
    kind: &'static str,
}

/// A volume whose planes have lines.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct LinesShown<'a> {
    volume: &'static str,
    key: &'a str,
}

/// What surfaces and lines were made of.
#[derive(Default)]
struct Sources {
    mesh: Option<Arc<TetMesh>>,
    carried: Option<Arc<Deformation>>,
    surfaces: Option<Arc<Surfaces>>,
    region: Option<Sphere>,
    labels: Option<Arc<LabelMap>>,
    tumour: Option<Sphere>,
    plan: Option<OwnObjects>,
}

/// What can be fetched.
#[derive(Default)]
pub(crate) struct Display {
    /// Keys that were given out, of all cases: none is given twice.
    keys: u64,
    views: Vec<ViewShown>,
    volumes: Vec<(VolumeShown, Voxels)>,
    surfaces: BTreeMap<&'static str, (String, Shape, Drawn)>,
    /// What planes cut, by volume.
    lines: BTreeMap<&'static str, (String, Arc<Cuttable>)>,
    sources: Sources,
}

impl Display {
    pub(super) fn shown(&self) -> DisplayShown<'_> {
        let surfaces = self.surfaces.iter().map(|(part, (key, shape, drawn))| SurfaceShown {
            part,
            key,
            shape: shape.name(),
            kind: drawn.kind(),
        });
        DisplayShown {
            volumes: self.volumes.iter().map(|(shown, _)| shown).collect(),
            views: &self.views,
            surfaces: surfaces.collect(),
            lines: self.lines.iter().map(|(volume, (key, _))| LinesShown { volume, key }).collect(),
        }
    }

    /// The voxels of a volume under a key.
    pub(crate) fn voxels(&self, id: &str, key: &str) -> Option<Voxels> {
        let mut all = self.volumes.iter();
        let (_, voxels) = all.find(|(shown, _)| shown.id == id && shown.key == key)?;
        Some(voxels.clone())
    }

    /// The bytes of a surface under a key.
    pub(crate) fn surface(&self, part: &str, key: &str) -> Option<Vec<u8>> {
        let (known, _, drawn) = self.surfaces.get(part)?;
        (known == key).then(|| drawn.bytes())
    }

    /// What the planes of a volume cut, under a key.
    pub(crate) fn cuttable(&self, volume: &str, key: &str) -> Option<Arc<Cuttable>> {
        let (known, cuttable) = self.lines.get(volume)?;
        (known == key).then(|| Arc::clone(cuttable))
    }

    pub(super) fn clear(&mut self) {
        *self = Self { keys: self.keys, ..Self::default() };
    }

    pub(super) fn show_ct(&mut self, ct: &Arc<Ct>) {
        self.views = views(ct.grid());
        self.show("ct", Voxels::Hu(Arc::clone(ct), false), true);
    }

    /// Where the patient lies, in all volumes.
    pub(crate) fn set_body(&mut self, body: Option<[[usize; 3]; 2]>) {
        self.volumes.iter_mut().for_each(|(shown, _)| shown.body = body);
    }

    /// Shows the doses before and after.
    fn show_doses(&mut self, doses: [Option<Volume<i16>>; 2]) {
        for (id, dose) in DOSES.into_iter().zip(doses) {
            match dose {
                Some(dose) => self.show(id, Voxels::Dose(Arc::new(dose)), true),
                None => self.hide(id),
            }
        }
    }

    pub(super) fn mark_all_old(&mut self) {
        let derived = self.volumes.iter_mut().filter(|(shown, _)| shown.id != "ct");
        derived.for_each(|(shown, _)| shown.fresh = false);
    }

    /// Shows what the session holds.
    pub(super) fn read(&mut self, session: &Session, plan: &Plan) {
        let labels = session.peek_labels();
        if let Some((labels, freshness)) = &labels {
            let fresh = *freshness == Freshness::Fresh;
            self.show("labels", Voxels::Labels(Arc::clone(labels)), fresh);
        }
        if let Some((ct, freshness)) = session.peek_deformed_ct() {
            self.show("deformed", Voxels::Hu(ct, true), freshness == Freshness::Fresh);
        }
        if self.sources.plan.as_ref() != plan.objects() {
            self.show_doses(plan.doses());
        }
        self.show_shapes(session, labels.map(|(labels, _)| labels), plan.objects());
        self.show_scans(session);
        self.show_jacobian(session);
    }

    /// The local change of volume, in thousandths.
    fn show_jacobian(&mut self, session: &Session) {
        if !session.is_fresh(NodeId::Fields) {
            return self.hide("jacobian");
        }
        if self.volumes.iter().any(|(shown, _)| shown.id == "jacobian") {
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
    fn show_shapes(
        &mut self,
        session: &Session,
        labels: Option<Arc<LabelMap>>,
        plan: Option<&OwnObjects>,
    ) {
        let now = Sources {
            mesh: session.peek_mesh().map(|(mesh, _)| mesh),
            carried: session.peek_carried().map(|(carried, _)| carried),
            surfaces: session.peek_surfaces(),
            region: session.peek_region().map(|(region, _)| region),
            labels,
            tumour: session.tumour_sphere(),
            plan: plan.cloned(),
        };
        if self.sources == now {
            return;
        }
        self.sources = now;
        if let Some(tumour) = self.sources.tumour {
            self.show_surface("tumour", Shape::Ct, Drawn::Triangles(Surface::ball(&tumour)));
        }
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
                None => drop(self.surfaces.remove(part)),
            }
        }
    }

    /// The patient's whole skin, for orientation: made once.
    fn show_body(&mut self) {
        let labels = self.sources.labels.as_ref().filter(|_| !self.surfaces.contains_key("body"));
        if let Some(skin) = labels.and_then(|labels| Surface::body(labels)) {
            self.show_surface("body", Shape::Both, Drawn::Triangles(skin));
        }
    }

    fn show_mesh(&mut self) {
        let Some(mesh) = self.sources.mesh.clone() else { return };
        for (tag, [part, _]) in PARTS {
            self.show_surface(part, Shape::Ct, Drawn::Triangles(Surface::of(&mesh, tag)));
        }
    }

    fn show_carried(&mut self) {
        let Some(carried) = self.sources.carried.clone() else { return };
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
        let (carried, tumour) = (self.sources.carried.as_ref()?, self.sources.tumour?);
        let embedding = Arc::new(Embedding::new(Arc::clone(carried.mesh())));
        let displacement = carried.displacement().clone();
        let motion = Motion::new(Arc::clone(&embedding), displacement, Surround::default()).ok()?;
        Surface::ball(&tumour).moved(|p: &Point| motion.at(&embedding.place(p)))
    }

    fn show_lines(&mut self, session: &Session) {
        let ct = self.volumes.iter().find(|(shown, _)| shown.id == "ct");
        let Some(grid) = ct.map(|(_, voxels)| voxels.grid().clone()) else { return };
        let body = self.sources.mesh.clone().map(|mesh| {
            let edges = Arc::new(Edges::new(&mesh));
            Body { mesh, edges, displacement: None }
        });
        let surfaces = self.sources.surfaces.clone();
        let uncertainty = session.peek_uncertainty();
        let plan = self.sources.plan.clone().map(|objects| {
            let levels_gy = levels_gy(&objects);
            PlanLines { objects, carried: false, levels_gy }
        });
        let plan_carried = plan.clone().map(|plan| PlanLines { carried: true, ..plan });
        if surfaces.is_some() || body.is_some() || plan.is_some() {
            let (region, tumour, grid) = (self.sources.region, None, grid.clone());
            let ct = Cuttable { grid, surfaces, uncertainty, region, body, tumour, plan };
            self.put_lines("ct", ct);
        } else {
            self.lines.remove("ct");
        }
        let Some(carried) = self.sources.carried.clone() else { return };
        let body = Some(Body {
            mesh: Arc::clone(carried.mesh()),
            edges: Arc::new(Edges::new(carried.mesh())),
            displacement: Some(Arc::new(carried.displacement().clone())),
        });
        let (tumour, plan) = (self.carried_tumour().map(Arc::new), plan_carried);
        let (surfaces, uncertainty, region) = (None, None, None);
        let deformed = Cuttable { grid, surfaces, uncertainty, region, body, tumour, plan };
        self.put_lines("deformed", deformed);
    }

    fn next_key(&mut self) -> String {
        self.keys += 1;
        self.keys.to_string()
    }

    fn show(&mut self, id: &'static str, voxels: Voxels, fresh: bool) {
        let at = self.volumes.iter().position(|(shown, _)| shown.id == id);
        let known = at.map(|at| &self.volumes[at]);
        let body = known.and_then(|(shown, _)| shown.body);
        let same = known.filter(|(_, known)| known.is_same(&voxels));
        let key = same.map(|(shown, _)| shown.key.clone()).unwrap_or_else(|| self.next_key());
        let volume = (VolumeShown { body, ..voxels.shown(id, key, fresh) }, voxels);
        match at {
            Some(at) => self.volumes[at] = volume,
            None => self.volumes.push(volume),
        }
    }

    fn hide(&mut self, id: &str) {
        self.volumes.retain(|(shown, _)| shown.id != id);
    }

    fn show_surface(&mut self, part: &'static str, shape: Shape, drawn: Drawn) {
        if self.surfaces.get(part).is_none_or(|(.., known)| *known != drawn) {
            let key = self.next_key();
            self.surfaces.insert(part, (key, shape, drawn));
        }
    }

    fn put_lines(&mut self, volume: &'static str, cuttable: Cuttable) {
        let key = self.next_key();
        self.lines.insert(volume, (key, Arc::new(cuttable)));
    }
}

impl PartialEq for Sources {
    /// Whether all of them are the same in memory.
    fn eq(&self, other: &Self) -> bool {
        same(&self.mesh, &other.mesh)
            && same(&self.carried, &other.carried)
            && same(&self.surfaces, &other.surfaces)
            && same(&self.labels, &other.labels)
            && self.plan == other.plan
            && (self.tumour, self.region) == (other.tumour, other.region)
    }
}

fn same<T>(one: &Option<Arc<T>>, other: &Option<Arc<T>>) -> bool {
    match (one, other) {
        (Some(one), Some(other)) => Arc::ptr_eq(one, other),
        (None, None) => true,
        _ => false,
    }
}
