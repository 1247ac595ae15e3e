//! Voxels as bytes, little-endian, x fastest.

use serde::Serialize;
use std::sync::Arc;
use supine_space::Grid;
use supine_volume::{Ct, LabelMap, Volume, label};

/// Bytes that are made at once: the page draws as they come.
const CHUNK: usize = 1 << 20;

/// A volume whose bytes the page may fetch.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct VolumeShown {
    pub(crate) id: &'static str,
    pub(crate) key: String,
    #[serde(rename = "type")]
    pub(crate) voxel: &'static str,
    pub(crate) size: [usize; 3],
    pub(crate) spacing_mm: [f64; 3],
    pub(crate) origin_mm: [f64; 3],
    /// Unit vectors of the grid's axes, LPS.
    pub(crate) axes: [[f64; 3]; 3],
    /// Whether it is no acquired CT.
    pub(crate) simulated: bool,
    /// First and last voxel of the patient along each axis, where that was looked for.
    pub(crate) body: Option<[[usize; 3]; 2]>,
    /// Whether it is of what is given now.
    pub(crate) fresh: bool,
    pub(crate) names: serde_json::Map<String, serde_json::Value>,
}

impl VolumeShown {
    /// A volume on a grid.
    pub(crate) fn on(grid: &Grid, id: &'static str, voxel: &'static str, key: String) -> Self {
        let axis = |a: usize| -> [f64; 3] { grid.direction().column(a).into_owned().into() };
        Self {
            id,
            key,
            voxel,
            size: grid.size(),
            spacing_mm: grid.spacing().into(),
            origin_mm: grid.origin().coords.into(),
            axes: [axis(0), axis(1), axis(2)],
            simulated: false,
            body: None,
            fresh: true,
            names: serde_json::Map::new(),
        }
    }
}

/// A volume that the page may fetch.
#[derive(Clone, Debug)]
pub(crate) enum Voxels {
    /// A CT, HU, and whether it is simulated.
    Hu(Arc<Ct>, bool),
    /// Labels.
    Labels(Arc<LabelMap>),
    /// Local change of volume, thousandths: 1000 is kept.
    Jacobian(Arc<Volume<i16>>),
    /// Dose, cGy.
    Dose(Arc<Volume<i16>>),
}

impl Voxels {
    /// Whether both are one volume in memory.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Hu(a, _), Self::Hu(b, _)) => Arc::ptr_eq(a, b),
            (Self::Labels(a), Self::Labels(b)) => Arc::ptr_eq(a, b),
            (Self::Jacobian(a), Self::Jacobian(b)) | (Self::Dose(a), Self::Dose(b)) => {
                Arc::ptr_eq(a, b)
            }
            _ => false,
        }
    }

    /// What the page is told of it.
    pub(crate) fn shown(&self, id: &'static str, key: String, fresh: bool) -> VolumeShown {
        let shown = match self {
            Self::Hu(ct, simulated) => {
                VolumeShown { simulated: *simulated, ..VolumeShown::on(ct.grid(), id, "i16", key) }
            }
            Self::Jacobian(map) | Self::Dose(map) => VolumeShown::on(map.grid(), id, "i16", key),
            Self::Labels(labels) => {
                let names =
                    [(label::SOFT_TISSUE, "soft tissue"), (label::CHEST_WALL, "chest wall")];
                let names = names.map(|(value, name)| (value.to_string(), name.into()));
                VolumeShown {
                    names: names.into_iter().collect(),
                    ..VolumeShown::on(labels.grid(), id, "u8", key)
                }
            }
        };
        VolumeShown { fresh, ..shown }
    }

    /// Where its voxels lie.
    pub(crate) fn grid(&self) -> &Grid {
        match self {
            Self::Hu(ct, _) => ct.grid(),
            Self::Labels(labels) => labels.grid(),
            Self::Jacobian(map) | Self::Dose(map) => map.grid(),
        }
    }

    /// Bytes of all voxels.
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Hu(ct, _) => 2 * ct.data().len(),
            Self::Labels(labels) => labels.data().len(),
            Self::Jacobian(map) | Self::Dose(map) => 2 * map.data().len(),
        }
    }

    /// Its bytes in pieces.
    pub(crate) fn pieces(self) -> impl Iterator<Item = Vec<u8>> + Send {
        let count = self.len().div_ceil(CHUNK);
        (0..count).map(move |n| self.piece(n * CHUNK))
    }

    fn piece(&self, from: usize) -> Vec<u8> {
        let to = (from + CHUNK).min(self.len());
        match self {
            Self::Hu(ct, _) => {
                ct.data()[from / 2..to / 2].iter().flat_map(|hu| hu.to_le_bytes()).collect()
            }
            Self::Jacobian(map) | Self::Dose(map) => {
                map.data()[from / 2..to / 2].iter().flat_map(|n| n.to_le_bytes()).collect()
            }
            Self::Labels(labels) => labels.data()[from..to].to_vec(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Matrix, Point, Vector};

    #[test]
    fn pieces_are_the_whole() {
        let size = [90, 91, 92];
        let grid =
            Grid::new(size, Vector::repeat(1.0), Point::origin(), Matrix::identity()).unwrap();
        let value = |v: [usize; 3]| (v[0] * 7 + v[1] * 131 + v[2] * 977) as u16 as i16;
        let ct = Arc::new(Ct::from_fn(grid.clone(), value));
        let voxels = Voxels::Hu(Arc::clone(&ct), false);
        let bytes: Vec<u8> = voxels.clone().pieces().flatten().collect();
        assert_eq!(bytes.len(), voxels.len());
        let back: Vec<i16> =
            bytes.chunks(2).map(|pair| i16::from_le_bytes([pair[0], pair[1]])).collect();
        assert!(back == ct.data());
        let labels = Arc::new(LabelMap::from_fn(grid, |v| (v[2] % 3) as u8));
        let bytes: Vec<u8> = Voxels::Labels(Arc::clone(&labels)).pieces().flatten().collect();
        assert!(bytes == labels.data());
    }
}
