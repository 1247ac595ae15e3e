//! Voxel data as a file holds them, before they become HU or labels.

use crate::{Problem, labels::segments::Segment, scalar::Scalar};
use std::collections::BTreeMap;
use supine_space::Grid;

/// Keys under which a header says in words how its volume came to be: ours, and those under which
/// ITK keeps a description that it read from another format.
pub(crate) const NOTES: [&str; 5] =
    ["derivation", "Comment", "ITK_FileNotes", "descrip", "aux_file"];

/// Samples on a grid, still in the type of the file.
#[derive(Debug)]
pub(crate) struct Raster {
    pub(crate) grid: Grid,
    /// Values per voxel.
    pub(crate) layers: usize,
    /// Whether the values of one voxel are neighbours in memory (or each layer is one volume).
    pub(crate) layers_first: bool,
    pub(crate) scalar: Scalar,
    pub(crate) big_endian: bool,
    /// Exactly one sample per layer and voxel.
    pub(crate) bytes: Vec<u8>,
    /// Value = slope * sample + intercept.
    pub(crate) slope: f64,
    pub(crate) intercept: f64,
    /// Key/value pairs of the header.
    pub(crate) keys: BTreeMap<String, String>,
    /// What the file says in words about how the volume came to be; empty when it says nothing.
    pub(crate) note: String,
    /// What the values are called; empty when the file does not say.
    pub(crate) segments: Vec<Segment>,
}

/// How far from a whole number a scaled value may lie: f32 slopes leave 1e-4 at 1000 HU.
const WHOLE_TOLERANCE: f64 = 1e-3;

impl Raster {
    /// The voxel of a sample, counted in memory.
    fn voxel_of(&self, place: usize) -> usize {
        if self.layers_first { place / self.layers } else { place % self.grid.len() }
    }

    /// The layer of a sample, counted in memory.
    pub(crate) fn layer_of(&self, place: usize) -> usize {
        if self.layers_first { place % self.layers } else { place / self.grid.len() }
    }

    /// Place of a voxel of a layer in memory.
    pub(crate) fn place(&self, layer: usize, voxel: usize) -> usize {
        if self.layers_first {
            voxel * self.layers + layer
        } else {
            layer * self.grid.len() + voxel
        }
    }

    /// All values, which must be whole numbers of the type `T`, in the order of the file.
    pub(crate) fn whole<T: TryFrom<i64>>(&self, expected: &'static str) -> Result<Vec<T>, Problem> {
        let samples = self.bytes.len() / self.scalar.size();
        let mut values: Vec<T> = Vec::new();
        values
            .try_reserve_exact(samples)
            .map_err(|_| Problem::Memory(samples.saturating_mul(size_of::<T>())))?;
        let converted = self.scalar.try_each(&self.bytes, self.big_endian, |place, sample| {
            let value = sample * self.slope + self.intercept;
            // Mostly the value is whole already.
            let mut whole = value as i64;
            if whole as f64 != value {
                let near = value.round();
                let off = (value - near).abs();
                if off.is_nan() || off > WHOLE_TOLERANCE {
                    return Err((place, value));
                }
                whole = near as i64;
            }
            values.push(T::try_from(whole).map_err(|_| (place, value))?);
            Ok(())
        });
        converted.map_err(|(place, value)| {
            let voxel = self.grid.voxel(self.voxel_of(place));
            Problem::Value { voxel, value, reason: expected }
        })?;
        Ok(values)
    }

    /// All values as 16-bit numbers, rounded half to even, and whether one was further from a whole
    /// number than scaling leaves it.
    pub(crate) fn rounded(&self, expected: &'static str) -> Result<(Vec<i16>, bool), Problem> {
        let mut values: Vec<i16> = Vec::new();
        let samples = self.bytes.len() / self.scalar.size();
        let memory = |_| Problem::Memory(samples.saturating_mul(size_of::<i16>()));
        values.try_reserve_exact(samples).map_err(memory)?;
        let mut rounded = false;
        let converted = self.scalar.try_each(&self.bytes, self.big_endian, |place, sample| {
            let value = sample * self.slope + self.intercept;
            let near = value.round_ties_even();
            // Neither NaN nor what is too large lies within.
            if !(f64::from(i16::MIN)..=f64::from(i16::MAX)).contains(&near) {
                return Err((place, value));
            }
            rounded |= (value - near).abs() > WHOLE_TOLERANCE;
            values.push(near as i16);
            Ok(())
        });
        converted.map_err(|(place, value)| {
            let voxel = self.grid.voxel(self.voxel_of(place));
            Problem::Value { voxel, value, reason: expected }
        })?;
        Ok((values, rounded))
    }
}
