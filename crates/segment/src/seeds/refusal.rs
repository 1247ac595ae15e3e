//! Why a single seed is refused.

use crate::Error;
use supine_space::Point;
use supine_volume::SeedKind;

/// The skin itself is never chest wall, mm. Chosen, not measured.
pub(super) const SKIN_MM: f32 = 2.0;

/// A seed of a kind at a place (LPS, mm), and why it cannot be obeyed.
pub(super) fn refused(kind: SeedKind, point: Point, why: String) -> Error {
    Error::Seed { kind: kind.name(), point: point.coords.into(), why }
}
