//! Departures from what is safest, for systems that cannot take it.

/// What a site asks of an export against the defaults; all false is the safest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Policy {
    /// A study of its own, for archives that lock studies; else the source's.
    pub new_study: bool,
    /// The scanner as the equipment, for systems that choose the HU-to-density curve by it; else
    /// this software, so that the system asks.
    pub keep_equipment: bool,
    /// The source's frame of reference, for systems that cannot take a new one: contours and plans
    /// of the source then attach by themselves to a breast that has moved (PS3.3 C.7.4.1 forbids
    /// it). Series Description says SAME-FRAME.
    pub same_frame: bool,
    /// -1024 HU for all that the source has below it, outside the reconstruction circle mostly, for
    /// systems that take such values for a fault; else they are as in the source.
    pub clip_padding: bool,
}

/// What Series Description says of an export in the source's frame of reference.
pub(crate) const SAME_FRAME: &str = "SAME-FRAME";
