//! Masks that a program made of the whole body: what of them can be taken for granted.
//!
//! A model's edges are right to its voxels, 1.5 mm of TotalSegmentator, 3 mm with `--fast`, while
//! the boundary of the chest wall is sought to a tenth of that. So the edges of masks that meet
//! there say nothing; what lies deeper does.

use super::map::Map;
use super::names::MaskKind;
use supine_space::Grid;
use supine_volume::{Volume, distance_mm};

/// Of a mask that reaches the boundary, this much is left out along its edge, mm.
pub(super) const RIM_MM: f32 = 3.0;

/// All masks on one grid, joined by what they are taken for.
pub(super) struct Masks {
    pub(super) grid: Grid,
    joined: Vec<(MaskKind, Volume<bool>)>,
}

impl Masks {
    pub(super) fn new(grid: Grid) -> Self {
        Self { grid, joined: Vec::new() }
    }

    /// Adds the voxels, by their place in memory, of a mask of a kind.
    pub(super) fn add(&mut self, kind: MaskKind, on: impl Fn(usize) -> bool) {
        let place = self.joined.iter().position(|(k, _)| *k == kind).unwrap_or_else(|| {
            self.joined.push((kind, Volume::from_fn(self.grid.clone(), |_| false)));
            self.joined.len() - 1
        });
        for (n, voxel) in self.joined[place].1.data_mut().iter_mut().enumerate() {
            *voxel |= on(n);
        }
    }

    /// What the masks say; nothing where two kinds claim a voxel.
    pub(super) fn into_map(self) -> Map {
        let mut map = Volume::from_fn(self.grid, |_| (None, false));
        for (MaskKind { tissue: kind, deep }, mut mask) in self.joined {
            if !deep {
                shrink(&mut mask);
            }
            for (told, _) in map.data_mut().iter_mut().zip(mask.data()).filter(|(_, on)| **on) {
                let other = told.0.is_some_and(|other| other != kind);
                *told = (Some(kind), told.1 || other);
            }
        }
        map.map(|&(kind, contested)| kind.filter(|_| !contested))
    }
}

/// Leaves out what lies within [`RIM_MM`] of the mask's edge; the end of the grid is none.
fn shrink(mask: &mut Volume<bool>) {
    let grid = mask.grid().clone();
    let (mut low, mut high) = (grid.size(), [0; 3]);
    for n in (0..grid.len()).filter(|&n| mask.data()[n]) {
        let voxel = grid.voxel(n);
        low = [0, 1, 2].map(|a| low[a].min(voxel[a]));
        high = [0, 1, 2].map(|a| high[a].max(voxel[a]));
    }
    let start = low.map(|n| n.saturating_sub(1));
    let size = [0, 1, 2].map(|a| (high[a] + 2).min(grid.size()[a]).saturating_sub(start[a]));
    let Ok(part) = grid.crop(start, size) else { return };
    let whole = |v: [usize; 3]| [0, 1, 2].map(|a| v[a] + start[a]);
    let edge = distance_mm(&Volume::from_fn(part, |v| !mask.at(whole(v))));
    for (n, &away) in edge.data().iter().enumerate() {
        let place = grid.offset(whole(edge.grid().voxel(n)));
        mask.data_mut()[place] &= away > RIM_MM;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Matrix, Point, Vector};
    use supine_volume::SeedKind;

    #[test]
    fn edges_that_meet_say_nothing_and_bones_stay_whole() {
        let grid = Grid::new([40, 8, 8], Vector::repeat(1.0), Point::origin(), Matrix::identity());
        let grid = grid.unwrap();
        let mut masks = Masks::new(grid.clone());
        let kind = |tissue, deep| MaskKind { tissue, deep };
        let along = |low: usize, end: usize| {
            let grid = &grid;
            move |n: usize| (low..end).contains(&grid.voxel(n)[0])
        };
        masks.add(kind(SeedKind::ChestWall, false), along(10, 20));
        masks.add(kind(SeedKind::SoftTissue, false), along(19, 40));
        masks.add(kind(SeedKind::ChestWall, true), along(8, 9));
        masks.add(kind(SeedKind::ChestWall, true), along(30, 31));
        let map = masks.into_map();
        let row: Vec<Option<SeedKind>> = (0..40).map(|i| map.at([i, 4, 4])).collect();
        let expected: Vec<Option<SeedKind>> = (0..40)
            .map(|i| match i {
                8 | 13..=16 => Some(SeedKind::ChestWall),
                // A bone in the breast: one of the two is wrong.
                30 => None,
                22.. => Some(SeedKind::SoftTissue),
                _ => None,
            })
            .collect();
        assert_eq!(row, expected);
    }
}
