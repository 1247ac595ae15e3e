//! Tissue from which a cavity is cut, before an applicator from which it lifts off.

use crate::analysis::OutOfMemory;
use crate::applicator::stuck;
use crate::compliance::Compliance;
use crate::coupling::Coupling;
use crate::discretisation::Discretisation;
use crate::gap::Surface;
use crate::model::Model;
use crate::newton::{KnownEquilibrium, Newton};
use crate::pattern::{Pattern, Storage};
use crate::site::{ContactSite, Tissue, TissueState, Touch};
use crate::tangent::Tangent;
use crate::unilateral::{BURIED_MM, STEP_GOAL, UnilateralContact};
use crate::wall::{Target, Wall};
use crate::{Error, Insertion, Job};
use std::collections::BTreeMap;
use std::sync::Arc;
use supine_mesh::{TET_EDGES, TET_FACES};
use supine_space::{Point, Pose, Progress, Vector};

/// Nodes this close to the surface, as a share of the size of the body, lie in it.
const ON_SURFACE: f64 = 1e-4;
/// Nodes nearer than this share of the body's size are in reach of its next motions.
const MARGIN: f64 = 0.3;
/// A part of the tissue hangs on at least so many held corners.
const HOLD: usize = 3;

impl Job<'_> {
    /// The tissue before an applicator from which it lifts off: without its cavity, settled, with
    /// the applicator put in.
    ///
    /// # Errors
    /// As [`crate::Applicator::attach`].
    pub(crate) fn press<const N: usize, const Q: usize>(
        &self,
        discretisation: &Discretisation<N, Q>,
        (mut tissue, mut u): (Tissue<N, Q>, Vec<Vector>),
        insertion: &Insertion<'_>,
        progress: Progress<'_>,
    ) -> Result<Coupling<N, Q>, Error> {
        let rigid = insertion.rigid;
        let bears = bearing(discretisation, (&tissue, &u), insertion)?;
        let mut held = discretisation.held.clone();
        if bears.contains(&false) {
            tissue.model = tissue.model.only(&bears);
            tissue.load = tissue.model.elements.load(u.len(), self.force());
            let mut orphan = vec![true; u.len()];
            let nodes = tissue.model.elements.nodes.iter().flatten();
            nodes.for_each(|n| orphan[*n as usize] = false);
            held.iter_mut().zip(&orphan).for_each(|(held, orphan)| *held |= orphan);
            if held.iter().all(|held| *held) {
                return Err(Error::NothingFree);
            }
            u = self.settled_without(&tissue, (&held, &bears), u, progress.part(0.0, 0.4))?;
        }
        tissue.bears = bears;
        let on = on_surface(&tissue.model.elements.nodes, u.len());
        let free = |on_surface: bool| -> Vec<u32> {
            let all = 0..u.len() as u32;
            all.filter(|&n| !held[n as usize] && on[n as usize] == on_surface).collect()
        };
        let wall = Arc::new(Wall {
            surface: Surface::new(rigid, progress.part(0.4, 0.5))?,
            nodes: free(true),
            within: free(false),
            rest: tissue.rest.clone(),
            margin_mm: MARGIN * rigid.size_mm(),
        });
        let follow = vec![false; u.len()];
        let touch = Touch {
            held: &held,
            follow: &follow,
            sliding: None,
            centre: rigid.centre().coords,
            size_mm: rigid.size_mm(),
        };
        let site = ContactSite::new(tissue, &u, touch);
        self.put_in(site, u, wall, progress.part(0.5, 1.0))
    }

    /// Puts the applicator into settled tissue.
    fn put_in<const N: usize, const Q: usize>(
        &self,
        site: ContactSite<N, Q>,
        u: Vec<Vector>,
        wall: Arc<Wall>,
        progress: Progress<'_>,
    ) -> Result<Coupling<N, Q>, Error> {
        let unknowns = site.pattern.unknowns();
        let memory = |_: OutOfMemory| Error::Memory { unknowns };
        let mut place = TissueState { pose: Pose::identity(), u };
        let nodes = wall.reach(&place.u, &[], (Target::at(&place.pose), wall.margin_mm));
        let compliance = Compliance::new(&site, &place.u, nodes, None)
            .map_err(memory)?
            .ok_or(Error::Singular)?;
        let mut pressing = UnilateralContact::new(wall, compliance);
        pressing
            .begin(&site, &mut place, self.params.tolerance.max(STEP_GOAL), progress)
            .map_err(|halt| stuck(halt, unknowns))?;
        let target = Target::at(&place.pose);
        if let Some(place) = pressing.wall.buried(&place.u, (target, BURIED_MM)) {
            return Err(Error::ApplicatorBuried { place: place.into() });
        }
        Ok(Coupling::pressed(site, place, pressing))
    }

    /// The equilibrium of the tissue without its cavity, from that with it.
    fn settled_without<const N: usize, const Q: usize>(
        &self,
        tissue: &Tissue<N, Q>,
        (held, bears): (&[bool], &[bool]),
        u: Vec<Vector>,
        progress: Progress<'_>,
    ) -> Result<Vec<Vector>, Error> {
        let Tissue { model, load, weight, .. } = tissue;
        let pattern = Arc::new(Pattern::new(&model.elements.nodes, held, Storage::Lower));
        let tangent =
            Tangent::new(&pattern).map_err(|_| Error::Memory { unknowns: pattern.unknowns() })?;
        let mut newton = Newton::new(model, tangent, held, *weight, self.params.max_iterations);
        // What the cavity bore holds the shape that the tissue has with it.
        let borne = forces(model, &u)?;
        let known = KnownEquilibrium { u: &u, load: &borne };
        let tolerance = self.params.tolerance;
        match newton.equilibrium(load, &u, known, tolerance, progress) {
            Ok(found) => Ok(found.u),
            Err(halt) => Err(numbered(newton.failed(halt, tolerance), bears)),
        }
    }
}

/// Internal nodal forces, mN.
fn forces<const N: usize, const Q: usize>(
    model: &Model<N, Q>,
    u: &[Vector],
) -> Result<Vec<Vector>, Error> {
    Ok(model.evaluate(u).ok_or(Error::Singular)?.1)
}

/// The error with the number that the tetrahedron has in the whole mesh.
fn numbered(mut error: Error, bears: &[bool]) -> Error {
    if let Error::NonConvergence { tet, .. } = &mut error {
        let of_kept = (0..bears.len()).filter(|&t| bears[t]).nth(*tet);
        *tet = of_kept.unwrap_or(*tet);
    }
    error
}

/// Whether each tetrahedron is left when the cavity is cut, and what then hangs on nothing has
/// gone.
fn bearing<const N: usize, const Q: usize>(
    discretisation: &Discretisation<N, Q>,
    (tissue, u): (&Tissue<N, Q>, &[Vector]),
    insertion: &Insertion<'_>,
) -> Result<Vec<bool>, Error> {
    let elements = &tissue.model.elements.nodes;
    let now: Vec<Vector> = tissue.rest.iter().zip(u).map(|(x, u)| x + u).collect();
    let (body, places) = match insertion.cavity {
        Some(cavity) => (cavity, &discretisation.positions),
        None => (insertion.rigid, &now),
    };
    let distance = |place: Vector| body.distance(&Point::from(place));
    let from_wall: Vec<f64> = places.iter().map(|place| distance(*place)).collect();
    let close = ON_SURFACE * body.size_mm();
    if insertion.cavity.is_none() {
        let on = on_surface(elements, u.len());
        if from_wall.iter().zip(&on).all(|(mm, on)| *mm > close || *on) {
            return Ok(vec![true; elements.len()]);
        }
    }
    let mut bears: Vec<bool>;
    if let Some(cavity) = insertion.cavity {
        let middle =
            |e: &[u32; N]| e[..4].iter().map(|n| places[*n as usize]).sum::<Vector>() / 4.0;
        // A node that lay deep in it could be buried in an applicator, or pushed to either side.
        let deep = |n: &u32| from_wall[*n as usize] < -BURIED_MM;
        let stays = |e: &[u32; N]| distance(middle(e)) > 0.0 && !e.iter().any(deep);
        bears = elements.iter().map(stays).collect();
        if !bears.contains(&false) {
            return Err(Error::CavityEmpty { centre: cavity.centre().coords.into() });
        }
    } else {
        let out = |n: &u32| from_wall[*n as usize] > close;
        bears = elements.iter().map(|e| e.iter().any(out)).collect();
    }
    drop_loose(elements, &discretisation.held, &mut bears);
    if bears.contains(&true) { Ok(bears) } else { Err(Error::NothingFree) }
}

/// Takes out tetrahedra that hang on too few held corners: those that share faces hang together.
fn drop_loose<const N: usize>(elements: &[[u32; N]], held: &[bool], bears: &mut [bool]) {
    let mut part: Vec<usize> = (0..elements.len()).collect();
    fn root(part: &mut [usize], mut t: usize) -> usize {
        while part[t] != t {
            part[t] = part[part[t]];
            t = part[t];
        }
        t
    }
    let mut first: BTreeMap<[u32; 3], usize> = BTreeMap::new();
    for (t, element) in elements.iter().enumerate().filter(|(t, _)| bears[*t]) {
        for face in faces(element) {
            if let Some(other) = first.insert(face, t) {
                let (a, b) = (root(&mut part, t), root(&mut part, other));
                part[a.max(b)] = a.min(b);
            }
        }
    }
    let mut holds: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
    for (t, element) in elements.iter().enumerate().filter(|(t, _)| bears[*t]) {
        let own = holds.entry(root(&mut part, t)).or_default();
        own.extend(element[..4].iter().filter(|n| held[**n as usize]));
    }
    for nodes in holds.values_mut() {
        nodes.sort_unstable();
        nodes.dedup();
    }
    for t in 0..elements.len() {
        let root = root(&mut part, t);
        bears[t] &= holds.get(&root).is_some_and(|nodes| nodes.len() >= HOLD);
    }
}

/// The corners of an element's faces, sorted.
fn faces<const N: usize>(element: &[u32; N]) -> [[u32; 3]; 4] {
    TET_FACES.map(|face| {
        let mut corners = face.map(|c| element[c]);
        corners.sort_unstable();
        corners
    })
}

/// Whether each node lies on a face of one element alone.
pub(crate) fn on_surface<const N: usize>(elements: &[[u32; N]], nodes: usize) -> Vec<bool> {
    let mut open: BTreeMap<[u32; 3], (usize, [usize; 3])> = BTreeMap::new();
    for (e, element) in elements.iter().enumerate() {
        for (key, face) in faces(element).into_iter().zip(TET_FACES) {
            if open.remove(&key).is_none() {
                open.insert(key, (e, face));
            }
        }
    }
    let mut on = vec![false; nodes];
    for (e, face) in open.into_values() {
        face.into_iter().for_each(|c| on[elements[e][c] as usize] = true);
        for (k, ends) in TET_EDGES.iter().enumerate() {
            if ends.iter().all(|end| face.contains(end))
                && let Some(middle) = elements[e].get(4 + k)
            {
                on[*middle as usize] = true;
            }
        }
    }
    on
}
