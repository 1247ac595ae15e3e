//! What a painted map says.

use supine_volume::{SeedKind, Volume};

/// What each voxel was painted as.
pub(super) type Map = Volume<Option<SeedKind>>;
