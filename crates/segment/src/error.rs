//! What can go wrong.

use supine_space::{Failure, Side, Stopped};

/// Why a CT could not be segmented.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The slices are not roughly axial.
    #[error(
        "the third axis of the CT runs {degrees:.0} degrees off the head-foot direction, allowed \
         are 20; give an axial series"
    )]
    NotAxial {
        /// Angle between the k axis and the head-foot direction, degrees.
        degrees: f64,
    },
    /// Too few slices or pixels to hold a chest.
    #[error(
        "the CT of {size:?} voxels covers {extent_mm:.0?} mm; a chest needs at least 150 x 100 mm \
         in the slice and 60 mm along the body"
    )]
    TooSmall {
        /// Voxels along i, j, k.
        size: [usize; 3],
        /// Extent along i, j, k, mm.
        extent_mm: [f64; 3],
    },
    /// All voxels hold one value.
    #[error("the CT is empty: every voxel holds {value}")]
    Uniform {
        /// The value.
        value: i16,
    },
    /// The values are not Hounsfield units.
    #[error(
        "the values are not Hounsfield units (air -1000, water 0): {why}; apply the rescale slope \
         and intercept of the images, or export the CT again"
    )]
    NotHounsfield {
        /// What contradicts.
        why: String,
    },
    /// Slices without a patient between slices with one.
    #[error(
        "slices {first} to {last} (counted from 0 along the volume) hold no patient, the slices on \
         both sides do: slices are missing or damaged; export the series again"
    )]
    EmptySlices {
        /// The first of them.
        first: usize,
        /// The last of them.
        last: usize,
    },
    /// The patient does not lie as is taken.
    #[error(
        "the patient seems to lie on her {on}: the table is there and her lungs are not denser \
         towards her {taken}, on which `position` has her lie; say how she lay, or export the CT \
         again if its directions are wrong"
    )]
    LiesOtherwise {
        /// `front`, `back`, `left side` or `right side`.
        on: &'static str,
        /// The side that is taken.
        taken: &'static str,
    },
    /// Head and feet are exchanged.
    #[error(
        "head and feet of the CT seem to be exchanged: the ribs run up towards the front, and heart and liver lie between the \
         lungs' upper halves; check the positions and the order of the slices and export the series again, or, if the CT is \
         right, give labels made elsewhere"
    )]
    HeadFeetReversed,
    /// One side of the chest is not in the CT.
    #[error(
        "only half of the chest is in the CT: on the {side} {why}, so that ribs and skin are missing there; give a CT that \
         holds both sides and is not cropped"
    )]
    HalfChest {
        /// The side that is cut off.
        side: Side,
        /// What shows it.
        why: String,
    },
    /// Lung outside the chest wall that was found.
    #[error(
        "{lung_ml:.0} ml of lung lie outside the chest wall that was found, most of it at {at:.0?} mm (LPS): the wall lies \
         too deep there, or air beside the patient was taken for lung; add chest-wall seeds there"
    )]
    LungOutsideWall {
        /// Volume, ml.
        lung_ml: f64,
        /// Middle of the largest piece, LPS, mm.
        at: [f64; 3],
    },
    /// Bone or the like in the breast.
    #[error(
        "{bone_cm3:.0} cm³ as dense as bone lie in the soft tissue of the region: an arm before the \
         breast, or a chest wall that was found inside the ribs; give a CT with the arms raised, or \
         add chest-wall seeds"
    )]
    BoneInBreast {
        /// Volume, cm³.
        bone_cm3: f64,
    },
    /// The breast is not wholly in the CT.
    #[error(
        "the {side} breast is not wholly in the CT: {why}; a larger field of view is needed, or other seeds where some were given"
    )]
    BreastCut {
        /// The breast.
        side: Side,
        /// Where it is cut.
        why: String,
    },
    /// No voxels above the skin threshold that could be a patient.
    #[error("no body found: the largest object above {skin_hu:.0} HU has {volume_l:.2} litres")]
    NoBody {
        /// Threshold between air and tissue, HU.
        skin_hu: f64,
        /// Volume of the largest object, litres.
        volume_l: f64,
    },
    /// No air-filled lungs inside the body.
    #[error(
        "this does not look like a chest: {lung_l:.2} litres of lung found, 0.3 are needed; give a \
         CT of the chest that is not cropped"
    )]
    NoLungs {
        /// Volume of lung found, litres.
        lung_l: f64,
    },
    /// Too little bone round the lungs.
    #[error(
        "no rib cage found: bone in {slices} slices only, {needed} are needed; is this a chest CT \
         in Hounsfield units?"
    )]
    NoRibs {
        /// Slices with enough bone.
        slices: usize,
        /// Slices needed.
        needed: usize,
    },
    /// Fat and muscle cannot be told apart.
    #[error(
        "fat at {fat_hu:.0} HU and muscle at {muscle_hu:.0} HU are too close to tell apart; are \
         the values in Hounsfield units?"
    )]
    NoContrast {
        /// Mode of the fat, HU.
        fat_hu: f64,
        /// Mode of the back muscles, HU.
        muscle_hu: f64,
    },
    /// A threshold that cannot work.
    #[error("parameter {name} = {value:.3} is not usable: {why}")]
    Parameter {
        /// Name of the field of [`crate::Params`].
        name: &'static str,
        /// The value given.
        value: f64,
        /// What it must be.
        why: &'static str,
    },
    /// A seed where it cannot be.
    #[error("the {kind} seed at {point:.1?} mm {why}; move or remove it")]
    Seed {
        /// `chest-wall`, `soft-tissue` or `exclude`.
        kind: &'static str,
        /// LPS, mm.
        point: [f64; 3],
        /// What is wrong with it.
        why: String,
    },
    /// A painted map that says nothing of this CT.
    #[error(
        "no painted seed lies within the CT; was it painted on another series? Give seeds in the \
         patient's coordinates of this one"
    )]
    SeedsElsewhere,
    /// Two seeds that exclude each other.
    #[error(
        "the {first_kind} seed at {first:.1?} mm and the {second_kind} seed at {second:.1?} mm \
         contradict each other: {why}; remove one"
    )]
    SeedsContradict {
        /// Kind of the first seed.
        first_kind: &'static str,
        /// First seed, LPS, mm.
        first: [f64; 3],
        /// Kind of the second seed.
        second_kind: &'static str,
        /// Second seed, LPS, mm.
        second: [f64; 3],
        /// Why both cannot hold.
        why: &'static str,
    },
    /// No breast on that side.
    #[error(
        "no {side} breast found, so no region can be proposed: {why}; check the side, or give the \
         region"
    )]
    NoBreast {
        /// The side.
        side: Side,
        /// What is missing.
        why: &'static str,
    },
    /// A breast on the other side only.
    #[error(
        "there is no {side} breast: about {at:.0?} mm (LPS), opposite the other breast, the soft tissue in front of the chest \
         wall is {own_mm:.0} mm thick, {other_mm:.0} mm there, as after a mastectomy; check the side, or, if this one is meant, \
         give the region; the other side can be simulated"
    )]
    BreastMissing {
        /// The side.
        side: Side,
        /// Thickness of the soft tissue on this side, mm.
        own_mm: f64,
        /// That on the other side, mm.
        other_mm: f64,
        /// Where the breast should be, LPS, mm.
        at: [f64; 3],
    },
    /// No sphere within the CT can hold the breast's tumour.
    #[error("no region can be proposed for the {side} breast: {why}")]
    NoRegion {
        /// The breast.
        side: Side,
        /// What does not fit.
        why: String,
    },
    /// Labels that do not belong to the CT.
    #[error(
        "the labels of {labels:?} voxels do not lie on the grid of the CT of {ct:?} voxels; give \
         labels made on this CT"
    )]
    OtherGrid {
        /// Voxels of the labels along i, j, k.
        labels: [usize; 3],
        /// Voxels of the CT along i, j, k.
        ct: [usize; 3],
    },
    /// The user asked to stop.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl Error {
    /// The kind of failure. What is wrong with the CT is a failure of the method that looked at it;
    /// what the user gave beside it (parameters, seeds, labels) is input.
    pub fn kind(&self) -> Failure {
        match self {
            Self::Stopped(_) => Failure::Stopped,
            Self::Parameter { .. }
            | Self::Seed { .. }
            | Self::SeedsElsewhere
            | Self::SeedsContradict { .. }
            | Self::OtherGrid { .. } => Failure::Input,
            _ => Failure::Method,
        }
    }
}
