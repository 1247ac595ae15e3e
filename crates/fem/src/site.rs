//! Where a rigid body acts on tissue.

use crate::analysis::OutOfMemory;
use crate::curved::Straightening;
use crate::model::Model;
use crate::pattern::{Pattern, Storage};
use crate::sliding::{Slide, Sliding};
use crate::tangent::Tangent;
use nalgebra::UnitQuaternion;
use std::sync::Arc;
use supine_space::{Pose, Vector};

/// Directions in which a rigid body moves: three shifts, three turns.
pub(crate) const MOTIONS: usize = 6;

/// The tissue on which a rigid body is to act.
pub(crate) struct Tissue<const N: usize, const Q: usize> {
    pub(crate) model: Model<N, Q>,
    pub(crate) load: Vec<Vector>,
    pub(crate) to_ct: Vec<Vector>,
    pub(crate) straight: Straightening<N>,
    pub(crate) rest: Vec<Vector>,
    pub(crate) weight: f64,
    /// Whether each tetrahedron bears: is not of a cavity.
    pub(crate) bears: Vec<bool>,
}

/// Where and how a rigid body touches tissue at its first pose.
pub(crate) struct Touch<'a> {
    /// Whether each node is held, and whether it follows the body.
    pub(crate) held: &'a [bool],
    pub(crate) follow: &'a [bool],
    /// The nodes that slide.
    pub(crate) sliding: Option<Sliding>,
    /// Centre (mm) and size (mm) of the body.
    pub(crate) centre: Vector,
    pub(crate) size_mm: f64,
}

/// What does not change while the rigid body moves.
pub(crate) struct ContactSite<const N: usize, const Q: usize> {
    pub(crate) model: Model<N, Q>,
    /// Nodal forces of gravity, mN.
    pub(crate) load: Vec<Vector>,
    /// Displacement from the stress-free shape to the CT shape, mm.
    pub(crate) to_ct: Vec<Vector>,
    /// To the nodes of the mesh of straight elements.
    pub(crate) straight: Straightening<N>,
    /// Stress-free positions, mm.
    pub(crate) rest: Vec<Vector>,
    /// The nodes that follow the pose, and where they are at the first one, mm.
    pub(crate) coupled: Vec<(u32, Vector)>,
    /// The nodes that slide.
    pub(crate) sliding: Option<Arc<Sliding>>,
    /// Elements with nodes that follow or slide.
    pub(crate) around: Vec<u32>,
    /// Whether each node is held or follows the pose.
    pub(crate) held: Vec<bool>,
    pub(crate) pattern: Arc<Pattern>,
    /// Centre (mm) and size (mm) of the rigid body at the first pose.
    pub(crate) centre: Vector,
    pub(crate) size_mm: f64,
    /// Norm of the nodal forces of gravity, mN.
    pub(crate) weight: f64,
    /// Whether each tetrahedron of the mesh bears: is not of a cavity.
    pub(crate) bears: Vec<bool>,
}

/// A factor of the stiffness and the linear responses to the rigid body's motions.
pub(crate) struct Responses {
    pub(crate) tangent: Tangent,
    /// Where they were made.
    pub(crate) pose: Pose,
    /// Displacement of the unknowns per mm, for each motion.
    pub(crate) columns: [Vec<f64>; MOTIONS],
}

/// Where the tissue is.
#[derive(Clone)]
pub(crate) struct TissueState {
    pub(crate) pose: Pose,
    /// Displacement from the stress-free shape, mm.
    pub(crate) u: Vec<Vector>,
}

impl<const N: usize, const Q: usize> ContactSite<N, Q> {
    /// The site of a body that takes the nodes it touches where they are at displacement `u` (mm).
    pub(crate) fn new(tissue: Tissue<N, Q>, u: &[Vector], touch: Touch<'_>) -> Self {
        let Touch { held, follow, sliding, centre, size_mm } = touch;
        let Tissue { model, load, to_ct, straight, rest, weight, bears } = tissue;
        let around = match &sliding {
            Some(sliding) => sliding.around.clone(),
            None => elements_of(&model.elements.nodes, follow),
        };
        let all = 0..held.len();
        let held: Vec<bool> = all.clone().map(|n| held[n] || follow[n]).collect();
        let pattern = Arc::new(Pattern::new(&model.elements.nodes, &held, Storage::Lower));
        let coupled = all.filter(|&n| follow[n]).map(|n| (n as u32, rest[n] + u[n])).collect();
        let sliding = sliding.map(Arc::new);
        Self {
            model,
            load,
            to_ct,
            straight,
            rest,
            coupled,
            sliding,
            around,
            held,
            pattern,
            centre,
            size_mm,
            weight,
            bears,
        }
    }

    /// The motion from one pose to another, in mm at the body's surface.
    pub(crate) fn motion(&self, from: &Pose, to: &Pose) -> [f64; MOTIONS] {
        let shift = self.centre_at(to) - self.centre_at(from);
        let turn = (to.rotation * from.rotation.inverse()).scaled_axis() * self.size_mm;
        [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z]
    }

    /// A share of the way: the centre on a straight line, the turn about one axis.
    pub(crate) fn between(&self, from: &Pose, to: &Pose, share: f64) -> Pose {
        let motion = self.motion(from, to).map(|v| share * v);
        let [shift, turn] = [0, 3].map(|k| Vector::new(motion[k], motion[k + 1], motion[k + 2]));
        let turn = UnitQuaternion::from_scaled_axis(turn / self.size_mm);
        let turned = Pose::rotation_wrt_point(turn, self.centre_at(from).into());
        Pose::translation(shift.x, shift.y, shift.z) * turned * from
    }

    fn centre_at(&self, pose: &Pose) -> Vector {
        pose.transform_point(&self.centre.into()).coords
    }

    /// The nodes on which the body acts.
    pub(crate) fn touched(&self) -> impl Iterator<Item = usize> {
        let sliding = self.sliding.iter().flat_map(|s| s.nodes.iter().map(|slider| slider.node));
        self.coupled.iter().map(|(node, _)| *node).chain(sliding).map(|n| n as usize)
    }

    /// The nodes that slide, with the body at `pose`.
    pub(crate) fn slide(&self, pose: &Pose) -> Option<Slide> {
        self.sliding.clone().map(|sliding| Slide { sliding, pose: *pose })
    }

    /// The tissue with the body at `pose`.
    pub(crate) fn model_at(&self, pose: &Pose) -> Model<N, Q> {
        self.model.sliding(self.slide(pose))
    }

    /// Velocities (mm/mm) of all nodes in one motion of the body with which the nodes on it go,
    /// zero but at these; and how the body turns, radians/mm.
    fn velocities(&self, motion: usize, place: &TissueState) -> (Vec<Vector>, Vector) {
        let mut velocities = vec![Vector::zeros(); self.held.len()];
        let (axis, centre) = (Vector::ith(motion % 3, 1.0), self.centre_at(&place.pose));
        let (shift, turn) = if motion < 3 {
            (axis, Vector::zeros())
        } else {
            (Vector::zeros(), axis / self.size_mm)
        };
        for n in self.touched() {
            velocities[n] = shift + turn.cross(&(self.rest[n] + place.u[n] - centre));
        }
        (velocities, turn)
    }

    fn at(&self, pose: &Pose, first: &Vector) -> Vector {
        pose.transform_point(&(*first).into()).coords
    }

    /// Moves the nodes on the body to where `pose` has them: those that slide to the nearest such
    /// place; false where one has none.
    pub(crate) fn put(&self, pose: &Pose, u: &mut [Vector]) -> bool {
        for (node, first) in &self.coupled {
            let n = *node as usize;
            u[n] = self.at(pose, first) - self.rest[n];
        }
        self.slide(pose).is_none_or(|slide| slide.bring(u))
    }

    /// The factor at a place, and the responses to the motions there; `None` when there is no
    /// factor.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn responses(
        &self,
        place: &TissueState,
        spare: Option<Tangent>,
    ) -> Result<Option<Responses>, OutOfMemory> {
        let mut tangent = match spare {
            Some(tangent) => tangent,
            None => Tangent::new(&self.pattern)?,
        };
        if !tangent.renew(&self.model_at(&place.pose), &place.u)? {
            return Ok(None);
        }
        let Some(changes) = self.changes(place) else { return Ok(None) };
        let mut columns: [Vec<f64>; MOTIONS] = Default::default();
        for (forces, column) in changes.iter().zip(&mut columns) {
            *column = self.pattern.gather(forces);
            column.iter_mut().for_each(|v| *v = -*v);
            if !tangent.apply_factor(column) {
                return Ok(None);
            }
        }
        Ok(Some(Responses { tangent, pose: place.pose, columns }))
    }

    /// Change of what is out of balance per mm of each motion, mN/mm, before the others respond.
    fn changes(&self, place: &TissueState) -> Option<Vec<Vec<Vector>>> {
        let slide = self.slide(&place.pose);
        let forces = slide.is_some().then(|| self.out_of_balance(&place.u));
        let change = |motion: usize| {
            let (mut velocities, turn) = self.velocities(motion, place);
            let (Some(slide), Some(forces)) = (&slide, &forces) else {
                return self.model.slope(&self.around, &place.u, &velocities);
            };
            let turned = slide.drag(&place.u, &turn, forces.as_ref()?, &mut velocities)?;
            let mut change = self.model.slope(&self.around, &place.u, &velocities)?;
            turned.into_iter().for_each(|(n, force)| change[n] += force);
            slide.project(&place.u, &mut change)?;
            Some(change)
        };
        (0..MOTIONS).map(change).collect()
    }

    /// Internal less external forces of all nodes, mN: what the rigid body gives at nodes on it.
    pub(crate) fn out_of_balance(&self, u: &[Vector]) -> Option<Vec<Vector>> {
        let (_, mut forces) = self.model.evaluate(u)?;
        forces.iter_mut().zip(&self.load).for_each(|(f, l)| *f -= l);
        Some(forces)
    }

    /// The same at the nodes on which the body acts, by the elements round them alone.
    pub(crate) fn forces_on_touched(&self, u: &[Vector]) -> Option<Vec<(u32, Vector)>> {
        let forces = self.model.forces_at(&self.around, u)?;
        Some(self.touched().map(|n| (n as u32, forces[n] - self.load[n])).collect())
    }
}

/// The elements with at least one of some nodes.
pub(crate) fn elements_of<const N: usize>(elements: &[[u32; N]], some: &[bool]) -> Vec<u32> {
    let has = |e: &u32| elements[*e as usize].iter().any(|&n| some[n as usize]);
    (0..elements.len() as u32).filter(has).collect()
}
