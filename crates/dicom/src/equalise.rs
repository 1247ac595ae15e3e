//! A volume of equal steps from slices at unequal ones.

use crate::number::{format_ds, parse_ds};
use crate::source::SourceSlice;
use dicom_core::VR;
use dicom_dictionary_std::tags;
use rayon::prelude::*;
use supine_space::{Grid, Point};

/// Slices farther apart than this are not interpolated, mm: what lies between is not known.
const FARTHEST_MM: f64 = 10.0;
/// Most slices that one may become. Chosen, not measured.
const MOST_PER_SLICE: usize = 4;

/// Equal steps in place of unequal ones: as short as the shortest, so that no slice is passed over.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct EqualSteps {
    /// Distance of each slice from the first, ascending, mm.
    places: Vec<f64>,
    /// Number of slices to be made.
    count: usize,
}

impl EqualSteps {
    /// For slices at these places along the normal, ascending, mm; `None` where steps are too long,
    /// or so unequal that little of the volume would be measured.
    pub(crate) fn of(places: &[f64]) -> Option<Self> {
        let steps = || places.windows(2).map(|pair| pair[1] - pair[0]);
        let (shortest, longest) = (steps().reduce(f64::min)?, steps().reduce(f64::max)?);
        let places: Vec<f64> = places.iter().map(|p| p - places[0]).collect();
        let count = (places.last()? / shortest).round() as usize + 1;
        let fair = longest <= FARTHEST_MM && count <= MOST_PER_SLICE * places.len();
        fair.then_some(Self { places, count })
    }

    /// Number of slices to be made.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// The step of the slices to be made, mm.
    pub(crate) fn step(&self) -> f64 {
        self.places.last().map_or(0.0, |last| last / (self.count - 1) as f64)
    }

    /// HU of the slices to be made from those that are there, `per_slice` voxels each: linear along
    /// the normal, rounded half to even.
    pub(crate) fn volume(&self, hu: &[i16], per_slice: usize) -> Vec<i16> {
        let mut out = vec![0; per_slice * self.count];
        out.par_chunks_mut(per_slice).enumerate().for_each(|(k, out)| {
            let (below, share) = self.between(k);
            let slice = |n: usize| &hu[n * per_slice..(n + 1) * per_slice];
            if share == 0.0 {
                return out.copy_from_slice(slice(below));
            }
            for ((out, &a), &b) in out.iter_mut().zip(slice(below)).zip(slice(below + 1)) {
                let (a, b) = (f64::from(a), f64::from(b));
                *out = (a + share * (b - a)).round_ties_even() as i16;
            }
        });
        out
    }

    /// The slices to be made, each with the header of the nearest that is there and its own
    /// position.
    pub(crate) fn headers(&self, source: &[SourceSlice], grid: &Grid) -> Vec<SourceSlice> {
        let header = |k: usize| {
            let (below, share) = self.between(k);
            let nearest = if share > 0.5 { below + 1 } else { below };
            let mut made = source[nearest].clone();
            made.place(grid.centre([0, 0, k]));
            made
        };
        (0..self.count).map(header).collect()
    }

    /// The slice at or below a slice to be made, and how far it lies towards the next (0 to 1).
    fn between(&self, k: usize) -> (usize, f64) {
        /// Rounding of places, as a share of the distance of two slices.
        const NOTHING: f64 = 1e-6;
        let place = k as f64 * self.step();
        let last = self.places.len() - 1;
        let above = self.places.partition_point(|p| *p <= place).clamp(1, last);
        let [a, b] = [self.places[above - 1], self.places[above]];
        match (place - a) / (b - a) {
            share if share < NOTHING => (above - 1, 0.0),
            share if share > 1.0 - NOTHING => (above, 0.0),
            share => (above - 1, share),
        }
    }
}

impl SourceSlice {
    /// Moves a slice to a position that can be written.
    fn place(&mut self, position: Point) {
        let texts: Vec<String> = position.iter().map(|c| format_ds(*c)).collect();
        self.header.put_text(tags::IMAGE_POSITION_PATIENT, VR::DS, &texts.join("\\"));
        let written = |n: usize| parse_ds(&texts[n]).unwrap_or(position[n]);
        self.slice.position = Point::new(written(0), written(1), written(2));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_become_as_short_as_the_shortest_and_slices_stay_where_they_are() {
        let steps = EqualSteps::of(&[-10.0, -5.0, 0.0, 2.5, 5.0]).unwrap();
        assert_eq!((steps.count(), steps.step()), (7, 2.5));
        let made = steps.volume(&[0, 100, 101, 50, 1], 1);
        assert_eq!(made, [0, 50, 100, 100, 101, 50, 1]);
    }

    #[test]
    fn what_lies_too_far_apart_is_not_made_up() {
        assert_eq!(EqualSteps::of(&[0.0, 3.0, 14.0]), None);
        assert_eq!(EqualSteps::of(&[0.0, 0.1, 5.0, 10.0]), None);
    }
}
