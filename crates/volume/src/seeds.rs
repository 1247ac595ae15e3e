//! What the user knows of the tissue at a place.

use crate::{Stroke, Volume};
use supine_space::Point;

/// What a seed says of its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SeedKind {
    /// Rib, sternum, intercostal, pectoralis, or anything they enclose.
    ChestWall,
    /// Gland, fat, skin.
    SoftTissue,
    /// Not the patient: wire, electrode, lead, table, blanket.
    Exclude,
}

impl SeedKind {
    /// `chest-wall`, `soft-tissue` or `exclude`.
    pub fn name(self) -> &'static str {
        match self {
            Self::ChestWall => "chest-wall",
            Self::SoftTissue => "soft-tissue",
            Self::Exclude => "exclude",
        }
    }
}

/// Places whose tissue the user knows: points (LPS, mm), painted voxels and strokes of a brush.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Seeds {
    /// Points of the chest wall.
    pub chest_wall: Vec<Point>,
    /// Points of the soft tissue.
    pub soft_tissue: Vec<Point>,
    /// Points that are not the patient.
    pub exclude: Vec<Point>,
    /// Painted maps, each on a grid of its own; `None` where nothing is said.
    pub painted: Vec<Volume<Option<SeedKind>>>,
    /// Strokes of a brush: a later one counts where it covers one before.
    pub strokes: Vec<Stroke>,
}

impl Seeds {
    /// The points of a kind, LPS, mm.
    pub fn points(&self, kind: SeedKind) -> &[Point] {
        match kind {
            SeedKind::ChestWall => &self.chest_wall,
            SeedKind::SoftTissue => &self.soft_tissue,
            SeedKind::Exclude => &self.exclude,
        }
    }

    /// The points of a kind, to be added to.
    pub fn points_mut(&mut self, kind: SeedKind) -> &mut Vec<Point> {
        match kind {
            SeedKind::ChestWall => &mut self.chest_wall,
            SeedKind::SoftTissue => &mut self.soft_tissue,
            SeedKind::Exclude => &mut self.exclude,
        }
    }
}
